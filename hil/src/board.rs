//! The board around the emulated chip: crystal, rail, converters, robot's wires. `boards/README.md` shows
//! the circuit.

use std::num::{NonZeroU32, NonZeroU64};
use std::sync::{Mutex, MutexGuard};

use rigless::chip::uart::Rate;
use rigless::device::{Device, DeviceContext, ErasedDevice, Level, RegisterFile, ResetCause};
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate, Wired};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::c_adc::ccr;
use rigless::soc::stm32f427::generated::dac::{Register, cr};
use rigless::soc::stm32f427::generated::{C_ADC, TIM5, adc1, c_adc, rcc, tim5};
use rigless::soc::stm32f427::peripherals::adc::Channel;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::{Bus, Error, Layout, Width, Window};
use rigless::time::VirtualNanos;
use sim::plant::Pins;
use softgrip::inputs::Levels;
use softgrip::telemetry::Indicators;
use softgrip::units::DacCode;

use crate::flash::{self, Array, Cells, Programmer, Shared};
use crate::line::Master;
use crate::remap::remapped;

/// The core's clock, and its instructions: one per cycle, no wait states.
pub const CLOCK_HZ: NonZeroU64 = NonZeroU64::new(180_000_000).expect("it runs");

/// 8 MHz from the ST-LINK's MCO.
const HSE_HZ: u64 = 8_000_000;
/// 3.3 V.
const RAIL_MV: u32 = 3_300;
/// The converter compares input and reference as whole numbers of any unit. Millivolts would be coarser
/// than its own steps, so both are given in this share of the reference.
const REFERENCE: u32 = 3_300_000;
/// The converter model's full scale.
const ADC_MAX: f64 = 4095.0;

/// The fourth of the timers on this bus.
const TIMER_5: usize = 3;

/// USART6 among the serial ports.
const SERIAL: usize = 3;

const PORT_D: usize = 3;
const PORT_E: usize = 4;
const PORT_F: usize = 5;

/// Gauges at PA3, PC0 and PC3, monitor at PC2, supply at PB1, as channels of ADC1.
const GAUGES: [u8; 3] = [3, 10, 13];
const MONITOR: u8 = 12;
const SUPPLY: u8 = 9;
/// The internal reference, and a channel that nothing uses, where it is put in the converter's unit here.
const INTERNAL_REFERENCE: u64 = 17;
const STAND_IN: u8 = 15;
/// What the internal reference reads at 3.3 V, as the factory has noted it: 1.21 V.
pub const REFERENCE_CODE: u16 = 1_502;

/// One change of the converter's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DacWrite {
    /// When.
    pub at: VirtualNanos,
    /// The code, or none while the converter is off and the pull-down holds the command at 0 V.
    pub code: Option<DacCode>,
}

/// DAC channel 1: what is written to the holding register comes out, and is noted.
#[derive(Debug, Default)]
pub struct Dac {
    output: Option<DacCode>,
    /// Every write since somebody last took them.
    pub writes: Vec<DacWrite>,
}

impl Device for Dac {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        _value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if !matches!(register, Register::Cr | Register::Dhr12r1) {
            return;
        }
        // Without a trigger the holding register is copied one APB cycle later (RM0090, 14.3.4).
        let held = registers.get(Register::Dhr12r1) & 0xfff;
        registers.set(Register::Dor1, held);
        let on = cr::EN1.is_set(registers.get(Register::Cr));
        self.output = on.then_some(DacCode(held as u16));
        self.writes.push(DacWrite {
            at: context.now(),
            code: self.output,
        });
    }
}

/// Why the chip restarts, where the model of the part knows no more than its reset pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restart {
    /// The pin, or what the model itself decided.
    Pin,
    /// The supply was away.
    PowerOn,
    /// The supply was below the brown-out level, but not away.
    BrownOut,
    /// A debugger has asked the core for it, as after flashing.
    Debugger,
}

/// The part with the converter that its model lacks.
#[derive(Debug)]
pub struct Chip {
    part: Stm32f427,
    dac: Dac,
    flash: Programmer,
    array: Shared,
    dac_slot: usize,
    rcc_slot: usize,
    adc_slot: usize,
    flash_slot: usize,
    /// The ST-LINK's clock arrives.
    has_clock: bool,
    restart: Restart,
}

impl Chip {
    /// Has the converter sample the stand-in where the firmware asks for the internal reference, if that is
    /// switched on: the model gives it in millivolts, and the pins' unit here is a finer one.
    fn put_in_reference(&mut self) {
        let (_, registers) = self.part.converter(0);
        let sequence = registers.get(adc1::Register::Sqr3);
        if adc1::sqr3::SQ6.get(sequence) != INTERNAL_REFERENCE {
            return;
        }
        let control = C_ADC.base + u64::from(c_adc::Register::Ccr.spec().offset);
        let control = self.peek(VirtualNanos(0), control, Width::W32);
        if control.is_ok_and(|control| ccr::TSVREFE.is_set(control)) {
            let (_, registers) = self.part.converter(0);
            let sequence = adc1::sqr3::SQ6.set(sequence, STAND_IN.into());
            registers.set(adc1::Register::Sqr3, sequence);
        }
    }
}

impl Mcu for Chip {
    fn bus(&self) -> &Bus {
        self.part.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.part.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        let cause = match cause {
            // The supply went off while the flash was at work.
            ResetCause::Model("FLASH") => {
                self.restart = Restart::PowerOn;
                ResetCause::Pin
            }
            cause => cause,
        };
        self.part.reset(at, cause);
        flash::lock(&self.array).cut();
        self.flash = Programmer::new(self.array.clone());
        self.dac.output = None;
        self.dac.writes.push(DacWrite { at, code: None });
        // Power-on shows as brown-out as well, and both at the pin (RM0090, 6.3.21).
        let flags = match self.restart {
            Restart::Pin => 0,
            Restart::PowerOn => rcc::csr::PORRSTF.mask() | rcc::csr::BORRSTF.mask(),
            Restart::BrownOut => rcc::csr::BORRSTF.mask(),
            Restart::Debugger => rcc::csr::SFTRSTF.mask(),
        };
        if flags != 0 {
            let (_, registers) = self.part.clocks();
            let flags = flags | rcc::csr::PADRSTF.mask();
            registers.set(rcc::Register::Csr, flags);
        }
        self.restart = Restart::Pin;
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.part.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if slot == self.rcc_slot && !self.has_clock {
            // The model's oscillator is ready even where nothing oscillates.
            let (_, registers) = self.part.clocks();
            let ready = rcc::cr::HSERDY.mask();
            registers.set(rcc::Register::Cr, registers.get(rcc::Register::Cr) & !ready);
        }
        if slot == self.adc_slot {
            self.put_in_reference();
        }
        let (bus, model) = self.part.split(slot);
        if slot == self.dac_slot {
            (bus, Some(&mut self.dac))
        } else if slot == self.flash_slot {
            (bus, Some(&mut self.flash))
        } else {
            (bus, model)
        }
    }
}

/// The NUCLEO-F429ZI with its front end.
#[derive(Debug)]
pub struct Nucleo {
    /// The chip, and its flash where the core is led to.
    wired: Wired<Chip, Cells>,
}

/// Its runs start from reset.
impl Store for Nucleo {}

impl Board for Nucleo {
    fn name(&self) -> &'static str {
        "nucleo-f429zi"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32f429"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.wired)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let lines = u32::from(self.wired.cpu().interrupt_lines);
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: CLOCK_HZ,
            interrupt_lines: NonZeroU32::new(lines).expect("it has interrupts"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("a divider"),
            instructions_per_second: CLOCK_HZ,
            boot: "flash",
        };
        let windows = rigless::cpu::armv7m::windows(self.wired.bus());
        let spec = core.spec_with_parts(&windows, armv7m::Fpu::FpV4Sp, armv7m::MpuRegions::Eight);
        vec![Target::new("stm32f429", &mut self.wired, remapped(spec))]
    }
}

impl Nucleo {
    /// The board without strain, pressure and a robot; with the ST-LINK's clock or without.
    pub fn new(has_clock: bool, array: Array) -> Result<Self, Error> {
        let mut part = Stm32f427::new()?;
        part.rcc
            .attach_crystals(if has_clock { HSE_HZ } else { 0 }, 0);
        part.set_supply(RAIL_MV);
        for adc in &mut part.adc {
            adc.set_reference(REFERENCE);
        }
        let dac_slot = part.bus().slot("DAC")?;
        let rcc_slot = part.bus().slot("RCC")?;
        let adc_slot = part.bus().slot("ADC1")?;
        let flash_slot = part.bus().slot("FLASH")?;
        part.usart[SERIAL].attach(Master::default());
        let array = Shared::new(Mutex::new(array));
        let chip = Chip {
            part,
            dac: Dac::default(),
            flash: Programmer::new(array.clone()),
            array: array.clone(),
            dac_slot,
            rcc_slot,
            adc_slot,
            flash_slot,
            has_clock,
            restart: Restart::Pin,
        };
        let size = NonZeroU64::new(flash::SIZE as u64).expect("two sectors");
        let window = Window::new("settings", flash::WINDOW, size);
        Ok(Self {
            wired: Wired::new(chip, window, Cells(array))?,
        })
    }

    /// Puts voltages on the converter's pins, on a board whose 3.3 V rail is off by a factor. What hangs on the
    /// rail follows it, and keeps its share of it.
    pub fn set_pins(&mut self, pins: &Pins, rail: f64) {
        let adc = &mut self.wired.part.part.adc[0];
        let mut set = |channel: u8, share: f64| {
            let channel = Channel::new(channel).expect("a pin's channel");
            // The model has 4095 steps and rounds down; the converter has 4096 and rounds.
            let code = (4096.0 * share).round().clamp(0.0, ADC_MAX);
            let value = (code + 0.5) / ADC_MAX * f64::from(REFERENCE);
            adc.set_input(channel, value as u32);
        };
        for (channel, share) in GAUGES.into_iter().zip(pins.gauges) {
            set(channel, share);
        }
        set(MONITOR, pins.monitor / rail);
        set(SUPPLY, pins.supply / rail);
        set(STAND_IN, f64::from(REFERENCE_CODE) / 4096.0 / rail);
    }

    /// Drives the robot's inputs. An optocoupler pulls its pin down while 24 V are applied.
    pub fn set_levels(&mut self, at: VirtualNanos, levels: Levels) {
        let wires = [
            (15, levels.grip),
            (14, levels.release),
            (13, levels.stop_closed),
            (12, levels.acknowledge),
        ];
        for (pin, on) in wires {
            let pin = Pin::new(pin).expect("a port has sixteen pins");
            let level = on.then_some(Level::Low);
            self.wired
                .part
                .part
                .drive_port(at, PORT_F, |port, registers, context| {
                    port.drive(pin, level, registers, context);
                });
        }
    }

    /// Who is at the other end of the line.
    pub fn master(&mut self) -> &mut Master {
        let port = &mut self.wired.part.part.usart[SERIAL];
        port.chip_mut().expect("it was attached")
    }

    /// So many words in a million arrive with a framing error.
    pub fn garble(&mut self, per_million: u32) {
        let errors = self.wired.part.part.usart[SERIAL].errors_mut();
        errors.framing = Rate {
            name: "framing",
            per_million,
        };
    }

    /// What the board tells the robot.
    pub fn indicators(&mut self) -> Indicators {
        let mut on = |port: usize, pin: u8| {
            let (port, registers) = self.wired.part.part.port(port);
            let pin = Pin::new(pin).expect("a port has sixteen pins");
            port.level(pin, registers) == Level::High
        };
        Indicators {
            ready: on(PORT_E, 13),
            holding: on(PORT_E, 11),
            lost: on(PORT_E, 9),
            fault: on(PORT_D, 15),
        }
    }

    /// The converter's output.
    pub fn dac(&mut self) -> &mut Dac {
        &mut self.wired.part.dac
    }

    /// The output's code; the pull-down's zero while it is off.
    pub fn command(&self) -> DacCode {
        self.wired.part.dac.output.unwrap_or(DacCode(0))
    }

    /// Puts the firmware's clock on to its next alarm, and raises that alarm: the next control tick, which
    /// is due within a millisecond, is due now.
    pub fn make_tick_due(&mut self, at: VirtualNanos) -> anyhow::Result<()> {
        let address = |register: tim5::Register| TIM5.base + u64::from(register.spec().offset);
        let unanswered = |fault| anyhow::anyhow!("TIM5: {fault:?}");
        let alarm = address(tim5::Register::Ccr2);
        let alarm = self
            .wired
            .part
            .peek(at, alarm, Width::W32)
            .map_err(unanswered)?;
        self.wired
            .part
            .write(at, address(tim5::Register::Cnt), Width::W32, alarm)
            .map_err(unanswered)?;
        let part = &mut self.wired.part.part;
        part.drive_timer(at, TIMER_5, |_, registers, context| {
            let flags = registers.get(tim5::Register::Sr) | tim5::sr::CC2IF.mask();
            registers.set(tim5::Register::Sr, flags);
            context.raise(0);
        });
        Ok(())
    }

    /// The settings' flash.
    pub fn flash(&self) -> MutexGuard<'_, Array> {
        flash::lock(&self.wired.part.array)
    }

    /// What the reset that follows will be taken for.
    pub fn set_restart(&mut self, restart: Restart) {
        self.wired.part.restart = restart;
    }
}

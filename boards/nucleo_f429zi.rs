//! NUCLEO-F429ZI (MB1137): pins, clocks, converters. The wiring stands in `boards/README.md`; pin names
//! in brackets are those of the board's Zio and Arduino headers (UM1974, table 17).

use cortex_m::peripheral::DWT;
use embassy_executor::SendSpawner;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals, interrupt, pac};
use softgrip::frontend;
use softgrip::inputs::Levels;
use softgrip::io;
use softgrip::telemetry::Indicators;
use softgrip::units::DacCode;

#[path = "stm32f4_converter.rs"]
mod converter;
#[path = "stm32f4_flash.rs"]
mod flash;
#[path = "stm32f4_serial.rs"]
mod serial;

pub use converter::Converter;
pub use flash::SettingsFlash;
pub use serial::{Serial, SerialParts};

use crate::links::HIGH_PRIORITY;

pub const NAME: &str = "NUCLEO-F429ZI";

/// No pressure.
const SAFE: DacCode = DacCode(0);

/// The watchdog counts at a quarter of its own clock, 8 kHz: 100 ms. That clock is good for 17 to 47 kHz
/// (DS9405, LSI characteristics), so these are 68 to 188 ms; it is fed every 20 ms.
const WATCHDOG_COUNTS: u16 = 800;

/// The ST-LINK's clock is there before the chip runs, or comes seconds late, or not at all.
const HSE_WITHIN_US: u32 = 20_000;

/// The core's clock at start-up, and what it may be later: what a wait is counted by.
const HSI_MHZ: u32 = 16;
const HIGHEST_MHZ: u32 = 180;

/// The hardware, as the control task uses it.
pub struct Board {
    pub converter: Converter,
    pub regulator: Regulator,
    pub inputs: InputPins,
    pub indicators: IndicatorPins,
}

/// What the chip runs on.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Clock {
    /// 180 MHz from the ST-LINK's crystal, within 50 ppm.
    External,
    /// 168 MHz from the chip's own oscillator: within 1 % at 25 °C, −8 to +4.5 % from −40 to 105 °C (DS9405,
    /// HSI characteristics). Every time of the controller is off by that.
    Internal,
}

/// Starts clocks and drivers. The output is safe before and after.
pub fn init() -> (Board, SettingsFlash, SerialParts, Clock) {
    let clock = match external_clock() {
        true => Clock::External,
        false => Clock::Internal,
    };
    let p = embassy_stm32::init(config(clock));
    // Setting up the ports may have reset the pin's mode.
    safe_output();
    if clock == Clock::External {
        // A clock that fails later is an exception without a handler, and the next start does without it.
        pac::RCC.cr().modify(|w| w.set_csson(true));
    }
    // The driver has written the wait states alone.
    pac::FLASH.acr().modify(|w| {
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
    if misreads_bank_2() {
        hold_pa12_low();
    }
    let (board, flash, serial) = board(p);
    (board, flash, serial, clock)
}

/// Silicon before revision 3 (A, Y and 1 by their numbers 0x1000, 0x1003 and 0x1007: RM0090, DBGMCU_IDCODE) reads bank 2
/// wrong unless PA12 is an output at 0 V (errata ES0206, 2.2.14), and the driver panics then.
fn misreads_bank_2() -> bool {
    const REVISION_3: u16 = 0x2001;
    pac::DBGMCU.idcode().read().rev_id() < REVISION_3
}

/// As the driver looks for it: with the pull-down as well.
fn hold_pa12_low() {
    let pin = 12;
    pac::GPIOA.bsrr().write(|w| w.set_br(pin, true));
    pac::GPIOA
        .pupdr()
        .modify(|w| w.set_pupdr(pin, pac::gpio::vals::Pupdr::PULL_DOWN));
    pac::GPIOA
        .moder()
        .modify(|w| w.set_moder(pin, pac::gpio::vals::Moder::OUTPUT));
}

/// Says so where PA12 must be left alone.
pub fn check_revision() {
    if misreads_bank_2() {
        defmt::warn!("silicon before revision 3: PA12 is held low, see boards/README.md");
    }
}

/// Whether the ST-LINK's clock is there, and stays switched on.
fn external_clock() -> bool {
    pac::RCC.cr().modify(|w| w.set_hsebyp(true));
    pac::RCC.cr().modify(|w| w.set_hseon(true));
    let there = wait_for(HSE_WITHIN_US, || pac::RCC.cr().read().hserdy());
    if !there {
        pac::RCC.cr().modify(|w| w.set_hseon(false));
    }
    there
}

fn config(clock: Clock) -> Config {
    let mut config = Config::default();
    let (source, prediv, mul) = match clock {
        // 8 MHz from the ST-LINK's MCO (UM1974, OSC clock supply) / 4 × 180 / 2 = 180 MHz.
        Clock::External => (PllSource::HSE, PllPreDiv::DIV4, PllMul::MUL180),
        // 16 MHz / 8 × 168 / 2 = 168 MHz: 4.5 % more stay below 180.
        Clock::Internal => (PllSource::HSI, PllPreDiv::DIV8, PllMul::MUL168),
    };
    config.rcc.hse = (clock == Clock::External).then_some(Hse {
        freq: Hertz::mhz(8),
        mode: HseMode::Bypass,
    });
    config.rcc.pll_src = source;
    config.rcc.pll = Some(Pll {
        prediv,
        mul,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    // Their limits are 45 and 90 MHz.
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

fn board(p: Peripherals) -> (Board, SettingsFlash, SerialParts) {
    let pull = Pull::Up;
    let (off, slow) = (Level::Low, Speed::Low);
    let flash = SettingsFlash::new(p.FLASH);
    let board = Board {
        converter: Converter::new(
            (p.ADC1, p.PA3, p.PC0, p.PC3, p.PC2, p.PB1, p.DMA2_CH0),
            frontend::reference_code(factory_reference()),
        ),
        regulator: Regulator(()),
        inputs: InputPins {
            grip: Input::new(p.PF15, pull),
            release: Input::new(p.PF14, pull),
            stop: Input::new(p.PF13, pull),
            acknowledge: Input::new(p.PF12, pull),
        },
        indicators: IndicatorPins {
            ready: Output::new(p.PE13, off, slow),
            holding: Output::new(p.PE11, off, slow),
            lost: Output::new(p.PE9, off, slow),
            fault: Output::new(p.PD15, off, slow),
            green: Output::new(p.PB0, off, slow),
            blue: Output::new(p.PB7, off, slow),
            red: Output::new(p.PB14, off, slow),
        },
    };
    let serial = (p.USART6, p.PG9, p.PG14, p.PD14, p.DMA2_CH1, p.DMA2_CH6);
    (board, flash, serial)
}

/// The executor of the control task, above the thread's and the drivers' interrupts and below the clock's. UART5 is not
/// used, and its interrupt is.
pub fn high_priority() -> SendSpawner {
    interrupt::UART5.set_priority(Priority::P6);
    HIGH_PRIORITY.start(interrupt::UART5)
}

// SAFETY: the name gives it the place of UART5's handler in the vector table.
#[interrupt]
unsafe fn UART5() {
    // SAFETY: called from this handler alone, which `start` enables once the executor is there.
    unsafe { HIGH_PRIORITY.on_interrupt() }
}

/// Puts the regulator's command to zero by register, whatever state the chip and its drivers are in:
/// at start-up, from a panic, from a fault.
pub fn safe_output() {
    pac::RCC.ahb1enr().modify(|w| w.set_gpioaen(true));
    pac::RCC.apb1enr().modify(|w| w.set_dacen(true));
    // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
    pac::RCC.apb1enr().read();
    pac::GPIOA
        .moder()
        .modify(|w| w.set_moder(4, pac::gpio::vals::Moder::ANALOG));
    write_dac(SAFE);
    pac::DAC1.cr().modify(|w| {
        // Buffered, so that the pull-down at the pin takes nothing from it. The buffer does not go below 0.2 V (DS9405,
        // DAC characteristics); the command's amplifier subtracts 0.3 V.
        w.set_boff(0, false);
        w.set_ten(0, false);
        w.set_en(0, true);
    });
}

fn write_dac(code: DacCode) {
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(code.0));
}

/// Starts the watchdog, which nothing stops. Its first time is half a second (348 to 964 ms): what is set here
/// counts from the first feeding on.
pub fn start_watchdog() {
    let watchdog = pac::IWDG;
    watchdog.kr().write(|w| w.set_key(Key::START));
    watchdog.kr().write(|w| w.set_key(Key::ENABLE));
    watchdog.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    watchdog.rlr().write(|w| w.set_rl(WATCHDOG_COUNTS - 1));
}

/// Gives the watchdog its whole time again.
pub fn feed_watchdog() {
    pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// Waits by the core's cycles: at least so long, whatever the clock.
pub fn wait_us(us: u32) {
    wait_for(us, || false);
}

/// Waits until something is so, for this long at most. Says whether it is.
fn wait_for(us: u32, so: impl Fn() -> bool) -> bool {
    let mhz = match pac::RCC.cfgr().read().sws() {
        Sysclk::HSI => HSI_MHZ,
        _ => HIGHEST_MHZ,
    };
    // SAFETY: nobody else uses the counter or what switches it on.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let began = DWT::cycle_count();
    while DWT::cycle_count().wrapping_sub(began) < us.saturating_mul(mhz) {
        if so() {
            return true;
        }
        // Microseconds: no need to keep the bus busy.
        cortex_m::asm::delay(50);
    }
    so()
}

/// Lights LD3 and tells the robot FAULT, by register: before the drivers, or behind them.
pub fn show_fault() {
    let output = pac::gpio::vals::Moder::OUTPUT;
    pac::RCC.ahb1enr().modify(|w| {
        w.set_gpioben(true);
        w.set_gpioden(true);
    });
    pac::RCC.ahb1enr().read();
    pac::GPIOB.bsrr().write(|w| w.set_bs(14, true));
    pac::GPIOB.moder().modify(|w| w.set_moder(14, output));
    pac::GPIOD.bsrr().write(|w| w.set_bs(15, true));
    pac::GPIOD.moder().modify(|w| w.set_moder(15, output));
}

/// Whether the robot applies 24 V to ACK, by register.
pub fn acknowledged() -> bool {
    pac::RCC.ahb1enr().modify(|w| w.set_gpiofen(true));
    pac::RCC.ahb1enr().read();
    pac::GPIOF
        .pupdr()
        .modify(|w| w.set_pupdr(12, pac::gpio::vals::Pupdr::PULL_UP));
    pac::GPIOF.idr().read().idr(12) == pac::gpio::vals::Idr::LOW
}

/// The chip's own number (RM0090, unique device ID register).
pub fn unique_id() -> [u8; 12] {
    embassy_stm32::uid::uid()
}

/// What the internal reference read at the factory, at 3.3 V and 30 °C (DS9405, embedded reference voltage).
fn factory_reference() -> u16 {
    const VREFIN_CAL: *const u16 = 0x1fff_7a2a as *const u16;
    // SAFETY: a readable halfword of the chip's system memory, aligned, and never written.
    unsafe { VREFIN_CAL.read_volatile() }
}

/// Says so where the chip would run on below 2.7 V: set once with a programmer, as `boards/README.md` shows.
pub fn check_brown_out() {
    // Level 3 is zero (RM0090, FLASH_OPTCR).
    if pac::FLASH.optcr().read().bor_lev() != 0 {
        defmt::warn!("brown-out level 3 is not set: see boards/README.md");
    }
}

/// Why the chip has started.
#[derive(Clone, Copy, defmt::Format)]
pub enum ResetReason {
    PowerOn,
    BrownOut,
    Pin,
    Software,
    Watchdog,
    Other,
}

/// Reads the reset flags and clears them for the next time.
pub fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset shows at the pin as well, and power-on as brown-out (RM0090, section 6.3.21).
    if flags.wdgrstf() || flags.wwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.porrstf() {
        ResetReason::PowerOn
    } else if flags.borrstf() {
        ResetReason::BrownOut
    } else if flags.padrstf() {
        ResetReason::Pin
    } else {
        ResetReason::Other
    }
}

/// DAC1 channel 1 at PA4 [D24], set up by [`safe_output`]. Only [`init`] makes one.
pub struct Regulator(());

impl Regulator {
    pub fn set(&mut self, code: DacCode) {
        write_dac(code);
    }
}

/// Optocouplers that pull a pin down while the robot applies 24 V.
pub struct InputPins {
    /// [D2]
    grip: Input<'static>,
    /// [D4]
    release: Input<'static>,
    /// [D7]
    stop: Input<'static>,
    /// [D8]
    acknowledge: Input<'static>,
}

impl InputPins {
    pub fn levels(&self) -> Levels {
        Levels {
            grip: self.grip.is_low(),
            release: self.release.is_low(),
            stop_closed: self.stop.is_low(),
            acknowledge: self.acknowledge.is_low(),
        }
    }
}

/// Outputs to the robot, and the board's lamps.
pub struct IndicatorPins {
    /// [D3]
    ready: Output<'static>,
    /// [D5]
    holding: Output<'static>,
    /// [D6]
    lost: Output<'static>,
    /// [D9]
    fault: Output<'static>,
    /// LD1: ready.
    green: Output<'static>,
    /// LD2: holding.
    blue: Output<'static>,
    /// LD3: lost or fault.
    red: Output<'static>,
}

impl IndicatorPins {
    pub fn set(&mut self, on: Indicators, io: &io::Settings) {
        let high = io.high(on);
        self.ready.set_level(high.ready.into());
        self.holding.set_level(high.holding.into());
        self.lost.set_level(high.lost.into());
        self.fault.set_level(high.fault.into());
        self.green.set_level(on.ready.into());
        self.blue.set_level(on.holding.into());
        self.red.set_level((on.lost || on.fault).into());
    }
}

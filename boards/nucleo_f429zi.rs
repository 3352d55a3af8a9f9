//! NUCLEO-F429ZI (MB1137): pins, clocks, converters. The wiring stands in `boards/README.md`; pin names
//! in brackets are those of the board's Zio and Arduino headers (UM1974, table 17).

use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals, interrupt, pac};
use softgrip::scan::CHANNELS;

use super::Board;
use super::analogue::{Analogue, sequence};
use super::clock::Clock;
use super::half_duplex::Pins;
use super::pins::{IndicatorPins, InputPins, input, is_pulled_down, output, raise};
use super::regulator::Regulator;
use super::sectors::SettingsFlash;
use super::stm32f4::{Converter, Serial, on_serial};

pub const NAME: &str = "NUCLEO-F429ZI";

/// The scan's order: gauges [A0, A1, A2; D12 for a fourth], monitor [A7], supply [A6], internal reference. At 22.5 MHz, with 12 cycles of
/// conversion, 21.9 and 4.3 µs each. The internal reference asks for 10 µs of sampling; the supply moves slowly, and a
/// capacitor holds it.
const ANALOGUE: [Analogue; CHANNELS] = sequence(
    [
        Analogue::new(pac::GPIOA, 3, 3, SampleTime::CYCLES480),
        Analogue::new(pac::GPIOC, 0, 10, SampleTime::CYCLES480),
        Analogue::new(pac::GPIOC, 3, 13, SampleTime::CYCLES480),
        Analogue::new(pac::GPIOA, 6, 6, SampleTime::CYCLES480),
    ],
    [
        Analogue::new(pac::GPIOC, 2, 12, SampleTime::CYCLES480),
        Analogue::new(pac::GPIOB, 1, 9, SampleTime::CYCLES84),
        Analogue::inside(17, SampleTime::CYCLES480),
    ],
);

/// USART6: received [D0] and sent [D1], function 8 (DS9405, table 12), and the driver enable [D10].
static SERIAL: Pins = Pins {
    receive: (pac::GPIOG, 9),
    send: (pac::GPIOG, 14),
    driver: (pac::GPIOD, 14),
};

/// 180 MHz from the ST-LINK's crystal; or 168 MHz from the chip's own oscillator, within 1 % at 25 °C, −8 to +4.5 % from −40
/// to 105 °C (DS9405, HSI characteristics).
pub fn config(clock: Clock) -> Config {
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

/// What is at its pins.
pub fn board(p: Peripherals) -> (Board, SettingsFlash, Serial) {
    let flash = SettingsFlash::new(p.FLASH);
    let board = Board {
        converter: Converter::new((p.ADC1, p.DMA2_CH0), &ANALOGUE),
        regulator: Regulator::new(),
        // [D2, D4, D7, D8]
        inputs: InputPins {
            grip: input(p.PF15),
            release: input(p.PF14),
            stop: input(p.PF13),
            acknowledge: input(p.PF12),
        },
        // [D3, D5, D6, D9], LD1 to LD3
        indicators: IndicatorPins {
            ready: output(p.PE13),
            holding: output(p.PE11),
            lost: output(p.PE9),
            fault: output(p.PD15),
            lamps: [
                Some(output(p.PB0)),
                Some(output(p.PB7)),
                Some(output(p.PB14)),
            ],
        },
    };
    let serial = Serial::new((p.USART6, p.DMA2_CH1, p.DMA2_CH6), &SERIAL);
    (board, flash, serial)
}

// SAFETY: the name gives it the place of the port's handler in the vector table.
#[interrupt]
unsafe fn USART6() {
    on_serial(&SERIAL);
}

/// Lights LD3 and tells the robot FAULT, by register.
pub fn show_fault() {
    pac::RCC.ahb1enr().modify(|w| {
        w.set_gpioben(true);
        w.set_gpioden(true);
    });
    pac::RCC.ahb1enr().read();
    raise(pac::GPIOB, 14);
    raise(pac::GPIOD, 15);
}

/// Whether the robot applies 24 V to ACK, by register.
pub fn acknowledged() -> bool {
    pac::RCC.ahb1enr().modify(|w| w.set_gpiofen(true));
    pac::RCC.ahb1enr().read();
    is_pulled_down(pac::GPIOF, 12)
}

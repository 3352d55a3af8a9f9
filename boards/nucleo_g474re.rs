//! NUCLEO-G474RE (MB1367): pins, clocks, converters. The wiring stands in `boards/README.md`; pin names
//! in brackets are those of the board's Arduino headers (UM2505, table 15).

use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk,
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
use super::stm32g4::{Converter, Serial, on_serial};

pub const NAME: &str = "NUCLEO-G474RE";

/// The scan's order: gauges [A0, A1, A3; CN10, pin 24 for a fourth], monitor [A4], supply [A5], internal reference. At 42.5 MHz, with 12.5 cycles of
/// conversion, eight times 1.4 and 6.1 µs each. The internal reference asks for 4 µs of sampling; capacitors hold the
/// others.
const ANALOGUE: [Analogue; CHANNELS] = sequence(
    [
        Analogue::new(pac::GPIOA, 0, 1, SampleTime::CYCLES47_5),
        Analogue::new(pac::GPIOA, 1, 2, SampleTime::CYCLES47_5),
        Analogue::new(pac::GPIOB, 0, 15, SampleTime::CYCLES47_5),
        Analogue::new(pac::GPIOB, 1, 12, SampleTime::CYCLES47_5),
    ],
    [
        Analogue::new(pac::GPIOC, 1, 7, SampleTime::CYCLES47_5),
        Analogue::new(pac::GPIOC, 0, 6, SampleTime::CYCLES47_5),
        Analogue::inside(18, SampleTime::CYCLES247_5),
    ],
);

/// USART1: received [D0] and sent [D1], and the driver enable at CN10, pin 12.
static SERIAL: Pins = Pins {
    receive: (pac::GPIOC, 5),
    send: (pac::GPIOC, 4),
    driver: (pac::GPIOA, 12),
};

/// 170 MHz from the board's crystal X3; or 160 MHz from the chip's own oscillator, within 1 % at 30 °C, −2 to +1.5 % from −40
/// to 125 °C (DS12288, HSI16 characteristics).
pub fn config(clock: Clock) -> Config {
    let mut config = Config::default();
    let (source, prediv, mul) = match clock {
        // 24 MHz / 6 × 85 / 2 = 170 MHz.
        Clock::External => (PllSource::HSE, PllPreDiv::DIV6, PllMul::MUL85),
        // 16 MHz / 4 × 80 / 2 = 160 MHz: 1.5 % more stay below 170.
        Clock::Internal => (PllSource::HSI, PllPreDiv::DIV4, PllMul::MUL80),
    };
    config.rcc.hse = (clock == Clock::External).then_some(Hse {
        freq: Hertz::mhz(24),
        mode: HseMode::Oscillator,
    });
    config.rcc.hsi48 = None;
    config.rcc.pll = Some(Pll {
        source,
        prediv,
        mul,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    // Above 150 MHz.
    config.rcc.boost = true;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV1;
    config.rcc.apb2_pre = APBPrescaler::DIV1;
    config
}

/// What is at its pins.
pub fn board(p: Peripherals) -> (Board, SettingsFlash, Serial) {
    let flash = SettingsFlash::new(p.FLASH);
    let board = Board {
        converter: Converter::new((p.ADC1, p.DMA1_CH1), &ANALOGUE),
        regulator: Regulator::new(),
        // [D2, D4, D7, D8]
        inputs: InputPins {
            grip: input(p.PA10),
            release: input(p.PB5),
            stop: input(p.PA8),
            acknowledge: input(p.PA9),
        },
        // [D3, D5, D6, D9]; the only lamp, LD2, is at PA5, and shows that something is lost or wrong
        indicators: IndicatorPins {
            ready: output(p.PB3),
            holding: output(p.PB4),
            lost: output(p.PB10),
            fault: output(p.PC7),
            lamps: [None, None, Some(output(p.PA5))],
        },
    };
    let serial = Serial::new((p.USART1, p.DMA1_CH2, p.DMA1_CH3), &SERIAL);
    (board, flash, serial)
}

// SAFETY: the name gives it the place of the port's handler in the vector table.
#[interrupt]
unsafe fn USART1() {
    on_serial();
}

/// Lights LD2 and tells the robot FAULT, by register.
pub fn show_fault() {
    pac::RCC.ahb2enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpiocen(true);
    });
    pac::RCC.ahb2enr().read();
    raise(pac::GPIOA, 5);
    raise(pac::GPIOC, 7);
}

/// Whether the robot applies 24 V to ACK, by register.
pub fn acknowledged() -> bool {
    pac::RCC.ahb2enr().modify(|w| w.set_gpioaen(true));
    pac::RCC.ahb2enr().read();
    is_pulled_down(pac::GPIOA, 9)
}

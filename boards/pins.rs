//! The digital pins of a board.

use embassy_stm32::gpio::{Input, Level, Output, Pin, Pull, Speed};
use embassy_stm32::{Peri, pac};
use pac::gpio::Gpio;
use softgrip::inputs::Levels;
use softgrip::io;
use softgrip::telemetry::Indicators;

/// Optocouplers that pull a pin down while the robot applies 24 V.
pub struct InputPins {
    pub grip: Input<'static>,
    pub release: Input<'static>,
    pub stop: Input<'static>,
    pub acknowledge: Input<'static>,
}

/// A pin with an optocoupler.
pub fn input(pin: Peri<'static, impl Pin>) -> Input<'static> {
    Input::new(pin, Pull::Up)
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
    pub ready: Output<'static>,
    pub holding: Output<'static>,
    pub lost: Output<'static>,
    pub fault: Output<'static>,
    /// Lamps for ready, for holding, and for lost or fault, as far as the board has them.
    pub lamps: [Option<Output<'static>>; 3],
}

/// An output, off.
pub fn output(pin: Peri<'static, impl Pin>) -> Output<'static> {
    Output::new(pin, Level::Low, Speed::Low)
}

impl IndicatorPins {
    pub fn set(&mut self, on: Indicators, io: &io::Settings) {
        let high = io.high(on);
        self.ready.set_level(high.ready.into());
        self.holding.set_level(high.holding.into());
        self.lost.set_level(high.lost.into());
        self.fault.set_level(high.fault.into());
        let shown = [on.ready, on.holding, on.lost || on.fault];
        for (lamp, on) in self.lamps.iter_mut().zip(shown) {
            if let Some(lamp) = lamp {
                lamp.set_level(on.into());
            }
        }
    }
}

/// Makes a pin an output that is high, by register: before the drivers, or behind them. Its port has a clock.
pub fn raise(port: Gpio, pin: usize) {
    port.bsrr().write(|w| w.set_bs(pin, true));
    port.moder()
        .modify(|w| w.set_moder(pin, pac::gpio::vals::Moder::OUTPUT));
}

/// Whether a pin is pulled down, by register. Its port has a clock.
pub fn is_pulled_down(port: Gpio, pin: usize) -> bool {
    port.pupdr()
        .modify(|w| w.set_pupdr(pin, pac::gpio::vals::Pupdr::PULL_UP));
    port.moder()
        .modify(|w| w.set_moder(pin, pac::gpio::vals::Moder::INPUT));
    port.idr().read().idr(pin) == pac::gpio::vals::Idr::LOW
}

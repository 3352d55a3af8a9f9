//! The regulator's command: channel 1 of the first converter, at PA4 on every chip here.

use embassy_stm32::pac;
use softgrip::units::DacCode;

/// No pressure.
pub const SAFE: DacCode = DacCode(0);

/// Writes a command by register.
pub fn write(code: DacCode) {
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(code.0));
}

/// The converter, set up by the chip's `safe_output`. Only the board's start makes one.
pub struct Regulator(());

impl Regulator {
    pub(super) fn new() -> Self {
        Self(())
    }

    pub fn set(&mut self, code: DacCode) {
        write(code);
    }
}

//! Air loss: the pressure is missing, and the grip goes with it.

use crate::air::Air;

/// The pressure must be missing this long to be an air loss: ripple is shorter, and 50 ms are allowed.
const AIR_TICKS: u16 = 20;

/// For how long the pressure has been missing.
#[derive(Debug, Clone, Copy)]
pub(super) struct AirLoss {
    ticks: u16,
}

impl AirLoss {
    /// Nothing is missing.
    pub const NONE: Self = Self { ticks: 0 };

    /// Whether the pressure has been this far below what it should be for long enough. Without a measurement
    /// the count stands still: neither good news nor bad.
    pub fn step(&mut self, air: &Air, limit_kpa: f32) -> bool {
        if let (Some(measured), Some(expected)) = (air.measured, air.expected) {
            self.ticks = match measured.0 < expected.0 - limit_kpa {
                true => self.ticks.saturating_add(1),
                false => 0,
            };
        }
        self.ticks >= AIR_TICKS
    }
}

//! Whether a gauge still moves: one that freezes, or that ignores the pressure, is stuck.

use crate::units::{AdcCode, Microstrain};

/// A gauge that always flickers and then shows one code for this long is stuck.
const STUCK_TICKS: u16 = 15;
/// Share of measurements with a new code, averaged over 250 ms, above which a gauge flickers.
const LIVELY: f32 = 0.9;
/// A gauge that shows one code while the free-bend strain moves by this much is stuck.
const STUCK_FREE_UE: f32 = 1_500.0;

/// How long a gauge has shown its code, and how often it shows a new one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Liveliness {
    last_code: AdcCode,
    unchanged: u16,
    /// Free-bend strain when the code changed last.
    free_at_change: Option<f32>,
    lively: f32,
}

impl Liveliness {
    /// Nothing measured yet.
    pub const NEW: Self = Self {
        last_code: AdcCode(0),
        unchanged: 0,
        free_at_change: None,
        lively: 0.0,
    };

    /// Takes one measurement, with the gain of an average over 250 ms.
    pub fn step(&mut self, code: AdcCode, free_strain: Option<Microstrain>, gain: f32) {
        let free_strain = free_strain.map(|free| free.0);
        if code == self.last_code {
            self.unchanged = self.unchanged.saturating_add(1);
            self.free_at_change = self.free_at_change.or(free_strain);
            // Liveliness is judged on what went before, so a freeze does not wash it out.
            if self.unchanged < 2 {
                self.lively -= gain * self.lively;
            }
        } else {
            self.last_code = code;
            self.unchanged = 0;
            self.free_at_change = free_strain;
            self.lively += gain * (1.0 - self.lively);
        }
    }

    /// Whether it has frozen, or ignores the pressure.
    pub fn is_stuck(&self, free_strain: Option<Microstrain>) -> bool {
        let froze = self.lively > LIVELY && self.unchanged >= STUCK_TICKS;
        let ignored_pressure = match (free_strain, self.free_at_change) {
            (Some(now), Some(then)) => self.unchanged > 0 && (now.0 - then).abs() > STUCK_FREE_UE,
            _ => false,
        };
        froze || ignored_pressure
    }
}

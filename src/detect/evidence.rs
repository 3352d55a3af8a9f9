//! Evidence: what the fall has exceeded its allowance by, summed up tick by tick.
//!
//! CUSUM (Page 1954): of all detectors with the same rate of false alarms it has the least delay, and it needs
//! no window to be chosen.

use crate::math::{larger, smaller};
use crate::units::Instant;

/// `ln` of the mean ticks between false alarms on pure noise: 10¹² ticks are 32 years at 1 kHz.
const LN_RUN_LENGTH: f32 = 27.6;

/// The sum, and since when it is above zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evidence {
    sum: f32,
    onset: Instant,
}

impl Evidence {
    /// None.
    pub fn none(now: Instant) -> Self {
        Self {
            sum: 0.0,
            onset: now,
        }
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.sum == 0.0
    }

    /// Takes one tick's fall beyond its allowance; when it began, once the sum is past its limit. `variance`
    /// is that of the fall's noise, `allowance` what of it counts for nothing.
    pub fn step(
        &mut self,
        now: Instant,
        fall: f32,
        variance: f32,
        allowance: f32,
        least_limit: f32,
    ) -> Option<Instant> {
        if self.is_none() {
            self.onset = now;
        }
        // Mean run length of a CUSUM on white noise of variance σ²: exp(2 k h / σ²) (Siegmund 1985).
        let noise_limit = LN_RUN_LENGTH * variance / (2.0 * allowance);
        let limit = larger(least_limit, noise_limit);
        // No single tick, nor two, can be a loss: a finger does not empty so fast, a cable's glitch does.
        let step = smaller(fall, 0.5 * limit);
        self.sum = larger(self.sum + step, 0.0);
        (self.sum > limit).then_some(self.onset)
    }
}

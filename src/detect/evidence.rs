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

#[cfg(test)]
mod tests {
    use super::*;

    /// Share that counts for nothing, and evidence of a loss without noise, share times ticks.
    const ALLOWANCE: f32 = 0.05;
    const LEAST_LIMIT: f32 = 0.08;

    fn at(ms: u64) -> Instant {
        Instant::from_micros(1_000 * ms)
    }

    /// The tick, from one, in which a steady fall is a loss.
    fn lost_after(fall: f32, variance: f32) -> Option<u64> {
        let mut evidence = Evidence::none(at(0));
        (1..=1_000).find(|&ms| {
            evidence
                .step(at(ms), fall, variance, ALLOWANCE, LEAST_LIMIT)
                .is_some()
        })
    }

    #[test]
    fn a_loss_is_what_sums_up_to_more_than_the_limit_and_began_with_its_first_tick() {
        let mut evidence = Evidence::none(at(0));
        let mut step = |ms, fall| {
            let lost = evidence.step(at(ms), fall, 0.0, ALLOWANCE, LEAST_LIMIT);
            (lost, evidence.is_none())
        };
        // What has gone back is forgotten, and counts for no later fall.
        assert_eq!(step(1, 0.03), (None, false));
        assert_eq!(step(2, -1.0), (None, true));
        assert_eq!(step(3, -1.0), (None, true));
        for ms in 4..7 {
            assert_eq!(step(ms, 0.025), (None, false), "{ms}");
        }
        assert_eq!(step(7, 0.025), (Some(at(4)), false));
    }

    #[test]
    fn no_fall_of_two_ticks_is_a_loss_however_deep() {
        assert_eq!(lost_after(100.0, 0.0), Some(3));
    }

    #[test]
    fn noise_raises_the_limit_to_one_false_alarm_in_1e12_ticks() {
        // 10 % of noise: run length exp(2 k h / σ²), so h = 0.01 · 27.6 / 0.1 = 2.76.
        assert_eq!(lost_after(0.1, 0.01), Some(28));
        // Half the amplitude, a quarter of the limit: 0.69.
        assert_eq!(lost_after(0.1, 0.002_5), Some(7));
        // So little that the limit of the settings is the higher one.
        assert_eq!(lost_after(0.03, 1e-4), Some(3));
    }
}

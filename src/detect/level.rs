//! The level: residual summed over the fingers, over its plateau, smoothed.

use super::shares::Shares;
use crate::math::lag_gain;
use crate::units::TICK_US;

/// Averaging of the sum into the level from which a fall counts, and which tells a slip: a third of a
/// collapse.
const LEVEL_MS: f32 = 8.0;
const TICKS_PER_S: f32 = 1e6 / TICK_US as f32;

/// Gain of the average, and what it leaves of noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Smoothing {
    /// Share of the way that an average goes in one tick.
    pub gain: f32,
    /// Variance of the level's noise over that of the sum.
    variance: f32,
}

impl Smoothing {
    /// Over [`LEVEL_MS`].
    pub fn new() -> Self {
        let gain = lag_gain(LEVEL_MS);
        Self {
            gain,
            // White noise of variance σ² through a first-order lag of gain g: σ² g / (2 − g).
            variance: gain / (2.0 - gain),
        }
    }
}

/// The level, and how fast it changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// One at the plateau.
    pub value: f32,
    /// 1/s.
    pub rate: f32,
    /// Variance of its noise.
    pub variance: f32,
}

impl Level {
    /// At the plateau.
    pub const START: Self = Self {
        value: 1.0,
        rate: 0.0,
        variance: 0.0,
    };

    /// Takes one tick.
    pub fn step(&mut self, shares: &Shares, smoothing: &Smoothing) {
        let before = self.value;
        self.value += smoothing.gain * (shares.sum - self.value);
        let rate = (self.value - before) * TICKS_PER_S;
        self.rate += smoothing.gain * (rate - self.rate);
        self.variance = shares.variance * smoothing.variance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_followed_by_63_percent_in_8_ms() {
        let (mut level, smoothing) = (Level::START, Smoothing::new());
        for _ in 0..8 {
            level.step(&Shares::every(0.0), &smoothing);
        }
        assert!((level.value - 0.368).abs() < 0.001, "{level:?}");
    }

    #[test]
    fn the_rate_of_a_steady_fall_is_its_own() {
        let (mut level, smoothing) = (Level::START, Smoothing::new());
        // 40 % in 200 ms.
        for ms in 1..=200 {
            level.step(&Shares::every(1.0 - 0.002 * ms as f32), &smoothing);
        }
        assert!((level.rate + 2.0).abs() < 0.01, "{level:?}");
    }

    #[test]
    fn the_noise_of_the_level_is_what_the_average_leaves_of_it() {
        let (mut level, smoothing) = (Level::START, Smoothing::new());
        let mut random = fastrand::Rng::with_seed(1);
        let (mut squares, ticks) = (0.0, 100_000);
        for _ in 0..ticks {
            // Uniform in ±0.1: a variance of 0.01 / 3.
            let mut shares = Shares::every(0.9 + 0.2 * random.f32());
            shares.variance = 0.01 / 3.0;
            level.step(&shares, &smoothing);
            squares += (level.value - 1.0) * (level.value - 1.0);
        }
        let measured = squares / ticks as f32;
        assert!((measured / level.variance - 1.0).abs() < 0.05, "{measured}");
    }
}

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

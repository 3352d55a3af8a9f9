//! Collapse: the sum falls faster than an arm makes the residual of a held object fall.
//!
//! A loss is quick, whatever came before it: a sphere that slides out raises the sum by up to 40 % until its
//! widest section has passed the tips, and then lets it collapse. So the sum is compared with where the level
//! was just now, a reference that follows every rise but falls no faster than the hardest arm makes a held
//! object's residual fall.

use super::level::{Level, Smoothing};
use super::limits::Limits;
use super::shares::Shares;
use crate::math::{larger, smaller};
use crate::units::TICK_US;

const TICKS_PER_S: f32 = 1e6 / TICK_US as f32;

/// Where the level was just now.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collapse {
    /// Not above one, unless the object has passed the tips.
    recent: f32,
    /// Share of the emptiest finger, smoothed.
    least: f32,
    /// Every finger has risen so far that there is no way back.
    passed: bool,
}

impl Collapse {
    /// At the plateau.
    pub const START: Self = Self {
        recent: 1.0,
        least: 1.0,
        passed: false,
    };

    /// Rise of the emptiest finger over its plateau, smoothed, share.
    pub fn rise(&self) -> f32 {
        self.least - 1.0
    }

    /// Fall of the sum below where it was just now, less what counts for nothing. `tightens`: the grip is
    /// being changed, or still follows the last of its pressure.
    pub fn step(
        &mut self,
        shares: &Shares,
        level: &Level,
        smoothing: &Smoothing,
        tightens: bool,
        allowance: f32,
        limits: &Limits,
    ) -> f32 {
        self.least += smoothing.gain * (shares.emptiest - self.least);
        // Neither a higher pressure nor an object that is still being put in is a way past the tips.
        self.passed = !tightens
            && (self.least > 1.0 + limits.passed.limit || self.passed && level.value > 1.0);
        let reached = match self.passed {
            true => level.value,
            false => smaller(level.value, 1.0),
        };
        let recent = self.recent - limits.fall_per_s.limit / TICKS_PER_S;
        self.recent = larger(reached, recent);
        self.recent - shares.sum - allowance - limits.quick_allowance
    }
}

//! Collapse: the sum falls faster than an arm makes the residual of a held object fall.
//!
//! A loss is quick, whatever came before it: a sphere that slides out raises the sum by up to 40 % until its
//! widest section has passed the tips, and then lets it collapse. So the sum is compared with where the level
//! was just now, a reference that follows every rise but falls no faster than the hardest arm makes a held
//! object's residual fall.

use super::level::{Level, Smoothing};
use super::limits::{Limits, PASSED};
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

    /// Fall of the sum below where it was just now. `tightens`: the grip is being changed, or still follows the
    /// last of its pressure.
    pub fn step(
        &mut self,
        shares: &Shares,
        level: &Level,
        smoothing: &Smoothing,
        tightens: bool,
        limits: &Limits,
    ) -> f32 {
        self.least += smoothing.gain * (shares.emptiest - self.least);
        // Neither a higher pressure nor an object that is still being put in is a way past the tips.
        self.passed = !tightens && (self.least > PASSED || self.passed && level.value > 1.0);
        let reached = match self.passed {
            true => level.value,
            false => smaller(level.value, 1.0),
        };
        let recent = self.recent - limits.held_fall_per_s / TICKS_PER_S;
        self.recent = larger(reached, recent);
        self.recent - shares.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::limits::{MOVING, PASSED, TWO_FINGERS};

    struct Hold {
        collapse: Collapse,
        level: Level,
        smoothing: Smoothing,
    }

    impl Hold {
        fn new() -> Self {
            Self {
                collapse: Collapse::START,
                level: Level::START,
                smoothing: Smoothing::new(),
            }
        }

        /// So many ticks; the fall in the last one.
        fn run(&mut self, shares: Shares, tightens: bool, ticks: u32, limits: &Limits) -> f32 {
            let mut fall = f32::NAN;
            for _ in 0..ticks {
                self.level.step(&shares, &self.smoothing);
                fall = self
                    .collapse
                    .step(&shares, &self.level, &self.smoothing, tightens, limits);
            }
            fall
        }
    }

    fn assert_close(value: f32, expected: f32) {
        assert!(
            (value - expected).abs() < 1e-3,
            "{value} and not {expected}"
        );
    }

    #[test]
    fn a_fall_counts_from_a_reference_that_falls_as_fast_as_a_held_object_at_most() {
        let mut hold = Hold::new();
        let per_tick = 1e-3 * MOVING.held_fall_per_s;
        assert_close(hold.run(Shares::every(1.0), false, 100, &MOVING), 0.0);
        let fallen = Shares::every(0.5);
        assert_close(hold.run(fallen, false, 1, &MOVING), 0.5 - per_tick);
        assert_close(hold.run(fallen, false, 19, &MOVING), 0.5 - 20.0 * per_tick);
        // In the end it is where the level is.
        assert_close(hold.run(fallen, false, 1_000, &MOVING), 0.0);
    }

    #[test]
    fn two_fingers_may_fall_faster() {
        let mut hold = Hold::new();
        let fall = hold.run(Shares::every(0.5), false, 10, &TWO_FINGERS);
        let reference = 1.0 - 1e-2 * TWO_FINGERS.held_fall_per_s;
        assert_close(fall, reference - 0.5);
    }

    #[test]
    fn the_way_back_from_a_rise_is_no_fall_unless_every_finger_has_passed_the_tips() {
        // Two fingers have risen by a half, the third by nothing.
        let mut turned = Shares::every(1.3);
        turned.emptiest = 1.0;
        let risen = Shares::every(1.3);
        for (shares, tightens, reference) in [
            (turned, false, 1.0),
            (risen, true, 1.0),
            (risen, false, 1.3),
        ] {
            let mut hold = Hold::new();
            hold.run(shares, tightens, 200, &MOVING);
            let fall = hold.run(Shares::every(1.1), tightens, 1, &MOVING);
            let falls = match reference > 1.0 {
                true => 1e-3 * MOVING.held_fall_per_s,
                false => 0.0,
            };
            assert_close(fall, reference - falls - 1.1);
        }
    }

    #[test]
    fn the_tips_are_passed_when_the_average_of_the_emptiest_finger_is_beyond_its_limit() {
        let mut hold = Hold::new();
        let limit = PASSED - 1.0;
        // 63 % of one and a half times the limit in 8 ms, 78 % in 12.
        let risen = Shares::every(1.0 + 1.5 * limit);
        hold.run(risen, false, 8, &MOVING);
        assert_close(hold.collapse.least - 1.0, 0.632 * 1.5 * limit);
        assert!(!hold.collapse.passed);
        hold.run(risen, false, 4, &MOVING);
        assert!(hold.collapse.passed);
        // And stay so as long as there is more than at the plateau.
        hold.run(Shares::every(1.05), false, 200, &MOVING);
        assert!(hold.collapse.passed);
        hold.run(Shares::every(0.98), false, 200, &MOVING);
        assert!(!hold.collapse.passed);
        hold.run(Shares::every(1.05), false, 200, &MOVING);
        assert!(!hold.collapse.passed);
    }
}

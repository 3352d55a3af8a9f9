//! One-sided loss: an object that leaves sideways empties one finger while it presses on the others.
//!
//! A gauge that fades looks like an emptying finger, but the other fingers do not feel it, and it takes seconds.

use super::level::Smoothing;
use super::limits::{Limits, SIDEWAYS};
use super::plateau::CALM;
use super::shares::Shares;
use crate::math::{root, smaller};

/// The least of three noisy numbers lies 0.85 standard deviations below them (order statistics of the normal
/// distribution), and looking ahead doubles that.
const FINGER_SIGMAS: f32 = 2.0;
/// An object that turns in the grip lets the other fingers pass through their plateau on the way.
const FELT_TICKS: u16 = 50;
/// A finger that has less than this left of what it carried lately, …
const EMPTIED: f32 = 0.4;
/// … and has gone all the way from here …
const EMPTIES: f32 = 0.75;
/// … in more time than this, empties, felt by the others or not: a box that turns on its edge rests on them as before,
/// and takes 60 to 150 ms. A gauge that breaks takes none, and one that comes off with a time constant of 3 s has 0.67
/// left.
const EMPTYING_TICKS: u16 = 25;

/// The emptiest finger, and whether the others feel it.
#[derive(Debug, Clone, Copy)]
pub(super) struct OneSided {
    /// Share that the emptiest finger has left of what it had lately, smoothed.
    emptiest: f32,
    /// How much longer the other fingers are taken to feel what the emptiest does.
    felt_ticks: u16,
    /// Ticks in which it has been emptying.
    emptying_ticks: u16,
}

impl OneSided {
    /// Every finger carries.
    pub const START: Self = Self {
        emptiest: 1.0,
        felt_ticks: 0,
        emptying_ticks: 0,
    };

    /// Fall of the emptiest finger, less what counts for nothing; none unless the object leaves sideways.
    /// `shares` are of the plateau, `lately` of what each finger has carried lately.
    pub fn step(
        &mut self,
        shares: &Shares,
        lately: &Shares,
        smoothing: &Smoothing,
        limits: &Limits,
    ) -> Option<f32> {
        self.emptiest += smoothing.gain * (lately.emptiest - self.emptiest);
        // Where the emptiest finger will be one averaging time from now: a push against the grip makes it
        // empty too, but comes to rest.
        let ahead = 2.0 * lately.emptiest - self.emptiest;
        let mut fall = smaller(
            1.0 - ahead - limits.finger_allowance,
            limits.emptying - lately.emptiest,
        );
        if fall > 0.0 {
            fall -= FINGER_SIGMAS * root(lately.emptiest_variance);
        }
        self.felt_ticks = match (lately.others - 1.0).abs() > CALM {
            true => FELT_TICKS,
            false => self.felt_ticks.saturating_sub(1),
        };
        // A knock from the side presses on the others almost as much as it takes away.
        if lately.emptiest > EMPTIES {
            self.emptying_ticks = 0;
        } else if lately.emptiest > EMPTIED {
            self.emptying_ticks = self.emptying_ticks.saturating_add(1);
        }
        let empties = lately.emptiest < EMPTIED && self.emptying_ticks > EMPTYING_TICKS;
        let leaves = self.is_felt() || empties;
        (leaves && shares.sum < 1.0 - SIDEWAYS).then_some(fall)
    }

    /// Whether the other fingers feel what the emptiest does. What they do not feel is a gauge that fades.
    pub fn is_felt(&self) -> bool {
        self.felt_ticks > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::limits::MOVING;

    /// One finger with this share, the others pressed and the sum fallen as by an object that leaves sideways.
    fn leaving(emptiest: f32) -> Shares {
        Shares {
            emptiest,
            others: 1.1,
            ..Shares::every(0.85)
        }
    }

    /// The fall in the last tick of so many alike.
    fn fall(one_sided: &mut OneSided, shares: &Shares, ticks: u32) -> Option<f32> {
        let smoothing = Smoothing::new();
        (0..ticks)
            .map(|_| one_sided.step(shares, shares, &smoothing, &MOVING))
            .last()?
    }

    /// The same of a finger that has carried until then.
    fn fall_of(shares: &Shares, ticks: u32) -> Option<f32> {
        let mut one_sided = OneSided::START;
        fall(&mut one_sided, shares, ticks)
    }

    fn assert_close(value: Option<f32>, expected: f32) {
        assert!(
            value.is_some_and(|value| (value - expected).abs() < 2e-3),
            "{value:?} and not {expected}"
        );
    }

    #[test]
    fn a_finger_that_empties_is_judged_by_where_it_will_be_in_8_ms() {
        let (mut one_sided, smoothing) = (OneSided::START, Smoothing::new());
        // 60 % in 150 ms.
        for ms in 1..=150 {
            let shares = leaving(1.0 - 0.004 * ms as f32);
            let fall = one_sided.step(&shares, &shares, &smoothing, &MOVING);
            // 0.03 less in 7.5 ticks: what it would be at that place.
            if ms == 120 {
                assert_close(fall, 0.48 + 0.03 - MOVING.finger_allowance);
            }
        }
    }

    #[test]
    fn a_finger_at_rest_counts_beyond_what_a_push_takes_and_its_noise() {
        let allowance = MOVING.finger_allowance;
        let mut noisy = leaving(0.3);
        assert_close(fall_of(&noisy, 200), 0.7 - allowance);
        // Twice its 2 % of noise.
        noisy.emptiest_variance = 4e-4;
        assert_close(fall_of(&noisy, 200), 0.7 - allowance - 0.04);
        // Noise makes no less of what is no fall.
        noisy.emptiest = 0.56;
        assert_close(fall_of(&noisy, 200), 0.44 - allowance);
    }

    #[test]
    fn a_finger_that_falls_fast_counts_once_it_is_nearly_half_empty_alone() {
        for emptiest in [0.65, 0.56] {
            let first = fall_of(&leaving(emptiest), 1);
            assert_close(first, MOVING.emptying - emptiest);
        }
    }

    #[test]
    fn what_the_others_do_not_feel_is_a_gauge_that_fades() {
        let mut fades = leaving(0.1);
        for (others, is_felt) in [(1.02, false), (0.98, false), (1.04, true), (0.96, true)] {
            fades.others = others;
            let mut one_sided = OneSided::START;
            let fall = fall(&mut one_sided, &fades, 1);
            assert_eq!(
                (fall.is_some(), one_sided.is_felt()),
                (is_felt, is_felt),
                "{others}"
            );
        }
    }

    #[test]
    fn others_that_pass_through_their_plateau_feel_it_for_50_ticks() {
        let mut one_sided = OneSided::START;
        let mut turning = leaving(0.1);
        fall(&mut one_sided, &turning, 1);
        turning.others = 1.0;
        assert!(fall(&mut one_sided, &turning, 49).is_some());
        assert_eq!(fall(&mut one_sided, &turning, 1), None);
    }

    #[test]
    fn a_knock_that_takes_less_than_7_percent_in_all_is_no_loss() {
        for (sum, leaves) in [(0.94, false), (0.92, true)] {
            let knocked = Shares {
                sum,
                ..leaving(0.1)
            };
            let fall = fall_of(&knocked, 1);
            assert_eq!(fall.is_some(), leaves, "{sum}");
        }
    }

    #[test]
    fn a_finger_that_empties_over_many_ticks_is_believed_alone_and_one_that_does_at_once_is_not() {
        for (per_tick, is_believed) in [(0.01, true), (0.02, false), (0.7, false)] {
            let (mut one_sided, smoothing) = (OneSided::START, Smoothing::new());
            let mut last = None;
            for tick in 0..200 {
                let mut shares = leaving((1.0 - per_tick * tick as f32).max(0.3));
                shares.others = 1.0;
                last = one_sided.step(&shares, &shares, &smoothing, &MOVING);
            }
            assert_eq!(last.is_some(), is_believed, "{per_tick}");
        }
    }
}

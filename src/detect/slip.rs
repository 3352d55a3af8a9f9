//! A slip: the level's way from where it was held last.

use super::level::Level;
use super::plateau::CALM;
use crate::math::root;

/// A slip must last this long: longer than noise, shorter than the 20 ms from 5 to 15 mm of a fast slide.
const SLIP_TICKS: u16 = 5;
/// A fall is a slip after this time only: an arm that speeds up makes one too.
const SLIP_FALL_TICKS: u16 = 100;
/// Standard deviations of the level that a slip must exceed beyond its limit.
const SLIP_SIGMAS: f32 = 4.0;
/// A slip has ended, and the next one counts from there, when the level stays within `CALM` for so long.
const SLIP_OVER_TICKS: u16 = 500;

/// The level's way from the plateau.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slip {
    /// Level before it.
    from: f32,
    ticks: u16,
    slipping: bool,
    /// The level has stayed close to this for so many ticks.
    settled: f32,
    settled_ticks: u16,
}

impl Slip {
    /// None yet.
    pub const NONE: Self = Self {
        from: 1.0,
        ticks: 0,
        slipping: false,
        settled: 1.0,
        settled_ticks: 0,
    };

    /// Whether the level is off by more than the limit, and has been for long enough. `swell` is what
    /// it may have gained from the last of a rising pressure, `sag` what it may have lost to a lower one.
    pub fn step(&mut self, level: &Level, limit: f32, swell: f32, sag: f32) -> bool {
        let off = level.value - self.from;
        let limit = match off.abs() > limit {
            true => limit + SLIP_SIGMAS * root(level.variance),
            false => limit,
        };
        let rises = off > limit + swell;
        let falls = off < -(limit + sag);
        self.ticks = if rises || falls {
            self.ticks.saturating_add(1)
        } else {
            0
        };
        let enough = if rises { SLIP_TICKS } else { SLIP_FALL_TICKS };
        if self.ticks >= enough {
            self.slipping = true;
        } else if off.abs() < CALM {
            self.slipping = false;
        }
        if (level.value - self.settled).abs() < CALM {
            self.settled_ticks = self.settled_ticks.saturating_add(1);
        } else {
            self.settled = level.value;
            self.settled_ticks = 0;
        }
        if self.slipping && self.settled_ticks >= SLIP_OVER_TICKS {
            self.slipping = false;
            self.ticks = 0;
            self.from = level.value;
        }
        self.slipping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: f32 = 0.07;

    /// A level without noise.
    fn level(value: f32) -> Level {
        Level {
            value,
            ..Level::START
        }
    }

    /// The tick, from one, in which a level that stays is a slip.
    fn slips_after(level: Level, sag: f32) -> Option<u16> {
        let mut slip = Slip::NONE;
        (1..=400).find(|_| slip.step(&level, LIMIT, 0.0, sag))
    }

    #[test]
    fn a_rise_is_a_slip_after_5_ticks_and_a_fall_after_100() {
        assert_eq!(slips_after(level(1.08), 0.0), Some(5));
        assert_eq!(slips_after(level(1.06), 0.0), None);
        assert_eq!(slips_after(level(0.92), 0.0), Some(100));
        assert_eq!(slips_after(level(0.94), 0.0), None);
        // Ticks in a row.
        let mut slip = Slip::NONE;
        for tick in 1..=100 {
            let value = if tick % 5 == 0 { 1.0 } else { 1.08 };
            assert!(!slip.step(&level(value), LIMIT, 0.0, 0.0), "{tick}");
        }
    }

    #[test]
    fn a_slip_exceeds_its_limit_by_four_standard_deviations_of_the_noise() {
        let noisy = |value| Level {
            variance: 0.005 * 0.005,
            ..level(value)
        };
        assert_eq!(slips_after(noisy(1.085), 0.0), None);
        assert_eq!(slips_after(noisy(1.095), 0.0), Some(5));
        assert_eq!(slips_after(noisy(0.915), 0.0), None);
        assert_eq!(slips_after(noisy(0.905), 0.0), Some(100));
    }

    #[test]
    fn what_a_lower_pressure_takes_is_no_slip_and_gives_no_rise() {
        assert_eq!(slips_after(level(0.90), 0.05), None);
        assert_eq!(slips_after(level(0.87), 0.05), Some(100));
        assert_eq!(slips_after(level(1.08), 0.05), Some(5));
    }

    #[test]
    fn a_slip_goes_on_until_the_level_is_back() {
        let mut slip = Slip::NONE;
        for _ in 0..10 {
            slip.step(&level(1.08), LIMIT, 0.0, 0.0);
        }
        for (value, slips) in [(1.05, true), (0.95, true), (1.02, false), (1.05, false)] {
            assert_eq!(slip.step(&level(value), LIMIT, 0.0, 0.0), slips, "{value}");
        }
    }

    #[test]
    fn a_slip_is_over_500_ticks_after_the_level_has_come_to_rest_and_the_next_counts_from_there() {
        let mut slip = Slip::NONE;
        let mut slips = |value, ticks: u32| {
            (0..ticks)
                .filter(|_| slip.step(&level(value), LIMIT, 0.0, 0.0))
                .count()
        };
        // At rest from its second tick on; it moves once more by less than what is calm.
        assert_eq!(slips(1.10, 400), 396);
        assert_eq!(slips(1.08, 1_000), 100);
        // From 1.08, either way.
        assert_eq!(slips(1.14, 300), 0);
        assert_eq!(slips(1.02, 300), 0);
        assert_eq!(slips(1.16, 10), 6);
    }

    #[test]
    fn a_level_that_wanders_is_not_at_rest() {
        let mut slip = Slip::NONE;
        let slips = (0..2_000)
            .filter(|tick| {
                let value = if tick % 400 < 200 { 1.10 } else { 1.15 };
                slip.step(&level(value), LIMIT, 0.0, 0.0)
            })
            .count();
        assert_eq!(slips, 1_996);
    }
}

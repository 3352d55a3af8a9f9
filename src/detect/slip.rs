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

    /// Whether the level is off by more than the limit, and has been for long enough. `sag` is what it may
    /// have lost to a lower pressure.
    pub fn step(&mut self, level: &Level, limit: f32, sag: f32) -> bool {
        let off = level.value - self.from;
        let limit = match off.abs() > limit {
            true => limit + SLIP_SIGMAS * root(level.variance),
            false => limit,
        };
        let rises = off > limit;
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

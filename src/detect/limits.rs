//! Limits: what an arm does to an object that is held, what a loss does, and the line between.

use crate::command::Motion;
use crate::units::FINGERS;

/// One limit of the detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The most that held objects reach.
    pub held: f32,
    /// What counts as a loss.
    pub limit: f32,
    /// What 99 of 100 lost objects reach, of those that go this way.
    pub lost: f32,
}

/// The limits for what the arm does and for the fingers that can be felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Fall of the level, 1/s.
    pub fall_per_s: Limit,
    /// Fall of all fingers but the emptiest below their plateau, share.
    pub fallen: Limit,
    /// Fall of a finger below what it carried lately while the others feel it, share.
    pub emptied: Limit,
    /// Rise of the emptiest finger over its plateau, from where there is no way back, share.
    pub passed: Limit,
    /// Quick fall that counts for nothing, beyond that of the settings.
    pub(super) quick_allowance: f32,
    /// Share of the settings' limit that makes a slip.
    pub(super) slip: f32,
}

/// What the detector looks at in one tick, in the units of [`Limits`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signs {
    /// Fall of the level, 1/s.
    pub fall_per_s: f32,
    /// Fall of all fingers but the emptiest below their plateau, share.
    pub fallen: f32,
    /// Fall of a finger below what it carried lately while the others feel it, share.
    pub emptied: f32,
    /// Rise of the emptiest finger over its plateau, share.
    pub passed: f32,
}

/// A finger that leaves the object has less than this left; knocks at 60 m/s² leave it more.
pub(super) const EMPTYING: f32 = 0.5;
/// Fall of the sum that belongs to an object that leaves sideways. Knocks at 60 m/s² that empty a finger by
/// half take 5 %.
pub(super) const SIDEWAYS: f32 = 0.07;

impl Limits {
    /// For what the arm does, and so many fingers in the sum.
    pub const fn of(motion: Motion, fingers: usize) -> &'static Self {
        match (motion, fingers) {
            (Motion::Moving, FINGERS..) => &MOVING,
            (Motion::Still, FINGERS..) => &STILL,
            _ => &TWO_FINGERS,
        }
    }
}

/// Measured by `softgrip evaluate --limits --hours 30 --losses 500 --seed 1000000`.
pub static MOVING: Limits = Limits {
    fall_per_s: Limit {
        held: 0.0,
        limit: 5.0,
        lost: 0.0,
    },
    fallen: Limit {
        held: 0.0,
        limit: 0.18,
        lost: 0.0,
    },
    emptied: Limit {
        held: 0.0,
        limit: 0.55,
        lost: 0.0,
    },
    passed: Limit {
        held: 0.0,
        limit: 0.2,
        lost: 0.0,
    },
    quick_allowance: 0.0,
    slip: 1.0,
};

/// Nothing but knocks.
pub static STILL: Limits = Limits {
    fall_per_s: Limit {
        held: 0.0,
        limit: 2.5,
        lost: 0.0,
    },
    fallen: Limit {
        held: 0.0,
        limit: 0.1,
        lost: 0.0,
    },
    slip: 0.5,
    ..MOVING
};

/// What the arm does to two fingers from the side, the third does not balance.
pub static TWO_FINGERS: Limits = Limits {
    fall_per_s: Limit {
        held: 0.0,
        limit: 10.0,
        lost: 0.0,
    },
    fallen: Limit {
        held: 0.0,
        limit: 0.35,
        lost: 0.0,
    },
    quick_allowance: 0.15,
    slip: 4.0,
    ..MOVING
};

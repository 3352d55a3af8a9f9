//! What an arm does to an object that is held, and what of it counts for nothing.

use crate::command::Motion;
use crate::units::FINGERS;

/// What counts for nothing, for what the arm does and for the fingers that can be felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Fastest fall of the reference per second.
    pub held_fall_per_s: f32,
    /// Fall below the plateau, and below what the fingers carried lately, that counts for nothing.
    pub slow_allowance: f32,
    /// Quick fall that counts for nothing, beyond that of the settings.
    pub quick_allowance: f32,
    /// Fall of one finger that counts for nothing: what a push takes that an object withstands.
    pub finger_allowance: f32,
    /// A finger that leaves the object has less than this left; knocks at 60 m/s² leave it more.
    pub emptying: f32,
    /// Share of the settings' limit that makes a slip.
    pub slip: f32,
}

/// A rise of every finger that has got this far ends in a loss: the widest section of a sphere passes the
/// tips at 1.2 to 1.48. Slips that an arm's turn caught again raised the sum to 1.2 and the least of the
/// fingers to 1.06; the way back from there is no loss.
pub(super) const PASSED: f32 = 1.2;
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

/// Held objects fall by 3.2/s for 30 ms in an emergency stop at 20 m/s², and by 4.5/s for 10 ms after a knock of
/// 100 m/s². Lost ones fall by 16 to 25/s.
pub static MOVING: Limits = Limits {
    held_fall_per_s: 5.0,
    slow_allowance: 0.18,
    quick_allowance: 0.0,
    finger_allowance: 0.45,
    emptying: 0.58,
    slip: 1.0,
};

/// Knocks alone.
pub static STILL: Limits = Limits {
    held_fall_per_s: 2.5,
    slow_allowance: 0.1,
    quick_allowance: 0.0,
    finger_allowance: 0.45,
    emptying: 0.58,
    slip: 0.5,
};

/// What the arm does to two fingers from the side, the third does not balance: held objects fall by 8.1/s.
pub static TWO_FINGERS: Limits = Limits {
    held_fall_per_s: 9.0,
    slow_allowance: 0.24,
    quick_allowance: 0.08,
    finger_allowance: 0.44,
    emptying: 0.53,
    slip: 4.0,
};

/// What the detector saw in one tick, as shares of the plateau.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signs {
    /// The fingers have followed the pressure to its end.
    pub(super) steady: bool,
    /// Fall of the sum below where it was just now.
    pub collapse: f32,
    /// Fall of all fingers but the emptiest, below their plateau and below what they carried lately.
    pub slow: f32,
    /// Fall of the emptiest finger; none unless the object leaves sideways.
    pub one_sided: Option<f32>,
    /// What of any fall a lower pressure explains.
    pub sag: f32,
    /// What exceeds its allowance most, less that: summed up tick by tick, and never below zero, it is the
    /// evidence.
    pub excess: f32,
}

impl Signs {
    /// Nothing has fallen.
    pub(super) const NONE: Self = Self {
        steady: false,
        collapse: 0.0,
        slow: 0.0,
        one_sided: None,
        sag: 0.0,
        excess: 0.0,
    };
}

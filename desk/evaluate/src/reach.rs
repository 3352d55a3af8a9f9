//! How far what the detector looks at goes, in the situations that it has limits for.

use serde::Serialize;
use softgrip::command::Motion;
use softgrip::detect::limits::{Limits, Signs};
use softgrip::units::AdcCode;
use softgrip::{FINGERS, RawFrame};

use crate::cycle::Activity;

/// What is known of the arm and of the fingers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Situation {
    /// The arm may move.
    Moving,
    /// The robot says that the arm stands still.
    Still,
    /// One gauge is open.
    TwoFingers,
}

impl Situation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Moving, Self::Still, Self::TwoFingers];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Moving => "the arm may move",
            Self::Still => "the arm stands still",
            Self::TwoFingers => "one gauge is open",
        }
    }

    /// The detector's limits for it.
    pub fn limits(self) -> &'static Limits {
        match self {
            Self::Moving => Limits::of(Motion::Moving, FINGERS),
            Self::Still => Limits::of(Motion::Still, FINGERS),
            Self::TwoFingers => Limits::of(Motion::Moving, FINGERS - 1),
        }
    }

    /// What happens to held objects.
    pub fn activities(self) -> &'static [Activity] {
        use Activity as A;
        match self {
            Self::Moving | Self::TwoFingers => &[
                A::Rest,
                A::Move,
                A::HardStart,
                A::EmergencyStop,
                A::Vibration,
                A::Bump,
            ],
            Self::Still => &[A::Rest, A::Bump],
        }
    }

    /// What the controller gets of a frame.
    pub(crate) fn frame(self, mut frame: RawFrame) -> RawFrame {
        if self == Self::TwoFingers {
            frame.gauges[FINGERS - 1] = AdcCode(u16::MAX);
        }
        frame
    }

    /// What the robot says of its arm.
    pub(crate) fn motion(self) -> Motion {
        match self {
            Self::Moving | Self::TwoFingers => Motion::Moving,
            Self::Still => Motion::Still,
        }
    }
}

/// The greatest of each sign.
#[derive(Debug, Clone, Copy)]
pub struct Reach(pub [f32; 4]);

impl Reach {
    /// Nothing seen.
    pub const NONE: Self = Self([0.0; 4]);

    /// Takes one tick.
    pub fn take(&mut self, signs: &Signs) {
        let Signs {
            fall_per_s,
            fallen,
            emptied,
            passed,
        } = *signs;
        self.join(&Self([fall_per_s, fallen, emptied, passed]));
    }

    /// Takes the greater of each.
    pub fn join(&mut self, other: &Self) {
        for (greatest, value) in self.0.iter_mut().zip(other.0) {
            *greatest = greatest.max(value);
        }
    }
}

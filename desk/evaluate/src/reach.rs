//! How far what the detector looks at goes, in the situations that it has limits for.

use serde::Serialize;
use softgrip::command::Motion;
use softgrip::detect::limits::Signs;
use softgrip::units::AdcCode;
use softgrip::{FINGERS, RawFrame, TICK_US};

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

/// A hypothesis of the detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Hypothesis {
    /// Any of them: what the detector sums up.
    Any,
    /// The sum falls faster than an arm makes it.
    Collapse,
    /// All fingers but the emptiest have fallen below their plateau.
    Slow,
    /// One finger has emptied while the others feel it.
    OneSided,
}

impl Hypothesis {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Any, Self::Collapse, Self::Slow, Self::OneSided];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Any => "any",
            Self::Collapse => "collapse",
            Self::Slow => "slow loss",
            Self::OneSided => "one-sided loss",
        }
    }
}

/// Evidence of each of [`Hypothesis::ALL`] by itself, %·ms, and the most that it has been.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    sum: [f32; 4],
    /// The most.
    pub most: [f32; 4],
}

impl Reach {
    /// Nothing seen.
    pub const NONE: Self = Self {
        sum: [0.0; 4],
        most: [0.0; 4],
    };

    /// Takes one tick; none ends a hold.
    pub fn take(&mut self, signs: Option<Signs>) {
        let Some(signs) = signs else {
            self.sum = [0.0; 4];
            return;
        };
        let falls = [
            Some(signs.fall),
            Some(signs.collapse),
            Some(signs.slow),
            signs.one_sided,
        ];
        let tick_ms = 1e-3 * TICK_US as f32;
        for ((sum, most), fall) in self.sum.iter_mut().zip(&mut self.most).zip(falls) {
            *sum = fall.map_or(0.0, |fall| (*sum + 100.0 * tick_ms * fall).max(0.0));
            *most = most.max(*sum);
        }
    }

    /// Takes the greater of each.
    pub fn join(&mut self, other: &Self) {
        for (most, other) in self.most.iter_mut().zip(other.most) {
            *most = most.max(other);
        }
    }
}

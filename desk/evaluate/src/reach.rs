//! How far what the detector looks at goes, in the situations that it has limits for.

use serde::Serialize;
use softgrip::command::Motion;
use softgrip::detect::limits::{Limits, Signs};
use softgrip::settings::Settings;
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

    /// What counts for nothing.
    fn limits(self) -> &'static Limits {
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

/// What the detector looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sign {
    /// Fall of the sum below where it was just now, share.
    Collapse,
    /// Fall of all fingers but the emptiest below their plateau, share.
    Slow,
    /// Fall of the emptiest finger while the others feel it, share.
    OneSided,
    /// What any of these exceeds its allowance by, summed up, %·ms.
    Evidence,
}

impl Sign {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Collapse, Self::Slow, Self::OneSided, Self::Evidence];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Collapse => "collapse, share",
            Self::Slow => "slow loss, share",
            Self::OneSided => "one-sided loss, share",
            Self::Evidence => "evidence, %·ms",
        }
    }

    /// What of it counts for nothing; for the evidence, its limit without noise.
    pub fn limit(self, situation: Situation, settings: &Settings) -> f32 {
        let detection = &settings.detection;
        let limits = situation.limits();
        match self {
            Self::Collapse => 0.01 * detection.loss_allowance_percent + limits.quick_allowance,
            Self::Slow => limits.slow_allowance,
            Self::OneSided => limits.finger_allowance,
            Self::Evidence => detection.loss_evidence_percent_ms,
        }
    }
}

/// The most of each of [`Sign::ALL`].
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    evidence: f32,
    /// The most.
    pub most: [f32; 4],
}

impl Reach {
    /// Nothing seen.
    pub const NONE: Self = Self {
        evidence: 0.0,
        most: [0.0; 4],
    };

    /// Takes one tick; none is one without a hold at a steady pressure.
    pub fn take(&mut self, signs: Option<Signs>) {
        let Some(signs) = signs else {
            self.evidence = 0.0;
            return;
        };
        let tick_ms = 1e-3 * TICK_US as f32;
        self.evidence = (self.evidence + 100.0 * tick_ms * signs.excess).max(0.0);
        let one_sided = signs.one_sided.unwrap_or(0.0);
        let falls = [signs.collapse, signs.slow, one_sided].map(|fall| fall - signs.sag);
        let [collapse, slow, one_sided] = falls;
        let now = [collapse, slow, one_sided, self.evidence];
        for (most, now) in self.most.iter_mut().zip(now) {
            *most = most.max(now);
        }
    }

    /// Takes the greater of each.
    pub fn join(&mut self, other: &Self) {
        for (most, other) in self.most.iter_mut().zip(other.most) {
            *most = most.max(other);
        }
    }
}

//! What a step has found.

use softgrip::fault::Fault;

use crate::faults;

/// A step of the check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Which gripper it is, and nothing is latched.
    Identity,
    /// Every channel without pressure.
    Rest,
    /// The fingers move.
    Pressure,
    /// The pressure leaves.
    Release,
    /// Which plug is which finger's.
    Fingers,
    /// What the robot sees of a stop.
    Outputs,
    /// The gripper is as it was found.
    Left,
}

/// The steps in their order: the name, and what each expects in a few words.
pub const STEPS: [(Step, &str, &str); 7] = [
    (
        Step::Identity,
        "Identity",
        "this build's finger and version; nothing is latched",
    ),
    (
        Step::Rest,
        "At rest",
        "every channel is quiet and near its zero",
    ),
    (
        Step::Pressure,
        "Pressure",
        "the pressure goes where it is told, and each finger bends as its table says",
    ),
    (
        Step::Release,
        "Release",
        "the pressure leaves, and nothing is latched",
    ),
    (
        Step::Fingers,
        "Fingers",
        "the finger that is bent by hand is the one that is seen",
    ),
    (
        Step::Outputs,
        "Outputs",
        "a stop and its acknowledgement reach the robot",
    ),
    (
        Step::Left,
        "As found",
        "no pressure, no fault, the same settings",
    ),
];

impl Step {
    /// Its name.
    pub fn name(self) -> &'static str {
        let row = STEPS.iter().find(|(step, ..)| *step == self);
        row.map_or("", |(_, name, _)| name)
    }
}

/// What has become of an expectation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is as expected.
    Passed,
    /// It will do, and could be better.
    Warned,
    /// It is not.
    Failed,
    /// Nobody has looked, and the text says why.
    NotTried,
}

impl Verdict {
    /// In one word or two.
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Warned => "warning",
            Self::Failed => "FAILED",
            Self::NotTried => "not tried",
        }
    }
}

/// One expectation, and what was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Where.
    pub step: Step,
    /// What was looked at.
    pub what: String,
    /// What is expected of it, with its unit.
    pub expected: String,
    /// What was seen; of what was not tried, why.
    pub seen: String,
    /// What has become of it.
    pub verdict: Verdict,
    /// The fault, where it is one of the manual's.
    pub fault: Option<Fault>,
    /// What to look at; empty where nothing is wrong.
    pub look_at: String,
}

impl Finding {
    /// Judged.
    pub fn new(
        step: Step,
        what: impl Into<String>,
        expected: impl Into<String>,
        seen: impl Into<String>,
        verdict: Verdict,
    ) -> Self {
        Self {
            step,
            what: what.into(),
            expected: expected.into(),
            seen: seen.into(),
            verdict,
            fault: None,
            look_at: String::new(),
        }
    }

    /// Passed if it is so, else failed.
    pub fn judged(
        step: Step,
        what: impl Into<String>,
        expected: impl Into<String>,
        seen: impl Into<String>,
        is_so: bool,
    ) -> Self {
        let verdict = match is_so {
            true => Verdict::Passed,
            false => Verdict::Failed,
        };
        Self::new(step, what, expected, seen, verdict)
    }

    /// A fault of the manual's, by its number.
    pub fn fault(
        step: Step,
        what: impl Into<String>,
        expected: impl Into<String>,
        number: u16,
    ) -> Self {
        let fault = faults::of(number);
        let seen = match fault {
            Some(fault) => format!("fault {number}, {fault:?}"),
            None => format!("fault {number}, which is unknown to this program"),
        };
        let mut finding = Self::new(step, what, expected, seen, Verdict::Failed);
        finding.fault = fault;
        if let Some(fault) = fault {
            finding.look_at = format!("{} ({})", faults::look_at(fault), faults::page(fault));
        }
        finding
    }

    /// With what to look at where it has not passed.
    pub fn look_at(mut self, advice: &str) -> Self {
        if matches!(self.verdict, Verdict::Failed | Verdict::Warned) && self.look_at.is_empty() {
            self.look_at = advice.into();
        }
        self
    }
}

//! What a source tells.

use settings::Values;

use crate::observation::Observation;
use crate::tick::Tick;

/// Something that is told of a gripper.
#[derive(Debug, Clone, PartialEq)]
pub enum Told {
    /// What gripper it is. It comes first.
    Provenance(Provenance),
    /// Its settings: at the start, and as often as they change.
    Settings(SettingsTold),
    /// What is seen of it.
    Observation(Box<Observation>),
    /// A control tick; only where ticks were asked for. It comes before its observation.
    Tick(Box<Tick>),
    /// Something has happened.
    Event(EventTold),
    /// Something about the source.
    Note(String),
    /// Nothing more comes, as it should be, and why.
    Ended(String),
    /// Nothing more comes, for something is wrong.
    Failed(String),
}

/// What gripper it is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// The source.
    pub source: String,
    /// Version of the gripper's program; empty if that is not told.
    pub version: String,
    /// Name of the recipe of its finger table; empty if that is not told.
    pub recipe: String,
    /// First bytes of the SHA-256 of that recipe in hexadecimal digits, 16 of them or, from the registers, 8.
    pub table: String,
}

/// Settings of the gripper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettingsTold {
    /// When, s since its start; none where it is not known.
    pub t_s: Option<f64>,
    /// All of them.
    pub values: Values,
    /// The controller was given them before the tick at this time; else it found them itself in it, as a tare.
    pub applied: bool,
}

/// Something that has happened.
#[derive(Debug, Clone, PartialEq)]
pub struct EventTold {
    /// When, s since the gripper's start.
    pub t_s: f64,
    /// Its name, as in `softgrip replay --json`.
    pub name: String,
    /// In words.
    pub text: String,
}

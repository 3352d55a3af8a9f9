//! What a source tells.

use std::sync::mpsc::Receiver;

use settings::Values;

use crate::observation::Observation;
use crate::tick::Tick;
use crate::wish::Wishes;

/// A source that tells of a gripper.
pub struct Connection {
    /// What it is, in words.
    pub name: String,
    /// How often an observation is to come, Hz; 0 where the source's own rate is taken. The real rate is a
    /// [`Told::Note`] where it turns out to be another.
    pub rate_hz: f64,
    /// What it tells. It ends with [`Told::Ended`], and it ends itself once this is dropped.
    pub told: Receiver<Told>,
    /// Takes wishes; none where nothing can be wished of the gripper.
    pub wishes: Option<Wishes>,
}

/// Something that is told of a gripper.
#[derive(Debug, Clone, PartialEq)]
pub enum Told {
    /// What gripper it is. It comes first.
    Provenance(Provenance),
    /// Its settings: at the start, and as often as they change.
    Settings(SettingsTold),
    /// What is seen of it.
    Observation(Box<Observation>),
    /// A control tick in full; only where ticks were asked for.
    Tick(Box<Tick>),
    /// Something has happened.
    Event(EventTold),
    /// Something about the source.
    Note(String),
    /// Nothing more comes, and why.
    Ended(String),
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

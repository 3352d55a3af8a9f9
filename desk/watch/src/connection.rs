//! A source that has been opened.

use std::sync::mpsc::Receiver;

use crate::told::Told;
use crate::wish::Wishes;

/// A source that tells of a gripper.
pub struct Connection {
    /// What it is, in words.
    pub name: String,
    /// How often an observation is to come, Hz; 0 where the source's own rate is taken. The real rate is a
    /// [`Told::Note`] where it turns out to be another.
    pub rate_hz: f64,
    /// What it tells. It ends with [`Told::Ended`] or [`Told::Failed`], and it ends itself once this is dropped.
    pub told: Receiver<Told>,
    /// Takes wishes; none where nothing can be wished of the gripper.
    pub wishes: Option<Wishes>,
}

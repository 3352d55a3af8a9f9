//! What can be wished of a gripper.

use std::sync::mpsc::{self, Sender};

use serve::script::Action;
use softgrip::table::ObjectKind;

/// A wish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    /// Grip at the pressure of the settings.
    Grip,
    /// Grip at this pressure, kPa.
    GripAt(f32),
    /// Grip at the lowest pressure that lifts this with the margin of the settings.
    GripPayload {
        /// Its shape, in the size of the recipe.
        kind: ObjectKind,
        /// Its mass, kg.
        mass_kg: f32,
        /// Greatest acceleration of the arm, upwards, m/s².
        acceleration_m_s2: f32,
    },
    /// Let go.
    Release,
    /// Go to the safe state at once.
    Stop,
    /// What is latched has been seen.
    Acknowledge,
    /// Take the present strain as zero.
    Tare,
    /// Learn the mounted fingers, with nothing in the grip.
    Sweep,
    /// Store the settings.
    Save,
    /// Change a setting: its number, and its value.
    Set(u16, f32),
    /// Have the black box run again.
    ClearBlackBox,
    /// Something happens to the gripper: to the virtual one alone.
    World(Action),
}

/// What becomes of a wish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// It is done, or being done.
    Done,
    /// It was so, or was being done, already.
    Already,
    /// It is not done, and why.
    Refused(String),
}

/// A wish, and where its answer is to go.
pub(crate) struct Asked {
    pub wish: Wish,
    pub answer: Sender<Answer>,
}

/// Takes wishes for a gripper.
#[derive(Clone)]
pub struct Wishes(Sender<Asked>);

impl Wishes {
    pub(crate) fn new(sender: Sender<Asked>) -> Self {
        Self(sender)
    }

    /// Wishes something, and waits for the answer.
    ///
    /// # Errors
    /// If the source has ended.
    pub fn ask(&self, wish: Wish) -> anyhow::Result<Answer> {
        let (answer, answered) = mpsc::channel();
        let gone = || anyhow::anyhow!("the gripper's connection has ended");
        self.0.send(Asked { wish, answer }).map_err(|_| gone())?;
        answered.recv().map_err(|_| gone())
    }
}

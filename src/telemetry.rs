//! What the controller shows: a snapshot of each tick, which may be dropped, the record in which it is sent, and the
//! indicator outputs.

mod codes;
pub mod frame;
mod record;
mod snapshot;

pub use crate::event::{EVENTS, Event, Events};
pub use record::{Record, RecordError};
pub use snapshot::Snapshot;

/// Stands in a message right before the running build's id, so that a host whose ELF file is another image's finds it
/// all the same.
pub const BUILD_MARK: &str = "running build ";

/// Length of that id.
pub const BUILD_BYTES: usize = 8;

/// Indicator outputs for the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Indicators {
    /// A grip would be accepted.
    pub ready: bool,
    /// Something is held.
    pub holding: bool,
    /// A loss is latched.
    pub lost: bool,
    /// A fault, or a failed gauge, is latched.
    pub fault: bool,
}

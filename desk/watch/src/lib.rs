//! What a gripper tells, whatever it is watched by, and what can be wished of it.
//!
//! ```text
//! virtual, tty, tcp ─► source ─► Connection ─┬─ told ───► observations, events, settings, ticks
//!                                            └─ wishes ─► grip, release, set, … (registers), and what happens to the
//!                                                         virtual gripper
//! ```
#![forbid(unsafe_code)]
// So is the virtual gripper.
#![cfg(unix)]

pub mod observation;

pub mod fields;
pub mod page;

pub mod tick;

pub mod told;
pub mod wish;

mod registers;

mod gripper;
mod line;

pub mod source;

pub use observation::Observation;
pub use source::{Options, Source, open};
pub use told::{Connection, Told};
pub use wish::{Answer, Wish, Wishes};

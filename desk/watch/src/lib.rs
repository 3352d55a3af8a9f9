//! What a gripper tells, whatever it is watched by, and what can be wished of it.
//!
//! ```text
//! virtual, tty, tcp, defmt, probe, file ─► source ─► Connection ─┬─ told ───► observations, events, settings, ticks ─► recorder ─► file, live
//!                                                         └─ wishes ─► grip, release, set, … (registers), and what happens to the
//!                                                                      virtual gripper
//! file ─► recording ─► rerun (the controller does it again), verdicts (what differs)
//! ```
#![forbid(unsafe_code)]

pub mod observation;

pub mod fields;
pub mod page;

pub mod tick;

pub mod told;

mod protobuf;
pub mod schema;

mod frames;
mod messages;

mod encoder;

pub mod create;
mod csv_file;
#[cfg(feature = "live")]
mod live;
pub mod mcap_file;

pub mod recorder;
pub mod recording;

pub mod rerun;
pub mod verdicts;

// What is watched lies behind ports that there are on Unix alone, as those of the virtual gripper.
#[cfg(unix)]
pub mod wish;

#[cfg(unix)]
pub mod connection;

#[cfg(unix)]
mod registers;

#[cfg(unix)]
mod debugger;
#[cfg(unix)]
mod gripper;
#[cfg(unix)]
mod line;
#[cfg(unix)]
mod playback;
#[cfg(all(unix, feature = "probe"))]
mod probe;

#[cfg(unix)]
pub mod source;

#[cfg(unix)]
pub use connection::Connection;
pub use observation::Observation;
#[cfg(unix)]
pub use source::{Options, Source, open};
pub use told::Told;
#[cfg(unix)]
pub use wish::{Answer, Wish, Wishes};

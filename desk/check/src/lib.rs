//! The check of a gripper that has just been wired: what is expected of it, what is seen, and which fault that is.
//!
//! ```text
//! Connection ─► session (its told values, wishes, the gripper's own time) ─► rest, motion, person ─► run ─► Report
//!                                             limits, faults, response ─►┘
//! ```
//!
//! All times are the gripper's: how fast this computer is does not matter.
#![forbid(unsafe_code)]
// A gripper is watched behind ports that there are on Unix alone.
#![cfg(unix)]

pub mod faults;
pub mod finding;
pub mod limits;
mod response;

mod session;

mod motion;
mod person;
mod rest;

pub mod report;
mod run;

pub use finding::{Finding, Step, Verdict};
pub use report::{Ended, Report};
pub use run::{Options, Person, let_go, run};

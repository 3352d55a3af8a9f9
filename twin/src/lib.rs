//! The simulated gripper, and what the host command `softgrip` is made of.
//!
//! ```text
//! scenario ─► plant (arm, world, air, gauges) ◄─ codes ─► controller
//!                 │ truth                                  │ events
//!                 └──────────────► sim ◄───────────────────┘
//! ```
#![forbid(unsafe_code)]

pub mod gripper;
pub mod scenario;

pub mod arm;
pub mod world;

pub mod plant;

pub mod events;
pub mod sim;

pub mod files;
pub mod json;
pub mod plot;
pub mod replay;
pub mod report;
pub mod style;
pub mod table;
pub mod trace;

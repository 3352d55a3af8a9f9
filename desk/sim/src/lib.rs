//! The simulated gripper and its arm, injected faults, and one run of them, or of a recorded trace, through
//! the controller. Command lines, JSON, progress bars and pictures do not belong here.
//!
//! ```text
//! scenario ─► plant (arm, world, air, gauges) ◄─ codes ─► controller
//!                 │ truth                                  │ events
//!                 └──────────────► run ◄───────────────────┘
//! ```
#![forbid(unsafe_code)]

pub mod fault;
pub mod gripper;
pub mod hand;
pub mod scenario;

pub mod air;
pub mod arm;
pub mod silicone;
pub mod world;

pub mod bodies;

pub mod plant;

pub mod events;
pub mod run;

pub mod setup;

pub mod sweep;

pub mod csv_dialect;
pub mod replay;
pub mod trace;

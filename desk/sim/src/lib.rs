//! The simulated gripper and its arm, what may break in them, and one run of them, or of a recorded trace,
//! through the real controller; no command line, no JSON, no progress bar and no picture may be in it.
//!
//! ```text
//! scenario ─► plant (arm, world, air, gauges) ◄─ codes ─► controller
//!                 │ truth                                  │ events
//!                 └──────────────► run ◄───────────────────┘
//! ```
#![forbid(unsafe_code)]

pub mod fault;
pub mod gripper;
pub mod scenario;

pub mod air;
pub mod arm;
pub mod world;

pub mod plant;

pub mod events;
pub mod run;

pub mod setup;

pub mod csv_dialect;
pub mod replay;
pub mod trace;

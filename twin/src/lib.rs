//! The simulated gripper, and what the host command `softgrip` is made of.
//!
//! ```text
//! scenario ─► plant (arm, world, air, gauges) ◄─ codes ─► controller
//!                 │ truth                                  │ events
//!                 └──────────────► sim ◄───────────────────┘
//! ```
#![forbid(unsafe_code)]

pub mod fault;
pub mod gripper;
pub mod scenario;

pub mod arm;
pub mod world;

pub mod plant;

pub mod events;
pub mod sim;

pub mod setup;

pub mod capability;
pub mod evaluate;
pub mod gauge;
pub mod study;
pub mod sweep;

pub mod charts;
pub mod csv_dialect;
pub mod files;
pub mod fit;
pub mod html;
pub mod json;
pub mod plot;
pub mod replay;
pub mod report;
pub mod section;
pub mod side_view;
pub mod style;
pub mod table;
pub mod trace;

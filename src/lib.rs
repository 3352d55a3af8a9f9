//! Controller of a pneumatic soft gripper with three fingers: hardware-free, allocation-free.
//!
//! One call per millisecond, [`Controller::step`](controller::Controller::step), takes converter
//! codes and gives converter codes. The modules stand in the order in which data flows:
//!
//! ```text
//! RawFrame ─► condition ─► Reading ─┬─► air (what the pressure should be) ─► Air ────┐
//!                                   └─► estimate (by table) ─► Contact ─► zero       │
//!                                                                 └─► detect ◄───────┤
//!                                                                        │ Verdict   │
//! Command ─────────────────────► grasp (the only state machine) ◄────────┘           │
//! Settings ─► validate ─► Active      │ target pressure                              │
//!                                     ▼                                              │
//!                                  regulate ◄────────────────────────────────────────┘
//!                                     └─► interlock ─► DAC code
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod fault;
pub mod frontend;
mod math;
pub mod settings;
pub mod table;
pub mod units;

pub mod scan;

pub mod condition;

pub mod air;

pub mod estimate;

pub mod zero;

pub mod detect;

pub mod command;
pub mod inputs;
pub mod io;

pub mod event;

pub mod grasp;

pub mod regulate;

pub mod interlock;

pub mod controller;

pub mod telemetry;

mod checksum;
pub mod failure;

pub mod storage;

pub mod march;

pub use command::{Answer, Command, Grip};
pub use condition::RawFrame;
pub use controller::{Controller, Outputs};
pub use units::{FINGERS, TICK_US};

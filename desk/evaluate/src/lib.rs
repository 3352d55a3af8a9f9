//! Detection latency and false-alarm rate of the controller, compared with published rules. Other studies and
//! command lines do not belong here.
//!
//! ```text
//! case ─► record (simulator) ─► trial ─► latency ─┬─► summary ─► tables, figures, page
//!                                 └─► roc ◄───────┤
//!                          baselines ─┘           │
//! rig (simulator) ─► identified model ─► surrogate ─► workload ─┬─► alarms ─► tally
//!                         difference, slide        cycle ─┘     └─► reach ─► limits
//! ```
#![forbid(unsafe_code)]

pub mod options;

pub mod case;
pub mod record;
pub mod sensor_model;
mod store;

pub mod trial;

pub mod baselines;
pub mod latency;
mod losses;
pub mod roc;

pub mod difference;
pub mod identified_model;
pub mod rig;
pub mod slide;

pub mod cycle;
pub mod surrogate;

pub mod alarms;
pub mod reach;
pub mod tally;
mod workload;

pub mod limits;

pub mod evaluation;
pub mod silicone;
pub mod statistics;
pub mod summary;

pub mod details;
mod figures;
pub mod output;
mod page;
pub mod tables;

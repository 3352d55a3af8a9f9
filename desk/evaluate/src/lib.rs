//! Detection latency and false-alarm rate of the controller, compared with published rules. Other studies and
//! command lines do not belong here.
//!
//! ```text
//! case ─► record (simulator) ─► trial ─┬─► finding (latency)
//!                    baselines ─► roc ─┘
//! rig (simulator) ─► identified model ─► surrogate ─► workload ─┬─► tally (alarms)
//!                         difference, slide        cycle ─┘     └─► reach ─► limits
//!
//! finding, tally ─► work ─┬──────────────────► evaluation ─► sample ─► summary ─► tables, figures, page
//!                         └─► part (a file) ───┘
//! ```
#![forbid(unsafe_code)]

pub mod about;
pub mod options;

pub mod case;
pub mod record;
pub mod sensor_model;
mod store;

mod losses;
pub mod trial;

pub mod baselines;
pub mod finding;
pub mod latency;
pub mod roc;
pub mod sample;

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

pub mod calibration;

pub mod evaluation;
pub mod part;
pub mod silicone;
pub mod work;

pub mod statistics;
pub mod summary;

pub mod mounted;

pub mod details;
mod figures;
pub mod output;
mod page;
pub mod tables;

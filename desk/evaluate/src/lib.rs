//! Detection latency and false alarms of the real controller on random losses and on hours of work, beside
//! published rules; only what these two numbers need may be in it, and no command line.
//!
//! ```text
//! case ─► record (simulator) ─► trial ─► latency ─┬─► summary ─► tables, figures, page
//!                                 └─► roc ◄───────┤
//!                          baselines ─┘           │
//! bench (simulator) ─► identified model ─► surrogate ─► workload ─► alarms
//!                         difference, slide        cycle ─┘   └─ tally
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

pub mod bench;
pub mod difference;
pub mod identified_model;
pub mod slide;

pub mod cycle;
pub mod surrogate;

pub mod alarms;
pub mod tally;
mod workload;

pub mod evaluation;
pub mod limits;
mod reach;
pub mod statistics;
pub mod summary;

mod figures;
pub mod output;
mod page;
pub mod tables;
pub mod words;

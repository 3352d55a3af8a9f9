//! The firmware's image on an emulated microcontroller, closed with the simulated gripper, and what must hold
//! of it; nothing that could be found out without the image may be in it.
//!
//! ```text
//! image ─► bench (board, chip, host at the debug port) ◄─ millisecond by millisecond ─► sim::plant
//!            │ messages, outputs, ticks
//!            ├─► recording ─► the same ticks by the host's controller
//!            └─► suite: what must hold, with its numbers
//! ```
#![deny(unsafe_code)]

mod flash;
mod image;

mod board;
mod line;
mod moment;
mod remap;
mod rtt;

mod bench;

mod closed_loop;
mod recording;

mod calls;
mod inject;

mod cli;
mod suite;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    cli::run(&cli::Cli::parse()).unwrap_or_else(|error| {
        eprintln!("softgrip-hil: {error:#}");
        ExitCode::from(2)
    })
}

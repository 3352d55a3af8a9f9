//! The virtual gripper: the simulated one under its controller, in real time, behind a pseudo-terminal or a TCP port
//! that a robot's program opens as if there were a gripper. Physics, the controller and command lines do not belong
//! here.
//!
//! ```text
//! client ◄─► port (tty, tcp, pipe) ◄─► run (one loop: bytes, requests, ticks) ◄─► twin (plant, controller, robot)
//!                                  ▲ script, orders ─► play
//! ```
#![forbid(unsafe_code)]
// Elsewhere there are no pseudo-terminals.
#![cfg(unix)]

mod io;
pub mod pipe;
mod tcp;
mod tty;

pub mod port;

pub mod script;

pub mod master;
pub mod readout;

pub mod play;

pub mod twin;

mod pace;

pub mod run;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Becomes true when the program is told to end, by Ctrl-C or by a signal.
///
/// # Errors
/// If the system does not let it listen.
pub fn stop_on_signals() -> std::io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    Ok(stop)
}

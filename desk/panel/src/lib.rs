//! A page in the browser that shows a gripper and commands it: fingers, residuals, pressure, faults with their remedy,
//! the guided sweep, the settings. Where the gripper is, and how it is reached, is the business of `watch`.
//!
//! ```text
//! watch ─► told ─► tell (JSON) ─► hub ◄─► session ◄─► page, one thread each
//!      ◄─ wishes ◄────────────────── order ◄─┘
//! ```
#![forbid(unsafe_code)]
// So are the sources.
#![cfg(unix)]

mod bundle;
mod http;
mod manual;
mod order;
mod token;

pub mod hand;

mod hub;
mod session;
mod tell;

pub mod server;

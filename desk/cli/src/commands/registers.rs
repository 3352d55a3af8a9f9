//! `softgrip registers`: the table of all registers on the bus.

use std::process::ExitCode;

use bus::page::Page;

use super::output::out;

pub fn run() -> anyhow::Result<ExitCode> {
    out!("{Page}");
    Ok(ExitCode::SUCCESS)
}

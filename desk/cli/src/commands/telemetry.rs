//! `softgrip telemetry`: the table of all that a gripper tells.

use std::process::ExitCode;

use watch::page::Page;

use super::output::out;

pub fn run() -> anyhow::Result<ExitCode> {
    out!("{Page}");
    Ok(ExitCode::SUCCESS)
}

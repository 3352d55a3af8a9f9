//! `softgrip blackbox`: what a gripper has kept of the last seconds before its first loss or fault.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use ::serve::master::Master;
use ::serve::readout::{self, Readout};
use anyhow::Context;
use clap::Args;

use super::output::outln;

#[derive(Args)]
pub struct BlackboxArgs {
    /// Serial port of the gripper.
    #[arg(
        long,
        value_name = "PATH",
        required_unless_present = "tcp",
        conflicts_with = "tcp"
    )]
    tty: Option<PathBuf>,
    /// RTU frames over TCP, as `softgrip serve --tcp` has them.
    #[arg(long, value_name = "ADDRESS:PORT")]
    tcp: Option<String>,
    /// Baud rate of the serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200)]
    baud: u32,
    /// The gripper's id on the bus.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u8).range(1..=247))]
    id: u8,
    /// File for the trace (CSV), which `softgrip replay` takes.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Clear the black box once it has been read, so that it runs again.
    #[arg(long)]
    clear: bool,
}

pub fn run(args: &BlackboxArgs) -> anyhow::Result<ExitCode> {
    let mut master = match (&args.tty, &args.tcp) {
        (Some(path), _) => Master::open(path, args.baud, args.id)?,
        (None, Some(address)) => Master::connect(address, args.id)?,
        (None, None) => anyhow::bail!("say where the gripper is: --tty or --tcp"),
    };
    let Some(readout) = readout::read(&mut master)? else {
        outln!("the black box runs: no loss and no fault since it was cleared");
        return Ok(ExitCode::SUCCESS);
    };
    let when = readout
        .at_s
        .map_or("before its last restart".into(), |at_s| {
            format!("{at_s:.3} s after its start")
        });
    outln!("{}, {when}", readout.what);
    if let Some(came_s) = readout.came_s {
        outln!(
            "{} ticks, in which it came at {came_s:.3} s",
            readout.rows.len()
        );
    } else {
        outln!("{} ticks up to it", readout.rows.len());
    }
    if let Some(path) = &args.out {
        std::fs::write(path, csv(&readout))
            .with_context(|| format!("{}: cannot write", path.display()))?;
        outln!("trace: {}", path.display());
    }
    if args.clear {
        readout::clear(&mut master)?;
        outln!("cleared: it runs again");
    }
    Ok(ExitCode::SUCCESS)
}

/// As a trace.
fn csv(readout: &Readout) -> String {
    let mut text = String::from("t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n");
    for row in &readout.rows {
        let [a, b, c] = row.strain_ue;
        let (t_s, pressure, command) = (row.t_s, row.pressure_kpa, row.commanded_kpa);
        writeln!(
            text,
            "{t_s:.3},{a:.1},{b:.1},{c:.1},{pressure:.3},{command:.3}"
        )
        .expect("a string takes anything");
    }
    text
}

//! The host command `softgrip`.

mod cli;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// A soft gripper's controller on the desk: simulate a grasp, replay a recording, look at a finger.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Option<Action>,
}

#[derive(Subcommand)]
enum Action {
    /// Picks up, carries and perhaps loses an object under the real controller.
    ///
    /// Exits with 1 if the controller missed a loss or reported one that did not happen.
    Sim(cli::sim::SimArgs),
    /// Runs a recorded trace (CSV) through the real controller and prints what it reports.
    Replay(cli::replay::ReplayArgs),
    /// Prints a finger's table and the paper's numbers beside it.
    Table(cli::table::TableArgs),
}

fn main() -> ExitCode {
    let action = Cli::parse()
        .command
        .unwrap_or(Action::Sim(cli::sim::SimArgs::default()));
    let result = match action {
        Action::Sim(args) => cli::sim::run(&args),
        Action::Replay(args) => cli::replay::run(&args),
        Action::Table(args) => cli::table::run(&args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("softgrip: {error:#}");
        ExitCode::from(2)
    })
}

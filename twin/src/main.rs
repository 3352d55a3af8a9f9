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
    /// Replays the paper's twelve experiments and writes a report.
    ///
    /// Exits with 1 if the controller missed a loss or reported one that did not happen.
    Study(cli::study::StudyArgs),
    /// Finds the heaviest object that arrives, against the arm's acceleration.
    Capability(cli::capability::CapabilityArgs),
    /// Finds where on the finger the gauge should sit.
    ///
    /// Judges every stretch of the finger by what it sees of the same random grasps.
    Gauge(cli::gauge::GaugeArgs),
    /// Measures how soon the controller reports a loss and how often it cries wolf.
    Evaluate(cli::evaluate::EvaluateArgs),
    /// Runs a grid or a random sample over any parameters of the simulated gripper.
    Sweep(cli::sweep::SweepArgs),
    /// Runs a recorded trace (CSV) through the real controller and prints what it reports.
    Replay(cli::replay::ReplayArgs),
    /// Prints a finger's table and the paper's numbers beside it.
    Table(cli::table::TableArgs),
    /// Prints one section's dimensions and how it bends under pressure.
    Section(cli::section::SectionArgs),
    /// Fits a geometry recipe to the measured bend of a free finger.
    Fit(cli::fit::FitArgs),
}

fn main() -> ExitCode {
    let action = Cli::parse()
        .command
        .unwrap_or(Action::Sim(cli::sim::SimArgs::default()));
    let result = match action {
        Action::Sim(args) => cli::sim::run(&args),
        Action::Study(args) => cli::study::run(&args),
        Action::Capability(args) => cli::capability::run(&args),
        Action::Gauge(args) => cli::gauge::run(&args),
        Action::Evaluate(args) => cli::evaluate::run(&args),
        Action::Sweep(args) => cli::sweep::run(&args),
        Action::Replay(args) => cli::replay::run(&args),
        Action::Table(args) => cli::table::run(&args),
        Action::Section(args) => cli::section::run(&args),
        Action::Fit(args) => cli::fit::run(&args),
    };
    result.unwrap_or_else(|error| {
        cli::output::note(format_args!("{error:#}"));
        ExitCode::from(2)
    })
}

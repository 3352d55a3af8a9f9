//! The host command `softgrip`: arguments, progress and exit status. Anything that another program could want
//! belongs to another package.
#![forbid(unsafe_code)]

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// The controller of a soft gripper on a desktop computer: simulate a grasp, replay a recording, analyse a finger.
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
    Sim(commands::sim::SimArgs),
    /// Simulates the paper's twelve experiments and writes a report.
    ///
    /// Exits with 1 if the controller missed a loss or reported one that did not happen.
    Study(commands::study::StudyArgs),
    /// Finds the heaviest object that arrives, over the arm's acceleration.
    Capability(commands::capability::CapabilityArgs),
    /// Finds the best position of the gauge on the finger.
    ///
    /// Compares every span of the finger on the same random grasps.
    Gauge(commands::gauge::GaugeArgs),
    /// Measures the detection latency and the false-alarm rate of the controller.
    Evaluate(commands::evaluate::EvaluateArgs),
    /// Runs a grid or a random sample over any parameters of the simulated gripper.
    Sweep(commands::sweep::SweepArgs),
    /// Serves a virtual gripper that a robot's program finds as if it were a real one (Modbus RTU).
    ///
    /// Simulated gripper and controller run in real time behind a pseudo-terminal or a TCP port until Ctrl-C.
    #[cfg(unix)]
    Serve(commands::serve::ServeArgs),
    /// Shows a gripper on a page in the browser, which commands it, too.
    #[cfg(unix)]
    Panel(commands::panel::PanelArgs),
    /// Reads what a gripper has kept of the seconds before its first loss or fault.
    #[cfg(unix)]
    Blackbox(commands::blackbox::BlackboxArgs),
    /// Checks a gripper that has just been wired: every channel, small steps of the pressure, outputs.
    ///
    /// Exits with 1 if something has failed.
    #[cfg(unix)]
    Check(commands::check::CheckArgs),
    /// Records what a gripper tells: snapshots, events, settings and every tick, as MCAP or CSV.
    #[cfg(unix)]
    Record(commands::record::RecordArgs),
    /// Runs a recorded trace (CSV), or a recording (MCAP), through the real controller and prints what it reports.
    Replay(commands::replay::ReplayArgs),
    /// Compares the events of two recordings, traces or replays.
    ///
    /// Exits with 1 if they differ.
    Diff(commands::diff::DiffArgs),
    /// Prints the table of a finger, compared with the paper's numbers.
    Table(commands::table::TableArgs),
    /// Prints the dimensions of one cross-section and its bending under pressure.
    Section(commands::section::SectionArgs),
    /// Sweeps the simulated gripper: learns its mounted fingers, and writes them into a settings file.
    Calibrate(commands::calibrate::CalibrateArgs),
    /// Prints and checks the controller's settings.
    Settings(commands::settings::SettingsArgs),
    /// Prints the table of all registers on the bus (Markdown), by address.
    Registers,
    /// Prints the table of all that a gripper tells (Markdown).
    Telemetry,
    /// Fits a geometry recipe to the measured bending of a free finger.
    Fit(commands::fit::FitArgs),
}

fn main() -> ExitCode {
    let action = Cli::parse()
        .command
        .unwrap_or(Action::Sim(commands::sim::SimArgs::default()));
    let result = match action {
        Action::Sim(args) => commands::sim::run(&args),
        Action::Study(args) => commands::study::run(&args),
        Action::Capability(args) => commands::capability::run(&args),
        Action::Gauge(args) => commands::gauge::run(&args),
        Action::Evaluate(args) => commands::evaluate::run(&args),
        Action::Sweep(args) => commands::sweep::run(&args),
        #[cfg(unix)]
        Action::Serve(args) => commands::serve::run(&args),
        #[cfg(unix)]
        Action::Panel(args) => commands::panel::run(&args),
        #[cfg(unix)]
        Action::Blackbox(args) => commands::blackbox::run(&args),
        #[cfg(unix)]
        Action::Check(args) => commands::check::run(&args),
        #[cfg(unix)]
        Action::Record(args) => commands::record::run(&args),
        Action::Replay(args) => commands::replay::run(&args),
        Action::Diff(args) => commands::diff::run(&args),
        Action::Table(args) => commands::table::run(&args),
        Action::Section(args) => commands::section::run(&args),
        Action::Calibrate(args) => commands::calibrate::run(&args),
        Action::Settings(args) => commands::settings::run(&args),
        Action::Registers => commands::registers::run(),
        Action::Telemetry => commands::telemetry::run(),
        Action::Fit(args) => commands::fit::run(&args),
    };
    result.unwrap_or_else(|error| {
        commands::output::note(format_args!("{error:#}"));
        ExitCode::from(2)
    })
}

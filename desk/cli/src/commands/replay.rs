//! `softgrip replay`: runs a recorded trace through the controller.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, ValueEnum};
use report::json;
use sim::trace::Trace;
use sim::{replay, run, trace};
use softgrip::frontend::{FrontEnd, GaugeSettings};
use softgrip::settings::{GaugeSense, Settings};
use softgrip::table::FingerTable;

use super::output::outln;
use super::{Controls, load_recipe, output};

#[derive(Args)]
pub struct ReplayArgs {
    /// The trace, with the columns t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa, at 100 Hz
    /// to 10 kHz.
    ///
    /// Slower traces are less certain; below 10 Hz they are refused. Columns may be separated by commas, semicolons, tabs
    /// or blanks, decimals by a comma; names may state other units, as in time_ms or pressure_bar, or a row below
    /// them. A set-point that was read back with noise or logged as a ramp is converted to the commands behind it.
    /// Assumptions are noted on standard error.
    trace: PathBuf,
    /// The finger that it was recorded with.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    /// What the gauges measure [default: the setting finger.gauge_sense, or bend].
    #[arg(long, value_enum)]
    gauge: Option<GaugeKind>,
    /// Print one JSON object per event.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum GaugeKind {
    /// Bending of the finger, which contact reduces.
    Bend,
    /// Contact only; zero for a free finger.
    Contact,
}

/// Between rows of less than 100 Hz, s.
const SLOW_S: f64 = 0.0105;
/// How long a command that is late by a row lets the pressure deviate: a ramp of 160 kPa at 400 kPa/s.
const SLOW_FOLLOWING_MS: f32 = 400.0;

pub fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let trace = trace::read(&args.trace)?;
    let table = run::table_of(&load_recipe(args.recipe.as_deref())?)?;
    let mut settings = settings(args, &trace, table)?;
    let file = args.trace.display();
    let odd = trace::check(&trace, table, &settings).with_context(|| format!("{file}"))?;
    for note in trace.notes.iter().chain(&odd) {
        output::note(format_args!("{file}: {note}"));
    }
    // The command came at any time since the row before, and the pressure leads the model by as much.
    if trace.interval_s > SLOW_S {
        settings.grip.not_following_ms += SLOW_FOLLOWING_MS;
        settings.detection.air_loss_kpa +=
            settings.regulator.slew_kpa_per_s * trace.interval_s as f32;
    }
    let controller = run::controller(table, &settings)?;
    let front_end = FrontEnd::of(&settings.front_end, settings.gauge.gain);
    for event in replay::replay(&trace, &front_end, controller) {
        if args.json {
            outln!("{}", json::event(&event));
        } else {
            outln!("{:9.3} s  {}", event.t_s, event.words());
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The settings of the file, and what the trace and the options tell beyond it.
fn settings(
    args: &ReplayArgs,
    trace: &Trace,
    table: &'static FingerTable,
) -> anyhow::Result<Settings> {
    let mut settings = Settings::for_finger(table);
    if let Some(slew) = trace.slew_kpa_per_s {
        settings.regulator.slew_kpa_per_s = slew as f32;
    }
    let stated = args.controls.stated(table)?;
    let mut settings = settings
        .with(&stated, table)
        .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
    // The trace has strains, to which nothing is to be added.
    settings.gauge = GaugeSettings::default();
    match args.gauge {
        Some(GaugeKind::Bend) => settings.finger.gauge_sense = GaugeSense::Bend,
        Some(GaugeKind::Contact) => settings.finger.gauge_sense = GaugeSense::Contact,
        None => {}
    }
    Ok(settings)
}

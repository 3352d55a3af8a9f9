//! `softgrip replay`: runs a recorded trace through the controller.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::{Args, ValueEnum};
use report::json;
use sim::events::TimedEvent;
use sim::trace::Trace;
use sim::{replay, run, trace};
use softgrip::TICK_US;
use softgrip::frontend::{FrontEnd, GaugeSettings};
use softgrip::settings::{GaugeSense, Settings};
use softgrip::table::FingerTable;
use watch::create::ending;
use watch::fields::FIELDS;
use watch::recording;
use watch::rerun::{Difference, Outcome, Rerun};
use watch::{Observation, Told};

use super::output::outln;
use super::{Controls, load_table, output};

#[derive(Args)]
pub struct ReplayArgs {
    /// The trace, with the columns t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa, at 100 Hz
    /// to 10 kHz.
    ///
    /// Slower traces are less certain; below 10 Hz they are refused. Columns may be separated by commas, semicolons, tabs
    /// or blanks, decimals by a comma; names may state other units, as in time_ms or pressure_bar, or a row below
    /// them. A set-point that was read back with noise or logged as a ramp is converted to the commands behind it.
    /// Assumptions are noted on standard error.
    ///
    /// Or a recording (.mcap): its ticks and commands, by the settings that were in use but for what --settings states;
    /// where it has no ticks, its snapshots as a trace.
    trace: PathBuf,
    /// The finger that it was recorded with.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    /// What the gauges measure [default: the setting finger.gauge_sense, or bend].
    #[arg(long, value_enum)]
    gauge: Option<GaugeKind>,
    /// Compare all that the controller makes of a recording's ticks with what was recorded, bit for bit.
    ///
    /// Exits with 1 at any difference.
    #[arg(long)]
    from_hardware_frames: bool,
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

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Between rows of less than 100 Hz, s.
const SLOW_S: f64 = 0.0105;
/// How long a command that is late by a row lets the pressure deviate: a ramp of 160 kPa at 400 kPa/s.
const SLOW_FOLLOWING_MS: f32 = 400.0;

pub fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let table = load_table(args.recipe.as_deref())?;
    let began = Instant::now();
    let is_recording = ending(&args.trace) == "mcap";
    anyhow::ensure!(
        is_recording || !args.from_hardware_frames,
        "{}: --from-hardware-frames needs a recording (.mcap) with every tick",
        args.trace.display()
    );
    let (outcome, is_recorded) = match is_recording {
        true => of_recording(args, table)?,
        false => (of_trace(args, table, trace::read(&args.trace)?)?, false),
    };
    let took_s = began.elapsed().as_secs_f64();
    for event in &outcome.events {
        if args.json {
            outln!("{}", json::event(event));
        } else {
            outln!("{:9.3} s  {}", event.t_s, event.words());
        }
    }
    if args.from_hardware_frames {
        return judge(args, &outcome);
    }
    if is_recorded {
        tell_gaps(args, &outcome);
    }
    if !args.json {
        let length_s = outcome.length_s;
        outln!(
            "{length_s:.3} s in {took_s:.3} s: {:.0} times real time",
            length_s / took_s
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// What the controller reports of a trace, by its default settings.
pub fn trace_events(path: &Path) -> anyhow::Result<Vec<TimedEvent>> {
    let args = ReplayArgs {
        trace: path.into(),
        recipe: None,
        controls: Controls::default(),
        gauge: None,
        from_hardware_frames: false,
        json: false,
    };
    let table = load_table(None)?;
    Ok(of_trace(&args, table, trace::read(path)?)?.events)
}

/// What the controller makes of a recording: of its ticks, where it has them, else of its snapshots.
fn of_recording(args: &ReplayArgs, table: &'static FingerTable) -> anyhow::Result<(Outcome, bool)> {
    let path = &args.trace;
    let name = || path.display().to_string();
    let mut rerun = Rerun::new(table, args.controls.stated(table)?);
    let mut rows = trace::COLUMNS.join(",") + "\n";
    recording::read(path, &mut |told| {
        match &told {
            Told::Note(text) => output::note(format_args!("{text}")),
            Told::Observation(seen) => add_row(&mut rows, seen),
            // A gripper on the bus tells no patch level.
            Told::Provenance(about) if !VERSION.starts_with(&about.version) => {
                output::note(format_args!(
                    "{}: recorded from version {}, and done again by {VERSION}",
                    name(),
                    about.version
                ));
            }
            _ => {}
        }
        rerun.take(&told)
    })?;
    let outcome = rerun.outcome();
    // A debugger that asks for fewer snapshots than there are ticks gets as many frames.
    let has_most = outcome.ticks as f64 * 2e-6 * TICK_US as f64 >= outcome.length_s;
    if outcome.ticks > 0 && (has_most || args.from_hardware_frames) {
        return Ok((outcome, true));
    }
    anyhow::ensure!(
        !args.from_hardware_frames,
        "{}: has no ticks: what is read over the bus has none",
        name()
    );
    let trace = trace::parse(rows.as_bytes()).with_context(|| {
        format!(
            "{}: its snapshots are no trace of gauges and pressure",
            name()
        )
    })?;
    Ok((of_trace(args, table, trace)?, false))
}

/// Adds a snapshot as the row of a trace.
fn add_row(rows: &mut String, seen: &Observation) {
    let mut seen = *seen;
    let cells = FIELDS[..trace::COLUMNS.len()].iter();
    let cells: Vec<String> = cells.map(|field| field.text(&mut seen)).collect();
    rows.push_str(&cells.join(","));
    rows.push('\n');
}

/// What the controller makes of a trace.
fn of_trace(
    args: &ReplayArgs,
    table: &'static FingerTable,
    trace: Trace,
) -> anyhow::Result<Outcome> {
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
    let ends = trace.rows.first().zip(trace.rows.last());
    Ok(Outcome {
        length_s: ends.map_or(0.0, |(first, last)| last.t_s - first.t_s),
        events: replay::replay(&trace, &front_end, controller),
        ..Outcome::default()
    })
}

/// Says which ticks are missing.
fn tell_gaps(args: &ReplayArgs, outcome: &Outcome) {
    let file = args.trace.display();
    for (after_s, missing) in &outcome.gaps {
        output::note(format_args!(
            "{file}: {missing} ticks are missing after {after_s:.3} s"
        ));
    }
}

/// Whether a recording was repeated bit for bit.
fn judge(args: &ReplayArgs, outcome: &Outcome) -> anyhow::Result<ExitCode> {
    tell_gaps(args, outcome);
    let Some(from_s) = outcome.compared_from_s else {
        outln!(
            "it does not begin with the controller's first tick, and in none of {} snapshots the controller here was where \
             the recorded one is: nothing can be compared",
            outcome.ticks
        );
        return Ok(ExitCode::FAILURE);
    };
    if !outcome.from_start {
        outln!(
            "it does not begin with the controller's first tick: what came before is not known, and it is compared from \
             {from_s:.3} s on, where both are the same first"
        );
    }
    outln!(
        "{} DAC codes and {} snapshots of {} ticks were compared, from {from_s:.3} s on",
        outcome.codes,
        outcome.snapshots,
        outcome.ticks
    );
    match &outcome.difference {
        None => {
            let what = match outcome.codes == outcome.ticks {
                true => "",
                false => "what was compared is ",
            };
            outln!("{what}the same, bit for bit");
            Ok(ExitCode::SUCCESS)
        }
        Some(Difference {
            t_s,
            name,
            recorded,
            here,
        }) => {
            outln!(
                "the first difference is at {t_s:.3} s: {name} was {recorded}, and is {here} here"
            );
            Ok(ExitCode::FAILURE)
        }
    }
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

//! The host command `softgrip`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, Parser, Subcommand, ValueEnum};
use finger::recipe::{self, Recipe};
use finger::table::Table;
use indicatif::{ProgressBar, ProgressStyle};
use softgrip::settings::{GaugeSense, Settings};
use twin::gripper::Gripper;
use twin::scenario::{ObjectKind, Scenario};
use twin::sim::{self, Run};
use twin::table::Report;
use twin::{files, plot, replay, report, trace};

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
    Sim(SimArgs),
    /// Runs a recorded trace (CSV) through the real controller and prints what it reports.
    Replay(ReplayArgs),
    /// Prints a finger's table and the paper's numbers beside it.
    Table(TableArgs),
}

#[derive(Args, Default)]
struct SimArgs {
    /// What to pick up.
    #[arg(long)]
    object: Option<ObjectKind>,
    /// Its mass.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: Option<f64>,
    /// Greatest acceleration of the arm [default: 5, and then 10, if no other option says what to do].
    #[arg(long, value_name = "M_S2", allow_negative_numbers = true, value_parser = within(0.1, 50.0))]
    accel: Option<f64>,
    /// Pressure of the grip.
    #[arg(long, value_name = "KPA", allow_negative_numbers = true, value_parser = within(1.0, 160.0))]
    pressure: Option<f64>,
    /// Friction coefficient between fingers and object.
    #[arg(long, value_name = "MU", allow_negative_numbers = true, value_parser = within(0.0, 2.0))]
    friction: Option<f64>,
    /// Noise of the gauges, rms at the control tick.
    #[arg(long, value_name = "UE", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: Option<f64>,
    /// Seed of all noise.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Where trace.svg and trace.csv go [default: out, or nowhere with --json].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object per run.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ReplayArgs {
    /// The trace, with the columns t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa at
    /// 100 Hz to 10 kHz.
    trace: PathBuf,
    /// The finger that it was recorded with.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// What the gauges see.
    #[arg(long, value_enum, default_value = "bend")]
    gauge: Gauge,
    /// Print one JSON object per event.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Gauge {
    /// Bending; contact takes some of it away.
    Bend,
    /// Contact alone.
    Contact,
}

#[derive(Args)]
struct TableArgs {
    /// The finger.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Pressures to show, separated by commas.
    #[arg(long, value_name = "KPA", value_delimiter = ',')]
    pressure: Vec<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let action = Cli::parse()
        .command
        .unwrap_or(Action::Sim(SimArgs::default()));
    let result = match action {
        Action::Sim(args) => simulate(&args),
        Action::Replay(args) => replay_trace(&args),
        Action::Table(args) => show_table(&args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("softgrip: {error:#}");
        ExitCode::from(2)
    })
}

fn simulate(args: &SimArgs) -> anyhow::Result<ExitCode> {
    let out = match (&args.out, args.json) {
        (Some(dir), _) => Some(dir.as_path()),
        (None, false) => Some(Path::new("out")),
        (None, true) => None,
    };
    if let Some(dir) = out {
        files::prepare(dir)?;
    }
    let recipe = load_recipe(None)?;
    let table = sim::leak_table(&Table::of(&recipe));
    let gripper = Gripper::reference();
    let mut runs = Vec::new();
    for scenario in scenarios(args) {
        let bar = progress_bar(&scenario);
        let controller = sim::controller(table, &Settings::default())?;
        let run = sim::run(&scenario, &gripper, &recipe.chain, controller, |share| {
            bar.set_position((100.0 * share) as u64);
        });
        bar.finish_and_clear();
        if args.json {
            println!("{}", run.json());
        } else {
            println!("{}", report::timeline(&run));
        }
        runs.push(run);
    }
    if let Some(dir) = out {
        files::write(dir, "trace.csv", &trace::of_runs(&runs)?)?;
        files::write(dir, "trace.svg", plot::grasp(&runs)?.as_bytes())?;
        if !args.json {
            println!(
                "picture and trace: {0}/trace.svg, {0}/trace.csv",
                dir.display()
            );
        }
    }
    let mistakes: Vec<String> = runs.iter().filter_map(Run::mistake).collect();
    for mistake in &mistakes {
        eprintln!("softgrip: {mistake}");
    }
    Ok(ExitCode::from(u8::from(!mistakes.is_empty())))
}

/// One scenario; without any word on what to do, the two that show what this is about.
fn scenarios(args: &SimArgs) -> Vec<Scenario> {
    let default = Scenario::default();
    let scenario = Scenario {
        object: args.object.unwrap_or(default.object),
        mass_kg: args.mass.unwrap_or(default.mass_kg),
        accel_m_s2: args.accel.unwrap_or(default.accel_m_s2),
        pressure_kpa: args.pressure.unwrap_or(default.pressure_kpa),
        friction: args.friction.unwrap_or(default.friction),
        noise_ue: args.noise.unwrap_or(default.noise_ue),
        seed: args.seed.unwrap_or(default.seed),
    };
    let told = args.object.is_some()
        || args.mass.is_some()
        || args.accel.is_some()
        || args.pressure.is_some()
        || args.friction.is_some();
    if told {
        return vec![scenario];
    }
    let faster = Scenario {
        accel_m_s2: 10.0,
        ..scenario
    };
    vec![scenario, faster]
}

fn replay_trace(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let rows = trace::read(&args.trace)?;
    let recipe = load_recipe(args.recipe.as_deref())?;
    let settings = Settings {
        gauge_sense: match args.gauge {
            Gauge::Bend => GaugeSense::Bend,
            Gauge::Contact => GaugeSense::Contact,
        },
        ..Settings::default()
    };
    let controller = sim::controller(sim::leak_table(&Table::of(&recipe)), &settings)?;
    for event in replay::replay(&rows, controller) {
        if args.json {
            println!("{}", event.json());
        } else {
            println!("{:9.3} s  {}", event.t_s, event.words());
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn show_table(args: &TableArgs) -> anyhow::Result<ExitCode> {
    let report = Report::new(load_recipe(args.recipe.as_deref())?, &args.pressure)?;
    if args.json {
        println!("{}", report.json());
    } else {
        print!("{}", report.text());
    }
    Ok(ExitCode::SUCCESS)
}

fn load_recipe(path: Option<&Path>) -> anyhow::Result<Recipe> {
    match path {
        Some(path) => Ok(recipe::load(path)?),
        None => twin::table::paper(),
    }
}

fn progress_bar(scenario: &Scenario) -> ProgressBar {
    // indicatif draws to standard error, and only where that is a terminal.
    let bar = ProgressBar::new(100);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %") {
        bar.set_style(style);
    }
    bar.set_message(report::title(scenario));
    bar
}

fn within(min: f64, max: f64) -> impl Fn(&str) -> anyhow::Result<f64> + Clone {
    move |text| {
        let value: f64 = text.parse().context("must be a number")?;
        anyhow::ensure!(
            (min..=max).contains(&value),
            "must lie within {min} and {max}"
        );
        Ok(value)
    }
}

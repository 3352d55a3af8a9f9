//! `softgrip sim`: one pick-and-place run; without options, the two runs of the README.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use report::{files, json, plot, side_view, words};
use sim::fault::{FaultKind, Injected};
use sim::run::Run;
use sim::scenario::{ObjectKind, Scenario};
use sim::setup::Setup;
use sim::trace;

use super::output;
use super::output::outln;
use super::{Castings, Controls, Output, load_recipe, object, within};

#[derive(Args, Default)]
pub struct SimArgs {
    /// Object to pick up.
    #[arg(long, value_parser = object())]
    object: Option<ObjectKind>,
    /// Mass of the object.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: Option<f64>,
    /// Greatest acceleration of the arm [default: 5; without any other option 5 and then 10].
    #[arg(long, value_name = "M_S2", allow_negative_numbers = true, value_parser = within(0.1, 50.0))]
    accel: Option<f64>,
    /// Pressure of the grip [default: 140, or 7/8 of where the recipe ends].
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
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
    #[arg(long, value_name = "KIND[:FINGER]@FROM[..UNTIL]", help = fault_help())]
    fault: Vec<Injected>,
    #[command(flatten)]
    output: Output,
}

pub fn run(args: &SimArgs) -> anyhow::Result<ExitCode> {
    let out = args.output.directory()?;
    let recipe = load_recipe(args.recipe.as_deref())?;
    let mut setup = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    args.controls.apply(&mut setup)?;
    setup.faults = args.fault.clone();
    let mut runs = Vec::new();
    for scenario in scenarios(args, setup.scenario) {
        let bar = progress_bar(&scenario);
        setup.scenario = scenario;
        let run = setup.run(|share| bar.set_position((100.0 * share) as u64))?;
        bar.finish_and_clear();
        if args.output.json {
            outln!("{}", json::run(&run));
        } else {
            outln!("{}", words::timeline(&run));
        }
        runs.push(run);
    }
    if let Some(dir) = out {
        files::write(dir, "trace.csv", &trace::of_runs(&runs)?)?;
        files::write(dir, "trace.svg", plot::grasp(&runs)?.as_bytes())?;
        let film = side_view::film(&setup.grasp, &runs);
        files::write(dir, "grasp.svg", film.as_bytes())?;
        if !args.output.json {
            outln!(
                "pictures and trace: {0}/trace.svg, {0}/grasp.svg, {0}/trace.csv",
                dir.display()
            );
        }
    }
    let mistakes: Vec<String> = runs.iter().filter_map(Run::mistake).collect();
    for mistake in &mistakes {
        output::note(format_args!("{mistake}"));
    }
    Ok(ExitCode::from(u8::from(!mistakes.is_empty())))
}

fn fault_help() -> String {
    format!(
        "What breaks, and when, as in tube-burst@1.5s, tube-burst@1.5s..2s or gauge-open:2@1.5s; may be given several times. Kinds: {}",
        FaultKind::names()
    )
}

/// The scenario of the options; without any of them, the two of the README.
fn scenarios(args: &SimArgs, default: Scenario) -> Vec<Scenario> {
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
        || args.friction.is_some()
        || !args.fault.is_empty();
    if told {
        return vec![scenario];
    }
    let faster = Scenario {
        accel_m_s2: 10.0,
        ..scenario
    };
    vec![scenario, faster]
}

fn progress_bar(scenario: &Scenario) -> ProgressBar {
    // indicatif draws to standard error, and only where that is a terminal.
    let bar = ProgressBar::new(100);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %") {
        bar.set_style(style);
    }
    bar.set_message(words::title(scenario));
    bar
}

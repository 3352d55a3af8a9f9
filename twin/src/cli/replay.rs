//! `softgrip replay`: a recorded trace through the controller.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use softgrip::frontend::FrontEnd;
use softgrip::settings::{GaugeSense, Settings};
use twin::{replay, sim, trace};

use super::load_recipe;

#[derive(Args)]
pub struct ReplayArgs {
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

pub fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let rows = trace::read(&args.trace)?;
    let recipe = load_recipe(args.recipe.as_deref())?;
    let table = sim::table_of(&recipe)?;
    let settings = Settings {
        gauge_sense: match args.gauge {
            Gauge::Bend => GaugeSense::Bend,
            Gauge::Contact => GaugeSense::Contact,
        },
        ..Settings::for_finger(&FrontEnd::REFERENCE, table)
    };
    let controller = sim::controller(table, &settings)?;
    for event in replay::replay(&rows, controller) {
        if args.json {
            println!("{}", event.json());
        } else {
            println!("{:9.3} s  {}", event.t_s, event.words());
        }
    }
    Ok(ExitCode::SUCCESS)
}

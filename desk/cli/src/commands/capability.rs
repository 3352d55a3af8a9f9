//! `softgrip capability`: the heaviest object that arrives, over the arm's acceleration.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use report::files;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use studies::capability;

use super::output::outln;
use super::{Output, in_parallel, load_recipe, object, progress_bar, within};

#[derive(Args)]
pub struct CapabilityArgs {
    /// Object that is picked up.
    #[arg(long, default_value = "sphere", value_parser = object())]
    object: ObjectKind,
    /// Pressure of the grip [default: 140, or 7/8 of where the recipe ends].
    #[arg(long, value_name = "KPA", allow_negative_numbers = true, value_parser = within(1.0, 160.0))]
    pressure: Option<f64>,
    /// Friction coefficient between fingers and object at rest.
    #[arg(long, value_name = "MU", default_value = "0.8", allow_negative_numbers = true, value_parser = within(0.0, 2.0))]
    friction: f64,
    /// Accelerations of the arm, separated by commas.
    #[arg(long, value_name = "M_S2", value_delimiter = ',', default_value = "1,2,3,4,5,6,8,10", allow_negative_numbers = true, value_parser = within(0.1, 50.0))]
    accel: Vec<f64>,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub fn run(args: &CapabilityArgs) -> anyhow::Result<ExitCode> {
    let out = args.output.directory()?;
    let mut setup = Setup::of(&load_recipe(args.recipe.as_deref())?)?;
    setup.scenario.object = args.object;
    if let Some(pressure_kpa) = args.pressure {
        setup.scenario.pressure_kpa = pressure_kpa;
    }
    setup.scenario.friction = args.friction;
    let mut accels = args.accel.clone();
    accels.sort_by(f64::total_cmp);
    let bar = progress_bar(accels.len() as u64, "accelerations");
    let limits = in_parallel(args.jobs, || {
        capability::limits(&setup, &accels, || bar.inc(1))
    })??;
    bar.finish_and_clear();
    let json = capability::json(&setup, &limits);
    if let Some(dir) = out {
        let chart = capability::chart(&setup, &limits)?;
        files::write(dir, "capability.json", format!("{json}\n").as_bytes())?;
        files::write(dir, "capability.svg", chart.as_bytes())?;
    }
    if args.output.json {
        outln!("{json}");
        return Ok(ExitCode::SUCCESS);
    }
    let grams = |kg: Option<f64>| kg.map_or("none".into(), |kg| format!("{:.0} g", 1e3 * kg));
    outln!("  m/s²  sim., whole cycle  statics, lift");
    for limit in &limits {
        outln!(
            "{:6}  {:>17}  {:>13}",
            limit.accel_m_s2,
            grams(limit.simulated_kg),
            grams(limit.static_kg)
        );
    }
    if let Some(dir) = out {
        outln!("chart: {}/capability.svg", dir.display());
    }
    Ok(ExitCode::SUCCESS)
}

//! `softgrip gauge`: the best position of the gauge on the finger.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use report::files;
use sim::setup::Setup;
use studies::gauge::judge::Floor;
use studies::gauge::record::{HELD_ACCELS_M_S2, Wanted};
use studies::gauge::{self, chart};

use super::output::{out, outln};
use super::{Controls, Output, in_parallel, load_recipe, progress_bar, within};

#[derive(Args)]
pub struct GaugeArgs {
    /// Number of lost grasps of each object; a fifth as many are held at 5 and at 10 m/s².
    #[arg(long, value_name = "N", default_value = "60", value_parser = clap::value_parser!(u16).range(5..=10_000))]
    runs: u16,
    /// Noise of the gauges, rms at the control tick.
    #[arg(long, value_name = "UE", default_value = "100", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: f64,
    /// Change of the residual sum, in percent of its plateau, that creep and drift may make: less is taken
    /// for no slip.
    #[arg(long, value_name = "PERCENT", default_value = "8", allow_negative_numbers = true, value_parser = within(0.1, 50.0))]
    drift: f64,
    /// Seed of the grasps.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    output: Output,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub fn run(args: &GaugeArgs) -> anyhow::Result<ExitCode> {
    let out = args.output.directory()?;
    let mut setup = Setup::of(&load_recipe(args.recipe.as_deref())?)?;
    args.controls.apply(&mut setup)?;
    let floor = Floor {
        noise_ue: args.noise,
        drift: 1e-2 * args.drift,
    };
    let lost = usize::from(args.runs);
    let wanted = Wanted {
        lost,
        held: lost / 5,
    };
    let each = wanted.lost + HELD_ACCELS_M_S2.len() * wanted.held;
    let bar = progress_bar((gauge::OBJECTS.len() * each) as u64, "grasps");
    let study = in_parallel(args.jobs, || {
        gauge::study(&setup, args.seed, floor, wanted, || bar.inc(1))
    })??;
    bar.finish_and_clear();
    if let Some(dir) = out {
        let (json, chart) = (study.json(), chart::chart(&study)?);
        files::write(dir, "gauge.json", format!("{json}\n").as_bytes())?;
        files::write(dir, "gauge.svg", chart.as_bytes())?;
    }
    if args.output.json {
        outln!("{}", study.json());
        return Ok(ExitCode::SUCCESS);
    }
    out!("{}", study.text());
    if let Some(dir) = out {
        outln!("chart: {}/gauge.svg", dir.display());
    }
    Ok(ExitCode::SUCCESS)
}

//! `softgrip calibrate`: the free-bend sweep of the simulated gripper, and what it is good for.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use ::settings::page;
use ::sim::setup::Setup;
use ::sim::sweep;
use clap::Args;
use evaluate::calibration::{self, Options};
use finger::recipe::Recipe;
use report::files::Pending;
use watch::create;

use super::output::outln;
use super::{Controls, in_parallel, load_recipe, progress_bar, within};

#[derive(Args)]
pub struct CalibrateArgs {
    /// Seed of the fingers' tolerances; the first of --hands.
    #[arg(long, value_name = "N", default_value = "1")]
    finger_seed: u64,
    /// Noise of the gauges, µε rms at the control tick.
    #[arg(long, value_name = "UE", default_value = "20", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: f64,
    /// The settings file that the sweep makes of --settings or of the defaults.
    #[arg(long, value_name = "FILE", conflicts_with = "hands")]
    out: Option<PathBuf>,
    /// Replace a file that is there.
    #[arg(long, requires = "out")]
    force: bool,
    /// Sweep so many hands with 20, 100 and 300 µε of noise and regulators of 20 to 200 ms, and say how well the
    /// controller then knows them.
    #[arg(long, value_name = "N", conflicts_with_all = ["noise", "settings"], value_parser = clap::value_parser!(u32).range(1..=100_000))]
    hands: Option<u32>,
    /// Closes on nothing, and on an object, of each of --hands.
    #[arg(long, value_name = "N", default_value = "20", requires = "hands", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    grips: u32,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    /// Print JSON.
    #[arg(long, requires = "hands")]
    json: bool,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", requires = "hands", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let recipe = load_recipe(args.recipe.as_deref())?;
    match args.hands {
        Some(hands) => measure(&recipe, hands, args),
        None => one(&recipe, args),
    }
}

/// Sweeps one hand and keeps what has been found.
fn one(recipe: &Recipe, args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let out = match &args.out {
        Some(path) if !args.force && path.is_file() => return Err(create::taken(path)),
        Some(path) => Some((path, Pending::at(path)?)),
        None => None,
    };
    let mut setup = Setup::with_castings(recipe, args.finger_seed)?;
    args.controls.apply(&mut setup)?;
    setup.scenario.noise_ue = args.noise;
    let settings = setup.settings();
    let swept = sweep::sweep(&setup, &settings)?;
    let found = &swept.calibration;
    outln!("swept in {:.1} s", swept.duration_s);
    for (i, (gain, stiffness)) in found.gain.iter().zip(found.stiffness).enumerate() {
        outln!(
            "finger {}: {stiffness:.3} times as stiff, gauge {gain:.3}",
            i + 1
        );
    }
    match found.meeting {
        Some(at) => outln!("they meet as the recipe's would at {:.1} kPa", at.0),
        None => outln!("they do not meet"),
    }
    let [up_ms, down_ms] = found.lag_ms;
    outln!(
        "hysteresis {:.1} kPa, {up_ms:.0} ms behind a rising pressure, {down_ms:.0} ms behind a falling one",
        found.hysteresis_kpa
    );
    let [before, after] = calibration::errors_percent(&setup, &swept)?;
    outln!("free-bend error up to there {before:.1} % of full scale before, {after:.1} % now");
    if let Some((path, mut file)) = out {
        let values = calibration::calibrated(&setup, &swept)?.values();
        file.write_all(page::toml(&values).as_bytes())?;
        file.finish()?;
        outln!("settings: {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn measure(recipe: &Recipe, hands: u32, args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let options = Options {
        seed: args.finger_seed,
        hands,
        grips: args.grips,
    };
    let bar = progress_bar(hands.into(), "hands");
    let measured = in_parallel(args.jobs, || {
        calibration::measure(recipe, &options, &|| bar.inc(1))
    })??;
    bar.finish_and_clear();
    if args.json {
        outln!("{}", serde_json::to_string(&measured)?);
        return Ok(ExitCode::SUCCESS);
    }
    let table = calibration::table(&measured);
    outln!("{}\n{}", table.text(), table.note);
    for (seed, why) in &measured.refused {
        outln!("seed {seed}: {why}");
    }
    Ok(ExitCode::SUCCESS)
}

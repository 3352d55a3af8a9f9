//! `softgrip evaluate`: detection latency and false-alarm rate.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use evaluate::case::KNOWLEDGE;
use evaluate::options::Options;
use evaluate::summary::Summary;
use evaluate::{alarms, details, evaluation, latency, limits, output, silicone, tables};
use finger::recipe::Recipe;
use report::files;
use sim::hand::Hand;
use sim::setup::Setup;

use super::output::{out, outln};
use super::{Castings, Output, in_parallel, load_recipe, progress_bar, within};

#[derive(Args)]
pub struct EvaluateArgs {
    /// Hours of simulated operation without a loss at each level of noise; a tenth of that at the highest.
    #[arg(long, value_name = "H", default_value = "100", allow_negative_numbers = true, value_parser = within(0.0, 10_000.0))]
    hours: f64,
    /// Number of true losses, for calibrated and for uncalibrated fingers each.
    #[arg(long, value_name = "N", default_value = "500")]
    losses: usize,
    /// Seed of everything that is random. The detector was tuned on seeds below 1000.
    #[arg(long, value_name = "N", default_value = "1000000")]
    seed: u64,
    /// Directory for simulated losses, which are reused: after a change of the detector alone nothing is
    /// simulated again.
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Number of slowest reports to print in detail, at each level of noise.
    #[arg(long, value_name = "N", default_value = "0")]
    slowest: usize,
    /// Only this run of the losses, in detail.
    #[arg(long, value_name = "INDEX")]
    only: Option<u64>,
    /// Only what held objects reach and what lost ones reach of everything that the detector has a limit for.
    #[arg(long, conflicts_with_all = ["only", "slowest"])]
    limits: bool,
    /// Only what each imperfection of real fingers costs: slower deflation, hysteresis, creep, fingers that touch, and
    /// the castings of --finger-seed or, without it, of seed 1.
    #[arg(long, conflicts_with_all = ["only", "slowest", "limits"])]
    silicone: bool,
    /// Noise of the trace that --only writes, µε rms.
    #[arg(long, value_name = "UE", default_value = "20", requires = "only", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: f64,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    castings: Castings,
    #[command(flatten)]
    output: Output,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub fn run(args: &EvaluateArgs) -> anyhow::Result<ExitCode> {
    let out = args.output.directory()?;
    let recipe = load_recipe(args.recipe.as_deref())?;
    let base = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    evaluation::check(&base)?;
    let options = Options {
        seed: args.seed,
        losses: args.losses,
        hours: args.hours,
        recordings: args.recordings.clone(),
        settings: base.settings(),
    };
    if let Some(dir) = &options.recordings {
        files::prepare(dir)?;
    }
    if let Some(index) = args.only {
        for knowledge in KNOWLEDGE {
            for trial in latency::trials_of(&base, &options, knowledge, index)? {
                outln!("{}", details::line(&trial));
            }
            if let Some(dir) = out {
                let trace = latency::trace(&base, &options, knowledge, index, args.noise)?;
                let name = format!("{}-{index}.csv", knowledge.name());
                files::write(dir, &name, &trace)?;
            }
        }
        return Ok(ExitCode::SUCCESS);
    }
    if args.limits {
        return measure_limits(&base, &options, args);
    }
    if args.silicone {
        return measure_silicone(&recipe, &base, &options, args);
    }
    let start = Instant::now();
    let bar = progress_bar(evaluation::steps(&options), "losses and seconds");
    let evaluation = in_parallel(args.jobs, || {
        evaluation::run(&base, &options, &|steps| bar.inc(steps))
    })??;
    bar.finish_and_clear();
    let summary = Summary::of(&evaluation, &options);
    if let Some(dir) = out {
        output::write(&evaluation, &summary, &options, dir)?;
    }
    if args.output.json {
        outln!("{}", serde_json::to_string(&summary)?);
        return Ok(ExitCode::SUCCESS);
    }
    let trials = &evaluation.sample.trials;
    out!("{}", details::wrong(trials));
    if args.slowest > 0 {
        out!("{}", details::slowest(trials, args.slowest));
    }
    out!("{}", details::alarms(&evaluation.tallies));
    for table in tables::all(&summary) {
        outln!("{}", table.text());
    }
    outln!("{:.0} s", start.elapsed().as_secs_f64());
    if let Some(dir) = out {
        outln!("report: {}/report.html", dir.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn measure_silicone(
    recipe: &Recipe,
    base: &Setup,
    options: &Options,
    args: &EvaluateArgs,
) -> anyhow::Result<ExitCode> {
    let castings = match &base.castings {
        Some(castings) => castings.clone(),
        None => Hand::cast(recipe, 1)?,
    };
    let bar = progress_bar(silicone::steps(options), "losses and seconds");
    let costs = in_parallel(args.jobs, || {
        silicone::measure(base, &castings, options, &|steps| bar.inc(steps))
    })??;
    bar.finish_and_clear();
    let json = serde_json::to_string(&costs)?;
    if let Some(dir) = args.output.directory()? {
        files::write(dir, "silicone.json", json.as_bytes())?;
    }
    if args.output.json {
        outln!("{json}");
    } else {
        let table = silicone::table(&costs);
        outln!("{}\n{}", table.text(), table.note);
    }
    Ok(ExitCode::SUCCESS)
}

fn measure_limits(
    base: &Setup,
    options: &Options,
    args: &EvaluateArgs,
) -> anyhow::Result<ExitCode> {
    let bar = progress_bar(limits::steps(options), "losses and seconds");
    let measured = in_parallel(args.jobs, || {
        let models = alarms::models(base)?;
        limits::measure(base, options, &models, &|steps| bar.inc(steps))
    })??;
    bar.finish_and_clear();
    let text = match args.output.json {
        true => serde_json::to_string(&measured)? + "\n",
        false => details::limits(&measured),
    };
    if let Some(dir) = args.output.directory()? {
        files::write(
            dir,
            "limits.json",
            serde_json::to_string(&measured)?.as_bytes(),
        )?;
    }
    out!("{text}");
    Ok(ExitCode::SUCCESS)
}

//! `softgrip evaluate`: detection latency and false-alarm rate.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::{Args, Subcommand};
use evaluate::about::About;
use evaluate::case::KNOWLEDGE;
use evaluate::evaluation::{self, Evaluation};
use evaluate::mounted::{self, Hands};
use evaluate::options::Options;
use evaluate::output::{self, Losses};
use evaluate::part::{self, Part};
use evaluate::summary::Summary;
use evaluate::{alarms, details, latency, limits, silicone, tables};
use finger::recipe::Recipe;
use report::files;
use report::provenance::Provenance;
use report::shard::Shard;
use sim::hand::Hand;
use sim::setup::Setup;

use super::output::{out, outln};
use super::{
    BUILD, Castings, Controls, Merge, Output, in_parallel, incomplete, load_recipe, progress_bar,
    within,
};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct EvaluateArgs {
    #[command(subcommand)]
    merge: Option<Action>,
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
    /// Only what a free-bend sweep is worth: so many random hands, the first of them the castings of --finger-seed or,
    /// without it, of seed 1, known by the recipe, by a sweep, and exactly. --losses and --hours are of all of them.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "slowest", "limits", "silicone", "recordings"], value_parser = clap::value_parser!(u32).range(1..=100_000))]
    hands: Option<u32>,
    /// Only the i-th of n parts, into a folder of its own below --out, which all parts share. An interrupted part
    /// goes on where it was.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["only", "slowest", "limits", "silicone", "hands", "json"])]
    shard: Option<Shard>,
    /// Noise of the trace that --only writes, µε rms.
    #[arg(long, value_name = "UE", default_value = "20", requires = "only", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: f64,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
    #[command(flatten)]
    output: Output,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

#[derive(Subcommand)]
enum Action {
    /// Merges the parts of an evaluation that was split with --shard.
    ///
    /// Exits with 3 if parts are missing or unfinished, and prints their numbers as `sbatch --array` takes them.
    Merge(MergeArgs),
}

#[derive(Args)]
struct MergeArgs {
    #[command(flatten)]
    parts: Merge,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &EvaluateArgs) -> anyhow::Result<ExitCode> {
    if let Some(Action::Merge(args)) = &args.merge {
        return merge(args);
    }
    let out = args.output.directory()?;
    let recipe = load_recipe(args.recipe.as_deref())?;
    let mut base = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    args.controls.apply(&mut base)?;
    evaluation::check(&base)?;
    let options = Options {
        seed: args.seed,
        losses: args.losses,
        hours: args.hours,
        recordings: args.recordings.clone(),
        slowest: args.slowest,
        settings: base.settings(),
    };
    if let Some(dir) = &options.recordings {
        files::prepare(dir)?;
    }
    let provenance = Provenance::new(BUILD, &recipe, &options.settings);
    let about = About::new(&options, provenance, args.castings.finger_seed);
    if let Some(count) = args.hands {
        let first = args.castings.finger_seed.max(1);
        return measure_hands(&recipe, &base, &options, Hands { first, count }, args);
    }
    match (args.only, args.shard, out) {
        (Some(index), ..) => only(&base, &options, index, args.noise, out),
        _ if args.limits => measure_limits(&base, &options, args),
        _ if args.silicone => measure_silicone(&recipe, &base, &options, args),
        (None, Some(shard), Some(dir)) => run_part(&base, &options, &about, shard, dir, args.jobs),
        _ => whole(&base, &options, &about, out, args),
    }
}

/// One run of the losses, in detail.
fn only(
    base: &Setup,
    options: &Options,
    index: u64,
    noise_ue: f64,
    out: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    for knowledge in KNOWLEDGE {
        for trial in latency::trials_of(base, options, knowledge, index)? {
            outln!("{}", details::line(&trial));
        }
        if let Some(dir) = out {
            let trace = latency::trace(base, options, knowledge, index, noise_ue)?;
            let name = format!("{}-{index}.csv", knowledge.name());
            files::write(dir, &name, &trace)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn whole(
    base: &Setup,
    options: &Options,
    about: &About,
    out: Option<&Path>,
    args: &EvaluateArgs,
) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let mut losses = output::losses(out)?;
    let bar = progress_bar(
        evaluation::steps(options, Shard::WHOLE),
        "losses and seconds",
    );
    let evaluation = in_parallel(args.jobs, || {
        evaluation::run(base, options, about, &mut losses, &|steps| bar.inc(steps))
    })??;
    bar.finish_and_clear();
    publish(&evaluation, about, losses, out, args.output.json)?;
    if !args.output.json {
        outln!("{:.0} s", start.elapsed().as_secs_f64());
    }
    Ok(ExitCode::SUCCESS)
}

fn run_part(
    base: &Setup,
    options: &Options,
    about: &About,
    shard: Shard,
    dir: &Path,
    jobs: Option<u16>,
) -> anyhow::Result<ExitCode> {
    let folder = shard.folder(dir);
    files::prepare(&folder)?;
    let mut part = Part::open(&folder, about, shard)?;
    for note in part.notes() {
        super::output::note(format_args!("{note}"));
    }
    if part.is_finished() {
        outln!("{}: finished before", folder.display());
        return Ok(ExitCode::SUCCESS);
    }
    let bar = progress_bar(evaluation::steps(options, shard), "losses and seconds");
    in_parallel(jobs, || part.run(base, options, &|steps| bar.inc(steps)))??;
    bar.finish_and_clear();
    outln!("{}: finished", folder.display());
    Ok(ExitCode::SUCCESS)
}

fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let parts = part::find(&args.parts.dir, BUILD)?;
    if let Some(status) = incomplete(&args.parts.dir, &parts)? {
        return Ok(status);
    }
    let about = serde_json::from_value(parts.about.into());
    let about = about.with_context(|| args.parts.dir.display().to_string())?;
    let out = args.parts.prepare_out()?;
    let mut losses = output::losses(Some(out))?;
    let evaluation = part::merge(&parts.folders, &about, &mut losses)?;
    publish(&evaluation, &about, losses, Some(out), args.json)?;
    Ok(ExitCode::SUCCESS)
}

/// Writes and prints the results.
fn publish(
    evaluation: &Evaluation,
    about: &About,
    losses: Losses,
    out: Option<&Path>,
    json: bool,
) -> anyhow::Result<()> {
    let summary = Summary::of(evaluation, about);
    if let Some(dir) = out {
        output::write(evaluation, &summary, losses, dir)?;
    }
    if json {
        outln!("{}", serde_json::to_string(&summary)?);
        return Ok(());
    }
    out!("{}", evaluation.sample.wrong());
    out!("{}", evaluation.sample.slowest());
    out!("{}", details::alarms(&evaluation.tallies));
    for table in tables::all(&summary) {
        outln!("{}", table.text());
    }
    if let Some(dir) = out {
        outln!("report: {}/report.html", dir.display());
    }
    Ok(())
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

fn measure_hands(
    recipe: &Recipe,
    base: &Setup,
    options: &Options,
    hands: Hands,
    args: &EvaluateArgs,
) -> anyhow::Result<ExitCode> {
    let bar = progress_bar(mounted::steps(options, hands), "losses and seconds");
    let measured = in_parallel(args.jobs, || {
        mounted::measure(recipe, base, options, hands, &|steps| bar.inc(steps))
    })??;
    bar.finish_and_clear();
    let json = serde_json::to_string(&measured)?;
    if let Some(dir) = args.output.directory()? {
        files::write(dir, "hands.json", json.as_bytes())?;
    }
    if args.output.json {
        outln!("{json}");
        return Ok(ExitCode::SUCCESS);
    }
    let table = mounted::table(&measured, hands);
    outln!("{}\n{}", table.text(), table.note);
    for row in &measured.rows {
        for (event, times) in &row.instead {
            outln!("{}: {times} times {event}", row.known_by);
        }
    }
    for (seed, why) in &measured.refused {
        outln!("seed {seed}: {why}");
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
        false => limits::text(&measured),
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

//! `softgrip sweep`: runs a sweep or a part of it, and merges parts.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use report::files;
use report::provenance::Provenance;
use report::shard::Shard;
use sim::setup::Setup;
use studies::sweep::results::{self, About, CSV, Results};
use studies::sweep::spec::Spec;
use studies::sweep::{self, columns, parquet};

use super::output;
use super::output::outln;
use super::{BUILD, Controls, Merge, in_parallel, incomplete, load_recipe, progress_bar};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct SweepArgs {
    #[command(subcommand)]
    merge: Option<Action>,
    /// What to sweep (TOML): kind = "grid" or "random", `[vary]`, `[fixed]`.
    #[arg(required = true)]
    spec: Option<PathBuf>,
    /// Directory for results.csv and results.parquet. An interrupted sweep continues there.
    #[arg(long, value_name = "DIR", default_value = "out/sweep")]
    out: PathBuf,
    /// Only the i-th of n parts, into a folder of its own below --out, which all parts share.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

#[derive(Subcommand)]
enum Action {
    /// Merges the parts of a sweep that was split with --shard.
    ///
    /// Exits with 3 if parts are missing or unfinished, and prints their numbers as `sbatch --array` takes them.
    Merge(Merge),
}

pub fn run(args: &SweepArgs) -> anyhow::Result<ExitCode> {
    match (&args.merge, &args.spec) {
        (Some(Action::Merge(args)), _) => merge(args),
        (None, Some(path)) => sweep(args, &Spec::load(path)?),
        (None, None) => unreachable!("clap requires one of them"),
    }
}

fn sweep(args: &SweepArgs, spec: &Spec) -> anyhow::Result<ExitCode> {
    let recipe = load_recipe(args.recipe.as_deref())?;
    let mut base = Setup::of(&recipe)?;
    args.controls.apply(&mut base)?;
    let (shard, dir) = match args.shard {
        Some(shard) => (shard, shard.folder(&args.out)),
        None => (Shard::WHOLE, args.out.clone()),
    };
    in_parallel(args.jobs, || sweep::check(&base, spec, shard))??;
    files::prepare(&dir)?;
    let provenance = Provenance::new(BUILD, &recipe, &base.settings());
    let about = About::new(spec, provenance, shard);
    let columns = columns::columns(spec);
    let mut results = Results::open(&dir, &about, &columns)?;
    for note in results.notes() {
        output::note(format_args!("{note}"));
    }
    let (all, before) = (shard.len(spec.runs), results.finished);
    let bar = progress_bar(all, "runs");
    bar.set_position(before);
    in_parallel(args.jobs, || {
        sweep::run(&base, spec, &mut results, || bar.inc(1))
    })??;
    bar.finish_and_clear();
    parquet::write(&dir, &columns)?;
    outln!(
        "{all} runs, {} of them new: {1}/{CSV}, {1}/results.parquet",
        all - before,
        dir.display()
    );
    Ok(ExitCode::SUCCESS)
}

fn merge(args: &Merge) -> anyhow::Result<ExitCode> {
    let parts = results::find(&args.dir, BUILD)?;
    if let Some(status) = incomplete(&args.dir, &parts)? {
        return Ok(status);
    }
    let dir = args.prepare_out()?;
    let columns = results::merge(&parts.folders, dir)?;
    parquet::write(dir, &columns)?;
    outln!(
        "{} parts joined: {1}/{CSV}, {1}/results.parquet",
        parts.folders.len(),
        dir.display()
    );
    Ok(ExitCode::SUCCESS)
}

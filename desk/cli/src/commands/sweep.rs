//! `softgrip sweep`: runs a sweep or a part of it, and merges parts.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use report::files;
use sim::setup::Setup;
use studies::sweep::results::{self, About, CSV, Results};
use studies::sweep::shard::Shard;
use studies::sweep::spec::Spec;
use studies::sweep::{self, columns, parquet};

use super::output;
use super::output::outln;
use super::{in_parallel, load_recipe, progress_bar};

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
    /// Only the i-th of n parts; each goes into a directory of its own.
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

#[derive(Subcommand)]
enum Action {
    /// Merges the parts of a sweep that was split with --shard.
    Merge(MergeArgs),
}

#[derive(Args)]
struct MergeArgs {
    /// The directories of all parts, in any order.
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Directory for the merged results.csv and results.parquet.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
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
    let base = Setup::of(&recipe)?;
    in_parallel(args.jobs, || sweep::check(&base, spec, args.shard))??;
    files::prepare(&args.out)?;
    let about = About::new(spec, &recipe, args.shard);
    let columns = columns::columns(spec);
    let mut results = Results::open(&args.out, &about, &columns)?;
    if results.torn {
        output::note(format_args!(
            "{CSV}: dropped half a row that a killed sweep left"
        ));
    }
    let (all, before) = (args.shard.len(spec.runs), results.finished);
    let bar = progress_bar(all, "runs");
    let progress = |finished| bar.set_position(finished);
    in_parallel(args.jobs, || {
        sweep::run(&base, spec, &mut results, progress)
    })??;
    bar.finish_and_clear();
    parquet::write(&args.out, &columns)?;
    outln!(
        "{all} runs, {} of them new: {1}/{CSV}, {1}/results.parquet",
        all - before,
        args.out.display()
    );
    Ok(ExitCode::SUCCESS)
}

fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    files::prepare(&args.out)?;
    let columns = results::merge(&args.parts, &args.out)?;
    parquet::write(&args.out, &columns)?;
    outln!(
        "{} parts joined: {1}/{CSV}, {1}/results.parquet",
        args.parts.len(),
        args.out.display()
    );
    Ok(ExitCode::SUCCESS)
}

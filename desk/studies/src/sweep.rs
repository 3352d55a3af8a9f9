//! Runs over a grid or a random sample of any parameters of the simulated gripper.
//!
//! The directory of a sweep contains `sweep.json`, its specification, and `results.csv`, which grows in the
//! order of the runs. A sweep that was interrupted continues where it ended. When all runs are done,
//! `results.parquet` contains the same rows.

pub mod columns;
pub mod parquet;
pub mod results;
pub mod spec;

use std::time::Instant;

use anyhow::Context;
use rayon::prelude::*;
use report::journal::WRITTEN_EVERY;
use report::shard::Shard;
use sim::run::Run;
use sim::setup::Setup;

use results::Results;
use spec::Spec;

/// Most runs between one writing of results and the next.
const MOST_AT_ONCE: u64 = 10_000;

/// The row of a run.
fn row(spec: &Spec, number: u64, run: &Run) -> Vec<String> {
    let optional = |value: Option<f64>, decimals: usize| {
        value.map_or(String::new(), |value| format!("{value:.decimals$}"))
    };
    let mut row = vec![number.to_string()];
    row.extend(spec.values(number).map(|(_, value)| value.to_string()));
    row.extend([
        run.outcome.name().to_string(),
        optional(run.slid_at_s, 3),
        optional(run.collapse_at_s, 3),
        optional(run.flagged_at_s, 3),
        optional(run.latency_ms(), 1),
        run.lost_reports().to_string(),
        run.mistake().map_or("right", |_| "wrong").to_string(),
    ]);
    row
}

fn setup_of(base: &Setup, spec: &Spec, number: u64) -> anyhow::Result<Setup> {
    let mut setup = base.clone();
    for (name, value) in spec.values(number) {
        setup.set(name, value)?;
    }
    setup.check().with_context(|| format!("run {number}"))?;
    Ok(setup)
}

/// Checks every run of the shard before the first one starts.
///
/// # Errors
/// If a run is impossible; the message names it and says what would be possible.
pub fn check(base: &Setup, spec: &Spec, shard: Shard) -> anyhow::Result<()> {
    (0..shard.len(spec.runs))
        .into_par_iter()
        .try_for_each(|n| setup_of(base, spec, shard.unit(n)).map(drop))
}

/// Runs what is missing in `results`, in parallel; `done` is called after each run.
///
/// # Errors
/// If a run is impossible or the results cannot be written.
pub fn run(
    base: &Setup,
    spec: &Spec,
    results: &mut Results,
    done: impl Fn() + Sync,
) -> anyhow::Result<()> {
    let shard = results.shard;
    let all = shard.len(spec.runs);
    // One run per thread says how long a run takes.
    let mut at_once = rayon::current_num_threads() as u64;
    while results.finished < all {
        let began = Instant::now();
        let from = results.finished;
        let to = all.min(from + at_once);
        let rows: Vec<Vec<String>> = (from..to)
            .into_par_iter()
            .map(|n| {
                let number = shard.unit(n);
                let run = setup_of(base, spec, number)?.run(|_| ())?;
                done();
                Ok(row(spec, number, &run))
            })
            .collect::<anyhow::Result<_>>()?;
        results.append(&rows)?;
        let share = WRITTEN_EVERY.as_secs_f64() / began.elapsed().as_secs_f64().max(1e-3);
        let fitting = ((to - from) as f64 * share) as u64;
        at_once = fitting.clamp(rayon::current_num_threads() as u64, MOST_AT_ONCE);
    }
    Ok(())
}

//! `softgrip diff`: what two streams of verdicts do not have in common.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};
use clap::Args;
use serde_json::Value;
use watch::create::ending;
use watch::verdicts::{Verdict, compare};
use watch::{Told, recording};

use super::output::outln;
use super::replay;
use super::within;

#[derive(Args)]
pub struct DiffArgs {
    /// A recording (.mcap: the events that were recorded), a trace (.csv, which is replayed), or what
    /// `softgrip replay --json` has printed.
    first: PathBuf,
    /// The same.
    second: PathBuf,
    /// Events that are no further apart are the same.
    #[arg(long, value_name = "MS", default_value = "5", allow_negative_numbers = true, value_parser = within(0.0, 60_000.0))]
    tolerance: f64,
    /// Events that are further apart have nothing to do with one another.
    #[arg(long, value_name = "MS", default_value = "1000", allow_negative_numbers = true, value_parser = within(0.0, 3_600_000.0))]
    apart: f64,
}

pub fn run(args: &DiffArgs) -> anyhow::Result<ExitCode> {
    ensure!(
        args.tolerance <= args.apart,
        "--tolerance {} must not be more than --apart {}",
        args.tolerance,
        args.apart
    );
    let (first, second) = (verdicts(&args.first)?, verdicts(&args.second)?);
    let differences = compare(&first, &second, 1e-3 * args.tolerance, 1e-3 * args.apart);
    for difference in &differences {
        outln!("{difference}");
    }
    if differences.is_empty() {
        outln!(
            "the same: {} events each, within {} ms",
            first.len(),
            args.tolerance
        );
        return Ok(ExitCode::SUCCESS);
    }
    outln!(
        "{} differences; - in {} alone, + in {} alone, ~ at another time",
        differences.len(),
        args.first.display(),
        args.second.display()
    );
    Ok(ExitCode::FAILURE)
}

/// The events of a file.
fn verdicts(path: &Path) -> anyhow::Result<Vec<Verdict>> {
    match ending(path).as_str() {
        "mcap" => recorded(path),
        "csv" => {
            let events = replay::trace_events(path)?.into_iter();
            let verdicts = events.map(|event| Verdict {
                t_s: event.t_s,
                name: sim::events::name(&event.event).into(),
            });
            Ok(verdicts.collect())
        }
        _ => printed(path).with_context(|| path.display().to_string()),
    }
}

fn recorded(path: &Path) -> anyhow::Result<Vec<Verdict>> {
    let mut verdicts = Vec::new();
    recording::read(path, &mut |told| {
        match told {
            Told::Event(event) => verdicts.push(Verdict {
                t_s: event.t_s,
                name: event.name,
            }),
            Told::Note(text) => super::output::note(format_args!("{text}")),
            _ => {}
        }
        Ok(())
    })?;
    Ok(verdicts)
}

/// What `softgrip replay --json` has printed: an event in each line.
fn printed(path: &Path) -> anyhow::Result<Vec<Verdict>> {
    let text = std::fs::read_to_string(path)?;
    let lines = text.lines().zip(1..);
    let verdicts = lines.filter(|(line, _)| !line.trim().is_empty());
    let verdicts = verdicts.map(|(line, number)| {
        let wrong = || {
            format!(
                "line {number}: must be an event as `softgrip replay --json` prints it, or the file a .mcap or .csv"
            )
        };
        let event: Value = serde_json::from_str(line).with_context(wrong)?;
        let name = event["event"].as_str().with_context(wrong)?;
        Ok(Verdict {
            t_s: event["t_s"].as_f64().with_context(wrong)?,
            name: name.into(),
        })
    });
    verdicts.collect()
}

//! Writes the files of an evaluation.

use std::path::Path;

use report::{charts, files};

use crate::evaluation::Evaluation;
use crate::options::Options;
use crate::summary::Summary;
use crate::{figures, losses, page};

/// Writes page, charts, numbers and losses to a directory.
///
/// # Errors
/// If a figure cannot be drawn or a file cannot be written.
pub fn write(
    evaluation: &Evaluation,
    summary: &Summary,
    options: &Options,
    dir: &Path,
) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(summary)? + "\n";
    let trials = &evaluation.sample.trials;
    let page = page::page(evaluation, summary, options)?;
    let roc = charts::standalone(&figures::roc(summary)?);
    let latency = charts::standalone(&figures::latencies(trials)?);
    files::write(dir, "evaluation.json", json.as_bytes())?;
    files::write(dir, "losses.csv", &losses::csv(trials)?)?;
    files::write(dir, "roc.svg", roc.as_bytes())?;
    files::write(dir, "latency.svg", latency.as_bytes())?;
    files::write(dir, "report.html", page.as_bytes())
}

//! Writes the files of an evaluation.

use std::io::Write;
use std::path::Path;

use report::files::Pending;
use report::{charts, files};

use crate::evaluation::Evaluation;
use crate::summary::Summary;
use crate::{figures, losses, page};

/// Begins the table of losses in a directory; without one, nothing is kept of it.
///
/// # Errors
/// If the file cannot be created.
pub fn losses(dir: Option<&Path>) -> anyhow::Result<Losses> {
    let mut file = dir
        .map(|dir| Pending::create(dir, "losses.csv"))
        .transpose()?;
    if let Some(file) = &mut file {
        file.write_all(losses::header().as_bytes())?;
    }
    Ok(Losses(file))
}

/// The table of losses, which is written row by row.
pub struct Losses(Option<Pending>);

impl Write for Losses {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0
            .as_mut()
            .map_or(Ok(bytes.len()), |file| file.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.as_mut().map_or(Ok(()), Write::flush)
    }
}

/// Writes page, charts, numbers and losses to a directory.
///
/// # Errors
/// If a figure cannot be drawn or a file cannot be written.
pub fn write(
    evaluation: &Evaluation,
    summary: &Summary,
    losses: Losses,
    dir: &Path,
) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(summary)? + "\n";
    let page = page::page(evaluation, summary)?;
    let roc = charts::standalone(&figures::roc(summary)?);
    let latency = charts::standalone(&figures::latencies(&evaluation.sample)?);
    files::write(dir, "evaluation.json", json.as_bytes())?;
    if let Some(file) = losses.0 {
        file.finish()?;
    }
    files::write(dir, "roc.svg", roc.as_bytes())?;
    files::write(dir, "latency.svg", latency.as_bytes())?;
    files::write(dir, "report.html", page.as_bytes())
}

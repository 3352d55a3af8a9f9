//! Parts of an evaluation, for several machines: a folder for each, and what they give together.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use report::journal::{Journal, Lines};
use report::parts::{self, Parts};
use report::provenance::Build;
use report::shard::Shard;
use sim::setup::Setup;

use crate::about::About;
use crate::case::{KNOWLEDGE, Knowledge};
use crate::evaluation::{Collector, Evaluation};
use crate::options::Options;
use crate::work::{self, Standing, Unit};

/// Says what the part is a part of.
const ABOUT: &str = "part.json";
/// One line per unit that is done, JSON.
const UNITS: &str = "units.jsonl";

/// A part that can be gone on with.
pub struct Part {
    journal: Journal,
    standing: Standing,
}

impl Part {
    /// Opens the part in its folder, or begins it.
    ///
    /// # Errors
    /// If the folder holds something else, another process writes there, or a file cannot be read or written.
    pub fn open(folder: &Path, about: &About, shard: Shard) -> anyhow::Result<Self> {
        parts::claim(folder, ABOUT, UNITS, &about.of_part(shard)?)?;
        let mut standing = Standing::new(shard);
        let path = folder.join(UNITS);
        let journal = Journal::open(&path, |number, line| {
            parse(line)
                .and_then(|unit| standing.take(&unit))
                .with_context(|| {
                    format!("{}: line {number}; remove it and what follows, and the part goes on from there", path.display())
                })
        })?;
        Ok(Self { journal, standing })
    }

    /// What a user should know of its files.
    pub fn notes(&self) -> &[String] {
        &self.journal.notes
    }

    /// Whether nothing is left to be done.
    pub fn is_finished(&self) -> bool {
        self.standing.ended
    }

    /// Does what is left; see [`work::run`].
    ///
    /// # Errors
    /// As [`work::run`], or if the results cannot be written.
    pub fn run(
        &mut self,
        base: &Setup,
        options: &Options,
        done: &(dyn Fn(u64) + Sync),
    ) -> anyhow::Result<()> {
        let mut sink = |units: Vec<Unit>| {
            let mut text = String::new();
            for unit in &units {
                text += &(serde_json::to_string(unit)? + "\n");
            }
            self.journal.append(&text)
        };
        work::run(base, options, &mut self.standing, &mut sink, done)
    }
}

fn parse(line: &str) -> anyhow::Result<Unit> {
    serde_json::from_str(line).context("not a unit of an evaluation")
}

/// Looks for all parts in their common directory.
///
/// # Errors
/// If there are none, they are of another build, or a file cannot be read.
pub fn find(dir: &Path, build: Build) -> anyhow::Result<Parts> {
    parts::find(dir, ABOUT, build, |folder, _| {
        let end = serde_json::to_string(&Unit::End)?;
        let path = folder.join(UNITS);
        if !path.exists() {
            return Ok(Some("it has only begun".into()));
        }
        let (mut lines, mut units, mut last) = (Lines::of(&path), 0, String::new());
        while let Some(line) = lines.next_line()? {
            units += 1;
            last = line;
        }
        Ok((last != end).then(|| format!("{units} units are there, and not its end")))
    })
}

/// Sums up all parts, as one run would have. The rows of the table of losses go to `rows`.
///
/// # Errors
/// If a file cannot be read, a unit is missing, or `rows` cannot be written.
pub fn merge(
    folders: &[PathBuf],
    about: &About,
    rows: &mut dyn Write,
) -> anyhow::Result<Evaluation> {
    let mut collector = Collector::new(about, 0);
    let mut readers: Vec<Reader> = folders.iter().map(|folder| Reader::of(folder)).collect();
    let parts = readers.len() as u64;
    for number in 0..collector.stretches() {
        let reader = &mut readers[(number % parts) as usize];
        let unit = reader.stretch(number)?;
        collector.take(unit, rows)?;
    }
    for knowledge in KNOWLEDGE {
        let mut number = 0;
        while !collector.has_enough(knowledge) {
            let reader = &mut readers[(number % parts) as usize];
            let unit = reader.batch(knowledge, number)?;
            collector.take(unit, rows)?;
            number += 1;
        }
    }
    Ok(collector.finish())
}

/// Reads the units of a part.
struct Reader {
    lines: Lines,
    path: PathBuf,
    line: u64,
}

impl Reader {
    fn of(folder: &Path) -> Self {
        let path = folder.join(UNITS);
        Self {
            lines: Lines::of(&path),
            path,
            line: 0,
        }
    }

    fn next(&mut self) -> anyhow::Result<Unit> {
        self.line += 1;
        let place = || format!("{}: line {}", self.path.display(), self.line);
        let line = self.lines.next_line()?.with_context(place)?;
        parse(&line).with_context(place)
    }

    fn stretch(&mut self, wanted: u64) -> anyhow::Result<Unit> {
        match self.next()? {
            unit @ Unit::Stretch { number, .. } if number == wanted => Ok(unit),
            _ => bail!(
                "{}: line {}: must be stretch {wanted}",
                self.path.display(),
                self.line
            ),
        }
    }

    /// A batch. A part has more of the first class than are needed.
    fn batch(&mut self, class: Knowledge, wanted: u64) -> anyhow::Result<Unit> {
        loop {
            match self.next()? {
                unit @ Unit::Batch {
                    knowledge, number, ..
                } if knowledge == class && number == wanted => {
                    return Ok(unit);
                }
                Unit::Batch { knowledge, .. } if (knowledge as usize) < class as usize => {}
                _ => bail!(
                    "{}: line {}: must be batch {wanted} of {} fingers",
                    self.path.display(),
                    self.line,
                    class.name()
                ),
            }
        }
    }
}

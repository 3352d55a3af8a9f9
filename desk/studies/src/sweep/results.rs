//! The results of a sweep, or of a part of it, in a directory.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use report::files::Pending;
use report::journal::{Journal, Lines};
use report::parts::{self, Parts};
use report::provenance::{Build, Provenance};
use report::shard::Shard;
use serde::{Deserialize, Serialize};

use super::columns::{Column, columns};
use super::spec::Spec;

/// Name of the file that describes the sweep.
const ABOUT: &str = "sweep.json";
/// One row per finished run, in the order of the runs.
pub const CSV: &str = "results.csv";

/// Results can only be continued or merged where all of this is the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    #[serde(flatten)]
    provenance: Provenance,
    spec: String,
    #[serde(flatten)]
    shard: Shard,
}

impl About {
    /// Describes a new sweep.
    pub fn new(spec: &Spec, provenance: Provenance, shard: Shard) -> Self {
        Self {
            provenance,
            spec: spec.text.clone(),
            shard,
        }
    }

    fn fields(&self) -> anyhow::Result<parts::About> {
        Ok(serde_json::from_str(&serde_json::to_string(self)?)?)
    }
}

/// Results that can be added to.
pub struct Results {
    /// Which runs belong here.
    pub shard: Shard,
    /// Number of finished runs.
    pub finished: u64,
    journal: Journal,
}

impl Results {
    /// Opens the results in `dir`, or creates them.
    ///
    /// # Errors
    /// If the directory holds another sweep, another process writes there, or a file cannot be read or
    /// written.
    pub fn open(dir: &Path, about: &About, columns: &[Column]) -> anyhow::Result<Self> {
        parts::claim(dir, ABOUT, CSV, &about.fields()?)?;
        let path = dir.join(CSV);
        let mut rows = Rows::new(about.shard, columns);
        let mut journal = Journal::open(&path, |number, line| {
            rows.take(line).with_context(|| {
                format!("{}: line {number}; remove it and what follows, and the sweep goes on from there", path.display())
            })
        })?;
        if !rows.begun {
            journal.append(&(rows.header + "\n"))?;
        }
        Ok(Self {
            shard: about.shard,
            finished: rows.finished,
            journal,
        })
    }

    /// What a user should know of the files.
    pub fn notes(&self) -> &[String] {
        &self.journal.notes
    }

    /// Appends finished rows.
    ///
    /// # Errors
    /// If the rows cannot be written.
    pub fn append(&mut self, rows: &[Vec<String>]) -> anyhow::Result<()> {
        let text: String = rows.iter().map(|row| row.join(",") + "\n").collect();
        self.journal.append(&text)?;
        self.finished += rows.len() as u64;
        Ok(())
    }
}

/// Checks that lines are the header and the first rows of a part.
struct Rows {
    shard: Shard,
    header: String,
    fields: usize,
    begun: bool,
    finished: u64,
}

impl Rows {
    fn new(shard: Shard, columns: &[Column]) -> Self {
        let header: Vec<_> = columns.iter().map(|column| column.name.as_str()).collect();
        Self {
            shard,
            header: header.join(","),
            fields: columns.len(),
            begun: false,
            finished: 0,
        }
    }

    fn take(&mut self, line: &str) -> anyhow::Result<()> {
        if !self.begun {
            ensure!(line == self.header, "must be {}", self.header);
            self.begun = true;
            return Ok(());
        }
        let expected = self.shard.unit(self.finished);
        let mut fields = line.split(',');
        ensure!(
            fields.next() == Some(&expected.to_string()) && 1 + fields.count() == self.fields,
            "must be run {expected} with {} fields",
            self.fields
        );
        self.finished += 1;
        Ok(())
    }
}

/// Looks for all parts of a sweep in their common directory.
///
/// # Errors
/// If there are none, they are of another build, or a file cannot be read or holds something else.
pub fn find(dir: &Path, build: Build) -> anyhow::Result<Parts> {
    parts::find(dir, ABOUT, build, |folder, about| {
        let about: About = typed(folder, about)?;
        let spec = Spec::parse(&about.spec)?;
        let path = folder.join(CSV);
        let mut rows = Rows::new(about.shard, &columns(&spec));
        let mut lines = path.exists().then(|| Lines::of(&path));
        let mut number = 0;
        while let Some(line) = lines.as_mut().map_or(Ok(None), Lines::next_line)? {
            number += 1;
            rows.take(&line)
                .with_context(|| format!("{}: line {number}", path.display()))?;
        }
        let all = about.shard.len(spec.runs);
        let lacks = format!("{} of its {all} runs are there", rows.finished);
        Ok((rows.finished < all).then_some(lacks))
    })
}

fn typed(folder: &Path, about: &parts::About) -> anyhow::Result<About> {
    serde_json::from_value(about.clone().into())
        .with_context(|| format!("{}: not what a sweep writes", folder.join(ABOUT).display()))
}

/// Merges all parts of a sweep into `dir`, row by row.
///
/// # Errors
/// If the directory holds another sweep, or a file cannot be read or written.
pub fn merge(folders: &[PathBuf], dir: &Path) -> anyhow::Result<Vec<Column>> {
    let first = folders.first().context("nothing to merge")?;
    let about = parts::load(first, ABOUT)?.with_context(|| first.display().to_string())?;
    let about = About {
        shard: Shard::WHOLE,
        ..typed(first, &about)?
    };
    let spec = Spec::parse(&about.spec)?;
    let columns = columns(&spec);
    parts::claim(dir, ABOUT, CSV, &about.fields()?)?;
    // Run number n stands in part n modulo their number.
    let mut readers = Vec::new();
    for folder in folders {
        let mut lines = Lines::of(&folder.join(CSV));
        lines.next_line()?;
        readers.push(lines);
    }
    let mut rows = Rows::new(Shard::WHOLE, &columns);
    let mut out = Pending::create(dir, CSV)?;
    let context = || format!("{}: cannot write", dir.join(CSV).display());
    writeln!(out, "{}", rows.header).with_context(context)?;
    rows.begun = true;
    for run in 0..spec.runs {
        let part = (run % readers.len() as u64) as usize;
        let line = readers[part].next_line()?.unwrap_or_default();
        rows.take(&line)
            .with_context(|| folders[part].join(CSV).display().to_string())?;
        writeln!(out, "{line}").with_context(context)?;
    }
    out.finish()?;
    Ok(columns)
}

//! The results of a sweep, or of a part of it, in a directory.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use finger::recipe::Recipe;
use report::files;
use serde::{Deserialize, Serialize};

use super::columns::{Column, columns};
use super::shard::Shard;
use super::spec::Spec;

/// Name of the file that describes the sweep.
const ABOUT: &str = "sweep.json";
/// One row per finished run, in the order of the runs.
pub const CSV: &str = "results.csv";

/// Results can only be continued or merged where all of this is the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    version: String,
    recipe: String,
    inputs_hash: String,
    spec: String,
    shard: u64,
    shards: u64,
}

impl About {
    /// Describes a new sweep.
    pub fn new(spec: &Spec, recipe: &Recipe, shard: Shard) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            recipe: recipe.name.clone(),
            inputs_hash: format!("{:016x}", recipe.inputs_hash),
            spec: spec.text.clone(),
            shard: shard.index,
            shards: shard.of,
        }
    }

    /// Reads the description of the results in a directory.
    ///
    /// # Errors
    /// If the file is missing or is not a description of a sweep.
    pub fn load(dir: &Path) -> anyhow::Result<Self> {
        let path = dir.join(ABOUT);
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("{}: no sweep's directory", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("{}: not what a sweep writes", path.display()))
    }

    /// The part of the sweep.
    pub fn shard(&self) -> Shard {
        Shard {
            index: self.shard,
            of: self.shards,
        }
    }

    /// The specification of the sweep.
    ///
    /// # Errors
    /// If the stored text is not a valid specification.
    pub fn spec(&self) -> anyhow::Result<Spec> {
        Spec::parse(&self.spec)
    }

    /// The description without the part: equal for all parts of a sweep.
    pub fn whole(&self) -> Self {
        Self {
            shard: Shard::WHOLE.index,
            shards: Shard::WHOLE.of,
            ..self.clone()
        }
    }

    /// Writes it to `dir`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, dir: &Path) -> anyhow::Result<()> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        files::write(dir, ABOUT, text.as_bytes())
    }
}

/// Results that can be added to.
pub struct Results {
    /// Which runs belong here.
    pub shard: Shard,
    /// Number of finished runs.
    pub finished: u64,
    /// Whether an incomplete last row, left by an interruption, was removed.
    pub torn: bool,
    path: PathBuf,
    file: File,
}

impl Results {
    /// Opens the results in `dir`, or creates them.
    ///
    /// # Errors
    /// If the directory holds another sweep, another process writes there, or a file cannot be read or
    /// written.
    pub fn open(dir: &Path, about: &About, columns: &[Column]) -> anyhow::Result<Self> {
        let path = dir.join(CSV);
        if dir.join(ABOUT).exists() {
            ensure!(
                About::load(dir)? == *about,
                "{}: holds results of another sweep: its {ABOUT} differs in spec, recipe, shard or version; choose another directory",
                dir.display()
            );
        } else {
            ensure!(
                !path.exists(),
                "{}: is there, but no {ABOUT} that says what it is; choose another directory",
                path.display()
            );
            about.save(dir)?;
        }
        let mut options = OpenOptions::new();
        let file = options.create(true).append(true).read(true).open(&path);
        let file = file.with_context(|| path.display().to_string())?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                bail!("{}: another sweep is writing it", path.display())
            }
            Err(TryLockError::Error(error)) => {
                Err(error).with_context(|| path.display().to_string())?
            }
        }
        let mut results = Self {
            shard: about.shard(),
            finished: 0,
            torn: false,
            file,
            path,
        };
        results.count(columns)?;
        Ok(results)
    }

    /// Counts the rows, checks that they are the first ones of the shard, and drops half a row at the end.
    fn count(&mut self, columns: &[Column]) -> anyhow::Result<()> {
        let header: Vec<_> = columns.iter().map(|column| column.name.as_str()).collect();
        let header = header.join(",");
        let mut reader = BufReader::new(&self.file);
        let (mut line, mut number, mut good) = (String::new(), 0u64, 0u64);
        loop {
            line.clear();
            let length = reader
                .read_line(&mut line)
                .with_context(|| format!("{}: line {}", self.path.display(), number + 1))?;
            if !line.ends_with('\n') {
                self.torn = length > 0;
                break;
            }
            let place = || format!("{}: line {}", self.path.display(), number + 1);
            if number == 0 {
                ensure!(line.trim_end() == header, "{}: must be {header}", place());
            } else {
                let expected = self.shard.run(number - 1);
                let fields = line.trim_end().split(',').count();
                ensure!(
                    line.split(',').next() == Some(&expected.to_string())
                        && fields == columns.len(),
                    "{}: must be run {expected} with {} fields; remove this line and what follows, and the sweep goes on from there",
                    place(),
                    columns.len()
                );
            }
            number += 1;
            good += length as u64;
        }
        let context = || self.path.display().to_string();
        self.file.set_len(good).with_context(context)?;
        if number == 0 {
            self.file
                .write_all(format!("{header}\n").as_bytes())
                .with_context(context)?;
        }
        self.finished = number.saturating_sub(1);
        Ok(())
    }

    /// Appends finished rows.
    ///
    /// # Errors
    /// If the rows cannot be written.
    pub fn append(&mut self, rows: &[Vec<String>]) -> anyhow::Result<()> {
        let text: String = rows.iter().map(|row| row.join(",") + "\n").collect();
        self.file
            .write_all(text.as_bytes())
            .and_then(|()| self.file.sync_data())
            .with_context(|| format!("{}: cannot write", self.path.display()))?;
        self.finished += rows.len() as u64;
        Ok(())
    }
}

/// Merges the finished parts of a sweep into `dir`, row by row.
///
/// # Errors
/// If the parts are not all parts of one sweep, each once and finished; or a file cannot be read or written.
pub fn merge(parts: &[PathBuf], dir: &Path) -> anyhow::Result<Vec<Column>> {
    let mut abouts = Vec::new();
    for part in parts {
        abouts.push((About::load(part)?, part));
    }
    abouts.sort_by_key(|(about, _)| about.shard);
    let (first, first_dir) = abouts.first().context("nothing to merge")?;
    let (whole, spec) = (first.whole(), first.spec()?);
    for (about, part) in &abouts {
        ensure!(
            about.whole() == whole && about.shards == first.shards,
            "{} and {}: not parts of one sweep",
            first_dir.display(),
            part.display()
        );
    }
    for index in 1..=first.shards {
        let count = abouts
            .iter()
            .filter(|(about, _)| about.shard == index)
            .count();
        ensure!(
            count == 1,
            "part {index}/{}: must be there once, and is there {count} times",
            first.shards
        );
    }
    let columns = columns(&spec);
    let mut readers = Vec::new();
    for (about, part) in &abouts {
        let results = Results::open(part, about, &columns)?;
        let all = about.shard().len(spec.runs);
        ensure!(
            results.finished == all,
            "{}: {} of its {all} runs are there; run its sweep again to finish it",
            part.display(),
            results.finished
        );
        let file = File::open(part.join(CSV)).with_context(|| part.display().to_string())?;
        let mut lines = BufReader::new(file).lines();
        let header = lines.next().context("an empty file")??;
        readers.push((header, lines));
    }
    ensure!(
        !dir.join(ABOUT).exists() || About::load(dir)? == whole,
        "{}: holds another sweep; choose another directory",
        dir.display()
    );
    whole.save(dir)?;
    join(&mut readers, spec.runs, dir)
        .with_context(|| format!("{}: cannot write", dir.join(CSV).display()))?;
    Ok(columns)
}

/// Run number n stands in part n modulo their number.
fn join(parts: &mut [(String, Lines)], runs: u64, dir: &Path) -> anyhow::Result<()> {
    let part = dir.join(format!(".{CSV}.part"));
    let mut out = BufWriter::new(File::create(&part)?);
    writeln!(out, "{}", parts[0].0)?;
    let count = parts.len() as u64;
    for run in 0..runs {
        let (_, lines) = &mut parts[(run % count) as usize];
        let line = lines.next().context("a part has shrunk")??;
        writeln!(out, "{line}")?;
    }
    out.flush()?;
    Ok(std::fs::rename(&part, dir.join(CSV))?)
}

type Lines = std::io::Lines<BufReader<File>>;

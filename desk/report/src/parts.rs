//! Finds the parts of a study in their common directory, and says which are missing.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use serde_json::{Map, Value};

use crate::files;
use crate::provenance::Build;
use crate::shard::{Shard, ranges};

/// What decides the results of a part, beside its number: the fields of a JSON object.
pub type About = Map<String, Value>;

/// Reads what a part, or the whole, says of itself; none if it has not begun.
///
/// # Errors
/// If the file is there, but cannot be read or holds something else.
pub fn load(dir: &Path, name: &str) -> anyhow::Result<Option<About>> {
    let path = dir.join(name);
    if !path.exists() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let about = serde_json::from_str(&text);
    let about = about.with_context(|| format!("{}: not what a study writes", path.display()))?;
    Ok(Some(about))
}

/// Writes it to a directory.
///
/// # Errors
/// If the file cannot be written.
pub fn save(dir: &Path, name: &str, about: &About) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(about)? + "\n";
    files::write(dir, name, text.as_bytes())
}

/// In what something differs from what it should be, in words; empty if it does not.
pub fn differences(about: &About, wanted: &About) -> String {
    let short = |value: Option<&Value>| match value {
        Some(Value::String(text)) if text.contains('\n') => "another".into(),
        Some(value) => value.to_string(),
        None => "none".into(),
    };
    let names = wanted
        .keys()
        .chain(about.keys().filter(|name| !wanted.contains_key(*name)));
    let different = names.filter(|name| about.get(*name) != wanted.get(*name));
    let different = different.map(|name| {
        let [is, should] = [about, wanted].map(|map| short(map.get(name)));
        match is == should {
            true => format!("{name} differs"),
            false => format!("{name} is {is}, not {should}"),
        }
    });
    different.collect::<Vec<_>>().join("; ")
}

/// Claims `dir` for results that are `about` this, or finds that it holds them already.
///
/// # Errors
/// If it holds others, or the file cannot be read or written.
pub fn claim(dir: &Path, name: &str, results: &str, about: &About) -> anyhow::Result<()> {
    if let Some(found) = load(dir, name)? {
        let differences = differences(&found, about);
        ensure!(
            differences.is_empty(),
            "{}: holds results of another study: its {differences}; choose another directory",
            dir.join(name).display()
        );
        return Ok(());
    }
    ensure!(
        !dir.join(results).exists(),
        "{}: is there, but no {name} that says what it is; choose another directory",
        dir.join(results).display()
    );
    save(dir, name, about)
}

/// What keeps parts from being joined.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Problems {
    /// Parts that are to be run: those that are missing, and those that have not come to their end.
    pub to_run: Vec<u64>,
    /// Whether there are parts of something else.
    pub foreign: bool,
    /// Every part that is missing, unfinished or of something else, in words.
    pub lines: Vec<String>,
}

impl Problems {
    /// The parts that are to be run, as `sbatch --array=` takes them.
    pub fn array(&self) -> String {
        ranges(&self.to_run)
    }
}

/// All parts of a study.
#[derive(Debug, Clone)]
pub struct Parts {
    /// What they say of themselves, but for their number.
    pub about: About,
    /// Their folders, in the order of their numbers; empty if something keeps them from being joined.
    pub folders: Vec<PathBuf>,
    /// What keeps them from being joined.
    pub problems: Problems,
}

struct Part {
    shard: Shard,
    folder: PathBuf,
    /// None if it has not begun.
    about: Option<About>,
}

/// Looks for all parts below `dir`. What a part says of itself is in its file `name`; `unfinished` says of one that
/// belongs to the others what it lacks, if it lacks something. Most of the parts decide what the study is.
///
/// # Errors
/// If there is no part at all, they are of another build than this program, or a file cannot be read.
pub fn find(
    dir: &Path,
    name: &str,
    build: Build,
    unfinished: impl Fn(&Path, &About) -> anyhow::Result<Option<String>>,
) -> anyhow::Result<Parts> {
    let mut parts = Vec::new();
    for entry in fs::read_dir(dir).with_context(|| dir.display().to_string())? {
        let folder = entry.with_context(|| dir.display().to_string())?.path();
        if let Some(shard) = Shard::of_folder(&folder) {
            let about = load(&folder, name)?;
            parts.push(Part {
                shard,
                folder,
                about,
            });
        }
    }
    parts.sort_by_key(|part| part.shard);
    let (of, about) = most_common(&parts).with_context(|| {
        format!(
            "{}: no part-I-of-N with a {name}; --shard I/N writes them",
            dir.display()
        )
    })?;
    same_build(dir, &about, build)?;
    let mut found = Parts {
        about,
        folders: Vec::new(),
        problems: Problems::default(),
    };
    let problems = &mut found.problems;
    for part in parts.iter().filter(|part| part.shard.of != of) {
        problems.foreign = true;
        let folder = part.folder.display();
        problems.lines.push(format!(
            "{folder}: foreign: one of {} parts, not of {of}",
            part.shard.of
        ));
    }
    for index in 1..=of {
        let shard = Shard { index, of };
        let folder = shard.folder(dir);
        let there = parts.iter().find(|part| part.shard == shard);
        let lacks = match there {
            None => Some("missing".into()),
            Some(Part { about: None, .. }) => Some("unfinished: it has only begun".into()),
            Some(Part {
                about: Some(about), ..
            }) => {
                let differences = differences(&without_shard(about), &found.about);
                if !differences.is_empty() {
                    problems.foreign = true;
                    let folder = folder.display();
                    problems
                        .lines
                        .push(format!("{folder}: foreign: {differences}"));
                    continue;
                }
                unfinished(&folder, about)?.map(|lacks| format!("unfinished: {lacks}"))
            }
        };
        match lacks {
            None => found.folders.push(folder),
            Some(lacks) => {
                problems.to_run.push(index);
                problems
                    .lines
                    .push(format!("{}: {lacks}", folder.display()));
            }
        }
    }
    Ok(found)
}

/// Refuses parts that another build has run.
fn same_build(dir: &Path, about: &About, build: Build) -> anyhow::Result<()> {
    for (field, this) in [("version", build.version), ("commit", build.commit)] {
        let theirs = about.get(field).and_then(Value::as_str).unwrap_or("none");
        ensure!(
            theirs == this,
            "{}: parts of another build: their {field} is {theirs}, and this command's is {this}; merge with the one that ran them",
            dir.display()
        );
    }
    Ok(())
}

fn without_shard(about: &About) -> About {
    let mut about = about.clone();
    about.shift_remove("shard");
    about.shift_remove("shards");
    about
}

/// The number of parts and the description that most parts share; the first of those that are equally frequent.
fn most_common(parts: &[Part]) -> Option<(u64, About)> {
    let mut counts: Vec<((u64, About), usize)> = Vec::new();
    for part in parts {
        let Some(about) = &part.about else { continue };
        let kind = (part.shard.of, without_shard(about));
        match counts.iter_mut().find(|(other, _)| *other == kind) {
            Some((_, count)) => *count += 1,
            None => counts.push((kind, 1)),
        }
    }
    let most = counts.iter().map(|(_, count)| *count).max()?;
    counts
        .into_iter()
        .find(|(_, count)| *count == most)
        .map(|(kind, _)| kind)
}

//! Parts of a study, for several machines.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};

/// Every `of`-th unit of work from number `index` on, both counted from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Number of parts.
    #[serde(rename = "shards")]
    pub of: u64,
    /// Number of this part, from 1.
    #[serde(rename = "shard")]
    pub index: u64,
}

impl Shard {
    /// The whole as one part.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// How many of so many units belong to the part.
    pub fn len(self, units: u64) -> u64 {
        (units + self.of - self.index) / self.of
    }

    /// Number of the part's `n`-th unit, both from zero.
    pub fn unit(self, n: u64) -> u64 {
        n * self.of + self.index - 1
    }

    /// The part's own folder in the directory of all parts.
    pub fn folder(self, dir: &Path) -> PathBuf {
        let width = self.of.to_string().len();
        dir.join(format!("part-{:0width$}-of-{}", self.index, self.of))
    }

    /// The part that a folder's name says; none if it is not the name of a part's folder.
    pub fn of_folder(folder: &Path) -> Option<Self> {
        let name = folder.file_name()?.to_str()?;
        let (index, of) = name.strip_prefix("part-")?.split_once("-of-")?;
        let shard: Self = format!("{index}/{of}").parse().ok()?;
        (shard.folder(folder.parent()?) == folder).then_some(shard)
    }
}

impl std::str::FromStr for Shard {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (index, of) = text
            .split_once('/')
            .context("must be i/n, such as 1/4 for the first of four parts")?;
        let shard = Self {
            index: index.parse().context("must be two whole numbers, i/n")?,
            of: of.parse().context("must be two whole numbers, i/n")?,
        };
        ensure!(
            (1..=shard.of).contains(&shard.index) && shard.of <= 100_000,
            "must lie within 1/n and n/n, and n must be at most 100000"
        );
        Ok(shard)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// Numbers in the form that `sbatch --array=` takes, such as `2,7-9`. They must be sorted.
pub fn ranges(numbers: &[u64]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let runs = runs.map(|run| match run {
        [only] => only.to_string(),
        run => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_belongs_to_one_part() {
        for of in 1..=7 {
            let mut units: Vec<u64> = (1..=of)
                .map(|index| Shard { index, of })
                .flat_map(|shard| (0..shard.len(23)).map(move |n| shard.unit(n)))
                .collect();
            units.sort();
            assert_eq!(units, (0..23).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_folder_says_which_part_it_is() {
        let shard = Shard { index: 7, of: 120 };
        let folder = shard.folder(Path::new("out"));
        assert_eq!(folder, Path::new("out/part-007-of-120"));
        assert_eq!(Shard::of_folder(&folder), Some(shard));
        for other in [
            "out",
            "out/part-7-of-120",
            "out/part-1-of-0",
            "out/part-121-of-120",
        ] {
            assert_eq!(Shard::of_folder(Path::new(other)), None, "{other}");
        }
    }

    #[test]
    fn ranges_are_those_of_an_array_job() {
        assert_eq!(ranges(&[2, 7, 8, 9]), "2,7-9");
        assert_eq!(ranges(&[1, 2, 4]), "1-2,4");
        assert_eq!(ranges(&[]), "");
    }
}

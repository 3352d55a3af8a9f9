//! Parts of a sweep, for several machines.

use anyhow::{Context, ensure};

/// Every `of`-th run from number `index` on, both counted from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of this part, from 1.
    pub index: u64,
    /// Number of parts.
    pub of: u64,
}

impl Shard {
    /// The whole sweep as one part.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Runs of a sweep of so many runs that belong to the shard.
    pub fn len(self, runs: u64) -> u64 {
        (runs + self.of - self.index) / self.of
    }

    /// Number of the shard's `n`-th run.
    pub fn run(self, n: u64) -> u64 {
        n * self.of + self.index - 1
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

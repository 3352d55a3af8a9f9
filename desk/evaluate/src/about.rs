//! What was evaluated, and with what: the same for all parts of an evaluation.

use report::parts;
use report::provenance::Provenance;
use report::shard::Shard;
use serde::{Deserialize, Serialize};

use crate::options::Options;

/// All that decides the results, in the first fields of `evaluation.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Program, finger and settings.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Seed of the fingers' tolerances; 0 where all are the recipe's.
    pub finger_seed: u64,
    /// Seed of all other random numbers.
    pub seed: u64,
    /// Number of true losses for each class of calibration.
    pub losses: usize,
    /// Hours of operation at each level of noise; fewer at the highest.
    pub hours: f64,
}

impl About {
    /// Of an evaluation with these options.
    pub fn new(options: &Options, provenance: Provenance, finger_seed: u64) -> Self {
        Self {
            provenance,
            finger_seed,
            seed: options.seed,
            losses: options.losses,
            hours: options.hours,
        }
    }

    /// What a part says of itself.
    ///
    /// # Errors
    /// None with finite hours.
    pub fn of_part(&self, shard: Shard) -> anyhow::Result<parts::About> {
        #[derive(Serialize)]
        struct Part<'a> {
            #[serde(flatten)]
            about: &'a About,
            #[serde(flatten)]
            shard: Shard,
        }
        let text = serde_json::to_string(&Part { about: self, shard })?;
        Ok(serde_json::from_str(&text)?)
    }
}

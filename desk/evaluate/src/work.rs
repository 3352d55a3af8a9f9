//! The units of an evaluation, each with a random stream of its own, and the work of doing them.

use anyhow::ensure;
use rayon::prelude::*;
use report::shard::Shard;
use serde::{Deserialize, Serialize};
use sim::setup::Setup;

use crate::alarms::{self, Stretch};
use crate::case::{KNOWLEDGE, Knowledge};
use crate::finding::Finding;
use crate::latency;
use crate::options::Options;
use crate::tally::Tally;

/// Cases of a batch.
const BATCH: u64 = 16;
/// Units of work for each thread before their results are written: enough that few threads wait for the last one.
const PER_THREAD: usize = 4;

/// A unit of work that is done. Numbers count from 0 over all parts.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Operation without a loss.
    Stretch {
        /// Place among [`alarms::stretches`].
        number: u64,
        /// The false reports in it.
        tally: Box<Tally>,
    },
    /// A batch of cases.
    Batch {
        /// Class of calibration.
        knowledge: Knowledge,
        /// Number of the batch within the class.
        number: u64,
        /// The cases in their order.
        cases: Vec<Finding>,
    },
    /// No unit is left.
    End,
}

/// What a part has done.
#[derive(Debug, Clone)]
pub struct Standing {
    shard: Shard,
    stretches: u64,
    /// Batches of each class of calibration, and the losses in them.
    batches: [(u64, usize); KNOWLEDGE.len()],
    /// Whether it has come to its end.
    pub ended: bool,
}

impl Standing {
    /// Nothing done.
    pub fn new(shard: Shard) -> Self {
        Self {
            shard,
            stretches: 0,
            batches: Default::default(),
            ended: false,
        }
    }

    /// Takes a unit that is done.
    ///
    /// # Errors
    /// If another one comes next.
    pub fn take(&mut self, unit: &Unit) -> anyhow::Result<()> {
        ensure!(!self.ended, "must not be there: the part has ended before");
        match unit {
            Unit::Stretch { number, .. } => {
                let next = self.shard.unit(self.stretches);
                ensure!(*number == next, "must be stretch {next}, and is {number}");
                self.stretches += 1;
            }
            Unit::Batch {
                knowledge,
                number,
                cases,
            } => {
                let (batches, losses) = &mut self.batches[*knowledge as usize];
                let next = self.shard.unit(*batches);
                ensure!(*number == next, "must be batch {next}, and is {number}");
                *batches += 1;
                *losses += cases.iter().filter(|case| case.is_loss()).count();
            }
            Unit::End => self.ended = true,
        }
        Ok(())
    }

    /// Whether the batches before this part's next one certainly have the losses that are wanted.
    ///
    /// The part knows its own batches only. The others have as many losses per batch but for chance: by Hoeffding's
    /// inequality, the extrapolation is too great by [`CERTAINTY`] deviations with a chance below
    /// exp(−6²/2) = 1.5e-8, as the variance of a case is 1/4 at most. The whole as one part knows all of them, and
    /// stops exactly.
    fn has_enough(&self, knowledge: Knowledge, wanted: usize) -> bool {
        let (batches, losses) = self.batches[knowledge as usize];
        if batches == 0 {
            return wanted == 0;
        }
        let next = self.shard.unit(batches) as f64;
        let own = batches as f64;
        let extrapolated = losses as f64 * next / own;
        let variance = 0.25 * BATCH as f64 * (next - own) * next / own;
        extrapolated - CERTAINTY * variance.max(0.0).sqrt() >= wanted as f64
    }
}

/// Deviations below the extrapolated number of losses at which there are certainly enough.
const CERTAINTY: f64 = 6.0;

/// Does what is left of a part, in parallel; the units do not depend on how many threads there are. `sink` gets them
/// in their order, some at a time; `done` is told how many more losses and seconds are done.
///
/// # Errors
/// If a case cannot be simulated, a recording cannot be read or written, or `sink` fails.
pub fn run(
    base: &Setup,
    options: &Options,
    standing: &mut Standing,
    sink: &mut dyn FnMut(Vec<Unit>) -> anyhow::Result<()>,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<()> {
    let mut take = |standing: &mut Standing, units: Vec<Unit>| {
        units.iter().try_for_each(|unit| standing.take(unit))?;
        sink(units)
    };
    let at_once = PER_THREAD * rayon::current_num_threads();
    let shard = standing.shard;
    let all = alarms::stretches(&alarms::groups(options.hours));
    let own = shard.len(all.len() as u64);
    let left: Vec<u64> = (standing.stretches..own).map(|n| shard.unit(n)).collect();
    if !left.is_empty() {
        let models = alarms::models(base)?;
        for numbers in left.chunks(at_once) {
            let units = numbers.par_iter().map(|&number| {
                let stretch: &Stretch = &all[number as usize];
                let tally = Box::new(stretch.count(base, options, &models)?);
                done(stretch.seconds());
                Ok(Unit::Stretch { number, tally })
            });
            take(standing, units.collect::<anyhow::Result<_>>()?)?;
        }
    }
    let batches_at_once = at_once.div_ceil(BATCH as usize) as u64;
    for knowledge in KNOWLEDGE {
        while !standing.has_enough(knowledge, options.losses) {
            let (from, _) = standing.batches[knowledge as usize];
            let numbers: Vec<u64> = (from..from + batches_at_once)
                .map(|n| shard.unit(n))
                .collect();
            let cases = numbers.par_iter().flat_map(|&number| {
                let indices = number * BATCH..(number + 1) * BATCH;
                indices.into_par_iter().map(|index| {
                    let finding = latency::finding(base, options, knowledge, index)?;
                    done(finding.is_loss().into());
                    Ok(finding)
                })
            });
            let mut cases = cases.collect::<anyhow::Result<Vec<_>>>()?.into_iter();
            let units = numbers.iter().map(|&number| Unit::Batch {
                knowledge,
                number,
                cases: cases.by_ref().take(BATCH as usize).collect(),
            });
            take(standing, units.collect())?;
        }
    }
    take(standing, vec![Unit::End])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part that has found so many losses in so many batches.
    fn standing(index: u64, of: u64, batches: u64, losses: usize) -> Standing {
        let mut standing = Standing::new(Shard { index, of });
        standing.batches[0] = (batches, losses);
        standing
    }

    #[test]
    fn the_whole_stops_with_the_batch_that_brings_the_last_loss() {
        let enough = |losses| standing(1, 1, 10, losses).has_enough(KNOWLEDGE[0], 100);
        assert!(enough(100) && !enough(99));
        assert!(standing(1, 1, 0, 0).has_enough(KNOWLEDGE[0], 0));
        assert!(!standing(1, 1, 0, 0).has_enough(KNOWLEDGE[0], 1));
    }

    #[test]
    fn a_part_stops_only_where_the_others_cannot_lack_a_loss() {
        // Half of the 16 cases of each batch: 8 × 64 losses before batch 64, with a deviation of
        // √(4 × 48 × 64 / 16) = 27.7 in those of the other three parts.
        let enough = |wanted| standing(1, 4, 16, 128).has_enough(KNOWLEDGE[0], wanted);
        assert!(enough(512 - 167) && !enough(512 - 166));
    }
}

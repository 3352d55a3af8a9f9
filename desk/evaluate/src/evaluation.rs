//! The whole evaluation: losses, false alarms and operating curves.

use std::io::Write;

use anyhow::ensure;
use report::shard::Shard;
use sim::setup::Setup;
use softgrip::table::{self, ObjectKind};

use crate::about::About;
use crate::alarms::{self, Group, Stretch};
use crate::case::{KNOWLEDGE, Knowledge};
use crate::finding::Finding;
use crate::options::{NOISE_UE, Options};
use crate::roc::{self, Contest};
use crate::sample::Sample;
use crate::tally::Tally;
use crate::work::{self, Standing, Unit};

/// The raw results of an evaluation.
pub struct Evaluation {
    /// Random losses, at every level of noise.
    pub sample: Sample,
    /// False reports in operation without losses, one tally per level of noise.
    pub tallies: Vec<Tally>,
}

/// Losses and seconds that a part reports as done; of the losses this is about its share.
pub fn steps(options: &Options, shard: Shard) -> u64 {
    let groups = alarms::groups(options.hours);
    let hours: f64 = groups.iter().map(|group| group.hours).sum();
    (KNOWLEDGE.len() as u64 * options.losses as u64 + (3600.0 * hours) as u64) / shard.of
}

/// The highest pressure of the cases, kPa.
const HIGHEST_KPA: f32 = 160.0;

/// Refuses fingers that cannot grip as hard as the cases ask for, or of which nobody knows what they lift, and settings
/// that the cases do not respect.
///
/// # Errors
/// If the table gives no lift up to the highest pressure of the cases; the message names the pressure
/// up to which it does. If a setting allows less, or asks for a robot that speaks.
pub fn check(base: &Setup) -> anyhow::Result<()> {
    for kind in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let known = table::lift_known_to(base.table(), kind).map_or(0.0, |kpa| kpa.0);
        ensure!(
            known >= HIGHEST_KPA,
            "evaluate grips at 100 to {HIGHEST_KPA} kPa: the recipe {} tells the lift up to {known} kPa only",
            base.table().recipe
        );
    }
    let settings = base.settings();
    let most = settings.regulator.max_pressure_kpa;
    ensure!(
        most >= HIGHEST_KPA,
        "evaluate grips at 100 to {HIGHEST_KPA} kPa: the setting regulator.max_pressure_kpa is {most}"
    );
    ensure!(
        settings.grip.host_timeout_ms == 0.0,
        "the robot of evaluate says nothing while it moves: the setting grip.host_timeout_ms must be 0"
    );
    Ok(())
}

/// Measures everything, in parallel; the result does not depend on how many threads there are. The rows of the table
/// of losses go to `rows`; `done` is told how many more of [`steps`] are done.
///
/// # Errors
/// If a case cannot be simulated, a recording cannot be read or written, or `rows` cannot be written.
pub fn run(
    base: &Setup,
    options: &Options,
    about: &About,
    rows: &mut dyn Write,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Evaluation> {
    let mut collector = Collector::new(about, options.slowest);
    let mut standing = Standing::new(Shard::WHOLE);
    let mut sink = |units: Vec<Unit>| {
        let mut units = units.into_iter();
        units.try_for_each(|unit| collector.take(unit, rows))
    };
    work::run(base, options, &mut standing, &mut sink, done)?;
    Ok(collector.finish())
}

/// Sums up units of work in their order: first all stretches, then the batches of one class of calibration after
/// the other.
pub struct Collector {
    stretches: Vec<Stretch>,
    /// One per group.
    tallies: Vec<Tally>,
    /// From the first batch on, because the rules' thresholds follow from the stretches.
    sample: Option<Sample>,
    wanted: usize,
    losses: [usize; KNOWLEDGE.len()],
    slowest: usize,
}

impl Collector {
    /// Nothing yet, with so many of the slowest reports to be kept.
    pub fn new(about: &About, slowest: usize) -> Self {
        let groups = alarms::groups(about.hours);
        let none = |group: &Group| Tally::none(group.noise_ue);
        Self {
            stretches: alarms::stretches(&groups),
            tallies: groups.iter().map(none).collect(),
            sample: None,
            wanted: about.losses,
            losses: Default::default(),
            slowest,
        }
    }

    /// Number of all stretches.
    pub fn stretches(&self) -> u64 {
        self.stretches.len() as u64
    }

    /// Whether all losses of a class of calibration are there.
    pub fn has_enough(&self, knowledge: Knowledge) -> bool {
        self.losses[knowledge as usize] >= self.wanted
    }

    /// Takes the next unit. Cases after the last loss that is wanted do not count.
    ///
    /// # Errors
    /// If `rows` cannot be written.
    pub fn take(&mut self, unit: Unit, rows: &mut dyn Write) -> anyhow::Result<()> {
        match unit {
            Unit::Stretch { number, tally } => {
                let group = self.stretches[number as usize].group;
                self.tallies[group].add(*tally);
            }
            Unit::Batch {
                knowledge, cases, ..
            } => {
                for case in cases {
                    if !self.has_enough(knowledge) {
                        self.add(knowledge, case, rows)?;
                    }
                }
            }
            Unit::End => {}
        }
        Ok(())
    }

    fn add(
        &mut self,
        knowledge: Knowledge,
        case: Finding,
        rows: &mut dyn Write,
    ) -> std::io::Result<()> {
        self.losses[knowledge as usize] += usize::from(case.is_loss());
        let (tallies, slowest) = (&self.tallies, self.slowest);
        let sample = self.sample.get_or_insert_with(|| empty(tallies, slowest));
        sample.add(knowledge, case, rows)
    }

    /// The results.
    pub fn finish(mut self) -> Evaluation {
        let sample = self.sample.take();
        let sample = sample.unwrap_or_else(|| empty(&self.tallies, self.slowest));
        self.tallies.truncate(NOISE_UE.len());
        Evaluation {
            sample,
            tallies: self.tallies,
        }
    }
}

/// A sample without a case yet.
fn empty(tallies: &[Tally], slowest: usize) -> Sample {
    let (usual, swept) = tallies.split_at(NOISE_UE.len());
    Sample::new(Contest::new(&usual[roc::NOISE], swept), slowest)
}

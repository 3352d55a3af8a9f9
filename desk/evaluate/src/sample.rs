//! The random losses, counted one case after the other.

use std::io::Write;

use sim::scenario::ObjectKind;

use crate::case::{KNOWLEDGE, Knowledge, ORIGINS, Origin};
use crate::finding::{Finding, Response, Slide};
use crate::options::NOISE_UE;
use crate::roc::Contest;
use crate::statistics::Histogram;
use crate::trial::Classification;

/// A slip must be warned of before the object has moved this far, mm.
pub const WARN_MM: f64 = 15.0;

/// Errors that are kept in words. More than these nobody reads, and losses.csv has every loss.
const KEPT: usize = 1_000;

/// How the trials of one level of noise, one origin and one class of calibration count.
#[derive(Debug, Clone, Default)]
pub struct Counts {
    /// True losses.
    pub losses: usize,
    /// Latency of those that were reported, ms.
    pub reported_ms: Histogram,
    /// Reported before the onset.
    pub early: usize,
    /// Losses that were not reported in time.
    pub missed: usize,
    /// Reported as something else.
    pub misnamed: usize,
    /// Grips that were not recognised before the lift.
    pub not_recognised: usize,
    /// Runs in which nothing was lost.
    pub held: usize,
    /// Of these, runs in which the object was displaced.
    pub displaced: usize,
    /// Of these, runs in which a loss was reported.
    pub displaced_reported: usize,
    /// Reports of a loss that did not happen.
    pub false_alarms: usize,
}

/// Slides before the report, of one kind of object, one origin and one level of noise.
#[derive(Debug, Clone, Default)]
pub struct Slides {
    /// Time from the start of the slide to the report, ms.
    pub lost_ms: Histogram,
    /// Displacement at the report, mm.
    pub lost_mm: Histogram,
    /// Displacement at the warning of a slip, mm, where there was one.
    pub warned_mm: Histogram,
    /// Warnings before the object had moved [`WARN_MM`].
    pub warned_in_time: usize,
}

/// Everything that is known of the random losses. Its size does not depend on how many they are.
#[derive(Debug, Clone)]
pub struct Sample {
    /// By noise, origin and class of calibration.
    counts: [[[Counts; KNOWLEDGE.len()]; ORIGINS.len()]; NOISE_UE.len()],
    /// By kind of object, origin and noise.
    slides: [[[Slides; NOISE_UE.len()]; ORIGINS.len()]; ObjectKind::ALL.len()],
    /// The first errors, one line each.
    wrong: Vec<String>,
    more_wrong: usize,
    /// The slowest reports at each level of noise, slowest first.
    slowest: [Vec<(f64, String)>; NOISE_UE.len()],
    slowest_kept: usize,
    contest: Contest,
}

impl Sample {
    /// Nothing yet, with so many of the slowest reports to be kept.
    pub fn new(contest: Contest, slowest_kept: usize) -> Self {
        Self {
            counts: Default::default(),
            slides: Default::default(),
            wrong: Vec::new(),
            more_wrong: 0,
            slowest: Default::default(),
            slowest_kept,
            contest,
        }
    }

    /// Adds one case. Its rows of the table of losses go to `rows`.
    ///
    /// # Errors
    /// If `rows` cannot be written.
    pub fn add(
        &mut self,
        knowledge: Knowledge,
        finding: Finding,
        rows: &mut dyn Write,
    ) -> std::io::Result<()> {
        let is_loss = finding.is_loss();
        let origin = finding.origin as usize;
        for (noise, trial) in finding.trials.into_iter().enumerate() {
            let counts = &mut self.counts[noise][origin][knowledge as usize];
            counts.add(&trial, is_loss);
            if let Some(slide) = trial.slide {
                self.slides[finding.object as usize][origin][noise].add(slide);
            }
            if let Some(row) = trial.row {
                rows.write_all(row.as_bytes())?;
            }
            if let Some(line) = trial.line {
                self.keep(noise, trial.classification, line);
            }
        }
        if let Some(race) = finding.race {
            self.contest.add(&race);
        }
        Ok(())
    }

    fn keep(&mut self, noise: usize, classification: Classification, line: String) {
        match classification {
            Classification::Reported(ms) => {
                let slowest = &mut self.slowest[noise];
                let place = slowest.partition_point(|(slower_ms, _)| *slower_ms >= ms);
                slowest.insert(place, (ms, line));
                slowest.truncate(self.slowest_kept);
            }
            other if !other.is_wrong() => {}
            _ if self.wrong.len() < KEPT => self.wrong.push(line),
            _ => self.more_wrong += 1,
        }
    }

    /// The counts at one of [`NOISE_UE`].
    pub fn counts(&self, noise: usize, origin: Origin, knowledge: Knowledge) -> &Counts {
        &self.counts[noise][origin as usize][knowledge as usize]
    }

    /// The slides at one of [`NOISE_UE`].
    pub fn slides(&self, object: ObjectKind, origin: Origin, noise: usize) -> &Slides {
        &self.slides[object as usize][origin as usize][noise]
    }

    /// Losses at one of [`NOISE_UE`], and the latencies of those that were reported, ms.
    pub fn reported_ms(&self, noise: usize) -> (usize, Histogram) {
        let mut all = (0, Histogram::default());
        for counts in self.counts[noise].iter().flatten() {
            all.0 += counts.losses;
            all.1.join(&counts.reported_ms);
        }
        all
    }

    /// The controller and the rules of others on these losses.
    pub fn contest(&self) -> &Contest {
        &self.contest
    }

    /// The errors, with the parameters that repeat each run, one line each.
    pub fn wrong(&self) -> String {
        let mut text: String = self
            .wrong
            .iter()
            .map(|line| line.to_string() + "\n")
            .collect();
        if self.more_wrong > 0 {
            text += &format!("and {} more\n", self.more_wrong);
        }
        text
    }

    /// The slowest reports at each level of noise, one line each.
    pub fn slowest(&self) -> String {
        let lines = self.slowest.iter().flatten();
        lines.map(|(_, line)| line.to_string() + "\n").collect()
    }
}

impl Counts {
    /// Adds a trial.
    pub fn add(&mut self, trial: &Response, is_loss: bool) {
        let kind = match is_loss {
            true => &mut self.losses,
            false => &mut self.held,
        };
        *kind += 1;
        match trial.classification {
            Classification::Quiet => {}
            Classification::Reported(ms) => {
                self.reported_ms.add(ms);
                self.early += usize::from(ms < 0.0);
            }
            Classification::Missed => self.missed += 1,
            Classification::FalseAlarm => self.false_alarms += 1,
            Classification::NotRecognised => self.not_recognised += 1,
            Classification::Misnamed => self.misnamed += 1,
            Classification::Displaced => {
                self.displaced += 1;
                self.displaced_reported += usize::from(trial.said_lost);
            }
        }
    }
}

impl Slides {
    fn add(&mut self, slide: Slide) {
        self.lost_ms.add(slide.lost_ms);
        self.lost_mm.add(slide.lost_mm);
        if let Some(mm) = slide.warned_mm {
            self.warned_mm.add(mm);
            self.warned_in_time += usize::from(mm < WARN_MM);
        }
    }
}

//! Operating curves, latency over false-alarm rate: the controller at other evidence limits, and the
//! published rules at other thresholds, on the same traces.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use sim::setup::Setup;
use softgrip::TICK_US;
use softgrip::settings::Settings;

use crate::baselines::{Baseline, Baselines, Envelope, RULES};
use crate::case::Case;
use crate::options;
use crate::record::{ObjectOutcome, Recording};
use crate::statistics::Histogram;
use crate::tally::Tally;
use crate::trial::{self, Classification, UNMOVED_MM};

/// Place of the comparison's noise among [`options::NOISE_UE`].
pub const NOISE: usize = 1;
/// The noise there, µε.
pub const NOISE_UE: f64 = options::NOISE_UE[NOISE];
/// Factors on the controller's evidence limit, for its own curve.
pub const EVIDENCE: [f32; 9] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 2.0, 4.0];
/// Fraction of the hours that each point of the controller's curve gets.
pub const SWEEP_SHARE: f64 = 0.05;

/// One loss as seen by the controller and by every rule.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Race {
    onset: usize,
    envelopes: [Envelope; RULES],
    /// Latency of the controller at each of [`EVIDENCE`], ms.
    controller_ms: [Option<f64>; EVIDENCE.len()],
}

/// The settings with the evidence limit multiplied by `factor`.
pub fn with_evidence(settings: &Settings, factor: f32) -> Settings {
    let mut settings = *settings;
    let evidence = &mut settings.detection.loss_evidence_percent_ms;
    *evidence = (factor * *evidence).max(1.0);
    settings
}

impl Race {
    /// Runs the controller and all rules on a recording; none if nothing is lost in it.
    ///
    /// # Errors
    /// If the settings are not valid for the case's fingers.
    pub fn run(
        case: &Case,
        recording: &Recording,
        settings: &Settings,
        base: &Setup,
    ) -> anyhow::Result<Option<Self>> {
        let ObjectOutcome::Lost { onset } = recording.outcome() else {
            return Ok(None);
        };
        let mut controller_ms = [None; EVIDENCE.len()];
        for (ms, factor) in controller_ms.iter_mut().zip(EVIDENCE) {
            let settings = with_evidence(settings, factor);
            let trial = trial::judge(case, recording, NOISE_UE, &settings, base)?;
            *ms = match trial.classification() {
                Classification::Reported(ms) => Some(ms),
                _ => None,
            };
        }
        let controller = case.controller(base.table(), settings)?;
        let mut baselines = Baselines::default();
        let mut envelopes: [Envelope; RULES] = Default::default();
        let mut armed = false;
        let mut moved = false;
        recording.replay(case, NOISE_UE, controller, |tick, truth, outputs| {
            // Whoever has said nothing by now has missed it.
            if latency_ms(tick, onset) > trial::MISSED_MS {
                return ControlFlow::Break(());
            }
            let seen = &outputs.snapshot;
            // Armed with the controller, but not disarmed by its own report.
            armed = (armed || seen.state.is_holding()) && Some(tick) != recording.release;
            moved |= truth.moved_mm >= UNMOVED_MM;
            if let Some(scores) = baselines.step(&seen.residual, armed)
                && moved
            {
                for (envelope, score) in envelopes.iter_mut().zip(scores) {
                    envelope.add(tick, score);
                }
            }
            ControlFlow::Continue(())
        });
        Ok(Some(Self {
            onset,
            envelopes,
            controller_ms,
        }))
    }

    fn baseline_ms(&self, rule: Baseline, threshold: f32) -> Option<f64> {
        let tick = self.envelopes[rule as usize].crossing(threshold)?;
        Some(latency_ms(tick, self.onset))
    }
}

fn latency_ms(tick: usize, onset: usize) -> f64 {
    (tick as f64 - onset as f64) * TICK_US as f64 * 1e-3
}

/// False alarms and latency of a detector at one threshold.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Threshold of a rule (dimensionless), or factor on the controller's evidence limit.
    pub threshold: f64,
    /// Number of false alarms.
    pub alarms: u64,
    /// Hours in which they were counted.
    pub hours: f64,
    /// Median latency, ms; none if half of the losses are missed.
    pub p50_ms: Option<f64>,
    /// 99 % are reported within this, ms; none if more than 1 % are missed.
    pub p99_ms: Option<f64>,
    /// Losses that were not reported.
    pub missed: usize,
}

/// The operating curve of one detector.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Name of the detector in tables and charts.
    pub name: &'static str,
    /// From the most alarms to the fewest.
    pub points: Vec<Point>,
    /// At the published threshold, or at the controller's settings.
    pub published: Option<Point>,
    /// At the threshold with the controller's false-alarm rate, or with none where the controller has none.
    pub equal: Option<Point>,
}

/// A detector at one threshold, while the losses are counted.
#[derive(Debug, Clone)]
struct Setting {
    threshold: f32,
    alarms: u64,
    hours: f64,
    reported_ms: Histogram,
    missed: usize,
}

impl Setting {
    fn new(threshold: f32, alarms: u64, hours: f64) -> Self {
        Self {
            threshold,
            alarms,
            hours,
            reported_ms: Histogram::default(),
            missed: 0,
        }
    }

    fn add(&mut self, ms: Option<f64>) {
        match ms {
            Some(ms) => self.reported_ms.add(ms),
            None => self.missed += 1,
        }
    }

    fn point(&self) -> Point {
        // A loss that is missed takes for ever.
        let losses = self.reported_ms.len() + self.missed;
        Point {
            threshold: self.threshold.into(),
            alarms: self.alarms,
            hours: self.hours,
            p50_ms: self.reported_ms.quantile_of(0.5, losses),
            p99_ms: self.reported_ms.quantile_of(0.99, losses),
            missed: self.missed,
        }
    }
}

/// The settings of one detector; see [`Curve`].
#[derive(Debug, Clone)]
struct Thresholds {
    points: Vec<Setting>,
    published: Option<Setting>,
    equal: Option<Setting>,
}

impl Thresholds {
    fn each(&mut self, mut add: impl FnMut(&mut Setting)) {
        let single = self.published.iter_mut().chain(&mut self.equal);
        self.points.iter_mut().chain(single).for_each(&mut add);
    }

    fn curve(&self, name: &'static str) -> Curve {
        Curve {
            name,
            points: self.points.iter().map(Setting::point).collect(),
            published: self.published.as_ref().map(Setting::point),
            equal: self.equal.as_ref().map(Setting::point),
        }
    }
}

/// The controller and the rules, each at many thresholds, on one loss after the other.
#[derive(Debug, Clone)]
pub struct Contest {
    /// At each of [`EVIDENCE`].
    controller: Vec<Setting>,
    /// At its own settings.
    ours: Setting,
    rules: [Thresholds; RULES],
}

impl Contest {
    /// Chooses the thresholds by the false alarms that they give. `tally` is of the controller as it is set, with the
    /// greatest score of every rule in every hold; `swept` of the controller at each of [`EVIDENCE`].
    pub fn new(tally: &Tally, swept: &[Tally]) -> Self {
        let hours = tally.total().time_s / 3600.0;
        let controller = EVIDENCE.iter().zip(swept).map(|(&factor, tally)| {
            let count = tally.total();
            Setting::new(factor, count.lost, count.time_s / 3600.0)
        });
        let rules = Baseline::ALL.map(|rule| {
            let scores = tally.scores.iter().map(|hold| hold[rule as usize]);
            let mut greatest: Vec<f32> = scores.collect();
            greatest.sort_by(|a, b| b.total_cmp(a));
            let at = |threshold: f32| {
                let alarms = greatest.partition_point(|score| *score > threshold) as u64;
                Setting::new(threshold, alarms, hours)
            };
            // As many alarms as the rank says.
            let rank = |n: usize| greatest.get(n).map(|&score| at(score));
            let ranks = [3_000, 1_000, 300, 100, 30, 10, 3, 1, 0];
            Thresholds {
                points: ranks.into_iter().filter_map(rank).collect(),
                published: rule.published().map(at),
                equal: rank(tally.total().lost as usize),
            }
        });
        Self {
            controller: controller.collect(),
            // At its own setting it was counted for all hours.
            ours: Setting::new(1.0, tally.total().lost, hours),
            rules,
        }
    }

    /// Adds one loss.
    pub fn add(&mut self, race: &Race) {
        for ((setting, factor), ms) in self
            .controller
            .iter_mut()
            .zip(EVIDENCE)
            .zip(race.controller_ms)
        {
            setting.add(ms);
            if factor == 1.0 {
                self.ours.add(ms);
            }
        }
        for (rule, settings) in Baseline::ALL.into_iter().zip(&mut self.rules) {
            settings.each(|setting| setting.add(race.baseline_ms(rule, setting.threshold)));
        }
    }

    /// The controller's curve first, then the others'.
    pub fn curves(&self) -> Vec<Curve> {
        let ours = self.ours.point();
        let controller = Curve {
            name: "this controller",
            points: self.controller.iter().map(Setting::point).collect(),
            published: Some(ours),
            equal: Some(ours),
        };
        let rules = Baseline::ALL.into_iter().zip(&self.rules);
        let rules = rules.map(|(rule, settings)| settings.curve(rule.name()));
        std::iter::once(controller).chain(rules).collect()
    }
}

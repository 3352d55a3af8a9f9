//! Operating curves, latency over false-alarm rate: the controller at other evidence limits, and the
//! published rules at other thresholds, on the same traces.

use std::ops::ControlFlow;

use sim::setup::Setup;
use softgrip::TICK_US;
use softgrip::settings::Settings;

use crate::baselines::{Baseline, Baselines, Envelope, RULES};
use crate::case::Case;
use crate::record::{ObjectOutcome, Recording};
use crate::statistics::quantile;
use crate::tally::Tally;
use crate::trial::{self, Classification, UNMOVED_MM};

/// Noise of the comparison, µε.
pub const NOISE_UE: f64 = 100.0;
/// Factors on the controller's evidence limit, for its own curve.
pub const EVIDENCE: [f32; 9] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 2.0, 4.0];
/// Fraction of the hours that each point of the controller's curve gets.
pub const SWEEP_SHARE: f64 = 0.05;

/// One loss as seen by the controller and by every rule.
#[derive(Debug, Clone)]
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
        let ms = (tick as f64 - self.onset as f64) * TICK_US as f64 * 1e-3;
        Some(ms).filter(|ms| *ms <= trial::MISSED_MS)
    }
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

impl Point {
    /// False alarms per hour; where there was none, half of one.
    pub fn per_hour(&self) -> f64 {
        (self.alarms as f64).max(0.5) / self.hours
    }

    fn new(threshold: f64, alarms: u64, hours: f64, latencies: Vec<Option<f64>>) -> Self {
        // A loss that is missed takes for ever.
        let mut ms: Vec<f64> = latencies
            .iter()
            .map(|ms| ms.unwrap_or(f64::INFINITY))
            .collect();
        ms.sort_by(f64::total_cmp);
        let reported = |share| quantile(&ms, share).filter(|ms| ms.is_finite());
        Self {
            threshold,
            alarms,
            hours,
            p50_ms: reported(0.5),
            p99_ms: reported(0.99),
            missed: ms.iter().filter(|ms| ms.is_infinite()).count(),
        }
    }
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

/// The controller's curve first, then the others'.
///
/// `tally` is of the controller as it is set, with the greatest score of every rule in every hold;
/// `swept` of the controller at each of [`EVIDENCE`].
pub fn curves(races: &[Race], tally: &Tally, swept: &[Tally]) -> Vec<Curve> {
    let hours = tally.total().time_s / 3600.0;
    let controller = |n: usize| {
        let count = swept[n].total();
        let latencies = races.iter().map(|race| race.controller_ms[n]).collect();
        let threshold = f64::from(EVIDENCE[n]);
        Point::new(threshold, count.lost, count.time_s / 3600.0, latencies)
    };
    // At its own setting it was counted for all hours.
    let ours = EVIDENCE.iter().position(|factor| *factor == 1.0).map(|n| {
        let latencies = races.iter().map(|race| race.controller_ms[n]).collect();
        Point::new(1.0, tally.total().lost, hours, latencies)
    });
    let mut curves = vec![Curve {
        name: "this controller",
        points: (0..EVIDENCE.len()).map(controller).collect(),
        published: ours,
        equal: ours,
    }];
    for rule in Baseline::ALL {
        let mut greatest: Vec<f32> = tally
            .scores
            .iter()
            .map(|hold| hold[rule as usize])
            .collect();
        greatest.sort_by(|a, b| b.total_cmp(a));
        let at = |threshold: f32| {
            let alarms = greatest.partition_point(|score| *score > threshold) as u64;
            let latencies = races
                .iter()
                .map(|race| race.baseline_ms(rule, threshold))
                .collect();
            Point::new(f64::from(threshold), alarms, hours, latencies)
        };
        // As many alarms as the rank says.
        let rank = |n: usize| greatest.get(n).map(|&score| at(score));
        let ranks = [3_000, 1_000, 300, 100, 30, 10, 3, 1, 0];
        curves.push(Curve {
            name: rule.name(),
            points: ranks.into_iter().filter_map(rank).collect(),
            published: rule.published().map(at),
            equal: rank(tally.total().lost as usize),
        });
    }
    curves
}

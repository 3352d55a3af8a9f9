//! The published numbers, computed from the raw results.

use report::json::round;
use serde::Serialize;
use sim::scenario::ObjectKind;

use crate::case::{KNOWLEDGE, Knowledge, ORIGINS, Origin};
use crate::cycle::Activity;
use crate::evaluation::Evaluation;
use crate::options::{NOISE_UE, Options};
use crate::roc::{Curve, Point};
use crate::statistics::{poisson_upper_95, quantile};
use crate::tally::{Count, Tally};
use crate::trial::{Classification, ControllerReport, Trial};

/// A slip must be warned of before the object has moved this far, mm.
pub const WARN_MM: f64 = 15.0;

/// All published numbers; the object that `--json` prints.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Detection latency, one entry per level of noise, origin and class of calibration.
    pub latency: Vec<LatencyStatistics>,
    /// How far objects slid before the report, per object, origin and level of noise.
    pub slide: Vec<SlideStatistics>,
    /// False reports, one entry per level of noise.
    pub false_alarms: Vec<AlarmStatistics>,
    /// Comparison with published rules: the controller first.
    pub detectors: Vec<Detector>,
}

/// Detection latency at one level of noise, for one origin and one class of calibration.
#[derive(Debug, Clone, Serialize)]
pub struct LatencyStatistics {
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// What made the object fall.
    pub origin: Origin,
    /// Class of calibration.
    pub knowledge: Knowledge,
    /// Number of true losses.
    pub losses: usize,
    /// Quantiles of the latency, ms.
    #[serde(flatten)]
    pub ms: Quantiles,
    /// Losses that were reported before the onset.
    pub early: usize,
    /// Losses that were not reported within [`crate::trial::MISSED_MS`].
    pub missed: usize,
    /// Reported as something else: an air loss or a fault.
    pub misnamed: usize,
    /// Grips that were not recognised before the lift.
    pub not_recognised: usize,
    /// Runs in which nothing was lost.
    pub held: usize,
    /// Of these, runs in which the object was displaced by more than 20 mm.
    pub displaced: usize,
    /// Of these, runs in which a loss was reported.
    pub displaced_reported: usize,
    /// Reports of *lost* while the object was held, or before it had moved by [`crate::trial::UNMOVED_MM`].
    pub false_alarms: usize,
}

/// Quantiles of a latency; none where there is nothing.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Quantiles {
    /// Smallest latency.
    pub min: Option<f64>,
    /// Median latency.
    pub p50: Option<f64>,
    /// 95 % quantile.
    pub p95: Option<f64>,
    /// 99 % quantile.
    pub p99: Option<f64>,
    /// Greatest latency.
    pub max: Option<f64>,
}

impl Quantiles {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share| quantile(&values, share).map(|x| round(x, 1));
        Self {
            min: at(0.0),
            p50: at(0.5),
            p95: at(0.95),
            p99: at(0.99),
            max: at(1.0),
        }
    }
}

/// Slide of the object before the report, at one level of noise.
#[derive(Debug, Clone, Serialize)]
pub struct SlideStatistics {
    /// Kind of object.
    pub object: ObjectKind,
    /// What made the object fall.
    pub origin: Origin,
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// Losses that were reported.
    pub losses: usize,
    /// Time from the first 0.5 mm of slide to the report, ms.
    pub lost_ms: Quantiles,
    /// Displacement relative to the palm at the report, mm.
    pub lost_mm: Quantiles,
    /// Losses with a warning of a slip before the report.
    pub warned: usize,
    /// Of these, losses with a warning before the object had moved [`WARN_MM`].
    pub warned_in_time: usize,
    /// Displacement relative to the palm at the warning, mm.
    pub warned_mm: Quantiles,
}

/// False reports at one level of noise.
#[derive(Debug, Clone, Serialize)]
pub struct AlarmStatistics {
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// Per activity, in the order of [`crate::cycle::Activity::ALL`].
    pub causes: Vec<AlarmRate>,
    /// Sum over the activities of hard motion.
    pub hard_motion: AlarmRate,
    /// Sum over all activities.
    pub total: AlarmRate,
}

/// False reports during one activity, or a sum of activities.
#[derive(Debug, Clone, Serialize)]
pub struct AlarmRate {
    /// Name of the activity.
    pub cause: &'static str,
    /// Simulated time, h.
    pub hours: f64,
    /// How often the activity occurred.
    pub times: u64,
    /// Number of false reports of *lost*.
    pub lost: u64,
    /// False reports of *lost* per hour.
    pub lost_per_hour: f64,
    /// Upper 95 % bound of that.
    pub lost_per_hour_95: f64,
    /// False warnings of a slip: the object had not given way.
    pub slips: u64,
    /// False warnings of a slip per hour.
    pub slips_per_hour: f64,
    /// Number of false faults and false air losses.
    pub faults: u64,
}

/// The controller or a published rule, in the comparison.
#[derive(Debug, Clone, Serialize)]
pub struct Detector {
    /// Name in tables and charts.
    pub name: &'static str,
    /// At the threshold with the controller's false-alarm rate.
    pub equal: Option<OperatingPoint>,
    /// Ratio of its median latency there to the controller's; none if it misses half of the losses, or if the
    /// controller's median is not positive.
    pub times_slower_p50: Option<f64>,
    /// The same ratio for the 99 % quantile.
    pub times_slower_p99: Option<f64>,
    /// At the published threshold, or at the controller's settings.
    pub published: Option<OperatingPoint>,
    /// Operating points over all thresholds, from the most alarms to the fewest.
    pub curve: Vec<OperatingPoint>,
}

/// A detector at one threshold.
#[derive(Debug, Clone, Serialize)]
pub struct OperatingPoint {
    /// The threshold, or for the controller its evidence over that of the settings.
    pub threshold: f64,
    /// Number of false alarms.
    pub alarms: u64,
    /// Hours in which they were counted.
    pub hours: f64,
    /// Median latency, ms; none if half of the losses are missed.
    pub p50_ms: Option<f64>,
    /// 99 % quantile of the latency, ms; none if more than 1 % of the losses are missed.
    pub p99_ms: Option<f64>,
    /// Number of losses that were not reported.
    pub missed: usize,
}

impl Summary {
    /// Computes the published numbers from the raw results.
    pub fn of(evaluation: &Evaluation, options: &Options) -> Self {
        let trials = &evaluation.sample.trials;
        let latency = NOISE_UE.into_iter().flat_map(|noise| {
            ORIGINS.into_iter().flat_map(move |origin| {
                KNOWLEDGE.map(|knowledge| LatencyStatistics::of(trials, noise, origin, knowledge))
            })
        });
        let objects = [ObjectKind::Sphere, ObjectKind::Cylinder];
        let slide = objects.into_iter().flat_map(|object| {
            ORIGINS.into_iter().flat_map(move |origin| {
                NOISE_UE.map(|noise| SlideStatistics::of(trials, object, origin, noise))
            })
        });
        Self {
            seed: options.seed,
            latency: latency.collect(),
            slide: slide.collect(),
            false_alarms: evaluation.tallies.iter().map(AlarmStatistics::of).collect(),
            detectors: detectors(&evaluation.curves),
        }
    }
}

impl LatencyStatistics {
    fn of(trials: &[Trial], noise_ue: f64, origin: Origin, knowledge: Knowledge) -> Self {
        let of: Vec<&Trial> = trials
            .iter()
            .filter(|t| t.noise_ue == noise_ue && t.case.origin() == origin)
            .filter(|t| t.case.knowledge == knowledge)
            .collect();
        let classes: Vec<Classification> = of.iter().map(|trial| trial.classification()).collect();
        let count = |wanted| classes.iter().filter(|v| **v == wanted).count();
        let reported = classes.iter().filter_map(|class| match class {
            Classification::Reported(ms) => Some(*ms),
            _ => None,
        });
        let ms: Vec<f64> = reported.collect();
        Self {
            noise_ue,
            origin,
            knowledge,
            losses: of.iter().filter(|t| t.loss.is_some()).count(),
            early: ms.iter().filter(|ms| **ms < 0.0).count(),
            ms: Quantiles::of(ms),
            missed: count(Classification::Missed),
            misnamed: count(Classification::Misnamed),
            not_recognised: count(Classification::NotRecognised),
            held: of.iter().filter(|t| t.loss.is_none()).count(),
            displaced: count(Classification::Displaced),
            displaced_reported: of
                .iter()
                .filter(|t| t.classification() == Classification::Displaced)
                .filter(|t| matches!(t.report, ControllerReport::Lost { .. }))
                .count(),
            false_alarms: count(Classification::FalseAlarm),
        }
    }
}

impl SlideStatistics {
    fn of(trials: &[Trial], object: ObjectKind, origin: Origin, noise_ue: f64) -> Self {
        let reported = trials.iter().filter_map(|trial| {
            let case = &trial.case;
            let fits = trial.noise_ue == noise_ue
                && case.setup.scenario.object == object
                && case.origin() == origin;
            match (trial.classification(), &trial.report) {
                (Classification::Reported(_), ControllerReport::Lost { t_s, moved_mm }) if fits => {
                    Some((*t_s, f64::from(*moved_mm), trial.loss?))
                }
                _ => None,
            }
        });
        let reported: Vec<_> = reported.collect();
        let warnings = reported.iter().filter_map(|(_, _, loss)| loss.warning);
        let warned_mm: Vec<f64> = warnings.map(|(_, mm)| f64::from(mm)).collect();
        let lost_ms = reported.iter().map(|(t, _, loss)| 1e3 * (t - loss.slide_s));
        Self {
            object,
            origin,
            noise_ue,
            losses: reported.len(),
            lost_ms: Quantiles::of(lost_ms.collect()),
            lost_mm: Quantiles::of(reported.iter().map(|(_, mm, _)| *mm).collect()),
            warned: warned_mm.len(),
            warned_in_time: warned_mm.iter().filter(|mm| **mm < WARN_MM).count(),
            warned_mm: Quantiles::of(warned_mm),
        }
    }

    /// Share of the losses that were warned of in time.
    pub fn share_in_time(&self) -> f64 {
        self.warned_in_time as f64 / self.losses.max(1) as f64
    }
}

impl AlarmStatistics {
    fn of(tally: &Tally) -> Self {
        let causes = Activity::ALL.iter().zip(tally.counts);
        Self {
            noise_ue: tally.noise_ue,
            causes: causes
                .filter(|(_, count)| count.times > 0)
                .map(|(activity, count)| AlarmRate::of(activity.name(), count))
                .collect(),
            hard_motion: AlarmRate::of("hard motion", tally.hard_motion()),
            total: AlarmRate::of("everything", tally.total()),
        }
    }
}

impl AlarmRate {
    fn of(cause: &'static str, count: Count) -> Self {
        let hours = count.time_s / 3600.0;
        let per_hour = |n: f64| match hours > 0.0 {
            true => round(n / hours, 4),
            false => 0.0,
        };
        Self {
            cause,
            hours: round(hours, 4),
            times: count.times,
            lost: count.lost,
            lost_per_hour: per_hour(count.lost as f64),
            lost_per_hour_95: per_hour(poisson_upper_95(count.lost)),
            slips: count.slips,
            slips_per_hour: per_hour(count.slips as f64),
            faults: count.faults,
        }
    }
}

fn detectors(curves: &[Curve]) -> Vec<Detector> {
    let ours = curves.first().and_then(|curve| curve.equal);
    let slower = |curve: &Curve, ms: fn(&Point) -> Option<f64>| {
        let (theirs, ours) = (ms(&curve.equal?)?, ms(&ours?)?);
        (ours > 0.0).then(|| round(theirs / ours, 2))
    };
    curves
        .iter()
        .map(|curve| Detector {
            name: curve.name,
            equal: curve.equal.map(OperatingPoint::of),
            times_slower_p50: slower(curve, |point| point.p50_ms),
            times_slower_p99: slower(curve, |point| point.p99_ms),
            published: curve.published.map(OperatingPoint::of),
            curve: curve
                .points
                .iter()
                .copied()
                .map(OperatingPoint::of)
                .collect(),
        })
        .collect()
}

impl OperatingPoint {
    fn of(point: Point) -> Self {
        Self {
            threshold: round(point.threshold, 5),
            alarms: point.alarms,
            hours: round(point.hours, 3),
            p50_ms: point.p50_ms.map(|ms| round(ms, 1)),
            p99_ms: point.p99_ms.map(|ms| round(ms, 1)),
            missed: point.missed,
        }
    }
}

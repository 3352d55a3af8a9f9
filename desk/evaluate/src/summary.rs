//! The published numbers, from what was measured.

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
use crate::trial::{Report, Trial, Verdict};

/// A slip must be warned of before the object has moved this far, mm.
pub const WARN_MM: f64 = 15.0;

/// Everything that is published; the object that `--json` prints.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Seed.
    pub seed: u64,
    /// How soon.
    pub latency: Vec<Latency>,
    /// What came before.
    pub slide: Vec<Slide>,
    /// How often for nothing.
    pub false_alarms: Vec<Alarms>,
    /// Against others.
    pub detectors: Vec<Detector>,
}

/// How soon losses were reported, at one level of noise, for one origin and one class of knowledge.
#[derive(Debug, Clone, Serialize)]
pub struct Latency {
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// What took the object.
    pub origin: Origin,
    /// How well the controller knew its fingers.
    pub knowledge: Knowledge,
    /// True losses.
    pub losses: usize,
    /// Quantiles of the latency, ms.
    #[serde(flatten)]
    pub ms: Quantiles,
    /// Reported before the onset, and the earliest of them.
    pub early: usize,
    /// Not reported in time.
    pub missed: usize,
    /// Reported as something else: an air loss or a fault.
    pub misnamed: usize,
    /// Grips that were not recognised before the lift.
    pub not_recognised: usize,
    /// Runs in which nothing was lost.
    pub held: usize,
    /// Of these, runs in which the object was moved out of place by more than 20 mm.
    pub displaced: usize,
    /// Of these, runs in which a loss was reported.
    pub displaced_reported: usize,
    /// Reported lost while it was held, or long before it was lost.
    pub false_alarms: usize,
}

/// Quantiles of a latency; none where there is nothing.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Quantiles {
    /// The smallest.
    pub min: Option<f64>,
    /// The median.
    pub p50: Option<f64>,
    /// 95 %.
    pub p95: Option<f64>,
    /// 99 %.
    pub p99: Option<f64>,
    /// The greatest.
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

/// How long and how far an object had slid, at one level of noise.
#[derive(Debug, Clone, Serialize)]
pub struct Slide {
    /// What it was.
    pub object: ObjectKind,
    /// What took it.
    pub origin: Origin,
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// Losses that were reported.
    pub losses: usize,
    /// From the first half millimetre to the report, ms.
    pub lost_ms: Quantiles,
    /// Way against the palm at the report, mm.
    pub lost_mm: Quantiles,
    /// Losses with a warning of a slip before the report.
    pub warned: usize,
    /// Of these, within [`WARN_MM`].
    pub warned_in_time: usize,
    /// Way against the palm at the warning, mm.
    pub warned_mm: Quantiles,
}

/// False reports at one level of noise.
#[derive(Debug, Clone, Serialize)]
pub struct Alarms {
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// By what was going on.
    pub causes: Vec<Cause>,
    /// While the arm moved hard.
    pub hard_motion: Cause,
    /// Everything together.
    pub total: Cause,
}

/// False reports while something was going on.
#[derive(Debug, Clone, Serialize)]
pub struct Cause {
    /// What.
    pub cause: &'static str,
    /// For how long.
    pub hours: f64,
    /// How often.
    pub times: u64,
    /// False reports of *lost*, per hour, and the upper 95 % bound.
    pub lost: u64,
    /// Per hour.
    pub lost_per_hour: f64,
    /// Upper 95 % bound of that.
    pub lost_per_hour_95: f64,
    /// False warnings of a slip: the object had not given way.
    pub slips: u64,
    /// Per hour.
    pub slips_per_hour: f64,
    /// Faults and air losses that were none.
    pub faults: u64,
}

/// A detector.
#[derive(Debug, Clone, Serialize)]
pub struct Detector {
    /// Its name.
    pub name: &'static str,
    /// At the controller's rate of false alarms.
    pub equal: Option<Setting>,
    /// Its median latency there over the controller's; none if it misses half, or if the controller's is
    /// not positive.
    pub times_slower_p50: Option<f64>,
    /// The same of the 99 %.
    pub times_slower_p99: Option<f64>,
    /// As published or set.
    pub published: Option<Setting>,
    /// At many thresholds.
    pub curve: Vec<Setting>,
}

/// A detector at one threshold.
#[derive(Debug, Clone, Serialize)]
pub struct Setting {
    /// The threshold, or for the controller its evidence over that of the settings.
    pub threshold: f64,
    /// False alarms.
    pub alarms: u64,
    /// Hours in which they were counted.
    pub hours: f64,
    /// Median, ms.
    pub p50_ms: Option<f64>,
    /// 99 %, ms; none if more than one in a hundred is missed.
    pub p99_ms: Option<f64>,
    /// Losses that were missed.
    pub missed: usize,
}

impl Summary {
    /// Counts.
    pub fn of(evaluation: &Evaluation, options: &Options) -> Self {
        let trials = &evaluation.sample.trials;
        let latency = NOISE_UE.into_iter().flat_map(|noise| {
            ORIGINS.into_iter().flat_map(move |origin| {
                KNOWLEDGE.map(|knowledge| Latency::of(trials, noise, origin, knowledge))
            })
        });
        let objects = [ObjectKind::Sphere, ObjectKind::Cylinder];
        let slide = objects.into_iter().flat_map(|object| {
            ORIGINS.into_iter().flat_map(move |origin| {
                NOISE_UE.map(|noise| Slide::of(trials, object, origin, noise))
            })
        });
        Self {
            seed: options.seed,
            latency: latency.collect(),
            slide: slide.collect(),
            false_alarms: evaluation.tallies.iter().map(Alarms::of).collect(),
            detectors: detectors(&evaluation.curves),
        }
    }
}

impl Latency {
    fn of(trials: &[Trial], noise_ue: f64, origin: Origin, knowledge: Knowledge) -> Self {
        let of: Vec<&Trial> = trials
            .iter()
            .filter(|t| t.noise_ue == noise_ue && t.case.origin() == origin)
            .filter(|t| t.case.knowledge == knowledge)
            .collect();
        let verdicts: Vec<Verdict> = of.iter().map(|trial| trial.verdict()).collect();
        let count = |wanted| verdicts.iter().filter(|v| **v == wanted).count();
        let reported = verdicts.iter().filter_map(|verdict| match verdict {
            Verdict::Reported(ms) => Some(*ms),
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
            missed: count(Verdict::Missed),
            misnamed: count(Verdict::Misnamed),
            not_recognised: count(Verdict::NotRecognised),
            held: of.iter().filter(|t| t.loss.is_none()).count(),
            displaced: count(Verdict::Displaced),
            displaced_reported: of
                .iter()
                .filter(|t| t.verdict() == Verdict::Displaced)
                .filter(|t| matches!(t.report, Report::Lost { .. }))
                .count(),
            false_alarms: count(Verdict::FalseAlarm),
        }
    }
}

impl Slide {
    fn of(trials: &[Trial], object: ObjectKind, origin: Origin, noise_ue: f64) -> Self {
        let reported = trials.iter().filter_map(|trial| {
            let case = &trial.case;
            let fits = trial.noise_ue == noise_ue
                && case.setup.scenario.object == object
                && case.origin() == origin;
            match (trial.verdict(), &trial.report) {
                (Verdict::Reported(_), Report::Lost { t_s, moved_mm }) if fits => {
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

impl Alarms {
    fn of(tally: &Tally) -> Self {
        let causes = Activity::ALL.iter().zip(tally.counts);
        Self {
            noise_ue: tally.noise_ue,
            causes: causes
                .filter(|(_, count)| count.times > 0)
                .map(|(activity, count)| Cause::of(activity.name(), count))
                .collect(),
            hard_motion: Cause::of("hard motion", tally.hard_motion()),
            total: Cause::of("everything", tally.total()),
        }
    }
}

impl Cause {
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
            equal: curve.equal.map(Setting::of),
            times_slower_p50: slower(curve, |point| point.p50_ms),
            times_slower_p99: slower(curve, |point| point.p99_ms),
            published: curve.published.map(Setting::of),
            curve: curve.points.iter().copied().map(Setting::of).collect(),
        })
        .collect()
}

impl Setting {
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

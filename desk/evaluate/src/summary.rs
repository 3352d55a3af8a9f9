//! The published numbers, computed from the raw results.

use report::json::round;
use serde::Serialize;
use sim::scenario::ObjectKind;

use crate::about::About;
use crate::case::{KNOWLEDGE, Knowledge, ORIGINS, Origin};
use crate::cycle::Activity;
use crate::evaluation::Evaluation;
use crate::options::NOISE_UE;
use crate::roc::{Curve, Point};
use crate::sample::Sample;
use crate::statistics::{Histogram, poisson_upper_95};
use crate::tally::{Count, Tally};

/// All published numbers; the object that `--json` prints.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// What was evaluated, and with what.
    #[serde(flatten)]
    pub about: About,
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
    /// Of these values, ms.
    pub fn of(values: &Histogram) -> Self {
        Self {
            min: values.quantile(0.0),
            p50: values.quantile(0.5),
            p95: values.quantile(0.95),
            p99: values.quantile(0.99),
            max: values.quantile(1.0),
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
    /// Of these, losses with a warning before the object had moved [`crate::sample::WARN_MM`].
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
    pub fn of(evaluation: &Evaluation, about: &About) -> Self {
        let sample = &evaluation.sample;
        let latency = (0..NOISE_UE.len()).flat_map(|noise| {
            ORIGINS.into_iter().flat_map(move |origin| {
                KNOWLEDGE.map(|knowledge| LatencyStatistics::of(sample, noise, origin, knowledge))
            })
        });
        let slide = ObjectKind::ALL.into_iter().flat_map(|object| {
            ORIGINS.into_iter().flat_map(move |origin| {
                let noises = 0..NOISE_UE.len();
                noises.map(move |noise| SlideStatistics::of(sample, object, origin, noise))
            })
        });
        Self {
            about: about.clone(),
            latency: latency.collect(),
            slide: slide.collect(),
            false_alarms: evaluation.tallies.iter().map(AlarmStatistics::of).collect(),
            detectors: detectors(&sample.contest().curves()),
        }
    }
}

impl LatencyStatistics {
    fn of(sample: &Sample, noise: usize, origin: Origin, knowledge: Knowledge) -> Self {
        let counts = sample.counts(noise, origin, knowledge);
        Self {
            noise_ue: NOISE_UE[noise],
            origin,
            knowledge,
            losses: counts.losses,
            early: counts.early,
            ms: Quantiles::of(&counts.reported_ms),
            missed: counts.missed,
            misnamed: counts.misnamed,
            not_recognised: counts.not_recognised,
            held: counts.held,
            displaced: counts.displaced,
            displaced_reported: counts.displaced_reported,
            false_alarms: counts.false_alarms,
        }
    }
}

impl SlideStatistics {
    fn of(sample: &Sample, object: ObjectKind, origin: Origin, noise: usize) -> Self {
        let slides = sample.slides(object, origin, noise);
        Self {
            object,
            origin,
            noise_ue: NOISE_UE[noise],
            losses: slides.lost_ms.len(),
            lost_ms: Quantiles::of(&slides.lost_ms),
            lost_mm: Quantiles::of(&slides.lost_mm),
            warned: slides.warned_mm.len(),
            warned_in_time: slides.warned_in_time,
            warned_mm: Quantiles::of(&slides.warned_mm),
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

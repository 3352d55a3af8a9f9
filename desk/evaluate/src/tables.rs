//! The published numbers as tables, for a terminal and for HTML.

use report::table::Table;

use crate::roc;
use crate::sample::WARN_MM;
use crate::summary::{
    AlarmRate, AlarmStatistics, Detector, LatencyStatistics, OperatingPoint, Quantiles,
    SlideStatistics, Summary,
};

/// Every table of the evaluation, in the order of the page.
pub fn all(summary: &Summary) -> Vec<Table> {
    let mut tables = vec![latency(&summary.latency), slide(&summary.slide)];
    tables.extend(summary.false_alarms.iter().map(alarms));
    if !summary.detectors.is_empty() {
        tables.push(detectors(&summary.detectors));
    }
    tables
}

fn ms(value: Option<f64>) -> String {
    value.map_or("-".into(), |ms| format!("{ms:.0}").replace('-', "−"))
}

fn latency(rows: &[LatencyStatistics]) -> Table {
    let row = |row: &LatencyStatistics| {
        let Quantiles {
            min,
            p50,
            p95,
            p99,
            max,
        } = row.ms;
        let counts = [
            row.early,
            row.missed,
            row.misnamed,
            row.not_recognised,
            row.held,
            row.displaced,
            row.displaced_reported,
            row.false_alarms,
        ];
        let mut cells = vec![
            format!(
                "{} µε, {}, {}",
                row.noise_ue,
                row.origin.name(),
                row.knowledge.name()
            ),
            row.losses.to_string(),
        ];
        cells.extend([min, p50, p95, p99, max].map(ms));
        cells.extend(counts.map(|n| n.to_string()));
        cells
    };
    Table {
        title: "Latency of `lost`, ms".into(),
        head: vec![
            "gauge noise rms, object, fingers",
            "losses",
            "min",
            "p50",
            "p95",
            "p99",
            "max",
            "early",
            "missed",
            "misnamed",
            "unrecognised",
            "held",
            "displaced",
            "reported",
            "false",
        ],
        rows: rows.iter().map(row).collect(),
        note: "From the moment when the true residual, summed over the fingers, left 90 % of its plateau for good. A loss is an object that moved 20 mm against the palm and that no finger touches any more, before any commanded release. Dropped: left to the arm's motion; pushed out: by a force from outside. Early: reported before that moment, as where one finger empties first; the earliest is the minimum. Missed: not within 500 ms. Misnamed: reported as an air loss or a fault. Unrecognised: the controller did not say `holding` before the lift. Held: runs without a loss; displaced, those in which the object moved 20 mm but stayed in the fingers, count neither way, reported or not. False: reported lost while the object had moved less than 1 mm, or was never lost. Calibrated fingers are known to 1 %, uncalibrated ones to 10 %.".into(),
    }
}

fn slide(rows: &[SlideStatistics]) -> Table {
    let row = |row: &SlideStatistics| {
        let percent = |n: usize| format!("{:.0} %", 100.0 * n as f64 / row.losses.max(1) as f64);
        vec![
            format!("{}, {}, {} µε", row.object, row.origin.name(), row.noise_ue),
            row.losses.to_string(),
            ms(row.lost_ms.p50),
            ms(row.lost_ms.p95),
            ms(row.lost_mm.p50),
            ms(row.lost_mm.p95),
            percent(row.warned),
            percent(row.warned_in_time),
            ms(row.warned_mm.p50),
            ms(row.warned_mm.p95),
        ]
    };
    Table {
        title: "Slide before the report, and warnings of it".into(),
        head: vec![
            "object, gauge noise rms",
            "losses",
            "lost: ms p50",
            "p95",
            "mm p50",
            "p95",
            "warned",
            "in time",
            "mm p50",
            "p95",
        ],
        rows: rows.iter().map(row).collect(),
        note: format!(
            "Time from the first half millimetre that the object slid along the fingers to the report of the loss, and how far it had moved against the palm by then; then the share of losses with a warning of a slip before, the share with one before the object had moved {WARN_MM} mm, and how far it had moved at the warning. A gauge at the finger's base sees the load on the finger, not the skin: much of a slide changes nothing there."
        ),
    }
}

fn alarms(alarms: &AlarmStatistics) -> Table {
    let row = |cause: &AlarmRate| {
        vec![
            cause.cause.to_string(),
            format!("{:.2}", cause.hours),
            cause.times.to_string(),
            cause.lost.to_string(),
            format!("{:.3}", cause.lost_per_hour),
            format!("{:.3}", cause.lost_per_hour_95),
            cause.slips.to_string(),
            format!("{:.2}", cause.slips_per_hour),
            cause.faults.to_string(),
        ]
    };
    let sums = [&alarms.hard_motion, &alarms.total];
    Table {
        title: format!(
            "False reports in {:.1} h at {} µε",
            alarms.total.hours, alarms.noise_ue
        ),
        head: vec![
            "while", "h", "times", "lost", "per h", "95 % bound", "slips", "per h", "faults",
        ],
        rows: alarms.causes.iter().chain(sums).map(row).collect(),
        note: "Nothing is lost in these hours. The bound is that of a Poisson count: with no event at all the rate is below 3.0 over the hours with 95 % confidence. The object sits firmly in the grip or gives way sideways under hard stops as on the simulated gripper; objects on the verge of falling are in the first table, as runs that held. A fault of the gauge that goes bad is none of these faults: it is to be reported.".into(),
    }
}

fn detectors(detectors: &[Detector]) -> Table {
    let never =
        |ms: Option<f64>| ms.map_or("never".into(), |ms| format!("{ms:.0}").replace('-', "−"));
    let cells = |setting: &Option<OperatingPoint>| match setting {
        None => vec![String::new(); 5],
        Some(setting) => vec![
            format!("{:.4}", setting.threshold),
            format!("{} in {:.0} h", setting.alarms, setting.hours),
            never(setting.p50_ms),
            never(setting.p99_ms),
            setting.missed.to_string(),
        ],
    };
    let row = |detector: &Detector| {
        let mut row = vec![detector.name.to_string()];
        row.extend(cells(&detector.equal));
        let equal = detector.equal.as_ref();
        let ratio = |times: Option<f64>, ms: Option<Option<f64>>| match (times, ms) {
            (Some(times), _) => format!("{times:.1}"),
            (None, Some(None)) => "∞".into(),
            (None, _) => "-".into(),
        };
        let p50 = equal.map(|setting| setting.p50_ms);
        let p99 = equal.map(|setting| setting.p99_ms);
        row.push(ratio(detector.times_slower_p50, p50));
        row.push(ratio(detector.times_slower_p99, p99));
        row.extend(cells(&detector.published));
        row
    };
    Table {
        title: format!("Comparison with published rules, at {} µε", roc::NOISE_UE),
        head: vec![
            "rule",
            "threshold",
            "false alarms",
            "p50",
            "p99",
            "missed",
            "p50 × ours",
            "p99 × ours",
            "published",
            "false alarms",
            "p50",
            "p99",
            "missed",
        ],
        rows: detectors.iter().map(row).collect(),
        note: "Left: at the controller's own number of false alarms, or at the lowest threshold without any where the controller has none; each rule's threshold is chosen with hindsight on these very hours, which no user can do. Latencies in ms, of the same losses; a missed loss takes for ever; no ratio where ours comes before the onset. Right: at the threshold that is published for the rule, where there is one. All rules work on the controller's own residual, normalised by its mean over 40 ms before the hold, and are armed only while the controller holds.".into(),
    }
}

//! The evaluation in plain words.

use std::fmt::Write;

use super::NOISE_UE;
use super::alarms::Tally;
use super::case::{Case, KNOWLEDGE};
use super::latency::{Report, Trial, Verdict};
use super::roc::{Curve, NOISE_UE as COMPARED_UE, Point};
use super::routine::Activity;
use super::statistics::poisson_upper_95;
use super::statistics::quantile;
use crate::scenario::ObjectKind;

/// The latency table.
pub fn latency(trials: &[Trial]) -> String {
    let mut out = String::from(
        "Latency of `lost` after the true residual sum left 90 % of its plateau for good, ms\n\
         gauge noise  recipe        losses    p50    p95    p99    max  missed  early  other  unrecognised |  held  false\n",
    );
    for noise in NOISE_UE {
        for knowledge in KNOWLEDGE {
            let of: Vec<&Trial> = trials
                .iter()
                .filter(|t| t.noise_ue == noise && t.case.knowledge == knowledge)
                .collect();
            let verdicts: Vec<Verdict> = of.iter().map(|t| t.verdict()).collect();
            let count =
                |wanted: fn(&Verdict) -> bool| verdicts.iter().filter(|v| wanted(v)).count();
            let mut ms: Vec<f64> = verdicts
                .iter()
                .filter_map(|verdict| match verdict {
                    Verdict::Reported(ms) => Some(*ms),
                    _ => None,
                })
                .collect();
            ms.sort_by(f64::total_cmp);
            let cell = |share| quantile(&ms, share).map_or("-".into(), |ms| format!("{ms:.0}"));
            let losses = of.iter().filter(|t| t.loss.is_some()).count();
            let held = of.iter().filter(|t| t.loss.is_none()).count();
            // Writing to a String cannot fail.
            let _ = writeln!(
                out,
                "{:>8} µε  {:<12}  {losses:>6}  {:>5}  {:>5}  {:>5}  {:>5}  {:>6}  {:>5}  {:>5}  {:>12} | {held:>5}  {:>5}",
                noise,
                knowledge.name(),
                cell(0.5),
                cell(0.95),
                cell(0.99),
                cell(1.0),
                count(|v| *v == Verdict::Missed),
                ms.iter().filter(|ms| **ms < 0.0).count(),
                count(|v| *v == Verdict::Other),
                count(|v| *v == Verdict::NotRecognised),
                count(|v| *v == Verdict::FalseAlarm),
            );
        }
    }
    out
}

/// What came before: the slide and its warning.
pub fn slide(trials: &[Trial]) -> String {
    let mut out = String::from(
        "Sliding before a loss: time since the object began to slide, and how far it had moved against the palm\n\
         object    gauge noise  losses | lost: ms p50  p95   mm p50  p95 | warned  before 15 mm   mm p50  p95\n",
    );
    for object in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        for noise in NOISE_UE {
            let of: Vec<&Trial> = trials
                .iter()
                .filter(|t| t.noise_ue == noise && t.case.setup.scenario.object == object)
                .filter(|t| t.loss.is_some())
                .collect();
            let losses: Vec<_> = of
                .iter()
                .filter_map(|t| match (&t.report, t.verdict()) {
                    (Report::Lost { t_s, .. }, Verdict::Reported(_)) => {
                        t.loss.map(|loss| (*t_s, loss))
                    }
                    _ => None,
                })
                .collect();
            let sorted = |values: Vec<f64>| {
                let mut values = values;
                values.sort_by(f64::total_cmp);
                values
            };
            let time = sorted(
                losses
                    .iter()
                    .map(|(t, loss)| 1e3 * (t - loss.slide_s))
                    .collect(),
            );
            let way = sorted(
                losses
                    .iter()
                    .filter_map(|(_, loss)| loss.moved_flag_mm.map(f64::from))
                    .collect(),
            );
            let warned = sorted(
                losses
                    .iter()
                    .filter_map(|(_, loss)| loss.warning.map(|(_, mm)| f64::from(mm)))
                    .collect(),
            );
            let early = warned.iter().filter(|mm| **mm < 15.0).count();
            let percent = |n: usize| format!("{:.0} %", 100.0 * n as f64 / losses.len() as f64);
            let cell = |values: &[f64], share, decimals: usize| {
                quantile(values, share).map_or("-".into(), |x| format!("{x:.decimals$}"))
            };
            let _ = writeln!(
                out,
                "{object:<8}  {noise:>8} µε  {:>6} | {:>12}  {:>4}  {:>6}  {:>4} | {:>6}  {:>12}  {:>7}  {:>4}",
                losses.len(),
                cell(&time, 0.5, 0),
                cell(&time, 0.95, 0),
                cell(&way, 0.5, 1),
                cell(&way, 0.95, 1),
                percent(warned.len()),
                percent(early),
                cell(&warned, 0.5, 1),
                cell(&warned, 0.95, 1),
            );
        }
    }
    out
}

/// Everything that went wrong, and the slowest reports, so that they can be run again.
pub fn worst(trials: &[Trial], slowest: usize) -> String {
    let mut out = String::new();
    for trial in trials {
        let verdict = trial.verdict();
        if matches!(
            verdict,
            Verdict::Missed | Verdict::FalseAlarm | Verdict::Other | Verdict::NotRecognised
        ) {
            let _ = writeln!(out, "{}", line(trial));
        }
    }
    for noise in NOISE_UE {
        let mut late: Vec<(f64, &Trial)> = trials
            .iter()
            .filter(|t| t.noise_ue == noise)
            .filter_map(|t| match t.verdict() {
                Verdict::Reported(ms) => Some((ms, t)),
                _ => None,
            })
            .collect();
        late.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, trial) in late.iter().take(slowest) {
            let _ = writeln!(out, "{}", line(trial));
        }
    }
    out
}

/// One trial in one line.
pub fn line(trial: &Trial) -> String {
    let case = &trial.case;
    let mut text = format!(
        "{} {:>5} at {:>3} µε: {:?}",
        case.knowledge.name(),
        case.index,
        trial.noise_ue,
        trial.verdict()
    );
    match &trial.report {
        Report::Nothing => text.push_str(", nothing reported"),
        Report::Lost { t_s, moved_mm } => {
            let _ = write!(text, ", lost at {t_s:.3} s (moved {moved_mm:.1} mm)");
        }
        Report::Other { t_s, event } => {
            let _ = write!(text, ", {event:?} at {t_s:.3} s");
        }
    }
    if let Some(loss) = trial.loss {
        let _ = write!(
            text,
            ", onset {:.3} s, slides from {:.3} s, {:.1} mm at the onset",
            loss.onset_s, loss.slide_s, loss.moved_onset_mm
        );
    }
    let _ = write!(text, "; {}", parameters(case));
    text
}

fn parameters(case: &Case) -> String {
    let scenario = &case.setup.scenario;
    let mut text = format!(
        "{} {:.0} g, {:.0} kPa, {:.1} m/s², friction {:.2}",
        scenario.object,
        1e3 * scenario.mass_kg,
        scenario.pressure_kpa,
        scenario.accel_m_s2,
        scenario.friction
    );
    if let Some(push) = case.push {
        let [x, y, z] = push.force_n;
        let _ = write!(
            text,
            ", push ({x:.1} {y:.1} {z:.1}) N at {:.2} s in {:.0} ms",
            push.start_s,
            1e3 * push.rise_s
        );
    }
    text
}

/// False reports by cause.
pub fn alarms(tallies: &[Tally]) -> String {
    let mut out = String::new();
    for tally in tallies {
        let _ = writeln!(
            out,
            "False reports in {:.2} h at {} µε\n{:<40} {:>9} {:>8} {:>6} {:>8} {:>10} {:>7} {:>9} {:>7}",
            tally.total().time_s / 3600.0,
            tally.noise_ue,
            "while",
            "h",
            "times",
            "lost",
            "per h",
            "95 % bound",
            "slips",
            "per h",
            "faults"
        );
        let rows = Activity::ALL.iter().zip(tally.counts);
        let rows = rows.map(|(activity, count)| (activity.name(), count));
        let sums = [
            ("hard motion", tally.hard_motion()),
            ("everything", tally.total()),
        ];
        for (name, count) in rows.chain(sums).filter(|(_, count)| count.times > 0) {
            let hours = count.time_s / 3600.0;
            let _ = writeln!(
                out,
                "{name:<40} {hours:>9.3} {:>8} {:>6} {:>8.3} {:>10.3} {:>7} {:>9.2} {:>7}",
                count.times,
                count.lost,
                count.lost as f64 / hours,
                poisson_upper_95(count.lost) / hours,
                count.slips,
                count.slips as f64 / hours,
                count.faults
            );
        }
        for alarm in tally.alarms.iter().take(20) {
            let _ = writeln!(
                out,
                "  {:?} in block {} at {:.3} s: {}: {}",
                alarm.event,
                alarm.block,
                alarm.t_s,
                alarm.activity.name(),
                alarm.detail
            );
        }
    }
    out
}

/// What others would have reached at the controller's rate of false alarms.
pub fn curves(curves: &[Curve]) -> String {
    let Some(ours) = curves.first().and_then(|curve| curve.equal) else {
        return String::new();
    };
    let mut out = format!(
        "Latency at {COMPARED_UE} µε at the same rate of false alarms: {} in {:.1} h\n\
         {:<28} {:>9}  {:>5}  {:>5}  {:>6}  {:>10}  | as published: alarms/h    p50    p99  missed\n",
        ours.alarms, ours.hours, "", "threshold", "p50", "p99", "missed", "p50 / ours"
    );
    let cell = |ms: Option<f64>| ms.map_or("never".into(), |ms| format!("{ms:.0}"));
    for curve in curves {
        let Some(Point {
            threshold,
            p50_ms,
            p99_ms,
            missed,
            ..
        }) = curve.equal
        else {
            continue;
        };
        let ratio = match (p50_ms, ours.p50_ms) {
            (Some(theirs), Some(ours)) => format!("{:.1}", theirs / ours),
            _ => "∞".into(),
        };
        let published = curve.published.map_or(String::new(), |point| {
            format!(
                "{:>25.2}  {:>5}  {:>5}  {:>6}",
                point.alarms as f64 / point.hours,
                cell(point.p50_ms),
                cell(point.p99_ms),
                point.missed
            )
        });
        let _ = writeln!(
            out,
            "{:<28} {threshold:>9.3}  {:>5}  {:>5}  {missed:>6}  {ratio:>10}  |{published}",
            curve.name,
            cell(p50_ms),
            cell(p99_ms),
        );
    }
    out
}

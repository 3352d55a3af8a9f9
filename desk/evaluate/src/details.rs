//! Single runs and false alarms as text.

use std::fmt::Write;

use crate::case::Case;
use crate::limits::Measured;
use crate::options::NOISE_UE;
use crate::tally::Tally;
use crate::trial::{Classification, ControllerReport, Trial};

/// False alarms that are shown of each level of noise.
const SHOWN: usize = 30;

/// All errors on the losses, with the parameters that repeat each run.
pub fn wrong(trials: &[Trial]) -> String {
    let wrong = trials.iter().filter(|trial| {
        !matches!(
            trial.classification(),
            Classification::Quiet | Classification::Reported(_) | Classification::Displaced
        )
    });
    wrong.map(|trial| line(trial) + "\n").collect()
}

/// The slowest reports at each level of noise.
pub fn slowest(trials: &[Trial], number: usize) -> String {
    let mut out = String::new();
    for noise in NOISE_UE {
        let of = trials.iter().filter(|trial| trial.noise_ue == noise);
        let reported = of.filter_map(|trial| match trial.classification() {
            Classification::Reported(ms) => Some((ms, trial)),
            _ => None,
        });
        let mut reported: Vec<_> = reported.collect();
        reported.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, trial) in reported.iter().take(number) {
            out += &(line(trial) + "\n");
        }
    }
    out
}

/// The false alarms of the workload.
pub fn alarms(tallies: &[Tally]) -> String {
    let mut out = String::new();
    for tally in tallies {
        for alarm in tally.alarms.iter().take(SHOWN) {
            // Writing to a String cannot fail.
            let _ = writeln!(
                out,
                "{} µε, block {}, {:.3} s, {}: {:?}, {}",
                alarm.noise_ue,
                alarm.block,
                alarm.t_s,
                alarm.activity.name(),
                alarm.event,
                alarm.detail
            );
        }
        if tally.alarms.len() > SHOWN {
            let more = tally.alarms.len() - SHOWN;
            let _ = writeln!(out, "{} µε: and {more} more", tally.noise_ue);
        }
    }
    out
}

/// A trial as one line.
pub fn line(trial: &Trial) -> String {
    let case = &trial.case;
    let mut text = format!(
        "{} {} at {} µε: ",
        case.knowledge.name(),
        case.index,
        trial.noise_ue,
    );
    text += &match trial.classification() {
        Classification::Quiet => "held".into(),
        Classification::Reported(ms) => format!("{ms:.0} ms"),
        Classification::Missed => "MISSED".into(),
        Classification::FalseAlarm => "FALSE ALARM".into(),
        Classification::NotRecognised => "GRIP NOT RECOGNISED".into(),
        Classification::Misnamed => "MISNAMED".into(),
        Classification::Displaced => "displaced".into(),
    };
    match &trial.report {
        ControllerReport::Nothing => text.push_str(", nothing reported"),
        ControllerReport::Lost { t_s, moved_mm } => {
            let _ = write!(text, ", lost at {t_s:.3} s (moved {moved_mm:.1} mm)");
        }
        ControllerReport::Other { t_s, event } => {
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

/// Limits as measured: what held objects reached, the line, and what lost ones reached.
pub fn limits(measured: &[Measured]) -> String {
    let mut out = String::new();
    for Measured { situation, rows } in measured {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{}", situation.name());
        for row in rows {
            let lost = row.lost.map_or("-".into(), |lost| format!("{lost:.3}"));
            let _ = writeln!(
                out,
                "  {:24} held {:7.3}   limit {:6.3}   lost {lost:>7} {:5}   of {} losses",
                row.sign, row.held, row.limit, row.unit, row.losses
            );
        }
    }
    out
}

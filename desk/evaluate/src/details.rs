//! Single runs and false alarms as text.

use std::fmt::Write;

use crate::case::Case;
use crate::tally::Tally;
use crate::trial::{Classification, ControllerReport, Trial};

/// The false alarms of the workload.
pub fn alarms(tallies: &[Tally]) -> String {
    let mut out = String::new();
    for tally in tallies {
        for alarm in &tally.alarms {
            // Writing to a String cannot fail.
            let _ = writeln!(
                out,
                "{} µε, block {}, {:.3} s, {}: {}, {}",
                alarm.noise_ue,
                alarm.block,
                alarm.t_s,
                alarm.activity.name(),
                alarm.event,
                alarm.detail
            );
        }
        let total = tally.total();
        let more = total.lost + total.faults - tally.alarms.len() as u64;
        if more > 0 {
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

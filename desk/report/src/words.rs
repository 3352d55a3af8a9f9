//! A run as text: its title, its timeline and its latency.

use std::fmt::Write;

use sim::arm::Phase;
use sim::run::{Outcome, Run};
use sim::scenario::Scenario;

/// Object, mass, acceleration and pressure of a scenario in one line.
pub fn title(scenario: &Scenario) -> String {
    format!(
        "{} {:.0} g, {} kPa, {} m/s²",
        scenario.object,
        1e3 * scenario.mass_kg,
        scenario.pressure_kpa,
        scenario.accel_m_s2
    )
}

/// Events of the arm, the object and the controller in the order of time, and the outcome.
pub fn timeline(run: &Run) -> String {
    let mut lines: Vec<(f64, &str, String)> = Vec::new();
    let mut phase = None;
    for sample in &run.samples {
        if phase != Some(sample.truth.arm.phase) {
            phase = Some(sample.truth.arm.phase);
            let words = phase_words(sample.truth.arm.phase, &run.scenario);
            lines.push((sample.truth.t_s, "arm", words));
        }
    }
    for fault in &run.faults {
        lines.push((fault.from_s, "fault", format!("{} begins", fault.name())));
        if fault.until_s.is_finite() {
            lines.push((fault.until_s, "fault", format!("{} ends", fault.name())));
        }
    }
    if let Some(t_s) = run.slid_at_s {
        lines.push((t_s, "object", "has slid 20 mm".into()));
    }
    if let Some(t_s) = run.collapse_at_s {
        lines.push((t_s, "object", "the grip has collapsed by a tenth".into()));
    }
    lines.extend(
        run.events
            .iter()
            .map(|event| (event.t_s, "controller", event.words())),
    );
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));

    let mut out = format!("{}\n", title(&run.scenario));
    for (t_s, who, words) in lines {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "  {t_s:6.3} s  {who:<10}  {words}");
    }
    let physics = match run.outcome {
        Outcome::Hold => "the object arrived",
        Outcome::Pick => "the object fell while being lifted",
        Outcome::Transfer => "the object fell while being carried",
    };
    let verdict = match (run.mistake(), run.flagged_at_s, run.latency_ms()) {
        (Some(mistake), ..) => format!("WRONG: {mistake}"),
        (None, None, _) => "no loss reported".into(),
        (None, Some(_), Some(ms)) => format!("loss reported {}", latency(ms)),
        (None, Some(s), None) => format!("loss reported at {s:.3} s; the grip never collapsed"),
    };
    let _ = writeln!(
        out,
        "  {physics}; {verdict} ({:.0} × real time)",
        run.realtime_factor
    );
    out
}

/// A latency in words. A loss that shows in one finger can be reported before the sum collapses.
pub fn latency(ms: f64) -> String {
    if ms < 0.0 {
        format!("{:.0} ms before the grip collapsed", -ms)
    } else {
        format!("{ms:.0} ms after the grip collapsed")
    }
}

fn phase_words(phase: Phase, scenario: &Scenario) -> String {
    match phase {
        Phase::Approach => "comes down over the object".into(),
        Phase::Grip => format!("waits; asks for {} kPa", scenario.pressure_kpa),
        Phase::Lift => "lifts".into(),
        Phase::Carry => "carries".into(),
        Phase::Place => "sets down".into(),
        Phase::Release => "waits; asks for release".into(),
        Phase::Retreat => "goes up again".into(),
        Phase::Done => "is done".into(),
    }
}

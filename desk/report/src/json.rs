//! Numbers, events and runs as JSON.

use serde_json::{Value, json};
use sim::events::{TimedEvent, cause, fingers, name};
use sim::fault::Injected;
use sim::run::Run;
use softgrip::telemetry::Event;

/// The float nearest to `x` with so many decimals, so that JSON shows 1.234 and not 1.2340000000000002,
/// and never a negative zero.
pub fn round(x: f64, decimals: usize) -> f64 {
    format!("{x:.decimals$}").parse().unwrap_or(x) + 0.0
}

/// `{"t_s", "event", …}`; fingers count from 1.
pub fn event(timed: &TimedEvent) -> Value {
    let mut value = json!({"t_s": round(timed.t_s, 6), "event": name(&timed.event)});
    match timed.event {
        Event::Contact { finger } => value["finger"] = json!(finger + 1),
        Event::Slip { rate } => value["rate_per_s"] = json!(round(rate.into(), 4)),
        Event::Lost(loss) => {
            value["onset_s"] = json!(round(timed.onset_s(&loss), 6));
            value["cause"] = json!(cause(loss.cause));
            let fall = |share: f32| json!(round(share.into(), 3));
            value["evidence"] = json!(loss.evidence.map(|share| share.map(fall)));
        }
        Event::Holding { touching } => value["fingers"] = json!(fingers(touching)),
        Event::Fault { fault, finger } => {
            value["code"] = json!(fault.code());
            value["fault"] = json!(format!("{fault:?}"));
            if let Some(finger) = finger {
                value["finger"] = json!(finger + 1);
            }
        }
        Event::Refused(refusal) => value["reason"] = json!(format!("{refusal:?}")),
        Event::Regulator { delay_ms } => value["delay_ms"] = json!(delay_ms),
        Event::Empty
        | Event::Released
        | Event::Regripping
        | Event::AirLoss
        | Event::Tared
        | Event::Swept { .. }
        | Event::TareDue
        | Event::ClockInternal
        | Event::Acknowledged => {}
    }
    value
}

/// A run as one JSON object. Times are in s since the start of the run.
pub fn run(run: &Run) -> Value {
    let scenario = &run.scenario;
    json!({
        "object": scenario.object,
        "mass_kg": scenario.mass_kg,
        "accel_m_s2": scenario.accel_m_s2,
        "pressure_kpa": scenario.pressure_kpa,
        "friction": scenario.friction,
        "noise_ue": scenario.noise_ue,
        "seed": scenario.seed,
        "faults": run.faults.iter().map(Injected::to_string).collect::<Vec<_>>(),
        "outcome": run.outcome.name(),
        "slid_at_s": run.slid_at_s.map(|s| round(s, 6)),
        "collapse_at_s": run.collapse_at_s.map(|s| round(s, 6)),
        "flagged_at_s": run.flagged_at_s.map(|s| round(s, 6)),
        "latency_ms": run.latency_ms().map(|ms| round(ms, 3)),
        "events": run.events.iter().map(event).collect::<Vec<_>>(),
        "realtime_factor": round(run.realtime_factor, 1),
    })
}

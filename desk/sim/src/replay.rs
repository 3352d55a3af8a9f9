//! Replay of a recorded trace through the controller.

use softgrip::frontend::FrontEnd;
use softgrip::units::{AdcCode, Instant, Kilopascals, Microstrain, Volts};
use softgrip::{Command, Controller, Grip, RawFrame, TICK_US};

use crate::events::TimedEvent;
use crate::trace::resample::resample;
use crate::trace::{Row, Trace};

/// Feeds a trace to the controller, through the electronics that it has been told of, and returns what it reported.
///
/// A set-point that rises from zero, or changes, is a grip; one that falls to zero a release. Whoever
/// recorded the next grip had seen the loss before, so a latched loss is acknowledged then; a set-point that
/// was seen to fall on a ramp is no such grip.
pub fn replay(trace: &Trace, front_end: &FrontEnd, mut controller: Controller) -> Vec<TimedEvent> {
    let mut events = Vec::new();
    let mut asked = 0.0;
    let mut latched = false;
    for (tick, row) in resample(&trace.rows).into_iter().enumerate() {
        // Clock of the controller: starts at one tick, as on the target.
        let now = Instant::from_micros((tick as u64 + 1) * TICK_US);
        let mut step = |command| {
            let outputs = controller.step(now, &frame(&row, front_end), command);
            let t_s = row.t_s;
            events.extend(
                outputs
                    .events
                    .iter()
                    .map(|&event| TimedEvent { t_s, event }),
            );
            outputs.indicators.lost
        };
        let falls = !trace.stepped && row.setpoint_kpa < asked;
        // Whoever recorded it was there all the time.
        let command = if row.setpoint_kpa == asked {
            Command::Alive
        } else if row.setpoint_kpa > 0.0 {
            match (latched, falls) {
                (true, true) => Command::Alive,
                (true, false) => {
                    // Takes this tick; the grip follows in the next.
                    latched = step(Command::Acknowledge);
                    continue;
                }
                (false, _) => Command::Grip(Grip::Pressure(Kilopascals(row.setpoint_kpa as f32))),
            }
        } else {
            Command::Release
        };
        asked = row.setpoint_kpa;
        latched = step(command);
    }
    events
}

/// Converter codes for a row. Casts to codes saturate.
fn frame(row: &Row, front_end: &FrontEnd) -> RawFrame {
    let code = |code: f32| AdcCode(code.round() as u16);
    RawFrame {
        gauges: row.strain_ue.map(|ue| match ue.is_finite() {
            true => code(front_end.gauge_code(0, Microstrain(ue as f32))),
            false => AdcCode(u16::MAX),
        }),
        monitor: code(front_end.monitor_code(Kilopascals(row.pressure_kpa as f32))),
        supply: code(front_end.supply_code(Volts(24.0))),
        rail: softgrip::frontend::RAIL,
        scans: 1,
        overrun: false,
        carried: !row.measured,
    }
}

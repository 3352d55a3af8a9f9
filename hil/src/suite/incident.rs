//! Something happens while the sphere is held: how it is brought about, and what must follow a restart.

use rigless::device::ResetCause;
use rigless::time::VirtualNanos;
use sim::scenario::Scenario;
use softgrip::telemetry::Indicators;
use softgrip::units::DacCode;

use super::test::Outcome;
use crate::bench::{self, MS, Record, Setup};
use crate::closed_loop::{self, Loop};
use crate::moment::Moment;

/// From a reset to a defined code at the regulator.
pub const SAFE_AFTER_RESET_MS: f64 = 0.03;

/// What happened around something that was done while the sphere was held.
#[derive(Debug, Clone, Default)]
pub struct Incident {
    /// When it was done, ms.
    pub at_ms: u64,
    /// The command before.
    pub command: DacCode,
    /// What the robot was told at the end.
    pub at_the_end: Indicators,
}

/// From *holding* to the incident, and from there to the end, ms. The clock of the firmware counts in periods of
/// 32.768 ms, and the tick that is brought about by [`Nucleo::make_tick_due`](crate::board::Nucleo::make_tick_due) must
/// not be due beyond the end of one.
const HELD_MS: u64 = 120;
const AFTER_MS: u64 = 500;

/// Grips the sphere, and does something once it is held. The robot's grip input stays on.
pub fn while_holding(
    setup: &Setup<'_>,
    mut act: impl FnMut(&mut Loop, &mut Moment<'_>) -> anyhow::Result<()> + Send + 'static,
) -> anyhow::Result<(Incident, Record)> {
    let plant = Loop::new(&Scenario::default(), closed_loop::fingers()?);
    let state = (plant, None::<u64>, Incident::default());
    let ((_, held, incident), record) = bench::run(setup, state, move |state, moment| {
        let (plant, held, incident) = state;
        anyhow::ensure!(plant.step(moment), "the sphere was never held");
        let ms = moment.ms;
        if held.is_none() && moment.indicators().holding {
            *held = Some(ms);
        }
        if *held == Some(ms - HELD_MS.min(ms)) {
            incident.at_ms = ms;
            incident.command = moment.command();
            act(plant, moment)?;
        }
        incident.at_the_end = moment.indicators();
        Ok(held.is_none_or(|held| ms < held + HELD_MS + AFTER_MS))
    })?;
    anyhow::ensure!(held.is_some(), "the sphere was never held");
    Ok((incident, record))
}

/// Checks that the chip has restarted once, with the regulator's command at zero from then on.
pub fn vented_and_back(
    incident: &Incident,
    record: &Record,
    cause: ResetCause,
    says: &str,
    outcome: &mut Outcome,
) {
    outcome.must(
        incident.command > DacCode(0),
        "there was no pressure before",
    );
    let [reset] = record.resets[..] else {
        outcome
            .failures
            .push(format!("not one reset: {:?}", record.resets));
        return;
    };
    outcome.must(
        reset.cause == cause,
        format!("the reset's cause is {:?}, not {cause:?}", reset.cause),
    );
    let after = record.dac.iter().filter(|write| write.at >= reset.at);
    let defined = after.clone().find(|write| write.code.is_some());
    let defined_ms = defined.map_or(f64::NAN, |write| since_ms(reset.at, write.at));
    outcome.at_most(
        "reset to defined command",
        defined_ms,
        "ms",
        SAFE_AFTER_RESET_MS,
    );
    let highest = after.filter_map(|write| write.code).max();
    let highest = highest.map_or(f64::NAN, |code| f64::from(code.0));
    outcome.at_most("highest code after the reset", highest, "", 0.0);
    outcome.must(
        record.message(reset.at.0 / MS, says).is_some(),
        format!("nothing says {says:?} after the restart"),
    );
    // The program's own failure stays latched until somebody acknowledges it; a pin's or a supply's is over.
    let failed = cause != ResetCause::Pin;
    let end = incident.at_the_end;
    outcome.must(
        end == Indicators {
            ready: !failed,
            fault: failed,
            ..Indicators::default()
        },
        format!("at the end the robot is told {end:?}"),
    );
}

/// From one moment to another, ms.
pub fn since_ms(from: VirtualNanos, to: VirtualNanos) -> f64 {
    (to.0 as f64 - from.0 as f64) / MS as f64
}

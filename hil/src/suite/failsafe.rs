//! The program goes wrong: the fingers open, the host hears why, and the chip starts again.

use rigless::device::ResetCause;
use rigless::time::VirtualNanos;
use softgrip::telemetry::Indicators;
use softgrip::units::DacCode;
use twin::scenario::Scenario;

use super::boot::SAFE_AFTER_RESET_MS;
use super::{Context, Outcome, Test};
use crate::bench::{self, MS, Moment, Record, Setup};
use crate::closed_loop::{self, Loop};
use crate::inject::{self, Derailment, Task, Wrong};
use crate::rtt::Host;

pub const TESTS: [Test; 9] = [
    Test {
        name: "watchdog: control hangs",
        about: "reset, vented, reported after the restart",
        run: |context| watchdog(context, Task::Control, Wrong::Hang),
    },
    Test {
        name: "watchdog: control stops",
        about: "the same, where the task is never woken again",
        run: |context| watchdog(context, Task::Control, Wrong::Stop),
    },
    Test {
        name: "watchdog: telemetry hangs",
        about: "the same; the control tick goes on until the reset",
        run: |context| watchdog(context, Task::Telemetry, Wrong::Hang),
    },
    Test {
        name: "watchdog: telemetry stops",
        about: "the same, where the task no longer checks in",
        run: |context| watchdog(context, Task::Telemetry, Wrong::Stop),
    },
    Test {
        name: "panic",
        about: "first the safe output, then the message, then the reset",
        run: |context| crash(context, Wrong::Panic, "panicked at"),
    },
    Test {
        name: "hard fault: undefined instruction",
        about: "the same",
        run: |context| crash(context, Wrong::HardFault, "hard fault at 0x081e"),
    },
    Test {
        name: "hard fault: stack overflow",
        about: "the same, on a stack that starts over",
        run: |context| crash(context, Wrong::StackOverflow, "hard fault: stack overflow"),
    },
    Test {
        name: "overrun of the converter",
        about: "the scan starts again at its first channel",
        run: overrun,
    },
    Test {
        name: "24 V sag",
        about: "is reported, and what is held is kept as the settings say",
        run: sag,
    },
];

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

/// From *holding* to the incident, and from there to the end, ms.
const HELD_MS: u64 = 100;
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

fn since_ms(from: VirtualNanos, to: VirtualNanos) -> f64 {
    (to.0 as f64 - from.0 as f64) / MS as f64
}

/// The watchdog's 100 ms, with a clock of 32 kHz in the model, after at most one feeding late.
const WATCHDOG_MS: f64 = 125.0;

fn watchdog(context: &Context<'_>, task: Task, wrong: Wrong) -> anyhow::Result<Outcome> {
    let image = context.image;
    let setup = Setup {
        placed: Some(inject::placed(image)?),
        ..Setup::new(image, Host::Reading)
    };
    let derailment = Derailment::new(image, task, wrong)?;
    let (incident, record) = while_holding(&setup, move |_, moment| derailment.apply(moment))?;
    let mut outcome = Outcome::default();
    vented_and_back(
        &incident,
        &record,
        ResetCause::Model("IWDG"),
        "reset: Watchdog",
        &mut outcome,
    );
    if let Some(reset) = record.resets.first() {
        let ms = since_ms(bench::moment_at(incident.at_ms), reset.at);
        outcome.at_most("from the fault to the reset", ms, "ms", WATCHDOG_MS);
    }
    Ok(outcome)
}

/// From a panic to the safe output.
const SAFE_AFTER_PANIC_US: f64 = 100.0;

fn crash(context: &Context<'_>, wrong: Wrong, says: &str) -> anyhow::Result<Outcome> {
    let image = context.image;
    let setup = Setup {
        placed: Some(inject::placed(image)?),
        watch: Some(wrong.address()),
        watch_rtt: true,
        ..Setup::new(image, Host::Reading)
    };
    let derailment = Derailment::new(image, Task::Telemetry, wrong)?;
    let (incident, record) = while_holding(&setup, move |_, moment| {
        moment.guard_ram();
        derailment.apply(moment)
    })?;
    let mut outcome = Outcome::default();
    vented_and_back(
        &incident,
        &record,
        ResetCause::Core,
        "reset: Software",
        &mut outcome,
    );
    outcome.must(
        record.message(incident.at_ms, says).is_some(),
        format!("nothing says {says:?}"),
    );
    let Some(&began) = record.hits.first() else {
        outcome.failures.push("the task did not go wrong".into());
        return Ok(outcome);
    };
    let safe = record
        .dac
        .iter()
        .find(|write| write.at > began && write.code == Some(DacCode(0)));
    let said = record.rtt_writes.iter().find(|&&at| at > began);
    let reset = record.resets.first().map(|reset| reset.at);
    let (Some(safe), Some(&said), Some(reset)) = (safe.map(|write| write.at), said, reset) else {
        outcome
            .failures
            .push(format!("safe {safe:?}, said {said:?}, reset {reset:?}"));
        return Ok(outcome);
    };
    let us = |at| 1e3 * since_ms(began, at);
    outcome.at_most("to the safe output", us(safe), "µs", SAFE_AFTER_PANIC_US);
    outcome.number("to the message", us(said), "µs");
    outcome.number("to the reset", us(reset), "µs");
    outcome.must(
        safe < said && said < reset,
        "not in this order: safe output, message, reset",
    );
    Ok(outcome)
}

fn overrun(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        telemetry_us: 1_000,
        ..Setup::new(context.image, Host::Reading)
    };
    // DMA2 stream 0, its enable bit.
    let (stream, enable) = (0x4002_6410, 1);
    let (_, record) = while_holding(&setup, move |_, moment| {
        let control = moment.register(stream)?;
        moment.set_register(stream, control & !enable)
    })?;
    let mut outcome = Outcome::default();
    let recording = crate::recording::Recording::of(&record.messages)?;
    let lost = recording.ticks.iter().position(|seen| seen.frame.overrun);
    let Some(lost) = lost else {
        outcome.failures.push("no tick has seen an overrun".into());
        return Ok(outcome);
    };
    let overruns = recording
        .ticks
        .iter()
        .filter(|seen| seen.frame.overrun)
        .count();
    outcome.number("ticks that saw an overrun", overruns as f64, "");
    // The order of the channels: nothing jumps by more than the carried sphere makes it.
    let far = |a: u16, b: u16| f64::from(a.abs_diff(b)) / 16.0;
    let codes = |i: usize| {
        let frame = recording.ticks[i].frame;
        [
            frame.gauges[0].0,
            frame.gauges[1].0,
            frame.gauges[2].0,
            frame.monitor.0,
            frame.supply.0,
        ]
    };
    let (before, after) = (
        codes(lost - 1),
        codes((lost + 10).min(recording.ticks.len() - 1)),
    );
    let jump = before
        .iter()
        .zip(after)
        .map(|(&a, b)| far(a, b))
        .fold(0.0, f64::max);
    let apart = (0..5)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .filter(|&(i, j)| i >= 3 || j >= 3)
        .map(|(i, j)| far(before[i], before[j]))
        .fold(f64::INFINITY, f64::min);
    outcome.number("gauges, monitor and supply are apart by", apart, "steps");
    outcome.at_most("a channel differs after it by", jump, "steps", 15.0);
    outcome.must(record.resets.is_empty(), "the chip has restarted");
    let faults = recording
        .events
        .iter()
        .filter(|event| event.text.starts_with("Fault"));
    for fault in faults {
        outcome.notes.push(format!("reported: {}", fault.text));
    }
    Ok(outcome)
}

/// Below the 20.4 V at which a regulator may fail.
const SAG_V: f32 = 19.0;

fn sag(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup::new(context.image, Host::Reading);
    let (incident, record) = while_holding(&setup, |plant, _| {
        plant.supply_v = Some(SAG_V);
        Ok(())
    })?;
    let mut outcome = Outcome::default();
    let said = record.message(incident.at_ms, "SupplyLow");
    let ms = said.map_or(f64::NAN, |message| (message.ms - incident.at_ms) as f64);
    outcome.at_most("to the report", ms, "ms", 25.0);
    let end = incident.at_the_end;
    outcome.must(
        end.fault && !end.ready && !end.lost,
        format!("at the end the robot is told {end:?}"),
    );
    let last = record.dac.last().and_then(|write| write.code);
    outcome.must(
        last.is_some_and(|code| code.0.abs_diff(incident.command.0) < 20),
        format!("the command went from {:?} to {last:?}", incident.command),
    );
    outcome.must(record.resets.is_empty(), "the chip has restarted");
    Ok(outcome)
}

//! The program goes wrong: the fingers open, the host hears why, and the chip starts again.

use anyhow::Context as _;
use rigless::device::ResetCause;
use rigless::time::VirtualNanos;
use sim::plant::Pins;
use softgrip::inputs::Levels;
use softgrip::telemetry::Indicators;
use softgrip::units::{DacCode, Kilopascals};

use super::incident::{since_ms, vented_and_back, while_holding};
use super::test::{Context, Outcome, Test};
use crate::bench::{self, MS, Record, Setup};
use crate::calls;
use crate::closed_loop::{REST, front_end, pins_at_rest};
use crate::inject::{self, Derailment, Task, Wrong};
use crate::rtt::Host;

pub const TESTS: [Test; 16] = [
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
        run: |context| crash(context, Wrong::Panic, "panicked, called from"),
    },
    Test {
        name: "hard fault: undefined instruction",
        about: "the same",
        run: |context| crash(context, Wrong::HardFault, "hard fault at 0x081e"),
    },
    Test {
        name: "hard fault: stack overflow",
        about: "the same, on a stack that starts over",
        run: |context| {
            crash(
                context,
                Wrong::StackOverflow,
                "hard fault: stack pointer 0x1fff",
            )
        },
    },
    Test {
        name: "hard fault: stack pointer astray",
        about: "the same, from a stack pointer above all RAM",
        run: |context| {
            crash(
                context,
                Wrong::StackAway,
                "hard fault: stack pointer 0x2003",
            )
        },
    },
    Test {
        name: "interrupt without a handler",
        about: "the same",
        run: |context| crash(context, Wrong::Interrupt, "interrupt 0 has no handler"),
    },
    Test {
        name: "panic, and a tick in between",
        about: "a tick before the interrupts are off does not get behind the safe output",
        run: tick_in_between,
    },
    Test {
        name: "panic that nobody heard",
        about: "a host that comes after the restart is told the calls and the state",
        run: unheard,
    },
    Test {
        name: "restart loop",
        about: "after the third panic in ten seconds: safe, no more resets, and why; an acknowledgement ends it",
        run: restart_loop,
    },
    Test {
        name: "overrun of the converter",
        about: "the scan starts again at its first channel",
        run: overrun,
    },
    Test {
        name: "3.3 V rail off by 2 %",
        about: "the true pressure is shown all the same",
        run: |context| rail_off(context, 1.02, None),
    },
    Test {
        name: "3.3 V rail off by 6 %",
        about: "is a fault, and vents",
        run: |context| rail_off(context, 0.94, Some("RailOff")),
    },
    Test {
        name: "24 V sag",
        about: "is reported, and what is held is kept as the settings say",
        run: sag,
    },
];

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
        told_after(
            reset.at,
            &format!("the {task:?} task did not check in"),
            &record,
            &mut outcome,
        );
    }
    Ok(outcome)
}

/// From a panic to the safe output.
const SAFE_AFTER_PANIC_US: f64 = 5.0;

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
    told_after(reset, says, &record, &mut outcome);
    Ok(outcome)
}

/// What the program died of, and while doing what, is told after the restart.
fn told_after(reset: VirtualNanos, says: &str, record: &Record, outcome: &mut Outcome) {
    for says in [says, "while Holding:"] {
        outcome.must(
            record.message(reset.0 / MS, says).is_some(),
            format!("nothing says {says:?} after the restart"),
        );
    }
}

fn tick_in_between(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let image = context.image;
    let setup = Setup {
        placed: Some(inject::placed(image)?),
        watch: Some(Wrong::Panic.address()),
        tick_before: Some(inject::interrupts_off(image)?),
        ..Setup::new(image, Host::Reading)
    };
    let derailment = Derailment::new(image, Task::Telemetry, Wrong::Panic)?;
    let (_, record) = while_holding(&setup, move |_, moment| derailment.apply(moment))?;
    let mut outcome = Outcome::default();
    let (Some(&began), Some(reset)) = (record.hits.first(), record.resets.first()) else {
        outcome.failures.push("the task did not go wrong".into());
        return Ok(outcome);
    };
    let writes = record.dac.iter();
    let writes = writes.filter(|write| write.at > began && write.at < reset.at);
    let codes: Vec<_> = writes.filter_map(|write| write.code).collect();
    outcome.must(
        codes.iter().any(|&code| code > DacCode(0)),
        "no tick fell in between",
    );
    let last = codes.last().map_or(f64::NAN, |code| f64::from(code.0));
    outcome.at_most("code from the panic to the reset", last, "", 0.0);
    Ok(outcome)
}

fn unheard(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let image = context.image;
    let setup = Setup {
        placed: Some(inject::placed(image)?),
        // What follows the restart fills the buffer long before.
        host_from_ms: 4_000,
        ..Setup::new(image, Host::Reading)
    };
    let derailment = Derailment::new(image, Task::Telemetry, Wrong::Panic)?;
    let ((), record) = bench::run(&setup, (), move |(), moment| {
        if moment.ms == 0 {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
        }
        if moment.ms == 1_000 {
            derailment.apply(moment)?;
        }
        Ok(moment.ms < 4_100)
    })?;
    let mut outcome = Outcome::default();
    outcome.must(record.resets.len() == 1, format!("{:?}", record.resets));
    outcome.must(
        record.message(0, "while Idle:").is_some(),
        "nothing says what it was doing",
    );
    let told = record.message(0, "panicked, called from");
    let told = told.map_or("", |message| message.text());
    let calls: Vec<u64> = told
        .split(['[', ']', ','])
        .filter_map(|word| u64::from_str_radix(word.trim().strip_prefix("0x")?, 16).ok())
        .collect();
    // Behind the call of the panic there, a long instruction.
    let site = calls::panic_site(image).context("the image never panics")? + 4;
    outcome.must(
        calls.contains(&(site | 1)),
        format!("{told:?} does not lead to {site:#010x}"),
    );
    let names = calls.iter().filter_map(|&call| image.function_at(call));
    outcome
        .notes
        .push(format!("{told}: {:?}", names.collect::<Vec<_>>()));
    Ok(outcome)
}

fn restart_loop(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let image = context.image;
    let setup = Setup {
        placed: Some(inject::placed(image)?),
        ..Setup::new(image, Host::Reading)
    };
    let derailment = Derailment::new(image, Task::Telemetry, Wrong::Panic)?;
    let (panics_ms, asked_ms, ack_ms) = ([1_000, 4_000, 7_000], 12_000, 12_500);
    let state = (None, None);
    let ((stopped, after), record) = bench::run(&setup, state, move |state, moment| {
        let ms = moment.ms;
        moment.set_pins(&pins_at_rest());
        moment.set_levels(Levels {
            acknowledge: (ack_ms..ack_ms + 50).contains(&ms),
            ..REST
        });
        if panics_ms.contains(&ms) {
            derailment.apply(moment)?;
        }
        if ms == asked_ms {
            state.0 = Some(moment.indicators());
        }
        state.1 = Some(moment.indicators());
        Ok(ms < 13_000)
    })?;
    let mut outcome = Outcome::default();
    let resets = record.resets.iter().map(|reset| reset.at.0 / MS);
    let resets: Vec<u64> = resets.collect();
    outcome.must(
        matches!(resets[..], [a, b, c, d] if a < 2_000 && b < 5_000 && c < 8_000 && d >= ack_ms),
        format!(
            "resets at {resets:?} ms, not one after each panic and one after the acknowledgement"
        ),
    );
    let says = "three failures in ten seconds";
    let told = record.messages.iter();
    let told = told.filter(|message| message.text().contains(says)).count();
    // One per second from the third reset to the acknowledgement.
    outcome.must(
        (5..=6).contains(&told),
        format!("{says:?} is said {told} times"),
    );
    outcome.must(
        record.message(8_000, "panicked, called from").is_some(),
        "it does not go on telling why",
    );
    let highest = record.dac.iter().filter_map(|write| write.code).max();
    outcome.must(
        highest == Some(DacCode(0)),
        format!("the command was {highest:?}"),
    );
    let fault = Indicators {
        fault: true,
        ..Indicators::default()
    };
    outcome.must(
        stopped == Some(fault),
        format!("stopped, the robot is told {stopped:?}"),
    );
    let ready = Indicators {
        ready: true,
        ..Indicators::default()
    };
    outcome.must(
        after == Some(ready),
        format!("acknowledged, the robot is told {after:?}"),
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

/// What the monitor shows, kPa: little enough for the fingers to be at rest.
const SHOWN_KPA: f32 = 7.0;

fn rail_off(context: &Context<'_>, rail: f64, fault: Option<&str>) -> anyhow::Result<Outcome> {
    let setup = Setup::new(context.image, Host::Reading);
    let (from_ms, until_ms) = (1_500, 2_000);
    let ((), record) = bench::run(&setup, (), move |(), moment| {
        let monitor = front_end().monitor_code(Kilopascals(SHOWN_KPA));
        let pins = Pins {
            monitor: f64::from(monitor) / 65_536.0,
            ..pins_at_rest()
        };
        moment.set_pins_at_rail(&pins, if moment.ms < from_ms { 1.0 } else { rail });
        moment.set_levels(REST);
        Ok(moment.ms < until_ms)
    })?;
    let mut outcome = Outcome::default();
    let recording = crate::recording::Recording::of(&record.messages)?;
    let last = recording.ticks.last().context("no snapshot")?;
    let told = f64::from(last.frame.rail.0);
    outcome.number("rail as told", told, "mV");
    outcome.at_most(
        "which is wrong by",
        (told - 3_300.0 * rail).abs(),
        "mV",
        5.0,
    );
    let pressure = last.snapshot.pressure.context("no pressure")?;
    outcome.at_most(
        "pressure is wrong by",
        f64::from((pressure.0 - SHOWN_KPA).abs()),
        "kPa",
        0.05,
    );
    match fault {
        Some(fault) => {
            let said = record.message(from_ms, fault);
            let ms = said.map_or(f64::NAN, |message| (message.ms - from_ms) as f64);
            outcome.at_most("to the report", ms, "ms", 25.0);
        }
        None => outcome.must(
            recording.events.is_empty(),
            format!("reported: {:?}", recording.events),
        ),
    }
    Ok(outcome)
}

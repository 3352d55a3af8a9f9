//! Starts, of all kinds.

use rigless::device::ResetCause;
use softgrip::units::DacCode;

use super::incident::{SAFE_AFTER_RESET_MS, vented_and_back, while_holding};
use super::test::{Context, Outcome, Test};
use crate::bench::{self, MS, Setup};
use crate::board::Restart;
use crate::closed_loop::{REST, pins_at_rest};
use crate::rtt::Host;

pub const TESTS: [Test; 8] = [
    Test {
        name: "boot",
        about: "the command is defined before anything else, and is zero until a grip is asked for",
        run: boot,
    },
    Test {
        name: "reset: pin",
        about: "while something is held: vents, starts again, does not grip by itself",
        run: |context| restarted(context, Restart::Pin, "reset: Pin"),
    },
    Test {
        name: "reset: power cycle",
        about: "the same, with RAM that forgets",
        run: |context| restarted(context, Restart::PowerOn, "reset: PowerOn"),
    },
    Test {
        name: "reset: brown-out",
        about: "the same, with RAM that does not",
        run: |context| restarted(context, Restart::BrownOut, "reset: BrownOut"),
    },
    Test {
        name: "reset: debugger",
        about: "the same: flashing is no fault of the program",
        run: |context| restarted(context, Restart::Debugger, "reset: Software"),
    },
    Test {
        name: "clock: none from outside",
        about: "starts on the chip's own oscillator, says so, and ticks as ever",
        run: no_clock,
    },
    Test {
        name: "identity on request",
        about: "who asks is told once more what runs here; nobody can ask for telemetry too rarely",
        run: identity,
    },
    Test {
        name: "a grip that is on at power-up",
        about: "does nothing until it has been off",
        run: grip_at_power_up,
    },
];

/// The flash's access control register, and its bits for data cache, instruction cache and prefetch (RM0090,
/// FLASH_ACR).
const FLASH_ACR: u64 = 0x4002_3c00;
const CACHES: u32 = 0x700;

fn boot(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        watch_rtt: true,
        ..Setup::new(context.image, Host::Reading)
    };
    let (ready_ms, record) = bench::run(&setup, None, |ready_ms, moment| {
        if moment.ms == 0 {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
        }
        if moment.indicators().ready && ready_ms.is_none() {
            let caches = moment.register(FLASH_ACR)? & CACHES;
            anyhow::ensure!(
                caches == CACHES,
                "of caches and prefetch only {caches:#x} are on"
            );
            *ready_ms = Some(moment.ms);
        }
        Ok(moment.ms < 500)
    })?;
    let mut outcome = Outcome::default();
    // The march writes a word five times, and start-up gives it its value.
    let marched = record.rtt_writes.iter().filter(|at| at.0 < MS / 2).count();
    outcome.must(
        marched > 5,
        format!("before it had a value, a variable was written {marched} times"),
    );
    let defined = record.dac.iter().find(|write| write.code.is_some());
    let defined_ms = defined.map_or(f64::NAN, |write| write.at.0 as f64 / MS as f64);
    outcome.at_most(
        "reset to defined command",
        defined_ms,
        "ms",
        SAFE_AFTER_RESET_MS,
    );
    let highest = record.dac.iter().filter_map(|write| write.code).max();
    let highest = highest.map_or(f64::NAN, |code| f64::from(code.0));
    outcome.at_most("highest code before any grip", highest, "", 0.0);
    let first = record.ticks.first();
    let first_ms = first.map_or(f64::NAN, |tick| tick.at.0 as f64 / MS as f64);
    outcome.number("reset to first tick", first_ms, "ms");
    let ready_ms = ready_ms.map_or(f64::NAN, |ms| ms as f64);
    outcome.at_most("reset to ready", ready_ms, "ms", 100.0);
    outcome.must(record.resets.is_empty(), format!("{:?}", record.resets));
    match record.messages.first() {
        Some(message) if message.text().starts_with("softgrip ") => {
            outcome.notes.push(message.text().to_string());
        }
        other => outcome
            .failures
            .push(format!("the first message is {other:?}")),
    }
    Ok(outcome)
}

fn no_clock(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        has_clock: false,
        ..Setup::new(context.image, Host::Reading)
    };
    let record = super::timing::idle(&setup, 2_000)?;
    let mut outcome = Outcome::default();
    let first = record.ticks.first();
    let first_ms = first.map_or(f64::NAN, |tick| tick.at.0 as f64 / MS as f64);
    outcome.at_most("reset to first tick", first_ms, "ms", 1_000.0);
    super::timing::jitter(&record, &mut outcome);
    let recording = crate::recording::Recording::of(&record.messages)?;
    outcome.must(
        !recording.ticks.is_empty() && recording.ticks.iter().all(|tick| tick.internal_clock),
        "a record does not say so",
    );
    for says in ["clock: Internal", "ClockInternal"] {
        outcome.must(
            record.message(0, says).is_some(),
            format!("nothing says {says:?}"),
        );
    }
    Ok(outcome)
}

fn identity(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        // Ten seconds: the watchdog would come first.
        telemetry_us: 10_000_000,
        ..Setup::new(context.image, Host::Reading)
    };
    let request = context.image.variable("TELL_IDENTITY")?.address;
    let asked_ms = 500;
    let ((), record) = bench::run(&setup, (), move |(), moment| {
        if moment.ms == 0 {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
        }
        if moment.ms == asked_ms {
            moment.set_word(request, 1)?;
        }
        Ok(moment.ms < 2_500)
    })?;
    let mut outcome = Outcome::default();
    let said = record.message(asked_ms, "softgrip ");
    let after_ms = said.map_or(f64::NAN, |message| (message.ms - asked_ms) as f64);
    outcome.at_most("asked to told", after_ms, "ms", 60.0);
    outcome.must(record.resets.is_empty(), format!("{:?}", record.resets));
    outcome.must(
        record.message(0, "brown-out level 3 is not set").is_some(),
        "a chip as delivered is not told apart",
    );
    let seconds = record.messages.iter();
    let seconds = seconds.filter(|message| {
        message
            .text()
            .starts_with("longest tick of the last second")
    });
    outcome.must(
        seconds.count() == 2,
        "the longest tick is not told once per second",
    );
    Ok(outcome)
}

fn restarted(context: &Context<'_>, restart: Restart, says: &str) -> anyhow::Result<Outcome> {
    let setup = Setup::new(context.image, Host::Reading);
    let (incident, record) = while_holding(&setup, move |_, moment| {
        if restart == Restart::PowerOn {
            moment.scramble_ram()?;
        }
        moment.restart(restart);
        Ok(())
    })?;
    let mut outcome = Outcome::default();
    vented_and_back(&incident, &record, ResetCause::Pin, says, &mut outcome);
    Ok(outcome)
}

fn grip_at_power_up(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup::new(context.image, Host::Reading);
    let (off_ms, on_ms) = (300, 400);
    let (before, record) = bench::run(&setup, None, move |before, moment| {
        moment.set_pins(&pins_at_rest());
        moment.set_levels(softgrip::inputs::Levels {
            grip: moment.ms < off_ms || moment.ms >= on_ms,
            ..REST
        });
        if moment.ms == on_ms {
            *before = Some(moment.command());
        }
        Ok(moment.ms < on_ms + 50)
    })?;
    let mut outcome = Outcome::default();
    outcome.must(
        before == Some(DacCode(0)),
        format!("the command was {before:?} before the input had been off"),
    );
    let rises = record
        .dac
        .iter()
        .find(|write| write.code.is_some_and(|code| code > DacCode(0)));
    let after_ms = rises.map_or(f64::NAN, |write| {
        (write.at.0 as f64 - bench::moment_at(on_ms).0 as f64) / MS as f64
    });
    // 5 ms of bounce, and a tick.
    outcome.at_most("input on to pressure", after_ms, "ms", 7.0);
    Ok(outcome)
}

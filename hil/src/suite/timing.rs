//! The control tick is never late, whatever the host does, and for as long as you like.

use decode::Decoded;

use super::test::{Context, Outcome, Test};
use crate::bench::{self, MS, Preset, Record, Setup, Tick};
use crate::closed_loop::{REST, pins_at_rest};
use crate::rtt::Host;

pub const TESTS: [Test; 10] = [
    Test {
        name: "endurance",
        about: "no late tick, lost event or growing stack, across the 32-bit ends of the clock",
        run: endurance,
    },
    Test {
        name: "tick: 50 Hz, host reading",
        about: "60 s",
        run: |context| minute(context, 20_000, Host::Reading),
    },
    Test {
        name: "tick: 50 Hz, no host",
        about: "60 s",
        run: |context| minute(context, 20_000, Host::Absent),
    },
    Test {
        name: "tick: 50 Hz, host silent",
        about: "60 s; the host says that it is there, and does not read",
        run: |context| minute(context, 20_000, Host::Silent),
    },
    Test {
        name: "tick: 1 kHz, host reading",
        about: "60 s",
        run: |context| minute(context, 1_000, Host::Reading),
    },
    Test {
        name: "tick: 1 kHz, no host",
        about: "60 s",
        run: |context| minute(context, 1_000, Host::Absent),
    },
    Test {
        name: "tick: 1 kHz, host silent",
        about: "60 s; the host says that it is there, and does not read",
        run: |context| minute(context, 1_000, Host::Silent),
    },
    Test {
        name: "record: cost, host reading",
        about: "of one per tick: at most 5 % of the core's time",
        run: |context| cost(context, Host::Reading),
    },
    Test {
        name: "record: cost, no host",
        about: "of one per tick: at most 5 % of the core's time",
        run: |context| cost(context, Host::Absent),
    },
    Test {
        name: "record: cost, host silent",
        about: "of one per tick: at most 5 % of the core's time",
        run: |context| cost(context, Host::Silent),
    },
];

const JITTER_US: f64 = 50.0;
/// Nominal time between two ticks, µs.
const PERIOD_US: f64 = 1_000.0;

fn minute(context: &Context<'_>, telemetry_us: u32, host: Host) -> anyhow::Result<Outcome> {
    let setup = Setup {
        telemetry_us,
        ..Setup::new(context.image, host)
    };
    let record = idle(&setup, 60_000)?;
    let mut outcome = Outcome::default();
    jitter(&record, &mut outcome);
    if host == Host::Reading {
        let recording = crate::recording::Recording::of(&record.messages)?;
        outcome.at_most("messages lost", recording.dropped.into(), "", 0.0);
        outcome.number("snapshots", recording.ticks.len() as f64, "");
    }
    outcome.at_most("messages malformed", record.malformed as f64, "", 0.0);
    outcome.number("speed, × real time", record.realtime_factor(), "");
    Ok(outcome)
}

/// Instructions of a core at 180 MHz in a millisecond: one per cycle.
const INSTRUCTIONS_PER_MS: f64 = 180_000.0;
/// Instructions of a tick at most, with a record or without.
const TICK_LIMIT: f64 = 6_000.0;

/// What a record a millisecond costs: against one in fifty, everything else being the same.
fn cost(context: &Context<'_>, host: Host) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut per_tick = |telemetry_us: u32| {
        let setup = Setup {
            telemetry_us,
            ..Setup::new(context.image, host)
        };
        let record = idle(&setup, 5_000)?;
        jitter(&record, &mut outcome);
        outcome.at_most("messages malformed", record.malformed as f64, "", 0.0);
        let mut ticks = record.tick_instructions();
        ticks.sort_unstable();
        let mean = ticks.iter().sum::<u64>() as f64 / ticks.len() as f64;
        let p90 = ticks.get(ticks.len() * 9 / 10).copied().unwrap_or(0);
        let longest_us = record.messages.iter().filter_map(|message| {
            let Decoded::Record(record) = &message.decoded else {
                return None;
            };
            Some(record.longest_tick_us)
        });
        anyhow::Ok((mean, p90 as f64, longest_us.max()))
    };
    let (often, tick, longest_us) = per_tick(1_000)?;
    let (seldom, _, _) = per_tick(50_000)?;
    let record = (often - seldom) * 50.0 / 49.0;
    outcome.number("instructions of a record", record, "");
    outcome.number("instructions of a tick with its record, p90", tick, "");
    if let Some(longest_us) = longest_us {
        // A record is made between two ticks, by a task that they interrupt.
        outcome.at_most(
            "of that in the control task, by the firmware's own clock, at most",
            INSTRUCTIONS_PER_MS / 1e3 * f64::from(longest_us + 1),
            "",
            TICK_LIMIT,
        );
    }
    outcome.at_most(
        "records of every tick, of the core's time",
        100.0 * record / INSTRUCTIONS_PER_MS,
        "%",
        5.0,
    );
    Ok(outcome)
}

pub fn idle(setup: &Setup<'_>, until_ms: u64) -> anyhow::Result<Record> {
    let ((), record) = bench::run(setup, (), move |(), moment| {
        if moment.ms == 0 {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
        }
        Ok(moment.ms < until_ms)
    })?;
    Ok(record)
}

/// Every tick against its neighbour, and against the raster that the first one begins.
pub fn jitter(record: &Record, outcome: &mut Outcome) {
    let us = |tick: &Tick| tick.at.0 as f64 / 1e3;
    let periods = record
        .ticks
        .windows(2)
        .map(|pair| us(&pair[1]) - us(&pair[0]));
    let (shortest, longest) = periods.fold((f64::INFINITY, 0.0), |(min, max), period| {
        (f64::min(min, period), f64::max(max, period))
    });
    let first = record.ticks.first().map_or(0.0, us);
    let late = record
        .ticks
        .iter()
        .enumerate()
        .map(|(i, tick)| us(tick) - first - PERIOD_US * i as f64)
        .fold(0.0, f64::max);
    let early = record
        .ticks
        .iter()
        .enumerate()
        .map(|(i, tick)| first + PERIOD_US * i as f64 - us(tick))
        .fold(0.0, f64::max);
    outcome.number("ticks", record.ticks.len() as f64, "");
    outcome.number("shortest period", shortest, "µs");
    outcome.number("longest period", longest, "µs");
    let off = f64::max(longest - PERIOD_US, PERIOD_US - shortest);
    outcome.at_most("a period differs by", off, "µs", JITTER_US);
    outcome.at_most(
        "a tick is off its raster by",
        f64::max(late, early),
        "µs",
        JITTER_US,
    );
    // The first tick comes after the start, and the last millisecond may hold none.
    let expected = record.ms as f64 - first / PERIOD_US;
    outcome.must(
        (record.ticks.len() as f64 - expected).abs() <= 2.0,
        format!("{} ticks in {} ms", record.ticks.len(), record.ms),
    );
    outcome.must(record.resets.is_empty(), format!("{:?}", record.resets));
}

/// The clock counts half-periods of its timer, 2^15 µs each. It starts this far below 2^32 µs, where
/// whatever keeps a time in 32 bits would fall over.
const PERIODS_BEFORE_THE_END: u32 = (1 << 17) - 1_000;

/// Where the clock keeps that count: the word of its driver that grows as time passes.
fn clock_periods(context: &Context<'_>) -> anyhow::Result<u64> {
    let driver = context.image.variable("time_driver::driver::DRIVER")?;
    let words = (driver.address..driver.address + driver.size).step_by(4);
    let setup = Setup::new(context.image, Host::Absent);
    let (seen, _) = bench::run(&setup, Vec::new(), move |seen, moment| {
        if moment.ms == 100 || moment.ms == 432 {
            for address in words.clone() {
                seen.push((address, moment.word(address)?));
            }
        }
        Ok(moment.ms < 432)
    })?;
    // 332 ms are ten of them, and a bit.
    let (before, after) = seen.split_at(seen.len() / 2);
    let mut counts = before
        .iter()
        .zip(after)
        .filter(|(before, after)| (10..=11).contains(&after.1.wrapping_sub(before.1)));
    match (counts.next(), counts.next()) {
        (Some((count, _)), None) => Ok(count.0),
        _ => anyhow::bail!("the clock's count of periods is not to be found in {seen:?}"),
    }
}

/// Without settling anybody's fate, so long that the clock passes 2^32 µs.
fn endurance(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        preset: Some(Preset {
            address: clock_periods(context)?,
            value: PERIODS_BEFORE_THE_END,
        }),
        ..Setup::new(context.image, Host::Reading)
    };
    let until_ms = (3_600_000.0 * context.hours) as u64;
    let stack = context.image.stack()?;
    let (used, record) = bench::run(&setup, [0; 2], move |used, moment| {
        if moment.ms == 0 {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
            moment.paint(stack.clone())?;
        }
        if moment.ms == until_ms / 10 {
            used[0] = moment.used(stack.clone())?;
        }
        let goes_on = moment.ms < until_ms;
        if !goes_on {
            used[1] = moment.used(stack.clone())?;
        }
        Ok(goes_on)
    })?;
    let mut outcome = Outcome::default();
    outcome.number("virtual time", context.hours, "h");
    let [early, late] = used.map(|bytes| bytes as f64);
    outcome.at_most(
        "stack at the end, against its first tenth",
        late,
        "bytes",
        early,
    );
    jitter(&record, &mut outcome);
    let recording = crate::recording::Recording::of(&record.messages)?;
    outcome.at_most("messages lost", recording.dropped.into(), "", 0.0);
    let (first, last) = (recording.ticks.first(), recording.ticks.last());
    let micros = |seen: &softgrip::telemetry::Record| seen.snapshot.now.micros();
    let end = 1u64 << 32;
    outcome.must(
        first.is_some_and(|seen| micros(seen) < end) && last.is_some_and(|seen| micros(seen) > end),
        format!(
            "the clock went from {:?} to {:?} µs, not across {end}",
            first.map(micros),
            last.map(micros)
        ),
    );
    outcome.must(
        recording.events.is_empty(),
        format!("reported: {:?}", recording.events),
    );
    outcome.number("speed, × real time", record.realtime_factor(), "");
    let ms = record.ticks.last().map_or(0, |tick| tick.at.0 / MS);
    outcome.number("last tick", ms as f64, "ms");
    Ok(outcome)
}

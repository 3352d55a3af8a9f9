//! Settings survive, whenever the supply goes off, and storing them delays no tick.

use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Context as _;
use sim::hand::Hand;
use sim::plant::{Pins, Plant};
use sim::scenario::Scenario;
use softgrip::telemetry::Indicators;

use super::test::{Context, Outcome, Test};
use crate::bench::{self, MS, Message, Record, Setup};
use crate::board::Restart;
use crate::closed_loop::{self, REST, gripper, pins_at_rest};
use crate::flash;
use crate::rtt::Host;

pub const TESTS: [Test; 4] = [
    Test {
        name: "settings: no late tick while they are stored",
        about: "a minute with a tare every 1.2 seconds; the last one is in use 20 ms after the next start",
        run: busy,
    },
    Test {
        name: "settings: a free-bend sweep",
        about: "of the simulated fingers, on a debugger's word: learned within a minute, stored, found by the next start; no late tick",
        run: sweep,
    },
    Test {
        name: "settings: power cuts",
        about: "in the middle of any program or erase: those before or those to be stored, and what was acknowledged",
        run: cuts,
    },
    Test {
        name: "settings: damaged",
        about: "by a bit or as a whole: a fault, the factory's, and over with the next start",
        run: damaged,
    },
];

/// Between two tares, ms: within a second the command would be the same one.
const TARE_EVERY_MS: u64 = 1_200;

/// A reset to settings in use.
const VALID_WITHIN_MS: f64 = 20.0;
/// A step of the converter is 11 µε, and an average of eight hardly less.
const STEP_UE: f64 = 16.0;

/// What the gauges show when they are tared for the `n`th time, µε: never the same twice in a row, and never so
/// different that something seems to be in the grip.
fn tare_ue(n: u64) -> [f64; 3] {
    [n % 7, n % 5, n % 11].map(|n| 30.0 * n as f64 - 110.0)
}

/// Half a rail is 20 000 µε, less the amplifier's own ends: 1.5 V of 3.3.
fn pins(ue: [f64; 3]) -> Pins {
    let mut pins = pins_at_rest();
    for (share, ue) in pins.gauges.iter_mut().zip(ue) {
        *share += ue / 20_000.0 * 1.5 / 3.3;
    }
    pins
}

/// The tare that a start has found.
fn found_ue(message: &Message) -> Option<[f64; 3]> {
    let (_, tare) = message.text().split_once("stored, tare [")?;
    let (tare, _) = tare.split_once(']')?;
    let mut tare = tare.split(", ").map(|ue| ue.parse().ok());
    Some([tare.next()??, tare.next()??, tare.next()??])
}

fn same(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < STEP_UE)
}

fn first_tick_ms(record: &Record) -> f64 {
    let first = record.ticks.first();
    first.map_or(f64::NAN, |tick| tick.at.0 as f64 / MS as f64)
}

/// Starts with something in the settings' flash, and looks at it after a tenth of a second.
fn start(context: &Context<'_>, settings: Vec<u8>) -> anyhow::Result<(Indicators, Record)> {
    let setup = Setup {
        settings: Some(settings),
        ..Setup::new(context.image, Host::Reading)
    };
    bench::run(&setup, Indicators::default(), |told, moment| {
        moment.set_pins(&pins_at_rest());
        moment.set_levels(REST);
        *told = moment.indicators();
        Ok(moment.ms < 100)
    })
}

/// Tares again and again for so long; gives what is in flash then, and sectors erased.
fn tare_often(context: &Context<'_>, until_ms: u64) -> anyhow::Result<(Vec<u8>, u32, Record)> {
    let setup = Setup::new(context.image, Host::Reading);
    let tare = context.image.variable("TARE")?.address;
    let kept = (Vec::new(), 0);
    let ((bytes, erased), record) = bench::run(&setup, kept, move |kept, moment| {
        let ms = moment.ms;
        moment.set_levels(REST);
        moment.set_pins(&pins(tare_ue(ms / TARE_EVERY_MS)));
        if ms % TARE_EVERY_MS == 200 {
            moment.set_word(tare, 1)?;
        }
        let goes_on = ms < until_ms;
        if !goes_on {
            let flash = moment.session.board_mut().flash();
            *kept = (flash.bytes(), flash.erased);
        }
        Ok(goes_on)
    })?;
    Ok((bytes, erased, record))
}

fn busy(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let until_ms = 50 * TARE_EVERY_MS;
    let (bytes, erased, record) = tare_often(context, until_ms)?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    let stored = record.messages.iter();
    let stored = stored.filter(|message| message.text() == "settings stored");
    let stored = stored.count() as u64;
    outcome.number("tares stored", stored as f64, "");
    outcome.must(
        stored == until_ms / TARE_EVERY_MS,
        format!("{stored} tares stored"),
    );
    outcome.number("sectors erased meanwhile", erased.into(), "");
    outcome.must(erased >= 5, format!("{erased} sectors erased"));

    let (told, record) = start(context, bytes)?;
    let first_ms = first_tick_ms(&record);
    outcome.at_most("reset to settings in use", first_ms, "ms", VALID_WITHIN_MS);
    let found = record.messages.iter().find_map(found_ue);
    let last = tare_ue(until_ms / TARE_EVERY_MS - 1);
    outcome.must(
        found.is_some_and(|found| same(found, last)),
        format!("the next start found {found:?}, stored was {last:?}"),
    );
    outcome.must(told.ready, format!("after it the robot is told {told:?}"));
    Ok(outcome)
}

/// The image runs, and knows the noise of its gauges, after this, ms.
const RUNS_MS: u64 = 100;
/// From the end of the arm's moves to the sweep, and the longest sweep, ms.
const RESTS_MS: u64 = 500;
const SWEEP_MS: u64 = 60_000;

fn sweep(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let (chain, grasp) = closed_loop::fingers()?;
    let mut nothing = *grasp;
    // Out of reach.
    nothing.sphere.depth_m = 1.0;
    let hand = Hand::alike(chain);
    let plant = Plant::new(&Scenario::default(), &gripper(), &hand, &nothing);
    let asked_ms = RUNS_MS + (1e3 * plant.profile().duration_s()) as u64 + RESTS_MS;
    let word = context.image.variable("SWEEP")?.address;
    let setup = Setup::new(context.image, Host::Reading);
    let kept = (plant, Vec::new());
    let ((_, bytes), record) = bench::run(&setup, kept, move |(plant, bytes), moment| {
        moment.set_levels(REST);
        if moment.ms < RUNS_MS {
            moment.set_pins(&pins_at_rest());
            return Ok(true);
        }
        let (pins, _) = plant.step_pins(moment.command());
        moment.set_pins(&pins);
        if moment.ms == asked_ms {
            moment.set_word(word, 1)?;
        }
        let goes_on = moment.ms < asked_ms + SWEEP_MS;
        if !goes_on {
            *bytes = moment.session.board_mut().flash().bytes();
        }
        Ok(goes_on)
    })?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    let told = |text: &str| {
        record
            .messages
            .iter()
            .filter(|m| m.text().contains(text))
            .count()
    };
    outcome.must(told("Swept {") == 1, "no sweep has learned anything");
    outcome.must(told("settings stored") == 1, "nothing was stored");
    let (told, record) = start(context, bytes)?;
    outcome.must(told.ready, format!("after it the robot is told {told:?}"));
    let found = record
        .messages
        .iter()
        .any(|m| m.text().contains("bytes stored"));
    outcome.must(found, "the next start finds nothing");
    Ok(outcome)
}

/// From a start to the tare, and from there to the stored settings at the latest, with erased sectors, ms.
const TARE_MS: u64 = 100;
const STORED_MS: u64 = 900;
/// Cuts that are tried: `tests/host/storage.rs` tries thousands, but not of the chip.
const CUTS: u64 = 26;
/// A record, and the place that is left out or a sector, are fewer.
const OPERATIONS: u64 = 13;

/// What the script of the power cuts keeps.
#[derive(Default)]
struct Script {
    cut: u64,
    /// The start that the next cut is counted from, ms.
    started_ms: u64,
    resets: usize,
    /// When each tare was asked for.
    asked_ms: Vec<u64>,
    /// Cuts while a word was programmed, and while a sector was erased.
    programs: u32,
    erases: u32,
}

fn cuts(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let (settings, ..) = tare_often(context, TARE_EVERY_MS - 1)?;
    let setup = Setup {
        settings: Some(settings),
        ..Setup::new(context.image, Host::Reading)
    };
    let tare = context.image.variable("TARE")?.address;
    let (script, record) = bench::run(&setup, Script::default(), move |script, moment| {
        moment.set_levels(REST);
        moment.set_pins(&pins(tare_ue(script.cut)));
        let since_ms = moment.ms - script.started_ms;
        let resets = moment.session.resets().len();
        if resets == script.resets && since_ms > TARE_MS + STORED_MS {
            // More operations than there were: all is stored.
            let mut flash = moment.session.board_mut().flash();
            flash.until_cut = None;
            flash.cuts_erases = false;
            drop(flash);
            moment.restart(Restart::PowerOn);
        }
        if moment.session.resets().len() > script.resets {
            script.resets = moment.session.resets().len();
            script.started_ms = moment.ms;
            script.cut += 1;
            let flash = moment.session.board_mut().flash();
            (script.programs, script.erases) = flash.cuts;
        }
        if moment.ms == script.started_ms + TARE_MS {
            // Each of them in turn, but not in their order.
            let operation = script.cut * 5 % OPERATIONS;
            let mut flash = moment.session.board_mut().flash();
            flash.until_cut = Some(operation as u32);
            flash.cuts_erases = script.cut.is_multiple_of(2);
            drop(flash);
            moment.set_word(tare, 1)?;
            script.asked_ms.push(moment.ms);
        }
        Ok(script.cut < CUTS)
    })?;
    let mut outcome = Outcome::default();
    outcome.number(
        "cuts while a word was programmed",
        script.programs.into(),
        "",
    );
    outcome.number("cuts while a sector was erased", script.erases.into(), "");
    outcome.must(
        script.programs >= 15 && script.erases >= 2,
        "not enough of each",
    );
    let [before, after] = follow(&record, &script.asked_ms, &mut outcome);
    outcome.number("starts with the settings from before", before, "");
    outcome.number("starts with those to be stored", after, "");
    outcome.must(before >= 15.0 && after >= 2.0, "not enough of each");
    Ok(outcome)
}

/// Checks every start against what had been stored and what was to be; counts both.
fn follow(record: &Record, asked_ms: &[u64], outcome: &mut Outcome) -> [f64; 2] {
    let mut counts = [0.0; 2];
    // What was in flash when the run began.
    let mut stored = tare_ue(0);
    let mut asked = asked_ms.iter().enumerate().peekable();
    let mut wanted = None;
    for message in &record.messages {
        while let Some((n, _)) = asked.next_if(|(_, ms)| **ms <= message.ms) {
            wanted = Some(tare_ue(n as u64));
        }
        let found = match message.text() {
            "settings stored" => {
                stored = wanted.take().unwrap_or(stored);
                continue;
            }
            "settings: the factory's" => None,
            text if text.contains("settings are damaged") => None,
            _ => match found_ue(message) {
                Some(found) => Some(found),
                None => continue,
            },
        };
        let is = |tare| found.is_some_and(|found| same(tare, found));
        if is(stored) {
            counts[0] += 1.0;
        } else if let Some(wanted) = wanted.filter(|wanted| is(*wanted)) {
            counts[1] += 1.0;
            stored = wanted;
        } else {
            outcome.failures.push(format!(
                "{} ms: found {found:?}, stored was {stored:?}, to be stored {wanted:?}",
                message.ms
            ));
        }
        wanted = None;
    }
    counts
}

fn damaged(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let (good, _, _) = tare_often(context, TARE_EVERY_MS - 1)?;
    let written = good.iter().rposition(|&byte| byte != 0xff);
    written.context("nothing was stored")?;
    let mut outcome = Outcome::default();
    let mut bit = good.clone();
    // The third byte of the first record's bytes.
    bit[14] ^= 1;
    for (what, bytes) in [("a bit", bit), ("the whole", vec![0x5a; flash::SIZE])] {
        let setup = Setup {
            settings: Some(bytes),
            ..Setup::new(context.image, Host::Reading)
        };
        let restart_ms = 1_500;
        let told = Arc::new(Mutex::new([Indicators::default(); 2]));
        let seen = told.clone();
        let ((), record) = bench::run(&setup, (), move |(), moment| {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
            let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
            seen[usize::from(moment.ms > restart_ms)] = moment.indicators();
            if moment.ms == restart_ms {
                moment.restart(Restart::PowerOn);
            }
            Ok(moment.ms < restart_ms + 100)
        })?;
        let [first, second] = *told.lock().unwrap_or_else(PoisonError::into_inner);
        outcome.must(
            first.fault && !first.ready && second.ready && !second.fault,
            format!("{what}: the robot is told {first:?}, and after a restart {second:?}"),
        );
        for says in ["settings are damaged", "SettingsInvalid", "settings stored"] {
            outcome.must(
                record
                    .message(0, says)
                    .is_some_and(|message| message.ms < restart_ms),
                format!("{what}: nothing says {says:?}"),
            );
        }
        outcome.must(
            record
                .message(restart_ms, "settings: 0 bytes stored")
                .is_some(),
            format!("{what}: the factory's settings are not found after it"),
        );
    }
    Ok(outcome)
}

//! The black box: what the converters had around a loss, over every restart.

use anyhow::Context as _;
use sim::scenario::Scenario;
use softgrip::blackbox::{Kept, Phase, WORDS, ticks};
use softgrip::telemetry::Record;

use super::test::{Context, Outcome, Test};
use crate::bench::{self, Setup};
use crate::closed_loop::{Loop, REST, fingers, pins_at_rest};
use crate::moment::Moment;
use crate::recording::Recording;
use crate::rtt::Host;

pub const TESTS: [Test; 1] = [Test {
    name: "black box",
    about: "a loss: every tick of the two seconds as it was reported, found again after power-on, and gone once it has been seen",
    run: loss,
}];

/// From the end of the arm's moves to the end of the run, ms.
const RESTS_MS: u64 = 700;
/// It is seen so long after power-on, ms.
const SEEN_MS: u64 = 100;

/// The words of the black box.
fn words(moment: &mut Moment<'_>, address: u64) -> anyhow::Result<Vec<u32>> {
    (0..WORDS as u64)
        .map(|word| moment.word(address + 4 * word))
        .collect()
}

fn loss(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let box_at = context.image.variable("links::BLACK_BOX")?.address;
    let setup = Setup {
        telemetry_us: 1_000,
        ..Setup::new(context.image, Host::Reading)
    };
    // It falls while it is being picked.
    let scenario = Scenario {
        mass_kg: 0.3,
        ..Scenario::default()
    };
    let plant = Loop::new(&scenario, fingers()?);
    let kept = (plant, 0, Vec::new(), Vec::new());
    let ((.., before, flash), record) = bench::run(&setup, kept, move |kept, moment| {
        let (plant, rested_ms, before, flash) = kept;
        *rested_ms += u64::from(!plant.step(moment));
        let goes_on = *rested_ms < RESTS_MS;
        if !goes_on {
            *before = words(moment, box_at)?;
            *flash = moment.session.board_mut().flash().bytes();
        }
        Ok(goes_on)
    })?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    same_as_reported(&before, &Recording::of(&record.messages)?, &mut outcome)?;

    let clear = context.image.variable("CLEAR_BLACK_BOX")?.address;
    let setup = Setup {
        settings: Some(flash),
        ..Setup::new(context.image, Host::Reading)
    };
    let ((after, cleared, flash), _) =
        bench::run(&setup, (Vec::new(), 0, Vec::new()), move |kept, moment| {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
            if moment.ms == SEEN_MS {
                kept.0 = words(moment, box_at)?;
                moment.set_word(clear, 1)?;
            }
            let goes_on = moment.ms < SEEN_MS + RESTS_MS;
            if !goes_on {
                kept.1 = moment.word(box_at)?;
                kept.2 = moment.session.board_mut().flash().bytes();
            }
            Ok(goes_on)
        })?;
    outcome.must(after == before, "power-on changes it");
    outcome.must(
        Phase::of(cleared) == Some(Phase::Runs),
        "once it has been seen it does not run again",
    );
    let sector = flash.len() / 3;
    outcome.must(
        flash[2 * sector..].iter().all(|&byte| byte == u8::MAX),
        "once it has been seen it is still stored",
    );
    Ok(outcome)
}

/// Compares what stands in it with the ticks that the image has reported.
fn same_as_reported(
    words: &[u32],
    recording: &Recording,
    outcome: &mut Outcome,
) -> anyhow::Result<()> {
    outcome.must(
        Phase::of(words[0]) == Some(Phase::Stands),
        "nothing stands there",
    );
    let lost = recording.events.iter();
    let lost = lost
        .filter(|reported| reported.text.starts_with("Lost("))
        .map(|reported| reported.at)
        .next()
        .context("nothing was lost")?;
    let came_us = u64::from(words[2]) | u64::from(words[3]) << 32;
    outcome.must(
        lost.micros() == came_us,
        format!("it stands for {came_us} µs, and the loss came at {lost:?}"),
    );
    let at = recording.ticks.iter();
    let at = at.clone().position(|seen| seen.snapshot.now == lost);
    let at = at.context("the tick of the loss was not reported")?;
    let kept: Vec<Kept> = ticks(words).collect();
    outcome.must(
        kept.len() >= 2_000,
        format!("{} ticks stand there", kept.len()),
    );
    let differ = kept.iter().filter(|kept| {
        let i = at as i64 + i64::from(kept.tick) - i64::from(words[4]);
        let seen = usize::try_from(i).ok().and_then(|i| recording.ticks.get(i));
        seen.is_none_or(|seen| codes(seen) != kept.codes)
    });
    outcome.at_most("of them that were not so", differ.count() as f64, "", 0.0);
    Ok(())
}

/// What is kept of a tick.
fn codes(seen: &Record) -> [u16; 5] {
    let [a, b, c] = seen.frame.gauges.map(|code| code.0 >> 4);
    [a, b, c, seen.frame.monitor.0 >> 4, seen.dac.0]
}

//! Every tick as the image reported it, and the same ticks done again by the host's controller.

use anyhow::Context;
use decode::Decoded;
use softgrip::Controller;
use softgrip::settings::{Active, FACTORY};
use softgrip::table::FINGER;
use softgrip::telemetry::{Event, Record, Snapshot};
use softgrip::units::Instant;

use crate::bench::Message;

/// An event in the decoder's words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reported {
    /// The controller's time.
    pub at: Instant,
    /// What happened.
    pub text: String,
}

/// What the image reported in one run since its last start.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// Every record.
    pub ticks: Vec<Record>,
    /// Every event.
    pub events: Vec<Reported>,
    /// Records and events that were dropped, by their numbers.
    pub dropped: u32,
}

impl Recording {
    /// Reads the messages of a run; a restart of the firmware starts anew.
    pub fn of(messages: &[Message]) -> anyhow::Result<Self> {
        let mut recording = Self::default();
        let (mut records, mut events) = (0, 0);
        for message in messages {
            let text = message.text();
            if let Decoded::Record(record) = &message.decoded {
                recording.dropped += record.number - records - 1;
                records = record.number;
                recording.ticks.push(**record);
            } else if text.starts_with("softgrip ") {
                recording = Self::default();
                (records, events) = (0, 0);
            } else if let Some(rest) = text.strip_prefix("event ") {
                let (number, reported) =
                    event(rest).with_context(|| format!("message {text:?}"))?;
                recording.dropped += number - events - 1;
                events = number;
                recording.events.push(reported);
            }
        }
        Ok(recording)
    }
}

/// `N TIME: EVENT`
fn event(text: &str) -> anyhow::Result<(u32, Reported)> {
    let (number, rest) = text.split_once(' ').context("no number")?;
    let (at, event) = rest.split_once("}: ").context("no time")?;
    let micros = *integers(at).first().context("no time")?;
    let reported = Reported {
        at: Instant::from_micros(micros),
        text: event.into(),
    };
    Ok((number.parse()?, reported))
}

fn integers(text: &str) -> Vec<u64> {
    text.split(|letter: char| !letter.is_ascii_digit())
        .filter_map(|digits| digits.parse().ok())
        .collect()
}

/// The host's controller on the image's inputs.
#[derive(Debug, Clone, Default)]
pub struct Replay {
    /// The host's view of every tick.
    pub snapshots: Vec<Snapshot>,
    /// The host's events, each with its tick.
    pub events: Vec<(usize, Event)>,
    /// What differs from the image, in words; the first few.
    pub differences: Vec<String>,
    /// How many differ.
    pub differing: usize,
}

/// Differences that are put into words.
const WORDS: usize = 5;

impl Replay {
    /// Steps a fresh controller through a recording that begins with the first tick, and compares.
    pub fn of(recording: &Recording) -> anyhow::Result<Self> {
        let active = Active::of(&FACTORY, &FINGER).map_err(|error| anyhow::anyhow!("{error}"))?;
        let mut controller = Controller::new(&FINGER, active);
        let mut replay = Self::default();
        let mut reported = recording.events.iter();
        for (tick, seen) in recording.ticks.iter().enumerate() {
            let outputs = controller.step(seen.snapshot.now, &seen.frame, seen.command);
            let host = Record {
                dac: outputs.dac,
                snapshot: outputs.snapshot,
                ..*seen
            };
            // Equal to the bit, also in numbers that are none.
            if host.encode(&mut [0; Record::BYTES]) != seen.encode(&mut [0; Record::BYTES]) {
                replay.differ(seen, format!("{seen:?}, not {host:?}"));
            }
            for &event in outputs.events.iter() {
                let words = format!("{event:?}");
                match reported.next() {
                    Some(image) if image.at == seen.snapshot.now && same(&image.text, &words) => {}
                    other => replay.differ(seen, format!("{other:?}, not {words}")),
                }
                replay.events.push((tick, event));
            }
            replay.snapshots.push(outputs.snapshot);
        }
        if let Some(more) = reported.next() {
            replay.differing += 1;
            replay.differences.push(format!("the host has no {more:?}"));
        }
        Ok(replay)
    }

    fn differ(&mut self, seen: &Record, what: String) {
        self.differing += 1;
        if self.differences.len() < WORDS {
            self.differences.push(format!(
                "at {} µs the image has {what}",
                seen.snapshot.now.micros()
            ));
        }
    }
}

/// Whether a value in defmt's words is the value in Rust's: the same but for how a number is written.
fn same(defmt: &str, debug: &str) -> bool {
    let (mut left, mut right) = (tokens(defmt), tokens(debug));
    loop {
        match (left.next(), right.next()) {
            (None, None) => return true,
            (Some(a), Some(b)) if a == b => {}
            (Some(a), Some(b)) => match (a.parse::<f32>(), b.parse::<f32>()) {
                // Whole numbers are written alike, and were compared above.
                (Ok(x), Ok(y))
                    if x.to_bits() == y.to_bits() && (a.contains('.') || b.contains('.')) => {}
                _ => return false,
            },
            _ => return false,
        }
    }
}

/// Words, numbers and brackets.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let is_word =
        |letter: char| letter.is_alphanumeric() || matches!(letter, '.' | '-' | '+' | '_');
    let mut rest = text;
    std::iter::from_fn(move || {
        rest = rest.trim_start_matches([' ', ',', '\n']);
        let first = rest.chars().next()?;
        let length = if is_word(first) {
            rest.find(|letter| !is_word(letter)).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (token, after) = rest.split_at(length);
        rest = after;
        Some(token)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_may_be_written_differently_but_not_be_different() {
        assert!(same("Kilopascals(1)", "Kilopascals(1.0)"));
        assert!(same(
            "A { x: -1e-7 , y: [1, 2] }",
            "A { x: -1.0e-7, y: [1, 2] }"
        ));
        assert!(!same("Kilopascals(1.0000001)", "Kilopascals(1.0)"));
        assert!(!same("16777217", "16777216"));
        assert!(!same("Some(1)", "None"));
    }
}

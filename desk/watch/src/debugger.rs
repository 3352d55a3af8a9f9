//! What the firmware sends to a debugger, as bytes that somebody passes on, or a probe reads.

use std::io::{Read, stdin};
use std::net::TcpStream;
use std::path::Path;
use std::sync::mpsc::{self, Sender};
use std::thread;

use anyhow::Context;
use decode::{Decoded, Decoder, Image, Line};
use settings::Values;
use sim::events;
use softgrip::TICK_US;
use softgrip::telemetry::Record;

use crate::connection::Connection;
use crate::tick::{Scale, Tick};
use crate::told::{EventTold, Provenance, SettingsTold, Told};

/// How a stream is read.
pub struct Reading {
    /// What its bytes mean.
    pub image: Image,
    /// The settings that the firmware is believed to have, for the stream does not tell.
    pub values: Values,
    /// How often an observation is to come at most, Hz.
    pub rate_hz: f64,
    /// Every record's tick is wanted.
    pub with_ticks: bool,
}

/// Reads the image's ELF file.
///
/// # Errors
/// If it cannot be read, or is none of softgrip.
pub fn image(path: &Path) -> anyhow::Result<Image> {
    let elf = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    Image::read(&elf).with_context(|| format!("{}", path.display()))
}

/// Reads what comes in at standard input.
pub fn of_stdin(reading: Reading) -> Connection {
    open(Box::new(stdin()), "defmt:-".into(), reading)
}

/// Reads what a debugger's program serves at a TCP port.
///
/// # Errors
/// If nobody serves there.
pub fn of_tcp(address: &str, reading: Reading) -> anyhow::Result<Connection> {
    let stream =
        TcpStream::connect(address).with_context(|| format!("{address}: nobody serves there"))?;
    Ok(open(Box::new(stream), format!("defmt:{address}"), reading))
}

/// Reads bytes until they end, or nobody listens.
pub fn open(mut bytes: Box<dyn Read + Send>, name: String, reading: Reading) -> Connection {
    let (sender, told) = mpsc::channel();
    let rate_hz = reading.rate_hz;
    let source = name.clone();
    thread::spawn(move || {
        let end = match read(&mut bytes, source, &reading, &sender) {
            Ok(()) => Told::Ended("the stream is at its end".into()),
            Err(error) => Told::Failed(format!("{error:#}")),
        };
        // Who has opened it may be gone.
        let _ = sender.send(end);
    });
    Connection {
        name,
        rate_hz,
        told,
        wishes: None,
    }
}

fn read(
    bytes: &mut dyn Read,
    source: String,
    reading: &Reading,
    sender: &Sender<Told>,
) -> anyhow::Result<()> {
    sender.send(Told::Provenance(Provenance {
        source,
        ..Provenance::default()
    }))?;
    sender.send(Told::Settings(SettingsTold {
        t_s: None,
        values: reading.values,
        applied: true,
    }))?;
    sender.send(Told::Note(
        "a debugger's stream does not tell the settings: they are taken to be those of --settings, or the defaults".into(),
    ))?;
    let mut decoder = Decoder::new(&reading.image);
    let mut stream = Stream::new(reading);
    let mut buffer = [0; 4096];
    loop {
        let count = bytes.read(&mut buffer).context("the stream has failed")?;
        if count == 0 {
            break;
        }
        for decoded in decoder.take(&buffer[..count])? {
            for told in stream.take(decoded) {
                sender.send(told)?;
            }
        }
    }
    if decoder.malformed() > 0 {
        sender.send(Told::Note(format!(
            "{} messages of the stream could not be read",
            decoder.malformed()
        )))?;
    }
    Ok(())
}

/// What has come of a stream so far.
struct Stream<'a> {
    reading: &'a Reading,
    scale: Scale,
    /// The record before: its number, and its time, s.
    last: Option<(u32, f64)>,
    /// The next observation is due, s.
    due_s: f64,
}

impl<'a> Stream<'a> {
    fn new(reading: &'a Reading) -> Self {
        Self {
            reading,
            scale: Scale::of(&reading.values),
            last: None,
            due_s: f64::NEG_INFINITY,
        }
    }

    fn take(&mut self, decoded: Decoded) -> Vec<Told> {
        match decoded {
            Decoded::Record(record) => self.record(&record),
            Decoded::Line(line) => vec![of_line(&line)],
        }
    }

    fn record(&mut self, record: &Record) -> Vec<Told> {
        let mut told = Vec::new();
        let now = record.snapshot.now;
        let t_s = 1e-6 * now.micros() as f64;
        match self.last {
            Some((_, last_s)) if t_s < last_s => {
                told.push(Told::Note("the firmware has started again".into()));
                self.due_s = f64::NEG_INFINITY;
            }
            Some((last, last_s)) if record.number != last.wrapping_add(1) => {
                let missing = record.number.wrapping_sub(last).wrapping_sub(1);
                told.push(Told::Note(format!(
                    "{missing} records were dropped after {last_s:.3} s: the debugger reads too slowly"
                )));
            }
            _ => {}
        }
        self.last = Some((record.number, t_s));
        let tick = Tick {
            number: record.number,
            now,
            frame: record.frame,
            command: record.command,
            dac: record.dac,
        };
        if self.reading.with_ticks {
            told.push(Told::Tick(Box::new(tick)));
        }
        let half_a_tick_s = 0.5e-6 * TICK_US as f64;
        if t_s + half_a_tick_s >= self.due_s {
            let next_s = self.due_s + 1.0 / self.reading.rate_hz;
            self.due_s = next_s.max(t_s);
            let seen = self.scale.observe(&tick, &record.snapshot, None);
            told.push(Told::Observation(Box::new(seen)));
        }
        told
    }
}

/// An event, where a line of the log is one.
fn of_line(line: &Line) -> Told {
    match event(&line.text) {
        Some(event) => Told::Event(event),
        None => Told::Note(line.text.clone()),
    }
}

/// `event NUMBER Instant { micros: T }: WHAT`, as the firmware's telemetry task writes it.
fn event(text: &str) -> Option<EventTold> {
    let (when, what) = text.strip_prefix("event ")?.split_once(" }: ")?;
    let (_, micros) = when.split_once("micros: ")?;
    let name = snake_case(what.split([' ', '(']).next()?);
    let name = events::NAMES.iter().find(|known| **known == name)?;
    Some(EventTold {
        t_s: 1e-6 * micros.parse::<f64>().ok()?,
        name: (*name).into(),
        text: what.into(),
    })
}

/// `AirLoss` as `air_loss`.
fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.extend(letter.to_lowercase());
    }
    snake
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_of_the_log_has_its_time_and_its_name() {
        let text = "event 7 Instant { micros: 2500000 }: Holding { touching: [true, true, false] }";
        let found = event(text).expect("an event");
        assert_eq!((found.t_s, found.name.as_str()), (2.5, "holding"));
        assert_eq!(found.text, "Holding { touching: [true, true, false] }");
        let lost = event("event 8 Instant { micros: 1 }: Lost(Loss { onset: 1 })");
        assert_eq!(lost.expect("an event").name, "lost");
        let air = event("event 9 Instant { micros: 1 }: AirLoss");
        assert_eq!(air.expect("an event").name, "air_loss");
        for text in [
            "settings stored",
            "event 1",
            "event 1 Instant { micros: 1 }: Nonsense",
        ] {
            assert!(event(text).is_none(), "{text}");
        }
    }
}

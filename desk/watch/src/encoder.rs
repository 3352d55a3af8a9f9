//! What is told, as messages of topics with their time: for files, and for whoever watches meanwhile.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::frames;
use crate::messages::{self, EVENT, FRAMES, PROVENANCE, SETTINGS_IN_USE, SNAPSHOT, Topic};
use crate::protobuf::Writer;
use crate::tick::Tick;
use crate::told::Told;

/// So many ticks are in one message: each message takes 16 bytes of an index beside its own.
const TICKS: usize = 100;
/// Further back than this the gripper's clock does not jump unless it has started again, s.
const BACK_S: f64 = 0.5;

/// A message of a topic, and its time, ns since 1970.
pub struct Message {
    /// Where it belongs.
    pub topic: Topic,
    /// When.
    pub log_time: u64,
    /// What.
    pub data: Writer,
}

/// The gripper's clock on that of the calendar.
#[derive(Debug, Clone, Copy)]
struct Clock {
    /// The gripper's start, ns since 1970; none before the first moment.
    start_ns: Option<i64>,
    /// The latest moment, s since that start.
    t_s: f64,
}

impl Clock {
    /// A moment of the gripper's, ns since 1970.
    fn ns(&mut self, t_s: f64) -> u64 {
        let has_restarted = t_s < self.t_s - BACK_S;
        let since_ns = (1e9 * t_s) as i64;
        let start_ns = match self.start_ns {
            Some(start_ns) if !has_restarted => start_ns,
            _ => now_ns() - since_ns,
        };
        self.start_ns = Some(start_ns);
        self.t_s = t_s;
        (start_ns + since_ns).max(0).cast_unsigned()
    }

    /// The latest moment, or now, before the first.
    fn latest_ns(&mut self) -> u64 {
        match self.start_ns {
            Some(_) => self.ns(self.t_s),
            None => now_ns().max(0).cast_unsigned(),
        }
    }
}

fn now_ns() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as i64)
}

/// Makes messages of what is told. Ticks are gathered.
pub struct Encoder {
    clock: Clock,
    ticks: Vec<Tick>,
}

impl Encoder {
    /// Nothing has been told.
    pub fn new() -> Self {
        Self {
            clock: Clock {
                start_ns: None,
                t_s: 0.0,
            },
            ticks: Vec::new(),
        }
    }

    /// The messages that are complete with this.
    pub fn take(&mut self, told: &Told) -> Vec<Message> {
        match told {
            Told::Tick(tick) => self.tick(tick),
            Told::Observation(seen) => {
                vec![self.message(SNAPSHOT, seen.t_s, messages::of_observation(seen))]
            }
            Told::Event(event) => {
                vec![self.message(EVENT, Some(event.t_s), messages::of_event(event))]
            }
            Told::Settings(settings) => {
                // Ticks before these are not by them.
                let before = self.gathered();
                let message = messages::of_settings(settings);
                let message = self.message(SETTINGS_IN_USE, settings.t_s, message);
                before.into_iter().chain([message]).collect()
            }
            Told::Provenance(about) => {
                vec![self.message(PROVENANCE, None, messages::of_provenance(about))]
            }
            Told::Note(_) | Told::Ended(_) | Told::Failed(_) => Vec::new(),
        }
    }

    fn tick(&mut self, tick: &Tick) -> Vec<Message> {
        let follows = |last: &Tick| last.number.checked_add(1) == Some(tick.number);
        let before = match self.ticks.last().is_none_or(follows) {
            true => None,
            false => self.gathered(),
        };
        self.ticks.push(*tick);
        let full = match self.ticks.len() >= TICKS {
            true => self.gathered(),
            false => None,
        };
        before.into_iter().chain(full).collect()
    }

    /// The message of the ticks that have been gathered; none if there are none.
    pub fn gathered(&mut self) -> Option<Message> {
        let first = self.ticks.first()?;
        let t_s = 1e-6 * first.now.micros() as f64;
        let message = frames::encode(&self.ticks);
        self.ticks.clear();
        Some(self.message(FRAMES, Some(t_s), message))
    }

    fn message(&mut self, topic: Topic, t_s: Option<f64>, data: Writer) -> Message {
        let log_time = match t_s {
            Some(t_s) => self.clock.ns(t_s),
            None => self.clock.latest_ns(),
        };
        Message {
            topic,
            log_time,
            data,
        }
    }
}

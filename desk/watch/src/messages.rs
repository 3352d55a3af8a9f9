//! What is told, as messages of a recording.

use anyhow::{Context, bail};
use settings::{FIELDS as SETTINGS, Values};

use crate::fields::{FIELDS, Place};
use crate::frames;
use crate::observation::Observation;
use crate::protobuf::{Value, Writer, fields};
use crate::tick::Tick;
use crate::told::{EventTold, Provenance, SettingsTold, Told};

/// A topic of a recording, and the name of its messages' type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// As a recording has it.
    pub name: &'static str,
    /// Its messages' type, without the package.
    pub of: &'static str,
}

const fn topic(name: &'static str, of: &'static str) -> Topic {
    Topic { name, of }
}

/// [`Told::Observation`]
pub const SNAPSHOT: Topic = topic("/snapshot", "Snapshot");
/// [`Told::Event`]
pub const EVENT: Topic = topic("/event", "Event");
/// [`Told::Settings`]
pub const SETTINGS_IN_USE: Topic = topic("/settings", "Settings");
/// [`Told::Provenance`]
pub const PROVENANCE: Topic = topic("/provenance", "Provenance");
/// [`Told::Tick`], some at a time.
pub const FRAMES: Topic = topic("/frames", "Frames");

/// Every topic.
pub const TOPICS: [Topic; 5] = [SNAPSHOT, EVENT, SETTINGS_IN_USE, PROVENANCE, FRAMES];

/// The message of an observation.
pub fn of_observation(seen: &Observation) -> Writer {
    let mut seen = *seen;
    let mut message = Writer::new();
    for field in &FIELDS {
        let number = field.number;
        match (field.place)(&mut seen) {
            // A program that plots would take what is left out for 0.
            Place::Double(value) => message.double(number, value.unwrap_or(f64::NAN)),
            Place::Float(value) => message.float(number, value.unwrap_or(f32::NAN)),
            Place::Whole(Some(value)) => message.whole(number, (*value).into()),
            Place::Flag(Some(value)) => message.whole(number, (*value).into()),
            Place::Whole(None) | Place::Flag(None) => {}
        }
    }
    message
}

/// The message of an event.
pub fn of_event(event: &EventTold) -> Writer {
    let mut message = Writer::new();
    message.double(1, event.t_s);
    message.text(2, &event.name);
    message.text(3, &event.text);
    message
}

/// The message of settings.
pub fn of_settings(told: &SettingsTold) -> Writer {
    let mut message = Writer::new();
    message.double(1, told.t_s.unwrap_or(f64::NAN));
    message.whole(2, told.applied.into());
    for (field, value) in SETTINGS.iter().zip(told.values.all()) {
        let mut setting = Writer::new();
        setting.whole(1, field.number.into());
        setting.text(2, field.name);
        setting.float(3, *value);
        message.message(3, &setting);
    }
    message
}

/// The message of what gripper it is.
pub fn of_provenance(about: &Provenance) -> Writer {
    let mut message = Writer::new();
    let texts = [&about.source, &about.version, &about.recipe, &about.table];
    for (field, text) in (1..).zip(texts) {
        message.text(field, text);
    }
    message
}

/// What the message of a topic tells; nothing where the topic is none of a gripper's.
///
/// # Errors
/// If the message is none of this topic.
pub fn read(topic: &str, message: &[u8]) -> anyhow::Result<Vec<Told>> {
    let topic = TOPICS.iter().find(|known| known.name == topic);
    Ok(match topic {
        Some(&SNAPSHOT) => vec![Told::Observation(Box::new(observation(message)?))],
        Some(&EVENT) => vec![Told::Event(event(message)?)],
        Some(&SETTINGS_IN_USE) => vec![Told::Settings(settings(message)?)],
        Some(&PROVENANCE) => vec![Told::Provenance(provenance(message)?)],
        Some(&FRAMES) => {
            let ticks = frames::decode(message)?.into_iter();
            ticks.map(|tick: Tick| Told::Tick(Box::new(tick))).collect()
        }
        _ => Vec::new(),
    })
}

fn observation(message: &[u8]) -> anyhow::Result<Observation> {
    let mut seen = Observation::default();
    for (number, value) in fields(message)? {
        let Some(field) = FIELDS.iter().find(|field| field.number == number) else {
            continue;
        };
        match ((field.place)(&mut seen), value) {
            (Place::Double(place), Value::Double(value)) => {
                *place = (!value.is_nan()).then_some(value);
            }
            (Place::Float(place), Value::Float(value)) => {
                *place = (!value.is_nan()).then_some(value);
            }
            (Place::Whole(place), Value::Whole(value)) => *place = Some(u16::try_from(value)?),
            (Place::Flag(place), Value::Whole(value)) => *place = Some(value != 0),
            _ => bail!("{}: a value of another type", field.name),
        }
    }
    Ok(seen)
}

fn event(message: &[u8]) -> anyhow::Result<EventTold> {
    let mut event = EventTold {
        t_s: 0.0,
        name: String::new(),
        text: String::new(),
    };
    for (number, value) in fields(message)? {
        match number {
            1 => event.t_s = value.double()?,
            2 => event.name = value.text()?,
            3 => event.text = value.text()?,
            _ => {}
        }
    }
    Ok(event)
}

fn settings(message: &[u8]) -> anyhow::Result<SettingsTold> {
    let mut told = SettingsTold {
        t_s: None,
        values: Values::DEFAULT,
        applied: false,
    };
    for (number, value) in fields(message)? {
        match number {
            1 => told.t_s = Some(value.double()?).filter(|t_s| !t_s.is_nan()),
            2 => told.applied = value.whole()? != 0,
            3 => {
                let (mut setting, mut to) = (0, 0.0);
                for (number, value) in fields(value.bytes()?)? {
                    match number {
                        1 => setting = u16::try_from(value.whole()?)?,
                        3 => to = value.float()?,
                        _ => {}
                    }
                }
                let set = told.values.set(setting, to);
                set.map_err(|error| anyhow::anyhow!("{error}"))
                    .context("a setting of another program")?;
            }
            _ => {}
        }
    }
    Ok(told)
}

fn provenance(message: &[u8]) -> anyhow::Result<Provenance> {
    let mut about = Provenance::default();
    for (number, value) in fields(message)? {
        match number {
            1 => about.source = value.text()?,
            2 => about.version = value.text()?,
            3 => about.recipe = value.text()?,
            4 => about.table = value.text()?,
            _ => {}
        }
    }
    Ok(about)
}

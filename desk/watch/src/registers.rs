//! The gripper by its registers: what is seen of it, and how wishes are carried out (`docs/registers.md`).

use std::collections::BTreeMap;

use anyhow::bail;
use bus::robot::{
    DETAILS, FINGERS_IN_A_ROW, FOURTH, FOURTH_FROM, Item, REFUSALS, REGISTERS, SETTINGS_FROM, Shape,
};
use serve::master::{Master, Refused};
use serve::readout::register;
use settings::{FIELDS as SETTINGS, Values};
use softgrip::FINGERS;
use softgrip::fault::RULES;
use softgrip::table::ObjectKind;

use crate::fields::{CAUSES, FIELDS, Origin, Place, STATES};
use crate::observation::Observation;
use crate::told::EventTold;
use crate::wish::{Answer, Wish};

/// Of the own block, what only shows something ends here.
const SHOWN_END: u16 = 0x1100;
/// What no number is known for.
const UNKNOWN: u16 = 0x8000;

/// The registers that show something, at one moment.
pub struct Look(BTreeMap<u16, u16>);

impl Look {
    /// Reads them.
    ///
    /// # Errors
    /// If the gripper does not answer.
    pub fn take(master: &mut Master) -> anyhow::Result<Self> {
        let from = register(Item::MapVersion)?;
        let shown = REGISTERS
            .iter()
            .filter(|row| (from..SHOWN_END).contains(&row.address));
        let rows: Vec<_> = shown.collect();
        let mut words = BTreeMap::new();
        // An address between two blocks is refused.
        for run in rows.chunk_by(|a, b| a.address + a.item.shape().count() == b.address) {
            let (first, last) = (run[0], run[run.len() - 1]);
            let end = last.address + last.item.shape().count();
            let read = master.read(first.address, end - first.address)?;
            words.extend((first.address..end).zip(read));
        }
        if FINGERS > usize::from(FINGERS_IN_A_ROW) {
            let read = master.read(FOURTH_FROM, FOURTH.len() as u16)?;
            words.extend((FOURTH_FROM..).zip(read));
        }
        Ok(Self(words))
    }

    /// The number in a register of an item's row; none where it is not known.
    fn number(&self, item: Item, offset: u16) -> Option<f64> {
        let address = bus::robot::address(item, offset)?;
        let word = *self.0.get(&address)?;
        match item.shape() {
            Shape::Unsigned | Shape::Fingers => Some(word.into()),
            Shape::Signed | Shape::SignedFingers if word == UNKNOWN => None,
            Shape::Signed | Shape::SignedFingers => Some(word.cast_signed().into()),
            Shape::Long => {
                let lower = *self.0.get(&(address + 1))?;
                Some((u32::from(word) << 16 | u32::from(lower)).into())
            }
        }
    }

    fn word(&self, item: Item) -> u16 {
        self.number(item, 0).map_or(0, |number| number as u16)
    }

    /// First half of the hash of the finger's recipe, in hexadecimal digits.
    pub fn table(&self) -> String {
        let number = self.number(Item::Table, 0).unwrap_or_default();
        format!("{:08x}", number as u32)
    }

    /// Version of the gripper's program.
    pub fn version(&self) -> String {
        let word = self.word(Item::Version);
        format!("{}.{}", word >> 8, word & 0xff)
    }

    /// Time since the gripper's start, s.
    pub fn t_s(&self) -> f64 {
        1e-3 * self.number(Item::Uptime, 0).unwrap_or_default()
    }

    /// What is seen of the gripper.
    pub fn observation(&self) -> Observation {
        let mut observation = Observation::default();
        for field in &FIELDS {
            let number = match field.register {
                Origin::Nowhere => None,
                Origin::Register {
                    item,
                    offset,
                    parts,
                } => self
                    .number(item, offset)
                    .map(|number| number / f64::from(parts)),
                Origin::Bit { item, bit } => Some((self.word(item) >> bit & 1).into()),
            };
            match (field.place)(&mut observation) {
                Place::Double(place) => *place = number,
                Place::Float(place) => *place = number.map(|number| number as f32),
                Place::Whole(place) => *place = number.map(|number| number as u16),
                Place::Flag(place) => *place = number.map(|number| number != 0.0),
            }
        }
        if observation.loss_cause == Some(0) {
            observation.loss_latency_ms = None;
        }
        observation
    }

    /// What has happened since an earlier look.
    pub fn events_since(&self, before: &Self) -> Vec<EventTold> {
        let mut events = Vec::new();
        let mut add = |t_s: f64, name: &str, text: String| {
            events.push(EventTold {
                t_s,
                name: name.into(),
                text,
            });
        };
        let is_more = |item| self.word(item) != before.word(item);
        let now_s = self.t_s();
        if is_more(Item::Holds) {
            add(now_s, "holding", "holding".into());
        }
        if is_more(Item::Losses) {
            let at_s = |item| 1e-3 * self.number(item, 0).unwrap_or_default();
            let cause = CAUSES[usize::from(self.word(Item::LossCause)) % CAUSES.len()];
            let since_s = at_s(Item::LossOnset);
            let text = format!("LOST: the object is gone (since {since_s:.3} s, {cause})");
            add(at_s(Item::LossFlagged), "lost", text);
        }
        if is_more(Item::Refusals) {
            add(now_s, "refused", "a command was refused".into());
        }
        if is_more(Item::Tares) {
            add(now_s, "tared", "gauges zeroed".into());
        }
        if is_more(Item::Sweeps) {
            add(now_s, "swept", "fingers learned".into());
        }
        let state = self.word(Item::State);
        if is_more(Item::State) && STATES.get(usize::from(state)) == Some(&"empty") {
            add(now_s, "empty", "closed on nothing".into());
        }
        let fault = self.word(Item::Fault);
        if is_more(Item::Fault) && fault != 0 {
            let rule = RULES
                .iter()
                .find(|rule| u16::from(rule.fault.code()) == fault);
            let name = rule.map_or("unknown here".into(), |rule| format!("{:?}", rule.fault));
            add(now_s, "fault", format!("FAULT {fault}: {name}"));
        }
        events
    }
}

/// Numbers of the command register.
mod command {
    pub const GRIP: u16 = 1;
    pub const GRIP_AT: u16 = 2;
    pub const GRIP_PAYLOAD: u16 = 3;
    pub const RELEASE: u16 = 4;
    pub const STOP: u16 = 5;
    pub const ACKNOWLEDGE: u16 = 6;
    pub const TARE: u16 = 7;
    pub const SWEEP: u16 = 8;
    pub const SAVE: u16 = 9;
    pub const CLEAR_BLACK_BOX: u16 = 11;
}

/// Carries out a wish, and says what has become of it. A wish for the virtual gripper's world is none for registers.
///
/// # Errors
/// If the gripper does not answer.
pub fn carry_out(master: &mut Master, wish: &Wish) -> anyhow::Result<Answer> {
    let done = match *wish {
        Wish::Grip => give(master, command::GRIP),
        Wish::GripAt(kpa) => grip_at(master, kpa),
        Wish::GripPayload {
            kind,
            mass_kg,
            acceleration_m_s2,
        } => grip_payload(master, kind, mass_kg, acceleration_m_s2),
        Wish::Release => give(master, command::RELEASE),
        Wish::Stop => give(master, command::STOP),
        Wish::Acknowledge => give(master, command::ACKNOWLEDGE),
        Wish::Tare => give(master, command::TARE),
        Wish::Sweep => give(master, command::SWEEP),
        Wish::Save => write_command(master, command::SAVE),
        Wish::ClearBlackBox => write_command(master, command::CLEAR_BLACK_BOX),
        Wish::Set(number, value) => return set(master, number, value),
        Wish::World(_) => Ok(Answer::Refused(
            "this is no virtual gripper: nothing can be made to happen to it".into(),
        )),
    };
    refused_by_line(done)
}

/// An exception of the gripper is an answer, and a line that is gone is none.
fn refused_by_line(done: anyhow::Result<Answer>) -> anyhow::Result<Answer> {
    match done {
        Err(error) => match error.downcast_ref::<Refused>() {
            Some(refused) => Ok(Answer::Refused(refused.to_string())),
            None => Err(error),
        },
        done => done,
    }
}

fn write_command(master: &mut Master, number: u16) -> anyhow::Result<Answer> {
    master.write(register(Item::Command)?, number)?;
    Ok(Answer::Done)
}

/// Gives a command to the controller, and looks up what has become of it.
fn give(master: &mut Master, number: u16) -> anyhow::Result<Answer> {
    master.write(register(Item::Command)?, number)?;
    let fate = master.read(register(Item::Fate)?, 3)?;
    let [fate, refusal, detail] = fate[..] else {
        bail!("the gripper's answer has another length than asked for");
    };
    Ok(match fate {
        1 => Answer::Done,
        2 => Answer::Already,
        3 => Answer::Refused(reason(refusal, detail)),
        4 => Answer::Refused("a stop, or a release by the digital inputs, came before".into()),
        _ => Answer::Refused("the gripper does not say what has become of it".into()),
    })
}

/// Why a command was refused.
fn reason(refusal: u16, detail: u16) -> String {
    let word = |words: &[(u16, &'static str)], number: u16| {
        let found = words.iter().find(|(n, _)| *n == number);
        found.map_or("for a reason that is unknown here", |(_, word)| *word)
    };
    match refusal {
        4 => format!(
            "no pressure up to the highest lifts that much with the margin of the settings: {detail} g would be possible"
        ),
        10 | 11 => format!("{}: {}", word(&REFUSALS, refusal), word(&DETAILS, detail)),
        _ => word(&REFUSALS, refusal).into(),
    }
}

/// A number in a register of so many parts, if there is one.
fn in_register(name: &str, value: f32, parts: f32) -> Result<u16, Answer> {
    let scaled = (parts * value).round();
    match (0.0..=f32::from(u16::MAX)).contains(&scaled) {
        true => Ok(scaled as u16),
        false => Err(Answer::Refused(format!(
            "{name} = {value}: must lie within 0 and {}",
            f32::from(u16::MAX) / parts
        ))),
    }
}

fn grip_at(master: &mut Master, kpa: f32) -> anyhow::Result<Answer> {
    let pressure = match in_register("pressure, kPa", kpa, 10.0) {
        Ok(pressure) => pressure,
        Err(answer) => return Ok(answer),
    };
    let most = master.read(register(Item::MaxPressure)?, 1)?[0];
    if pressure > most {
        return Ok(Answer::Refused(format!(
            "{kpa} kPa: must lie within 0 and {} kPa, the setting regulator.max_pressure_kpa",
            f32::from(most) / 10.0
        )));
    }
    master.write(register(Item::GripPressure)?, pressure)?;
    give(master, command::GRIP_AT)
}

fn grip_payload(
    master: &mut Master,
    kind: ObjectKind,
    mass_kg: f32,
    acceleration_m_s2: f32,
) -> anyhow::Result<Answer> {
    let mass = in_register("mass, kg", mass_kg, 1e3);
    let acceleration = in_register("acceleration, m/s²", acceleration_m_s2, 1e3);
    let (mass, acceleration) = match (mass, acceleration) {
        (Ok(mass), Ok(acceleration)) => (mass, acceleration),
        (Err(answer), _) | (_, Err(answer)) => return Ok(answer),
    };
    let kind = match kind {
        ObjectKind::Sphere => 0,
        ObjectKind::Cylinder => 1,
    };
    master.write_all(register(Item::Mass)?, &[mass, acceleration, kind])?;
    give(master, command::GRIP_PAYLOAD)
}

fn set(master: &mut Master, number: u16, value: f32) -> anyhow::Result<Answer> {
    // Its own range is told in words; whether it goes with the others the gripper knows.
    let mut values = Values::DEFAULT;
    if let Err(error) = values.set(number, value) {
        return Ok(Answer::Refused(error.to_string()));
    }
    let field = SETTINGS.iter().find(|field| field.number == number);
    let name = field.map_or("", |field| field.name);
    let bits = value.to_bits();
    let words = [(bits >> 16) as u16, bits as u16];
    let done = master.write_all(SETTINGS_FROM + 2 * number, &words);
    match done {
        Ok(()) => Ok(Answer::Done),
        Err(error) => match error.downcast_ref::<Refused>() {
            Some(Refused { exception: 3, .. }) => Ok(Answer::Refused(format!(
                "{name} = {value}: does not go with the other settings: a pressure is higher than the finger, the \
                 regulator or regulator.max_pressure_kpa allows"
            ))),
            _ => refused_by_line(Err(error)),
        },
    }
}

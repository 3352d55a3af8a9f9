//! The block that says what the gripper knows beyond the convention, and takes commands of its own.

use super::compatible::Fingers;
use super::link::{Status, Wishes};
use super::numbers;
use super::registers::{Half, Item, MAP_VERSION};
use crate::modbus::Exception;
use softgrip::command::{Command, Grip, Motion, Payload};
use softgrip::detect::Loss;
use softgrip::failure::Activity;
use softgrip::fault::Fault;
use softgrip::table::ObjectKind;
use softgrip::units::{FINGERS, Instant, Kilograms, Kilopascals, MetresPerSecondSquared};

/// What no number is known for.
const UNKNOWN: u16 = 0x8000;

/// Version of this program: 256 times the major number plus the minor one.
const VERSION: u16 =
    number(env!("CARGO_PKG_VERSION_MAJOR")) << 8 | number(env!("CARGO_PKG_VERSION_MINOR"));

const fn number(digits: &str) -> u16 {
    match u16::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("cargo gives digits"),
    }
}

/// Tenths of a register's unit.
const TENTHS: f32 = 10.0;
/// The largest number in a register with a sign.
const MOST: f32 = i16::MAX as f32;
/// 0.1 % of a share.
const PER_MILLE: f32 = 1e3;

/// What a row holds.
enum Value {
    /// In one register.
    Word(u16),
    /// In two.
    Long(u32),
    /// In so many parts of its unit, with a sign, in one.
    Number(Option<f32>, f32),
}

/// The block's memory.
#[derive(Debug, Clone, Copy)]
pub struct Own {
    mass_g: u16,
    acceleration_mm_per_s2: u16,
    kind: u16,
    pressure: u16,
    command: u16,
    motion: u16,
    /// Number of what has become of the last command.
    fate: u16,
    /// Losses that have been acknowledged, as they are counted.
    acknowledged: u16,
    /// Losses in the last status.
    losses: u16,
    requests: u32,
    exceptions: u16,
    /// The settings are not as they are stored.
    pub changed: bool,
}

/// The command register's numbers.
const SAVE: u16 = 9;
const HALT: u16 = 10;
const CLEAR: u16 = 11;

/// What is done beside commands to the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Nothing.
    Nothing,
    /// The settings are stored.
    Save,
    /// The black box is cleared.
    ClearBlackBox,
}

impl Own {
    /// Nothing has been written.
    pub const fn new() -> Self {
        Self {
            mass_g: 0,
            acceleration_mm_per_s2: 0,
            kind: 0,
            pressure: 0,
            command: 0,
            motion: 0,
            fate: 0,
            acknowledged: 0,
            losses: 0,
            requests: 0,
            exceptions: 0,
            changed: false,
        }
    }

    /// Counts a request, or the exception that it is answered with.
    pub fn count(&mut self, good: bool) {
        match good {
            true => self.requests = self.requests.wrapping_add(1),
            false => self.exceptions = self.exceptions.wrapping_add(1),
        }
    }

    /// Somebody has seen the loss.
    pub fn acknowledge(&mut self) {
        self.acknowledged = self.losses;
    }

    /// Takes a status: before it is shown.
    pub fn observe(&mut self, status: &Status) {
        self.losses = status.record.losses;
        if let Some(fate) = status.fate {
            self.fate = numbers::of_fate(fate);
        }
    }

    /// Whether a register takes this value.
    ///
    /// # Errors
    /// The exception to be answered.
    pub fn check(item: Item, value: u16, fingers: &Fingers) -> Result<(), Exception> {
        let most = match item {
            Item::Mass | Item::Acceleration => u16::MAX,
            Item::Kind | Item::Motion => 1,
            Item::GripPressure => (TENTHS * fingers.limit.0) as u16,
            Item::Command => CLEAR,
            _ => return Err(Exception::IllegalAddress),
        };
        match value <= most {
            true => Ok(()),
            false => Err(Exception::IllegalValue),
        }
    }

    /// Takes a value that has been checked.
    pub fn write(&mut self, item: Item, value: u16) {
        let place = match item {
            Item::Mass => &mut self.mass_g,
            Item::Acceleration => &mut self.acceleration_mm_per_s2,
            Item::Kind => &mut self.kind,
            Item::GripPressure => &mut self.pressure,
            Item::Command => &mut self.command,
            Item::Motion => &mut self.motion,
            _ => return,
        };
        *place = value;
    }

    /// What a register means that has been written, once all of its request have been.
    pub fn act(&mut self, item: Item, wishes: &mut Wishes) -> Act {
        let command = match (item, self.command) {
            (Item::Motion, _) => Command::Motion(match self.motion {
                0 => Motion::Moving,
                _ => Motion::Still,
            }),
            (Item::Command, SAVE) => return Act::Save,
            (Item::Command, CLEAR) => return Act::ClearBlackBox,
            (Item::Command, number) => match self.command(number) {
                Some(command) => command,
                None => return Act::Nothing,
            },
            _ => return Act::Nothing,
        };
        wishes.add(command);
        Act::Nothing
    }

    fn command(&mut self, number: u16) -> Option<Command> {
        Some(match number {
            1 => Command::Grip(Grip::Default),
            2 => {
                let pressure = f32::from(self.pressure) / TENTHS;
                Command::Grip(Grip::Pressure(Kilopascals(pressure)))
            }
            3 => Command::Grip(Grip::Payload(Payload {
                kind: match self.kind {
                    0 => ObjectKind::Sphere,
                    _ => ObjectKind::Cylinder,
                },
                mass: Kilograms(1e-3 * f32::from(self.mass_g)),
                acceleration: MetresPerSecondSquared(1e-3 * f32::from(self.acceleration_mm_per_s2)),
            })),
            4 => Command::Release,
            5 => Command::Stop,
            6 => {
                self.acknowledge();
                Command::Acknowledge
            }
            7 => Command::Tare,
            8 => Command::Sweep,
            HALT => Command::Halt,
            _ => return None,
        })
    }

    /// The register with this offset in the item's row.
    pub fn shows(&self, item: Item, offset: u16, status: &Status, fingers: &Fingers) -> u16 {
        match self.value(item, offset, status, fingers) {
            Value::Word(word) => word,
            Value::Long(number) => Half::at(offset).of(number),
            Value::Number(number, parts) => signed(number, parts),
        }
    }

    /// What a row holds; for a row of one register for each finger that of the finger `offset`.
    fn value(&self, item: Item, offset: u16, status: &Status, fingers: &Fingers) -> Value {
        let Status {
            snapshot, record, ..
        } = status;
        let loss = self.loss(status);
        let (refusal, detail) = record.refusal.map_or((0, 0), numbers::of_refusal);
        let word = match item {
            Item::Table => return Value::Long((fingers.table.inputs_hash >> 32) as u32),
            Item::Uptime => return Value::Long(millis(snapshot.now)),
            Item::LossOnset => return Value::Long(loss.map_or(0, |loss| millis(loss.onset))),
            Item::LossFlagged => return Value::Long(loss.map_or(0, |loss| millis(loss.flagged))),
            Item::Requests => return Value::Long(self.requests),

            Item::MaxPressure => return Value::Number(Some(fingers.limit.0), TENTHS),
            Item::FullBend => return Value::Number(Some(fingers.full_bend().0), TENTHS),
            Item::Pressure => return Value::Number(snapshot.pressure.map(|kpa| kpa.0), TENTHS),
            Item::SetPoint => return Value::Number(Some(snapshot.setpoint.0), TENTHS),
            Item::Bend => return Value::Number(Some(snapshot.bend.0), TENTHS),
            Item::Level => return Value::Number(snapshot.level, PER_MILLE),
            Item::Margin => return Value::Number(snapshot.margin, PER_MILLE),
            Item::Residual => {
                let residual = of(&snapshot.residual, offset).flatten();
                return Value::Number(residual.map(|ue| ue.0), 1.0);
            }
            Item::Noise => {
                return Value::Number(of(&snapshot.noise, offset).map(|ue| ue.0), TENTHS);
            }
            Item::Drift => return Value::Number(of(&snapshot.drift, offset).map(|ue| ue.0), 1.0),
            Item::LossEvidence => {
                let evidence = loss.and_then(|loss| of(&loss.evidence, offset).flatten());
                return Value::Number(evidence, PER_MILLE);
            }

            Item::MapVersion => MAP_VERSION,
            Item::Version => VERSION,
            Item::State => Activity::from(&snapshot.state) as u16,
            Item::Fault => code(snapshot.state.fault()),
            Item::Flags => flags([
                snapshot.state.is_holding(),
                snapshot.lost.is_some(),
                snapshot.tare_due,
            ]),
            Item::Touching => flags(snapshot.touching),
            Item::GaugeFault => code(of(&status.gauges, offset).flatten().map(Fault::from)),
            Item::LossCause => loss.map_or(0, |loss| numbers::of_cause(loss.cause)),
            Item::LossLatency => {
                let us = loss.map_or(0, Loss::latency_us);
                let tenths = u32::try_from(us).unwrap_or(u32::MAX) / 100;
                u16::try_from(tenths).unwrap_or(u16::MAX)
            }
            Item::Exceptions => self.exceptions,
            Item::Holds => record.holds,
            Item::Losses => record.losses,
            Item::Refusals => record.refusals,
            Item::Tares => record.tares,
            Item::Sweeps => record.sweeps,
            Item::LostEvents => record.lost_events,
            Item::Mass => self.mass_g,
            Item::Acceleration => self.acceleration_mm_per_s2,
            Item::Kind => self.kind,
            Item::GripPressure => self.pressure,
            Item::Command => self.command,
            Item::Motion => self.motion,
            Item::Fate => self.fate,
            Item::Refusal => refusal,
            Item::Detail => detail,
            Item::Settings => self.changed.into(),
            // Of the compatible block, and what is reserved.
            _ => 0,
        };
        Value::Word(word)
    }

    /// The loss that nobody has acknowledged.
    fn loss<'a>(&self, status: &'a Status) -> Option<&'a Loss> {
        let loss = status.record.loss.as_ref();
        loss.filter(|_| status.record.losses != self.acknowledged)
    }
}

/// One finger's.
fn of<T: Copy>(fingers: &[T; FINGERS], finger: u16) -> Option<T> {
    fingers.get(usize::from(finger)).copied()
}

/// One bit for each.
fn flags<const N: usize>(bits: [bool; N]) -> u16 {
    let bits = bits.into_iter().rev();
    bits.fold(0, |flags, bit| flags << 1 | u16::from(bit))
}

/// The number of a fault; zero for none.
fn code(fault: Option<Fault>) -> u16 {
    fault.map_or(0, |fault| fault.code().into())
}

/// Milliseconds since the start; they wrap.
fn millis(moment: Instant) -> u32 {
    // A division of 64 bits takes 1 kB of flash: 2³² µs are 4 294 967 ms and 296 µs.
    let (high, low) = ((moment.micros() >> 32) as u32, moment.micros() as u32);
    let rest = high.wrapping_mul(296).wrapping_add(low % 1_000);
    high.wrapping_mul(4_294_967)
        .wrapping_add(low / 1_000)
        .wrapping_add(rest / 1_000)
}

/// So many parts of a number, rounded; beyond what a register holds it is the nearest that it does.
fn signed(number: Option<f32>, parts: f32) -> u16 {
    match number {
        Some(number) if !number.is_nan() => {
            let scaled = (parts * number).clamp(-MOST, MOST);
            let half = if scaled < 0.0 { -0.5 } else { 0.5 };
            ((scaled + half) as i16).cast_unsigned()
        }
        _ => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_no_number_and_what_is_too_large_is_the_largest() {
        assert_eq!(signed(None, 1.0), UNKNOWN);
        assert_eq!(signed(Some(f32::NAN), 1.0), UNKNOWN);
        for (number, shown) in [
            (1.26, 13),
            (-1.26, -13),
            (1e9, i16::MAX),
            (-1e9, -i16::MAX),
            (f32::INFINITY, i16::MAX),
        ] {
            assert_eq!(signed(Some(number), TENTHS).cast_signed(), shown);
        }
    }
}

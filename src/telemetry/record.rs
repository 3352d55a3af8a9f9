//! One tick in a fixed layout: all that the controller got, what it made of it, and how the program fared.
//!
//! This is the definition of what is sent 50 to 1000 times per second, recorded and replayed. Whoever has every record
//! of a run from its first tick on can do the run again, bit for bit.
//!
//! A record is words of 32 bits, least significant byte first. The first holds the layout and three codes, the second
//! a bit for each thing that is so or is there; what is not there is zero. A loss comes last and may be left off.

use core::fmt;

use super::codes::{cause_of, code_of, code_of_state, command_of, number_of, state_of};
use super::snapshot::Snapshot;
use crate::command::Command;
use crate::condition::RawFrame;
use crate::detect::Loss;
use crate::fault::Fault;
use crate::units::{
    AdcCode, DacCode, Degrees, FINGERS, Instant, Kilopascals, Microstrain, Millivolts,
};

/// One tick, and how the program fared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Counts the records since start-up, from 1 on: what is missing was dropped on its way.
    pub number: u32,
    /// The longest control tick since the record before, µs.
    pub longest_tick_us: u32,
    /// Events since start-up that found no room.
    pub events_lost: u32,
    /// The chip runs on its own oscillator: every time is off by what that is off.
    pub internal_clock: bool,
    /// What the converter delivered.
    pub frame: RawFrame,
    /// What the robot wanted.
    pub command: Command,
    /// What went to the regulator.
    pub dac: DacCode,
    /// What the controller made of it.
    pub snapshot: Snapshot,
}

/// Why bytes are no record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordError {
    /// They have this layout, and another one is read here, [`Record::LAYOUT`].
    Layout(u8),
    /// They have neither length of a record, or a code that the layout does not have.
    Malformed,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Layout(layout) => write!(
                f,
                "a record of layout {layout}, where layout {} is read",
                Record::LAYOUT
            ),
            Self::Malformed => f.write_str("no record: its length or a code in it is wrong"),
        }
    }
}

impl core::error::Error for RecordError {}

/// Codes of 16 bits in pairs: of each gauge, monitor, supply, rail, scans, converter.
const PAIRS: usize = (FINGERS + 5).div_ceil(2);
/// Where what stands in a record, in words, beyond the first ten.
const RESIDUALS: usize = 10;
const BEND: usize = RESIDUALS + FINGERS;
const NOISE: usize = BEND + 3;
const DRIFT: usize = NOISE + FINGERS;
const WISH: usize = DRIFT + FINGERS;
const CODES_AT: usize = WISH + 2;
const FARES: usize = CODES_AT + PAIRS;
/// Words of a record without its loss, and with it.
const SHORT: usize = FARES + 2;
const WORDS: usize = SHORT + 4 + FINGERS;

/// Bits of the second word, where there is one for each finger the first one's.
const LOST: u32 = 0;
const PRESSURE: u32 = 1;
const LEVEL: u32 = 2;
const MARGIN: u32 = 3;
const SINCE: u32 = 4;
const TARE_DUE: u32 = 5;
const OVERRUN: u32 = 6;
const CARRIED: u32 = 7;
const INTERNAL_CLOCK: u32 = 8;
const RESIDUAL: u32 = 9;
const TOUCHING: u32 = RESIDUAL + FINGERS as u32;
const EVIDENCE: u32 = TOUCHING + FINGERS as u32;
/// And two bits of a number.
const CAUSE: u32 = EVIDENCE + FINGERS as u32;

const fn bit(on: bool, at: u32) -> u32 {
    (on as u32) << at
}

const fn is_on(flags: u32, at: u32) -> bool {
    flags >> at & 1 != 0
}

/// A bit for each finger.
fn bits_of_fingers(on: [bool; FINGERS], at: u32) -> u32 {
    let each = on.into_iter().zip(at..32);
    each.fold(0, |bits, (on, at)| bits | bit(on, at))
}

fn fingers_of(flags: u32, at: u32) -> [bool; FINGERS] {
    let mut on = [false; FINGERS];
    for (on, at) in on.iter_mut().zip(at..32) {
        *on = is_on(flags, at);
    }
    on
}

/// A number's bits; zero for none.
fn bits(value: Option<f32>) -> u32 {
    value.map_or(0, f32::to_bits)
}

fn value(bits: u32, is_there: bool) -> Option<f32> {
    is_there.then_some(f32::from_bits(bits))
}

/// A code of 16 bits at an even place of a word, or an odd one.
fn half(place: usize, code: u16) -> u32 {
    u32::from(code) << (16 * (place % 2))
}

fn lower(moment: Instant) -> u32 {
    moment.micros() as u32
}

fn upper(moment: Instant) -> u32 {
    (moment.micros() >> 32) as u32
}

/// Words that are read one after the other.
struct Read<'a>(core::slice::Iter<'a, u32>);

impl Read<'_> {
    fn word(&mut self) -> u32 {
        self.0.next().copied().unwrap_or(0)
    }

    fn number(&mut self) -> f32 {
        f32::from_bits(self.word())
    }

    fn moment(&mut self) -> Instant {
        let (low, high) = (self.word(), self.word());
        Instant::from_micros(u64::from(low) | u64::from(high) << 32)
    }

    fn strains(&mut self) -> [Microstrain; FINGERS] {
        [(); FINGERS].map(|()| Microstrain(self.number()))
    }
}

impl Record {
    /// The layout that is written and read here. Another one has another number, whatever has changed, and so has another
    /// number of fingers.
    pub const LAYOUT: u8 = match FINGERS {
        3 => 1,
        fingers => 16 * fingers as u8 + 1,
    };

    /// The length of a record with a loss, bytes.
    pub const BYTES: usize = 4 * WORDS;

    /// The length of a record without one, bytes.
    pub const BYTES_WITHOUT_LOSS: usize = 4 * SHORT;

    /// Writes the record; gives what is to be sent, which is shorter while nothing is lost.
    pub fn encode<'a>(&self, into: &'a mut [u8; Self::BYTES]) -> &'a [u8] {
        let (chunks, _) = into.as_chunks_mut::<4>();
        for (chunk, word) in chunks.iter_mut().zip(self.words()) {
            *chunk = word.to_le_bytes();
        }
        let length = match self.snapshot.lost {
            Some(_) => Self::BYTES,
            None => Self::BYTES_WITHOUT_LOSS,
        };
        into.get(..length).unwrap_or(into)
    }

    /// Reads a record.
    ///
    /// # Errors
    ///
    /// See [`RecordError`].
    pub fn decode(bytes: &[u8]) -> Result<Self, RecordError> {
        let (chunks, rest) = bytes.as_chunks::<4>();
        match chunks.first() {
            Some(&[layout, ..]) if layout != Self::LAYOUT => {
                return Err(RecordError::Layout(layout));
            }
            Some(_) if rest.is_empty() && [SHORT, WORDS].contains(&chunks.len()) => {}
            _ => return Err(RecordError::Malformed),
        }
        let mut words = [0; WORDS];
        for (word, &chunk) in words.iter_mut().zip(chunks) {
            *word = u32::from_le_bytes(chunk);
        }
        let record = Self::of(&words).ok_or(RecordError::Malformed)?;
        match record.snapshot.lost.is_some() == (chunks.len() == WORDS) {
            true => Ok(record),
            false => Err(RecordError::Malformed),
        }
    }

    fn words(&self) -> [u32; WORDS] {
        let Self {
            frame, snapshot, ..
        } = self;
        let (state, since, target) = code_of_state(&snapshot.state);
        let fault = snapshot.state.fault().map_or(0, Fault::code);
        let (command, [first, second]) = code_of(self.command);
        let mut words = [0; WORDS];
        let mut add = |at: usize, word: u32| {
            if let Some(place) = words.get_mut(at) {
                *place |= word;
            }
        };
        let head = u32::from_le_bytes([Self::LAYOUT, state, command, fault]);
        add(0, head);
        add(1, self.flags(since.is_some()));
        add(2, self.number);
        add(3, lower(snapshot.now));
        add(4, upper(snapshot.now));
        if let Some(since) = since {
            add(5, lower(since));
            add(6, upper(since));
        }
        add(7, target.0.to_bits());
        add(8, bits(snapshot.pressure.map(|pressure| pressure.0)));
        add(9, snapshot.setpoint.0.to_bits());
        let strains = snapshot.noise.iter().zip(&snapshot.drift);
        let fingers = snapshot.residual.iter().zip(strains);
        for (finger, (residual, (noise, drift))) in (0..FINGERS).zip(fingers) {
            add(RESIDUALS + finger, bits(residual.map(|ue| ue.0)));
            add(NOISE + finger, noise.0.to_bits());
            add(DRIFT + finger, drift.0.to_bits());
        }
        add(BEND, snapshot.bend.0.to_bits());
        add(BEND + 1, bits(snapshot.level));
        add(BEND + 2, bits(snapshot.margin));
        add(WISH, first.to_bits());
        add(WISH + 1, second.to_bits());
        let others = [
            frame.monitor.0,
            frame.supply.0,
            frame.rail.0,
            frame.scans,
            self.dac.0,
        ];
        for (finger, code) in (0..FINGERS).zip(&frame.gauges) {
            add(CODES_AT + finger / 2, half(finger, code.0));
        }
        for (place, code) in (FINGERS..2 * PAIRS).zip(others) {
            add(CODES_AT + place / 2, half(place, code));
        }
        add(FARES, self.longest_tick_us);
        add(FARES + 1, self.events_lost);
        if let Some(loss) = &snapshot.lost {
            add(SHORT, lower(loss.onset));
            add(SHORT + 1, upper(loss.onset));
            add(SHORT + 2, lower(loss.flagged));
            add(SHORT + 3, upper(loss.flagged));
            for (finger, share) in (0..FINGERS).zip(loss.evidence) {
                add(SHORT + 4 + finger, bits(share));
            }
        }
        words
    }

    fn flags(&self, has_since: bool) -> u32 {
        let snapshot = &self.snapshot;
        bit(snapshot.pressure.is_some(), PRESSURE)
            | bit(snapshot.level.is_some(), LEVEL)
            | bit(snapshot.margin.is_some(), MARGIN)
            | bit(has_since, SINCE)
            | bit(snapshot.tare_due, TARE_DUE)
            | bit(self.frame.overrun, OVERRUN)
            | bit(self.frame.carried, CARRIED)
            | bit(self.internal_clock, INTERNAL_CLOCK)
            | bits_of_fingers(snapshot.residual.map(|r| r.is_some()), RESIDUAL)
            | bits_of_fingers(snapshot.touching, TOUCHING)
            | snapshot.lost.as_ref().map_or(0, loss_flags)
    }

    fn of(words: &[u32; WORDS]) -> Option<Self> {
        let mut from = Read(words.iter());
        let [_, state, command, fault] = from.word().to_le_bytes();
        let flags = from.word();
        let number = from.word();
        let (now, since) = (from.moment(), from.moment());
        let target = Kilopascals(from.number());
        let pressure = value(from.word(), is_on(flags, PRESSURE));
        let setpoint = Kilopascals(from.number());
        let residual = fingers_of(flags, RESIDUAL)
            .map(|is_there| value(from.word(), is_there).map(Microstrain));
        let bend = Degrees(from.number());
        let level = value(from.word(), is_on(flags, LEVEL));
        let margin = value(from.word(), is_on(flags, MARGIN));
        let (noise, drift) = (from.strains(), from.strains());
        let (first, second) = (from.number(), from.number());
        let mut codes = [0; 2 * PAIRS];
        let (pairs, _) = codes.as_chunks_mut::<2>();
        for pair in pairs {
            let word = from.word();
            *pair = [word as u16, (word >> 16) as u16];
        }
        let (gauges, others) = codes.split_first_chunk::<FINGERS>()?;
        let [monitor, supply, rail, scans, dac] = *others.first_chunk()?;
        let (longest_tick_us, events_lost) = (from.word(), from.word());
        Some(Self {
            number,
            longest_tick_us,
            events_lost,
            internal_clock: is_on(flags, INTERNAL_CLOCK),
            frame: RawFrame {
                gauges: gauges.map(AdcCode),
                monitor: AdcCode(monitor),
                supply: AdcCode(supply),
                rail: Millivolts(rail),
                scans,
                overrun: is_on(flags, OVERRUN),
                carried: is_on(flags, CARRIED),
            },
            command: command_of(command, [first, second])?,
            dac: DacCode(dac),
            snapshot: Snapshot {
                now,
                state: state_of(state, since, is_on(flags, SINCE), target, fault)?,
                lost: match is_on(flags, LOST) {
                    true => Some(loss_of(&mut from, flags)?),
                    false => None,
                },
                pressure: pressure.map(Kilopascals),
                setpoint,
                residual,
                touching: fingers_of(flags, TOUCHING),
                bend,
                level,
                margin,
                noise,
                drift,
                tare_due: is_on(flags, TARE_DUE),
            },
        })
    }
}

/// The bits of a loss.
fn loss_flags(loss: &Loss) -> u32 {
    bit(true, LOST)
        | bits_of_fingers(loss.evidence.map(|share| share.is_some()), EVIDENCE)
        | number_of(loss.cause) << CAUSE
}

fn loss_of(from: &mut Read, flags: u32) -> Option<Loss> {
    let (onset, flagged) = (from.moment(), from.moment());
    Some(Loss {
        onset,
        flagged,
        cause: cause_of(flags >> CAUSE & 3)?,
        evidence: fingers_of(flags, EVIDENCE).map(|is_there| value(from.word(), is_there)),
    })
}

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

/// Words of a record without its loss, and with it.
const SHORT: usize = 30;
const WORDS: usize = SHORT + 7;

/// Bits of the second word, where there are three of them the first finger's.
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

fn bits_of_three(on: [bool; FINGERS], at: u32) -> u32 {
    let [a, b, c] = on;
    bit(a, at) | bit(b, at + 1) | bit(c, at + 2)
}

fn three_of(flags: u32, at: u32) -> [bool; FINGERS] {
    [at, at + 1, at + 2].map(|at| is_on(flags, at))
}

/// A number's bits; zero for none.
fn bits(value: Option<f32>) -> u32 {
    value.map_or(0, f32::to_bits)
}

fn value(bits: u32, is_there: bool) -> Option<f32> {
    is_there.then_some(f32::from_bits(bits))
}

fn pair(low: u16, high: u16) -> u32 {
    u32::from(low) | u32::from(high) << 16
}

fn unpaired(word: u32) -> [u16; 2] {
    [word as u16, (word >> 16) as u16]
}

fn halves(moment: Instant) -> [u32; 2] {
    let micros = moment.micros();
    [micros as u32, (micros >> 32) as u32]
}

fn moment(low: u32, high: u32) -> Instant {
    Instant::from_micros(u64::from(low) | u64::from(high) << 32)
}

impl Record {
    /// The layout that is written and read here. Another one has another number, whatever has changed.
    pub const LAYOUT: u8 = 1;

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
        let [now, now_high] = halves(snapshot.now);
        let [since_low, since_high] = since.map_or([0; 2], halves);
        let [residual_a, residual_b, residual_c] = snapshot.residual.map(|r| bits(r.map(|r| r.0)));
        let [noise_a, noise_b, noise_c] = snapshot.noise.map(|noise| noise.0.to_bits());
        let [drift_a, drift_b, drift_c] = snapshot.drift.map(|drift| drift.0.to_bits());
        let [gauge_a, gauge_b, gauge_c] = frame.gauges.map(|code| code.0);
        let (loss, loss_flags) = loss_words(snapshot.lost.as_ref());
        let [
            onset,
            onset_high,
            flagged,
            flagged_high,
            share_a,
            share_b,
            share_c,
        ] = loss;
        [
            u32::from_le_bytes([Self::LAYOUT, state, command, fault]),
            self.flags(since.is_some()) | loss_flags,
            self.number,
            now,
            now_high,
            since_low,
            since_high,
            target.0.to_bits(),
            bits(snapshot.pressure.map(|pressure| pressure.0)),
            snapshot.setpoint.0.to_bits(),
            residual_a,
            residual_b,
            residual_c,
            snapshot.bend.0.to_bits(),
            bits(snapshot.level),
            bits(snapshot.margin),
            noise_a,
            noise_b,
            noise_c,
            drift_a,
            drift_b,
            drift_c,
            first.to_bits(),
            second.to_bits(),
            pair(gauge_a, gauge_b),
            pair(gauge_c, frame.monitor.0),
            pair(frame.supply.0, frame.rail.0),
            pair(frame.scans, self.dac.0),
            self.longest_tick_us,
            self.events_lost,
            onset,
            onset_high,
            flagged,
            flagged_high,
            share_a,
            share_b,
            share_c,
        ]
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
            | bits_of_three(snapshot.residual.map(|r| r.is_some()), RESIDUAL)
            | bits_of_three(snapshot.touching, TOUCHING)
    }

    fn of(words: &[u32; WORDS]) -> Option<Self> {
        let [
            head,
            flags,
            number,
            now,
            now_high,
            since,
            since_high,
            target,
            rest @ ..,
        ] = *words;
        let [
            pressure,
            setpoint,
            residual_a,
            residual_b,
            residual_c,
            rest @ ..,
        ] = rest;
        let [bend, level, margin, noise_a, noise_b, noise_c, rest @ ..] = rest;
        let [drift_a, drift_b, drift_c, first, second, rest @ ..] = rest;
        let [
            gauges,
            gauge_and_monitor,
            supply_and_rail,
            scans_and_dac,
            rest @ ..,
        ] = rest;
        let [longest_tick_us, events_lost, loss @ ..] = rest;

        let [_, state, command, fault] = head.to_le_bytes();
        let strain = |bits| Microstrain(f32::from_bits(bits));
        let [is_a, is_b, is_c] = three_of(flags, RESIDUAL);
        let residual = [
            value(residual_a, is_a),
            value(residual_b, is_b),
            value(residual_c, is_c),
        ];
        let target = Kilopascals(f32::from_bits(target));
        let since = moment(since, since_high);
        let [gauge_a, gauge_b] = unpaired(gauges);
        let [gauge_c, monitor] = unpaired(gauge_and_monitor);
        let [supply, rail] = unpaired(supply_and_rail);
        let [scans, dac] = unpaired(scans_and_dac);
        Some(Self {
            number,
            longest_tick_us,
            events_lost,
            internal_clock: is_on(flags, INTERNAL_CLOCK),
            frame: RawFrame {
                gauges: [gauge_a, gauge_b, gauge_c].map(AdcCode),
                monitor: AdcCode(monitor),
                supply: AdcCode(supply),
                rail: Millivolts(rail),
                scans,
                overrun: is_on(flags, OVERRUN),
                carried: is_on(flags, CARRIED),
            },
            command: command_of(command, [first, second].map(f32::from_bits))?,
            dac: DacCode(dac),
            snapshot: Snapshot {
                now: moment(now, now_high),
                state: state_of(state, since, is_on(flags, SINCE), target, fault)?,
                lost: match is_on(flags, LOST) {
                    true => Some(loss_of(loss, flags)?),
                    false => None,
                },
                pressure: value(pressure, is_on(flags, PRESSURE)).map(Kilopascals),
                setpoint: Kilopascals(f32::from_bits(setpoint)),
                residual: residual.map(|residual| residual.map(Microstrain)),
                touching: three_of(flags, TOUCHING),
                bend: Degrees(f32::from_bits(bend)),
                level: value(level, is_on(flags, LEVEL)),
                margin: value(margin, is_on(flags, MARGIN)),
                noise: [noise_a, noise_b, noise_c].map(strain),
                drift: [drift_a, drift_b, drift_c].map(strain),
                tare_due: is_on(flags, TARE_DUE),
            },
        })
    }
}

/// The words of a loss, and its bits.
fn loss_words(loss: Option<&Loss>) -> ([u32; WORDS - SHORT], u32) {
    let Some(loss) = loss else {
        return ([0; WORDS - SHORT], 0);
    };
    let [onset, onset_high] = halves(loss.onset);
    let [flagged, flagged_high] = halves(loss.flagged);
    let [a, b, c] = loss.evidence.map(bits);
    let flags = bit(true, LOST)
        | bits_of_three(loss.evidence.map(|share| share.is_some()), EVIDENCE)
        | number_of(loss.cause) << CAUSE;
    ([onset, onset_high, flagged, flagged_high, a, b, c], flags)
}

fn loss_of(words: [u32; WORDS - SHORT], flags: u32) -> Option<Loss> {
    let [onset, onset_high, flagged, flagged_high, a, b, c] = words;
    let [is_a, is_b, is_c] = three_of(flags, EVIDENCE);
    Some(Loss {
        onset: moment(onset, onset_high),
        flagged: moment(flagged, flagged_high),
        cause: cause_of(flags >> CAUSE & 3)?,
        evidence: [value(a, is_a), value(b, is_b), value(c, is_c)],
    })
}

//! Bytes with time stamps → frames.

use super::crc::crc;
use super::reply::LONGEST;
use super::request::{Exception, Function, Request};
use softgrip::units::Instant;

/// The id of a request to everybody.
const BROADCAST: u8 = 0;
/// An older request is not answered: the master may have given up, and would take the answer for that to its next one.
pub const STALE_US: u64 = 100_000;

/// When a frame has ended that is not complete at its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    silence_us: u32,
}

impl Timing {
    /// A serial line: a silence of 3.5 characters of 11 bits, or of 1750 µs above 19 200 Bd (Serial Line, 2.5.1.1).
    ///
    /// A gap of 1.5 characters inside a frame, after which a slave may give it up, does not count: no USB adapter keeps to
    /// it, and the checksum tells.
    pub const fn line(baud: u32) -> Self {
        Self {
            silence_us: match baud {
                1..=19_200 => 38_500_000 / baud,
                _ => 1_750,
            },
        }
    }

    /// A stream that keeps no times, as TCP and a pseudo-terminal are: a partial frame is given up after 20 ms, for an
    /// adapter may hold bytes back for 16.
    pub const fn stream() -> Self {
        Self { silence_us: 20_000 }
    }

    /// The silence, µs.
    pub const fn silence_us(self) -> u32 {
        self.silence_us
    }
}

/// A frame for this slave with a good checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// It is for every slave: nobody answers.
    pub is_broadcast: bool,
    /// Its function code, known or not.
    pub code: u8,
    /// What it asks for, or the exception to be answered.
    pub request: Result<Request<'a>, Exception>,
}

/// What has been received of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    id: u8,
    timing: Timing,
    bytes: [u8; LONGEST],
    /// Bytes so far, more than there is room for in a frame that is too long.
    length: usize,
    /// They are a whole frame for this slave.
    is_whole: bool,
    /// When the last byte came.
    last: Instant,
    damaged: u16,
}

impl Receiver {
    /// Nothing yet, for the slave with this id.
    pub const fn new(id: u8, timing: Timing) -> Self {
        Self {
            id,
            timing,
            bytes: [0; LONGEST],
            length: 0,
            is_whole: false,
            last: Instant::from_micros(0),
            damaged: 0,
        }
    }

    /// Takes a byte that came at `now`, which must not run backwards. After each byte, and now and then without one,
    /// [`Receiver::frame`] is to be asked. Where the line brings back what this slave sends, that is not to be given:
    /// the answer to function 06 is its request once more.
    pub fn receive(&mut self, now: Instant, byte: u8) {
        if self.is_whole || self.is_silent(now) {
            // A frame that nobody has taken in time is none any more.
            self.forget();
        }
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
        self.last = now;
        let received = self.bytes.get(..self.length).unwrap_or_default();
        if is_end(received, request_length(received)) {
            self.is_whole = self.is_for_us();
            self.length = match self.is_whole {
                true => self.length,
                false => 0,
            };
        } else if !self.is_for_us() && is_end(received, answer_length(received)) {
            // Another slave has answered; the next request may follow at once.
            self.length = 0;
        }
    }

    /// The frame that has ended by now, once. One of a known function ends at its length, if its checksum is good; any
    /// other ends with a silence.
    ///
    /// None for frames with a bad checksum or for other slaves, for those that are no request (a wrong length, an
    /// exception), and for one that is older than [`STALE_US`].
    pub fn frame(&mut self, now: Instant) -> Option<Frame<'_>> {
        if !self.is_whole && !self.is_silent(now) {
            return None;
        }
        let is_for_us = self.is_for_us() && now.micros_since(self.last) <= STALE_US;
        let length = self.length;
        let is_whole = core::mem::take(&mut self.is_whole);
        self.length = 0;
        let [id, code, data @ .., _, _] = self.bytes.get(..length).unwrap_or_default() else {
            self.damaged = self.damaged.wrapping_add(1);
            return None;
        };
        if !is_whole && crc(self.bytes.get(..length).unwrap_or_default()) != 0 {
            self.damaged = self.damaged.wrapping_add(1);
            return None;
        }
        let is_request = is_whole || Function::of(*code).is_none() && *code < EXCEPTION;
        (is_for_us && is_request).then(|| Frame {
            is_broadcast: *id == BROADCAST,
            code: *code,
            request: Request::decode(*code, data),
        })
    }

    /// Whether something has been received that a silence would end.
    pub fn has_begun(&self) -> bool {
        self.length > 0
    }

    /// Gives up what has been received, as after the line has failed.
    pub fn forget(&mut self) {
        if self.length > 0 && !self.is_whole {
            self.damaged = self.damaged.wrapping_add(1);
        }
        self.length = 0;
        self.is_whole = false;
    }

    /// Frames with a bad checksum, and those that were too long or too short, since the start; it wraps.
    pub fn damaged(&self) -> u16 {
        self.damaged
    }

    fn is_silent(&self, now: Instant) -> bool {
        self.length > 0 && now.micros_since(self.last) >= self.timing.silence_us.into()
    }

    fn is_for_us(&self) -> bool {
        let [id, ..] = self.bytes;
        id == self.id || id == BROADCAST
    }
}

/// Answers with an exception carry their request's function code with this bit.
const EXCEPTION: u8 = 0x80;

/// Whether the bytes are as many as a frame must have, and their checksum is good.
fn is_end(bytes: &[u8], length: Option<usize>) -> bool {
    length == Some(bytes.len()) && crc(bytes) == 0
}

/// How long a request is that begins with these bytes; none if they do not tell.
fn request_length(bytes: &[u8]) -> Option<usize> {
    Some(match Function::of(*bytes.get(1)?)? {
        Function::ReadHolding | Function::ReadInput | Function::WriteOne => 8,
        Function::WriteMany => 9 + usize::from(*bytes.get(6)?),
        Function::ReadWrite => 13 + usize::from(*bytes.get(10)?),
    })
}

/// The same for an answer.
fn answer_length(bytes: &[u8]) -> Option<usize> {
    Some(match *bytes.get(1)? {
        1..=4 | 23 => 5 + usize::from(*bytes.get(2)?),
        5 | 6 | 15 | 16 => 8,
        EXCEPTION.. => 5,
        _ => return None,
    })
}

#[cfg(test)]
mod tests;

//! A message on its way into the ring that a debugger empties: whole or not at all, and nobody waits.
//!
//! It is encoded as rzCOBS, as defmt's decoders expect it: a byte says after up to seven others which of them are zero
//! and left out, or how long a run without a zero has been; a zero ends the message.

/// Bytes of the ring: sixteen records, so a host may come every 16 ms where each tick is sent. A power of two, which
/// offsets wrap at without a comparison.
pub const SIZE: usize = 2048;

/// A message that is being written.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Where the next byte goes, beyond the ring's end where it goes to its start.
    next: usize,
    /// Up to where the host has read.
    read: usize,
    /// Whether the message has fitted so far.
    fits: bool,
    /// Whether the bytes since the last description are a run without a zero, longer than a group.
    in_run: bool,
    /// Bytes until the group, or the run, is complete.
    left: u8,
    /// Which bytes of the group were zero.
    zeros: u8,
}

/// So many bytes are described one by one.
const GROUP: u8 = 7;
/// A run without a zero goes on for so many more at most.
const RUN: u8 = 127;

impl Frame {
    /// There is nowhere to write to.
    pub const NONE: Self = Self {
        next: 0,
        read: 0,
        fits: false,
        in_run: false,
        left: 0,
        zeros: 0,
    };

    /// Begins a message behind what has been written to the ring; a host has read up to `read`. An offset that
    /// lies outside leaves no room.
    pub fn begin(written: usize, read: usize) -> Self {
        Self {
            next: written,
            read,
            fits: written < SIZE && read < SIZE,
            left: GROUP,
            ..Self::NONE
        }
    }

    /// Adds to the message.
    // Not part of a caller's code, which may be built for size.
    #[inline(never)]
    pub fn write(&mut self, ring: &mut [u8; SIZE], bytes: &[u8]) {
        self.reserve(bytes.len());
        if !self.fits {
            return;
        }
        let mut frame = *self;
        for &byte in bytes {
            frame.add(ring, byte);
        }
        *self = frame;
    }

    /// Ends the message. Gives up to where the ring has been written; none if the message does not fit, and is dropped.
    pub fn end(mut self, ring: &mut [u8; SIZE]) -> Option<usize> {
        self.reserve(0);
        if !self.fits {
            return None;
        }
        if self.in_run {
            self.put(ring, self.run());
        } else if self.left < GROUP {
            // What is missing of the group counts as zeros.
            let written = GROUP - self.left;
            self.put(ring, (self.zeros | 0xff << written) & 0x7f);
        }
        self.put(ring, 0);
        Some(self.next % SIZE)
    }

    /// Whether so many bytes have room, with all that is written about them and the end of the message. One byte stays
    /// free, as a full ring would look like an empty one.
    fn reserve(&mut self, bytes: usize) {
        let free = self.read.wrapping_sub(self.next).wrapping_sub(1) % SIZE;
        // A description for each seven, rounded up: one that has begun, the last one and the zero.
        let most = bytes.saturating_add(bytes / 4).saturating_add(4);
        self.fits &= most <= free;
    }

    #[inline(always)]
    fn add(&mut self, ring: &mut [u8; SIZE], byte: u8) {
        if byte != 0 {
            self.put(ring, byte);
        } else if self.in_run {
            return self.describe(ring, self.run());
        } else {
            self.zeros |= 1u8.wrapping_shl(GROUP.wrapping_sub(self.left).into());
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            match (self.in_run, self.zeros) {
                (true, _) => self.describe(ring, 0xff),
                (false, 0) => (self.in_run, self.left) = (true, RUN),
                (false, zeros) => self.describe(ring, zeros),
            }
        }
    }

    /// Describes a run that a zero ends.
    fn run(&self) -> u8 {
        0x80 | RUN.wrapping_sub(self.left)
    }

    fn describe(&mut self, ring: &mut [u8; SIZE], description: u8) {
        self.put(ring, description);
        (self.in_run, self.left, self.zeros) = (false, GROUP, 0);
    }

    /// Writes a byte that has room.
    #[inline(always)]
    fn put(&mut self, ring: &mut [u8; SIZE], byte: u8) {
        if let Some(place) = ring.get_mut(self.next % SIZE) {
            *place = byte;
        }
        self.next = self.next.wrapping_add(1);
    }
}

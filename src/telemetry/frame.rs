//! A message on its way into the ring that a debugger empties: whole or not at all, and nobody waits.
//!
//! It is encoded as rzCOBS, as defmt's decoders expect it: a byte says after up to seven others which of them are zero
//! and left out, or how long a run without a zero has been; a zero ends the message.

/// A message that is being written.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Where the next byte goes.
    next: usize,
    /// Bytes that may be written.
    free: usize,
    /// Whether it has fitted so far.
    fits: bool,
    /// Bytes since the last that said something about others.
    run: u8,
    /// Which of them were zero.
    zeros: u8,
}

/// So many bytes are described one by one.
const GROUP: u8 = 7;
/// The longest run without a zero.
const LONGEST_RUN: u8 = 134;

impl Frame {
    /// There is nowhere to write to.
    pub const NONE: Self = Self {
        next: 0,
        free: 0,
        fits: false,
        run: 0,
        zeros: 0,
    };

    /// Begins a message behind what has been written to a ring of this size; a host has read up to `read`.
    /// An offset that lies outside leaves no room.
    pub fn begin(size: usize, written: usize, read: usize) -> Self {
        if written >= size || read >= size {
            return Self::NONE;
        }
        let unread = match written >= read {
            true => written - read,
            false => size - (read - written),
        };
        Self {
            next: written,
            // A full ring would look like an empty one.
            free: size - 1 - unread,
            fits: true,
            ..Self::NONE
        }
    }

    /// Ends whatever stands before a message that nothing has been written of.
    pub fn separate(&mut self, ring: &mut [u8]) {
        self.put(ring, 0);
    }

    /// Adds to the message.
    pub fn write(&mut self, ring: &mut [u8], bytes: &[u8]) {
        let mut frame = *self;
        for &byte in bytes {
            frame.add(ring, byte);
        }
        *self = frame;
    }

    #[inline(always)]
    fn add(&mut self, ring: &mut [u8], byte: u8) {
        match byte {
            0 if self.run >= GROUP => return self.describe(ring, (self.run - GROUP) | 0x80),
            0 => self.zeros |= 1 << self.run,
            _ => self.put(ring, byte),
        }
        self.run = self.run.wrapping_add(1);
        if self.run == GROUP && self.zeros != 0 {
            self.describe(ring, self.zeros);
        } else if self.run == LONGEST_RUN {
            self.describe(ring, 0xff);
        }
    }

    /// Ends the message. Gives up to where the ring has been written; none if the message does not fit, and is dropped.
    pub fn end(mut self, ring: &mut [u8]) -> Option<usize> {
        match self.run {
            0 => {}
            run if run < GROUP => self.put(ring, (self.zeros | 0xff << run) & 0x7f),
            run => self.put(ring, (run - GROUP) | 0x80),
        }
        self.put(ring, 0);
        self.fits.then_some(self.next)
    }

    #[inline(always)]
    fn describe(&mut self, ring: &mut [u8], description: u8) {
        self.put(ring, description);
        self.run = 0;
        self.zeros = 0;
    }

    #[inline(always)]
    fn put(&mut self, ring: &mut [u8], byte: u8) {
        match ring.get_mut(self.next) {
            Some(place) if self.free > 0 => {
                *place = byte;
                self.free -= 1;
                self.next += 1;
                if self.next >= ring.len() {
                    self.next = 0;
                }
            }
            _ => self.fits = false,
        }
    }
}

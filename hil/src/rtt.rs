//! The host at the debug port: takes what the firmware has put into its RTT buffer, and reads it.

use decode::{Decoded, Decoder, Image};
use rigless::emulator::Memory;
use rigless::soc::Width;

/// Offsets in the control block: its name, then the one channel's pointers and flags (SEGGER UM08001).
const ID: [u8; 10] = *b"SEGGER RTT";
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
/// Where the firmware's write offset lies in the control block.
pub const WRITTEN: u64 = 36;
const READ: u64 = 40;
const FLAGS: u64 = 44;
/// The flag by which a host asks the firmware to wait for it.
const BLOCK_IF_FULL: u64 = 2;

/// What the host does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Host {
    /// There is none.
    Absent,
    /// It reads once per millisecond.
    Reading,
    /// It says that it is there, and reads nothing.
    Silent,
}

/// The host's side of the channel.
pub struct Rtt {
    block: u64,
    host: Host,
    decoder: Decoder<'static>,
}

impl Rtt {
    /// A host for the firmware whose control block lies at `block`.
    pub fn new(block: u64, host: Host, image: &'static Image) -> Self {
        Self {
            block,
            host,
            decoder: Decoder::new(image),
        }
    }

    /// The firmware starts again, and its buffer with it.
    pub fn restart(&mut self) {
        self.decoder.restart();
    }

    /// Messages that could not be read.
    pub fn malformed(&self) -> u64 {
        self.decoder.malformed()
    }

    /// Takes what is there: the bytes, and the messages that they complete.
    pub fn take(&mut self, memory: &mut dyn Memory) -> anyhow::Result<(Vec<u8>, Vec<Decoded>)> {
        let mut word = |offset: u64| memory.read(self.block + offset, Width::W32);
        let started = ID.iter().enumerate().all(|(i, &letter)| {
            let word = word(i as u64 & !3).unwrap_or(0);
            word >> (8 * (i % 4)) & 0xff == u64::from(letter)
        });
        if !started || self.host == Host::Absent {
            return Ok((Vec::new(), Vec::new()));
        }
        let (buffer, size) = (word(BUFFER)?, word(SIZE)?);
        let (written, mut read) = (word(WRITTEN)?, word(READ)?);
        if self.host == Host::Silent {
            memory.write(self.block + FLAGS, Width::W32, BLOCK_IF_FULL)?;
            return Ok((Vec::new(), Vec::new()));
        }
        let mut bytes = Vec::new();
        while read != written {
            bytes.push(memory.read(buffer + read, Width::W8)? as u8);
            read = (read + 1) % size;
        }
        memory.write(self.block + READ, Width::W32, read)?;

        let messages = self.decoder.take(&bytes)?;
        Ok((bytes, messages))
    }
}

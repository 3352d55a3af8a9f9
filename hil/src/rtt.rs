//! The host at the debug port: takes what the firmware has put into its RTT buffer, and reads it.

use decode::{Channel, ChannelError, Decoded, Decoder, Image};
use rigless::emulator::{Error, Memory};
use rigless::soc::Width;

/// Where the firmware's write offset lies in the control block (SEGGER UM08001).
pub const WRITTEN: u64 = 36;
/// Where the channel's flags lie.
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

/// The emulated chip's memory.
struct Chip<'m>(&'m mut dyn Memory);

impl decode::Memory for Chip<'_> {
    type Error = Error;

    fn read(&mut self, address: u64, words: &mut [u32]) -> Result<(), Error> {
        for (word, address) in words.iter_mut().zip((address..).step_by(4)) {
            *word = self.0.read(address, Width::W32)? as u32;
        }
        Ok(())
    }

    fn write(&mut self, address: u64, word: u32) -> Result<(), Error> {
        self.0.write(address, Width::W32, word.into())
    }
}

/// The host's side of the channel.
pub struct Rtt {
    block: u64,
    channel: Channel,
    host: Host,
    decoder: Decoder<'static>,
}

impl Rtt {
    /// A host for the firmware whose control block lies at `block`.
    pub fn new(block: u64, host: Host, image: &'static Image) -> Self {
        Self {
            block,
            channel: Channel::new(block),
            host,
            decoder: Decoder::new(image),
        }
    }

    /// The firmware starts again, and its buffer with it.
    pub fn restart(&mut self) {
        self.channel = Channel::new(self.block);
        self.decoder.restart();
    }

    /// Messages that could not be read.
    pub fn malformed(&self) -> u64 {
        self.decoder.malformed()
    }

    /// Takes what is there: the bytes, and the messages that they complete.
    pub fn take(&mut self, memory: &mut dyn Memory) -> anyhow::Result<(Vec<u8>, Vec<Decoded>)> {
        let mut chip = Chip(memory);
        let bytes = match self.host {
            Host::Absent => Vec::new(),
            Host::Reading => match self.channel.take(&mut chip) {
                // The firmware has not set it up yet.
                Err(ChannelError::NoChannel) => Vec::new(),
                taken => taken?,
            },
            Host::Silent => {
                // Once the firmware has set it up.
                if chip.0.read(self.block, Width::W32)? as u32 == u32::from_le_bytes(*b"SEGG") {
                    chip.0
                        .write(self.block + FLAGS, Width::W32, BLOCK_IF_FULL)?;
                }
                Vec::new()
            }
        };
        let messages = self.decoder.take(&bytes)?;
        Ok((bytes, messages))
    }
}

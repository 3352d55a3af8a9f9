//! The host's side of the log's channel: it takes the bytes out of the ring in the chip's memory, while the firmware runs on
//! (SEGGER UM08001, real-time transfer).

/// The chip's memory, for whoever is attached to it.
pub trait Memory {
    /// Why it cannot be reached.
    type Error: std::error::Error + 'static;

    /// Reads words from an address on that is a multiple of 4.
    ///
    /// # Errors
    /// If there is none, or nobody is attached any more.
    fn read(&mut self, address: u64, words: &mut [u32]) -> Result<(), Self::Error>;

    /// Writes a word to an address that is a multiple of 4.
    ///
    /// # Errors
    /// If there is none, or nobody is attached any more.
    fn write(&mut self, address: u64, word: u32) -> Result<(), Self::Error>;
}

/// Why nothing was taken.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError<E> {
    /// The memory cannot be reached.
    #[error("the chip's memory cannot be reached: {0}")]
    Memory(#[from] E),
    /// The control block is not there, or not yet.
    #[error("there is no RTT channel where the ELF file says: another image runs, or none")]
    NoChannel,
    /// The ring is not as it was left.
    #[error("the chip has started again, and its channel with it")]
    Restarted,
}

/// The name at the beginning of the control block, as words.
const ID: [u32; 4] = [
    u32::from_le_bytes(*b"SEGG"),
    u32::from_le_bytes(*b"ER R"),
    u32::from_le_bytes(*b"TT\0\0"),
    0,
];
/// Words of a control block with one channel: name, numbers of channels, and the channel's pointers and flags.
const BLOCK: usize = 12;
/// Where the offset lies at which the host goes on reading.
const READ: u64 = 40;
/// A ring that is larger is none of the firmware's.
const LARGEST: u32 = 1 << 20;

/// The channel of one run of the firmware.
#[derive(Debug, Clone)]
pub struct Channel {
    block: u64,
    /// Where reading ended.
    left: Option<u32>,
}

impl Channel {
    /// A channel whose control block lies at this address, see [`Image::channel`](crate::Image::channel).
    pub fn new(block: u64) -> Self {
        Self { block, left: None }
    }

    /// Takes what is there. The channel's flags stay as they are: nobody waits for this host.
    ///
    /// # Errors
    /// If there is no channel, or it is another run's, or the memory cannot be reached.
    pub fn take<M: Memory>(&mut self, memory: &mut M) -> Result<Vec<u8>, ChannelError<M::Error>> {
        let mut block = [0; BLOCK];
        memory.read(self.block, &mut block)?;
        let [a, b, c, d, _, _, _, ring, size, written, read, _] = block;
        if [a, b, c, d] != ID || size > LARGEST || written >= size || read >= size {
            return Err(ChannelError::NoChannel);
        }
        if self.left.is_some_and(|left| left != read) {
            return Err(ChannelError::Restarted);
        }
        let ring = u64::from(ring);
        let mut part = |from: u32, to: u32| bytes(memory, ring + u64::from(from), to - from);
        let bytes = match read <= written {
            true => part(read, written)?,
            false => [part(read, size)?, part(0, written)?].concat(),
        };
        if !bytes.is_empty() {
            memory.write(self.block + READ, written)?;
        }
        self.left = Some(written);
        Ok(bytes)
    }
}

/// So many bytes from an address on, from the words in which they lie.
fn bytes<M: Memory>(memory: &mut M, address: u64, count: u32) -> Result<Vec<u8>, M::Error> {
    let count = count as usize;
    let before = (address % 4) as usize;
    let mut words = vec![0; (before + count).div_ceil(4)];
    memory.read(address - before as u64, &mut words)?;
    let bytes = words.into_iter().flat_map(u32::to_le_bytes);
    Ok(bytes.skip(before).take(count).collect())
}

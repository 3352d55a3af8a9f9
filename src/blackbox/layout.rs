//! Where what lies in the words.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use crate::units::FINGERS;

/// Words of the black box.
pub const WORDS: usize = HEAD + BLOCKS * BLOCK;
/// Words before the first block.
pub const HEAD: usize = 5;
/// Blocks, of which the oldest makes room for the newest.
pub const BLOCKS: usize = 24;
/// Words of a block.
pub const BLOCK: usize = 53;
/// Gauges, monitor, command.
pub const CHANNELS: usize = FINGERS + 2;
/// Its words before the first code: its first tick; how many, and the last channel; the others in pairs.
pub const BLOCK_HEAD: usize = 2 + (CHANNELS - 1).div_ceil(2);
/// A block that nothing was written to.
pub const UNUSED: u32 = u32::MAX;

/// Where the words lie.
pub type Memory = [AtomicU32; WORDS];

/// What is in the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Phase {
    /// Nothing has come yet: it runs.
    Runs = 0x5afe_b0c5,
    /// Something has come, and it stands.
    Stands = 0x5afe_b0c6,
}

impl Phase {
    /// What the first word says; none in memory that holds anything else.
    pub fn of(word: u32) -> Option<Self> {
        [Self::Runs, Self::Stands]
            .into_iter()
            .find(|&phase| phase as u32 == word)
    }
}

/// What is kept of one tick.
pub type Codes = [u16; CHANNELS];

/// A word; zero where there is none.
pub fn load(memory: &Memory, at: usize) -> u32 {
    memory.get(at).map_or(0, |word| word.load(Relaxed))
}

/// Changes a word, if there is one.
pub fn store(memory: &Memory, at: usize, value: u32) {
    if let Some(word) = memory.get(at) {
        word.store(value, Relaxed);
    }
}

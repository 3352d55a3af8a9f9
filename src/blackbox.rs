//! The black box: converter codes and command of the last two seconds before the first loss or fault, and of a tenth of a
//! second after it.
//!
//! It lies in memory that a restart leaves alone, and that others read, as words. Each tick is how far each code is off
//! what the ones before predict, as Rice codes whose parameter follows the signal (Weinberger, Seroussi and Sapiro,
//! *The LOCO-I lossless image compression algorithm*, 2000): 2.4 s of gauges with 20 µε of noise fit, 1.7 s with 100 and 1.35 s
//! with 300. Blocks are filled one after the other, and each can be read without the ones before.
//!
//! | words | what |
//! | --- | --- |
//! | 0 | [`Phase`] |
//! | 1 | what came: 1 the residuals collapsed, 2 one finger emptied, 3 nothing was there after a change of pressure; or 256 more than a fault's code |
//! | 2, 3 | when, µs, lower half first; zero where the program failed, as nobody knows |
//! | 4 | the tick in which it came, counted as the blocks do |
//! | 5 … | [`BLOCKS`] blocks of [`BLOCK`] words: number of the first tick; how many ticks (upper half) and the command; codes of gauges 1 and 2; of gauge 3 and monitor; then the bits, from each word's highest on |

mod keep;
mod read;

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

pub use keep::{forget, keep, restore};
pub use read::{Kept, ticks};

use crate::condition::RawFrame;
use crate::event::Event;
use crate::fault::Fault;
use crate::units::{DacCode, Instant};

/// Words of the black box.
pub const WORDS: usize = HEAD + BLOCKS * BLOCK;
/// Words before the first block.
pub const HEAD: usize = 5;
/// Blocks, of which the oldest makes room for the newest.
pub const BLOCKS: usize = 24;
/// Words of a block.
pub const BLOCK: usize = 53;
/// Its words before the first code.
const BLOCK_HEAD: usize = 4;
/// Gauges, monitor, command.
pub const CHANNELS: usize = 5;

/// What comes before the codes of faults: those of losses.
const BEFORE_FAULTS: u32 = 256;
/// Ticks after the one in which something came.
const AFTER: u16 = 100;
/// A block that nothing was written to.
const UNUSED: u32 = u32::MAX;
/// At most so many ones, and the bits of what is off by as much as 12-bit codes can be.
const MOST_ONES: u32 = 11;
const WHOLE: u32 = 13;
/// How far off codes are at the start of a block, and the share that one more has in that: a sixteenth.
const MEAN: u32 = 8 << MEAN_SHIFT;
const MEAN_SHIFT: u32 = 4;

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

/// 12 bits of what the converters had: less than a third of their noise is in the rest.
fn codes(frame: &RawFrame, command: DacCode) -> Codes {
    let [a, b, c] = frame.gauges.map(|code| code.0 >> 4);
    [a, b, c, frame.monitor.0 >> 4, command.0 & 0xfff]
}

/// What writes it.
#[derive(Debug, Clone)]
pub struct Recorder {
    memory: &'static Memory,
    tick: u32,
    /// The present block, how many ticks are in it, and what the first of them commanded.
    block: usize,
    count: u32,
    first_command: u16,
    writer: Writer,
    predictors: [Predictor; CHANNELS],
    /// Ticks to go; none before something has come.
    left: Option<u16>,
}

impl Recorder {
    /// Starts anew, or keeps what stands there. `failed`: the program has failed, and what ran until then stands from
    /// now on.
    pub fn new(memory: &'static Memory, failed: bool) -> Self {
        let phase = Phase::of(load(memory, 0));
        if failed && phase == Some(Phase::Runs) {
            let what = BEFORE_FAULTS + u32::from(Fault::Internal.code());
            for (word, value) in [Phase::Stands as u32, what, 0, 0, UNUSED]
                .into_iter()
                .enumerate()
            {
                store(memory, word, value);
            }
        }
        let stands = Phase::of(load(memory, 0)) == Some(Phase::Stands);
        let mut recorder = Self {
            memory,
            tick: 0,
            block: BLOCKS - 1,
            count: 0,
            first_command: 0,
            writer: Writer::FULL,
            predictors: Predictor::all(&[0; CHANNELS]),
            left: None,
        };
        match stands {
            true => recorder.left = Some(0),
            false => recorder.clear(),
        }
        recorder
    }

    /// Forgets what stands, and runs.
    pub fn clear(&mut self) {
        for block in 0..BLOCKS {
            store(self.memory, HEAD + block * BLOCK, UNUSED);
        }
        self.writer = Writer::FULL;
        self.left = None;
        store(self.memory, 0, Phase::Runs as u32);
    }

    /// Whether something has come and all of it is there.
    pub fn stands(&self) -> bool {
        self.left == Some(0)
    }

    /// Takes what is reported in the coming tick. The first loss or fault counts; a stop that somebody wanted is none.
    pub fn report(&mut self, now: Instant, event: &Event) {
        let what = match event {
            Event::Lost(loss) => (loss.cause as u32).wrapping_add(1),
            Event::Fault { fault, .. } if *fault != Fault::Stopped => {
                BEFORE_FAULTS.wrapping_add(fault.code().into())
            }
            _ => return,
        };
        if self.left.is_some() {
            return;
        }
        self.left = Some(AFTER);
        let us = now.micros();
        for (word, value) in [what, us as u32, (us >> 32) as u32, self.tick]
            .into_iter()
            .enumerate()
        {
            store(self.memory, 1 + word, value);
        }
    }

    /// Takes one tick. Says whether with it all is there.
    // Never inlined, so that its cost can be read off the image.
    #[inline(never)]
    pub fn step(&mut self, frame: &RawFrame, command: DacCode) -> bool {
        match &mut self.left {
            Some(0) => return false,
            Some(left) => *left = left.wrapping_sub(1),
            None => {}
        }
        let codes = codes(frame, command);
        if !self.add(&codes) {
            self.begin(&codes);
        }
        self.tick = self.tick.wrapping_add(1);
        if self.left == Some(0) {
            store(self.memory, 0, Phase::Stands as u32);
            return true;
        }
        false
    }

    /// Begins the next block with these codes.
    fn begin(&mut self, codes: &Codes) {
        let &[a, b, c, monitor, command] = codes;
        self.block = self.block.wrapping_add(1) % BLOCKS;
        self.writer = Writer::EMPTY;
        self.count = 1;
        self.predictors = Predictor::all(codes);
        self.first_command = command;
        let pair = |high: u16, low: u16| u32::from(high) << 16 | u32::from(low);
        let head = [self.tick, pair(1, command), pair(a, b), pair(c, monitor)];
        let at = HEAD.wrapping_add(self.block.wrapping_mul(BLOCK));
        for (word, value) in head.into_iter().enumerate() {
            store(self.memory, at.wrapping_add(word), value);
        }
    }

    /// Adds these codes to the present block, if there is room. If not, what was written lies in the next one, which is
    /// to be begun.
    fn add(&mut self, codes: &Codes) -> bool {
        let at = HEAD.wrapping_add(self.block.wrapping_mul(BLOCK));
        let mut writer = self.writer;
        for (code, predictor) in codes.iter().zip(&mut self.predictors) {
            let (bits, length) = predictor.encode(*code);
            writer.put(self.memory, at, bits, length);
        }
        if writer.word >= BLOCK {
            return false;
        }
        store(self.memory, at.wrapping_add(writer.word), writer.bits);
        self.writer = writer;
        self.count = self.count.wrapping_add(1);
        let head = self.count << 16 | u32::from(self.first_command);
        store(self.memory, at.wrapping_add(1), head);
        true
    }
}

/// Where the next bits go in a block.
#[derive(Debug, Clone, Copy)]
struct Writer {
    /// The present word, and what is in it.
    word: usize,
    bits: u32,
    /// Bits that it lacks, at least one.
    lacks: u32,
}

impl Writer {
    /// At the end of a block.
    const FULL: Self = Self {
        word: BLOCK,
        bits: 0,
        lacks: u32::BITS,
    };
    /// At the start of one.
    const EMPTY: Self = Self {
        word: BLOCK_HEAD,
        ..Self::FULL
    };

    /// Appends at most 32 bits.
    fn put(&mut self, memory: &Memory, at: usize, value: u32, length: u32) {
        if length < self.lacks {
            self.lacks = self.lacks.wrapping_sub(length);
            self.bits |= value.wrapping_shl(self.lacks);
            return;
        }
        let rest = length.wrapping_sub(self.lacks);
        store(
            memory,
            at.wrapping_add(self.word),
            self.bits | value.wrapping_shr(rest),
        );
        self.word = self.word.wrapping_add(1);
        self.lacks = u32::BITS.wrapping_sub(rest);
        self.bits = match rest {
            0 => 0,
            _ => value.wrapping_shl(self.lacks),
        };
    }
}

/// What a channel's next code is taken to be, and how far off that is on the average.
#[derive(Debug, Clone, Copy)]
struct Predictor {
    /// Eight times the code.
    code: i32,
    /// So little of what was off is added each time: a quarter for gauges, whose noise takes fewer bits then; all of it for
    /// what goes up and down on ramps.
    shift: u32,
    /// Sixteen times the folded difference.
    mean: u32,
}

impl Predictor {
    fn all(&[a, b, c, monitor, command]: &Codes) -> [Self; CHANNELS] {
        let starting_at = |code: u16, shift| Self {
            code: i32::from(code) << 3,
            shift,
            mean: MEAN,
        };
        let [a, b, c] = [a, b, c].map(|code| starting_at(code, 2));
        [a, b, c, starting_at(monitor, 0), starting_at(command, 0)]
    }

    /// A code's bits and their number: as many ones as the upper part of how far it is off, a zero, and the lower part;
    /// or all ones and the whole. Signs are folded: 0, −1, 1, −2 … are 0, 1, 2, 3 …
    fn encode(&mut self, code: u16) -> (u32, u32) {
        let off = i32::from(code).wrapping_sub(self.code >> 3);
        let folded = ((off << 1) ^ (off >> 31)).cast_unsigned();
        let k = self.parameter();
        self.learn(code, folded);
        let ones = folded.wrapping_shr(k);
        if ones >= MOST_ONES {
            let all = (1 << MOST_ONES) - 1;
            return (all << WHOLE | folded, MOST_ONES + WHOLE);
        }
        let unary = 1u32.wrapping_shl(ones).wrapping_sub(1) << 1;
        let lower = folded & 1u32.wrapping_shl(k).wrapping_sub(1);
        let length = ones.wrapping_add(1).wrapping_add(k);
        (unary.wrapping_shl(k) | lower, length)
    }

    /// The code that is off by so much.
    fn decode(&mut self, folded: u32) -> u16 {
        let off = (folded >> 1).cast_signed() ^ (folded & 1).cast_signed().wrapping_neg();
        let code = (self.code >> 3).wrapping_add(off) as u16;
        self.learn(code, folded);
        code
    }

    /// Bits of the lower part: as many as take two thirds of the mean.
    fn parameter(&self) -> u32 {
        let typical = self.mean.wrapping_mul(5) >> (MEAN_SHIFT + 3);
        u32::BITS.wrapping_sub(typical.leading_zeros())
    }

    fn learn(&mut self, code: u16, folded: u32) {
        let off = (i32::from(code) << 3).wrapping_sub(self.code);
        self.code = self.code.wrapping_add(off.wrapping_shr(self.shift));
        let forgotten = self.mean.wrapping_sub(self.mean >> MEAN_SHIFT);
        self.mean = forgotten.wrapping_add(folded);
    }
}

fn load(memory: &Memory, at: usize) -> u32 {
    memory.get(at).map_or(0, |word| word.load(Relaxed))
}

fn store(memory: &Memory, at: usize, value: u32) {
    if let Some(word) = memory.get(at) {
        word.store(value, Relaxed);
    }
}

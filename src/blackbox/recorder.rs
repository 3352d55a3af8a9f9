//! What writes it, tick by tick.

use super::layout::{
    BLOCK, BLOCK_HEAD, BLOCKS, CHANNELS, Codes, HEAD, Memory, Phase, UNUSED, load, store,
};
use super::rice::Predictor;
use crate::condition::RawFrame;
use crate::event::Event;
use crate::fault::Fault;
use crate::units::{DacCode, Instant};

/// What comes before the codes of faults: those of losses.
const BEFORE_FAULTS: u32 = 256;
/// Ticks after the one in which something came.
const AFTER: u16 = 100;

/// 12 bits of what the converters had: less than a third of their noise is in the rest.
fn codes(frame: &RawFrame, command: DacCode) -> Codes {
    let mut codes = [0; CHANNELS];
    let measured = frame.gauges.iter().chain([&frame.monitor]);
    let kept = measured.map(|code| code.0 >> 4).chain([command.0 & 0xfff]);
    for (place, code) in codes.iter_mut().zip(kept) {
        *place = code;
    }
    codes
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
        let [measured @ .., command] = codes;
        self.block = self.block.wrapping_add(1) % BLOCKS;
        self.writer = Writer::EMPTY;
        self.count = 1;
        self.predictors = Predictor::all(codes);
        self.first_command = *command;
        let pair = |high: u16, low: u16| u32::from(high) << 16 | u32::from(low);
        let at = HEAD.wrapping_add(self.block.wrapping_mul(BLOCK));
        store(self.memory, at, self.tick);
        store(self.memory, at.wrapping_add(1), pair(1, *command));
        for (word, codes) in (2..BLOCK_HEAD).zip(measured.chunks(2)) {
            let low = codes.get(1).copied().unwrap_or(0);
            let high = codes.first().copied().unwrap_or(0);
            store(self.memory, at.wrapping_add(word), pair(high, low));
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

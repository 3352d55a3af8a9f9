//! What stands in a black box, tick by tick.

use super::layout::{BLOCK, BLOCK_HEAD, BLOCKS, CHANNELS, Codes, HEAD, UNUSED};
use super::rice::{MOST_ONES, Predictor, WHOLE};

/// One tick of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    /// Its number, as the trigger's is counted.
    pub tick: u32,
    /// 12-bit codes of gauges and monitor, and the command.
    pub codes: Codes,
}

/// The ticks in a black box of [`WORDS`](super::WORDS) words, oldest first. Whatever the words are, it ends.
pub fn ticks(words: &[u32]) -> impl Iterator<Item = Kept> + '_ {
    let first = |block: usize| words.get(HEAD + block * BLOCK).copied().unwrap_or(UNUSED);
    let oldest = (0..BLOCKS).min_by_key(|&block| first(block)).unwrap_or(0);
    (0..BLOCKS)
        .map(move |i| (oldest + i) % BLOCKS)
        .filter(move |&block| first(block) != UNUSED)
        .filter_map(|block| Block::of(words.get(HEAD + block * BLOCK..HEAD + (block + 1) * BLOCK)?))
        .flatten()
}

/// A block that is being read.
struct Block<'a> {
    next: Kept,
    left: u32,
    bits: Bits<'a>,
    predictors: [Predictor; CHANNELS],
}

impl<'a> Block<'a> {
    fn of(words: &'a [u32]) -> Option<Self> {
        let (&[tick, count, ref pairs @ ..], rest) = words.split_first_chunk::<BLOCK_HEAD>()?;
        let measured = pairs
            .iter()
            .flat_map(|pair| [(pair >> 16) as u16, *pair as u16]);
        let mut codes = [0; CHANNELS];
        let [places @ .., command] = &mut codes;
        for (place, code) in places.iter_mut().zip(measured) {
            *place = code;
        }
        *command = count as u16;
        Some(Self {
            next: Kept { tick, codes },
            predictors: Predictor::all(&codes),
            left: count >> 16,
            bits: Bits { words: rest, at: 0 },
        })
    }

    fn read_next(&mut self) -> Option<Kept> {
        let mut codes = [0; CHANNELS];
        for (code, predictor) in codes.iter_mut().zip(&mut self.predictors) {
            *code = predictor.decode(self.bits.folded(predictor.parameter())?);
        }
        Some(Kept {
            tick: self.next.tick.wrapping_add(1),
            codes,
        })
    }
}

impl Iterator for Block<'_> {
    type Item = Kept;

    fn next(&mut self) -> Option<Kept> {
        self.left = self.left.checked_sub(1)?;
        let kept = self.next;
        if self.left > 0 {
            match self.read_next() {
                Some(next) => self.next = next,
                None => self.left = 0,
            }
        }
        Some(kept)
    }
}

/// Words as bits, from each one's highest on.
struct Bits<'a> {
    words: &'a [u32],
    at: usize,
}

impl Bits<'_> {
    fn bit(&mut self) -> Option<u32> {
        let word = self.words.get(self.at / 32)?;
        let bit = word >> (31 - self.at % 32) & 1;
        self.at += 1;
        Some(bit)
    }

    fn number(&mut self, length: u32) -> Option<u32> {
        let mut number = 0;
        for _ in 0..length {
            number = number << 1 | self.bit()?;
        }
        Some(number)
    }

    /// How far a code is off, as the encoder writes it with this parameter.
    fn folded(&mut self, k: u32) -> Option<u32> {
        let mut ones = 0;
        while ones < MOST_ONES && self.bit()? == 1 {
            ones += 1;
        }
        match ones {
            MOST_ONES => self.number(WHOLE),
            _ => Some(ones.wrapping_shl(k) | self.number(k)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blackbox::layout::{Memory, Phase, WORDS};
    use crate::blackbox::recorder::Recorder;
    use crate::condition::RawFrame;
    use crate::event::Event;
    use crate::fault::Fault;
    use crate::units::{AdcCode, DacCode, Instant};
    use std::boxed::Box;
    use std::vec::Vec;

    fn memory() -> &'static Memory {
        Box::leak(Box::new(
            [const { core::sync::atomic::AtomicU32::new(0x1234_5678) }; WORDS],
        ))
    }

    fn words(memory: &Memory) -> Vec<u32> {
        let words = memory.iter();
        words
            .map(|word| word.load(core::sync::atomic::Ordering::Relaxed))
            .collect()
    }

    fn fault(fault: Fault) -> Event {
        Event::Fault {
            fault,
            finger: None,
        }
    }

    fn frame([a, b, c, monitor, _]: Codes) -> RawFrame {
        RawFrame {
            gauges: [a, b, c].map(|code| AdcCode(code << 4)),
            monitor: AdcCode(monitor << 4),
            ..RawFrame::default()
        }
    }

    /// Codes around the middle with this noise, in codes, and jumps from rail to rail now and then.
    fn noisy(random: &mut fastrand::Rng, codes: f64, jumps: bool) -> Codes {
        core::array::from_fn(|channel| {
            if jumps && random.u32(..100) == 0 {
                return 4095 * random.u16(..2);
            }
            let normal: f64 = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
            match channel {
                0..3 => (2048.0 + codes * normal).clamp(0.0, 4095.0) as u16,
                3 => (1700.0 + normal) as u16,
                _ if jumps => 1720 + random.u16(..2),
                _ => 1720,
            }
        })
    }

    /// What was put in, and what stands there, after something has come in tick `at`.
    fn recorded(at: u32, codes: f64, jumps: bool) -> (Vec<Kept>, Vec<Kept>, Vec<u32>) {
        let memory = memory();
        let mut recorder = Recorder::new(memory, false);
        let mut random = fastrand::Rng::with_seed(7);
        let mut put = Vec::new();
        for tick in 0.. {
            let codes = noisy(&mut random, codes, jumps);
            if tick == at {
                recorder.report(Instant::from_micros(1), &Event::Empty);
                recorder.report(Instant::from_micros(1), &fault(Fault::Stopped));
                recorder.report(Instant::from_micros(0x1_0000_0002), &fault(Fault::AirLoss));
                recorder.report(Instant::from_micros(5), &fault(Fault::SupplyLow));
            }
            put.push(Kept { tick, codes });
            if recorder.step(&frame(codes), DacCode(codes[4])) {
                break;
            }
        }
        assert!(recorder.stands());
        // Nothing more is taken.
        let before = words(memory);
        assert!(!recorder.step(&frame([0; CHANNELS]), DacCode(0)));
        assert_eq!(words(memory), before);
        (put, ticks(&before).collect(), before)
    }

    #[test]
    fn what_was_measured_up_to_a_tenth_of_a_second_after_it_comes_back_as_it_was() {
        for (codes, jumps) in [
            (0.0, false),
            (2.0, false),
            (28.0, false),
            (2.0, true),
            (500.0, true),
        ] {
            for at in [0, 1, 77, 10_000] {
                let (put, kept, words) = recorded(at, codes, jumps);
                let (last, first) = (
                    put.last().copied(),
                    kept.first().map_or(0, |kept| kept.tick),
                );
                assert_eq!(last.map(|kept| kept.tick), Some(at + 99));
                assert_eq!(kept, put[first as usize..]);
                assert_eq!(words[..5], [Phase::Stands as u32, 256 + 3, 2, 1, at]);
            }
        }
    }

    #[test]
    fn as_much_fits_as_is_said() {
        let fits = |codes: f64| recorded(20_000, codes, false).1.len();
        // A code is 10.7 µε.
        for (noise_ue, least) in [(20.0, 2_400), (100.0, 1_700), (300.0, 1_350)] {
            let kept = fits(noise_ue / 10.7);
            assert!(kept >= least, "{noise_ue} µε: {kept} ticks");
        }
    }

    #[test]
    fn what_stands_is_kept_over_a_restart_and_what_ran_is_not() {
        let memory = memory();
        let mut recorder = Recorder::new(memory, false);
        assert!(!recorder.stands());
        recorder.report(Instant::from_micros(1), &fault(Fault::SupplyLow));
        while !recorder.step(&frame([1; CHANNELS]), DacCode(1)) {}
        let before = words(memory);
        assert!(Recorder::new(memory, false).stands());
        assert_eq!(words(memory), before);
        let mut recorder = Recorder::new(memory, true);
        assert_eq!(words(memory), before);
        recorder.clear();
        assert!(!recorder.stands());
        assert_eq!(ticks(&words(memory)).count(), 0);
    }

    #[test]
    fn what_ran_until_the_program_failed_stands_after_the_restart() {
        let memory = memory();
        let mut recorder = Recorder::new(memory, false);
        for code in 0..100 {
            recorder.step(&frame([code; CHANNELS]), DacCode(code));
        }
        let recorder = Recorder::new(memory, true);
        assert!(recorder.stands());
        let words = words(memory);
        assert_eq!(words[1], 256 + 65);
        let kept: Vec<Codes> = ticks(&words).map(|kept| kept.codes).collect();
        assert_eq!(kept, Vec::from_iter((0..100).map(|code| [code; CHANNELS])));
    }

    #[test]
    fn words_that_hold_anything_else_end_too() {
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..1_000 {
            let words: Vec<u32> = (0..random.usize(..2 * WORDS))
                .map(|_| random.u32(..))
                .collect();
            assert!(ticks(&words).count() <= BLOCKS * BLOCK * 32);
        }
    }
}

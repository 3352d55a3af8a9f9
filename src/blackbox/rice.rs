//! What a channel's next code is taken to be, and the bits that tell how far off that was.

use super::layout::{CHANNELS, Codes};
use crate::units::FINGERS;

/// At most so many ones, and the bits of what is off by as much as 12-bit codes can be.
pub const MOST_ONES: u32 = 11;
pub const WHOLE: u32 = 13;
/// How far off codes are at the start of a block, and the share that one more has in that: a sixteenth.
const MEAN: u32 = 8 << MEAN_SHIFT;
const MEAN_SHIFT: u32 = 4;

/// What a channel's next code is taken to be, and how far off that is on the average.
#[derive(Debug, Clone, Copy)]
pub struct Predictor {
    /// Eight times the code.
    code: i32,
    /// So little of what was off is added each time: a quarter for gauges, whose noise takes fewer bits then; all of it for
    /// what goes up and down on ramps.
    shift: u32,
    /// Sixteen times the folded difference.
    mean: u32,
}

impl Predictor {
    /// One for each channel, starting at its code.
    pub fn all(codes: &Codes) -> [Self; CHANNELS] {
        let mut predictors = [Self {
            code: 0,
            shift: 0,
            mean: MEAN,
        }; CHANNELS];
        for (predictor, code) in predictors.iter_mut().zip(codes) {
            predictor.code = i32::from(*code) << 3;
        }
        for gauge in predictors.iter_mut().take(FINGERS) {
            gauge.shift = 2;
        }
        predictors
    }

    /// A code's bits and their number: as many ones as the upper part of how far it is off, a zero, and the lower part;
    /// or all ones and the whole. Signs are folded: 0, −1, 1, −2 … are 0, 1, 2, 3 …
    pub fn encode(&mut self, code: u16) -> (u32, u32) {
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
    pub fn decode(&mut self, folded: u32) -> u16 {
        let off = (folded >> 1).cast_signed() ^ (folded & 1).cast_signed().wrapping_neg();
        let code = (self.code >> 3).wrapping_add(off) as u16;
        self.learn(code, folded);
        code
    }

    /// Bits of the lower part: as many as take two thirds of the mean.
    pub fn parameter(&self) -> u32 {
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

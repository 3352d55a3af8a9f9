//! Values as bytes, for storage: what differs from the factory's, by number.
//!
//! Six bytes each, little-endian: the number (`u16`) and the value (`f32`). A number never means something else, so
//! an older or newer release reads what it knows, and a setting that was left alone follows the factory's.

use crate::fields::COUNT;
use crate::values::{LIMITS, Values};

/// Bytes of one setting.
const BYTES: usize = 6;

/// Bytes of all settings: what [`Values::encode`] writes at most.
pub const ENCODED_BYTES: usize = BYTES * COUNT;

/// What was stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decoded {
    /// Valid values, whatever the bytes.
    pub values: Values,
    /// Settings that this release does not know, and were left out.
    pub unknown: u16,
    /// For each setting, whether its value was wrong, so that it is the factory's.
    wrong: [bool; COUNT],
}

impl Decoded {
    /// Numbers of the settings that had a wrong value.
    pub fn wrong(&self) -> impl Iterator<Item = u16> {
        let all = LIMITS.iter().zip(&self.wrong);
        all.filter_map(|(limit, wrong)| wrong.then_some(limit.number))
    }

    /// Takes the factory's value for a setting; says whether there is one.
    #[inline(never)]
    fn give_up(&mut self, number: u16, factory: &Values) -> bool {
        let Some(value) = factory.get(number) else {
            return false;
        };
        // The factory's values are in their ranges.
        let _ = self.values.set(number, value);
        for (limit, wrong) in LIMITS.iter().zip(&mut self.wrong) {
            *wrong |= limit.number == number;
        }
        true
    }
}

impl Values {
    /// Writes what differs from the factory's values; gives the number of bytes, at most [`ENCODED_BYTES`]; none if
    /// they do not fit.
    pub fn encode(&self, factory: &Self, bytes: &mut [u8]) -> Option<usize> {
        let mut length = 0;
        let pairs = self.all().iter().zip(factory.all());
        for (limit, (value, factory)) in LIMITS.iter().zip(pairs) {
            if value.to_bits() == factory.to_bits() {
                continue;
            }
            let slot = bytes.get_mut(length..)?.first_chunk_mut::<BYTES>()?;
            let [a, b] = limit.number.to_le_bytes();
            let [c, d, e, f] = value.to_le_bytes();
            *slot = [a, b, c, d, e, f];
            length += BYTES;
        }
        Some(length)
    }

    /// Reads what [`Values::encode`] has written, for a finger whose table ends at `table_kpa`. A setting that is not
    /// there, or has a value that it cannot have, is the factory's, which must be valid; an unknown one is left out.
    pub fn decode(factory: &Self, bytes: &[u8], table_kpa: f32) -> Decoded {
        let mut decoded = Decoded {
            values: *factory,
            unknown: 0,
            wrong: [false; COUNT],
        };
        let (slots, rest) = bytes.as_chunks::<BYTES>();
        for &[a, b, c, d, e, f] in slots {
            let number = u16::from_le_bytes([a, b]);
            let value = f32::from_le_bytes([c, d, e, f]);
            let is_right = decoded.values.set(number, value).is_ok();
            if !is_right && !decoded.give_up(number, factory) {
                decoded.unknown = decoded.unknown.saturating_add(1);
            }
        }
        if !rest.is_empty() {
            decoded.unknown = decoded.unknown.saturating_add(1);
        }
        // What each may be, but not together, or not with this finger.
        for problem in decoded.values.problems(table_kpa) {
            decoded.give_up(problem.number, factory);
        }
        decoded.values.fit(table_kpa);
        decoded
    }
}

#[cfg(test)]
mod tests;

//! Settings as bytes, for storage: what differs from the factory's, by number.
//!
//! Six bytes each, little-endian: the number (`u16`) and the value (`f32`). A number never means something else, so
//! an older or newer release reads what it knows, and a setting that was left alone follows the factory's.

use softgrip_settings::{LIMITS, all_limits};

use super::tree::Settings;
use crate::frontend::FrontEnd;
use crate::table::FingerTable;

/// Bytes of one setting.
const BYTES: usize = 6;

/// Bytes of all settings: what [`Settings::encode`] writes at most.
pub const ENCODED_BYTES: usize = BYTES * LIMITS.len();

/// What was stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decoded {
    /// Valid settings, whatever the bytes.
    pub settings: Settings,
    /// Settings that this release does not know, and were left out.
    pub unknown: u16,
    /// For each of [`LIMITS`], whether its value was wrong, so that it is the factory's.
    wrong: [bool; LIMITS.len()],
}

impl Decoded {
    /// Numbers of the settings that had a wrong value.
    pub fn wrong(&self) -> impl Iterator<Item = u16> {
        let limits = all_limits().iter().zip(self.wrong);
        limits.filter_map(|(limit, wrong)| wrong.then_some(limit.number))
    }

    fn mark(&mut self, number: u16) {
        let place = all_limits().iter().position(|limit| limit.number == number);
        if let Some(wrong) = place.and_then(|place| self.wrong.get_mut(place)) {
            *wrong = true;
        }
    }
}

impl Settings {
    /// Writes what differs from the factory's settings; gives the number of bytes, at most [`ENCODED_BYTES`]; none if
    /// they do not fit.
    pub fn encode(&self, factory: &Self, bytes: &mut [u8]) -> Option<usize> {
        let mut length = 0;
        for limit in all_limits() {
            let value = self.get(limit.number)?.to_bits();
            if value == factory.get(limit.number)?.to_bits() {
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

    /// Reads what [`Settings::encode`] has written. A setting that is not there, or has a value that it cannot have, is
    /// the factory's, which must be valid; an unknown one is left out.
    pub fn decode(
        factory: &Self,
        bytes: &[u8],
        front_end: &FrontEnd,
        table: &FingerTable,
    ) -> Decoded {
        let mut decoded = Decoded {
            settings: *factory,
            unknown: 0,
            wrong: [false; LIMITS.len()],
        };
        let (slots, rest) = bytes.as_chunks::<BYTES>();
        for &[a, b, c, d, e, f] in slots {
            let number = u16::from_le_bytes([a, b]);
            let value = f32::from_le_bytes([c, d, e, f]);
            if decoded.settings.set(number, value).is_ok() {
                continue;
            }
            match decoded.settings.get(number) {
                Some(_) => decoded.mark(number),
                None => decoded.unknown = decoded.unknown.saturating_add(1),
            }
        }
        if !rest.is_empty() {
            decoded.unknown = decoded.unknown.saturating_add(1);
        }
        // What each may be, but not together, or not with this finger.
        let stored = decoded.settings;
        for problem in stored.problems(front_end, table) {
            decoded.mark(problem.number);
            if let Some(value) = factory.get(problem.number) {
                // The factory's settings are valid.
                let _ = decoded.settings.set(problem.number, value);
            }
        }
        decoded.settings.fit(front_end, table);
        decoded
    }
}

#[cfg(test)]
mod tests;

//! Replies → bytes.

use super::crc::crc;
use super::request::Exception;

/// The longest frame (Serial Line, 2.5.1).
pub const LONGEST: usize = 256;

/// A reply, ready to be sent when it is [`finished`](Reply::finish).
#[derive(Debug, Clone, Copy)]
pub struct Reply {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Reply {
    /// An empty one.
    pub const fn new() -> Self {
        Self {
            bytes: [0; LONGEST],
            length: 0,
        }
    }

    /// Nothing is to be sent.
    pub fn clear(&mut self) {
        self.length = 0;
    }

    /// Begins anew, as the slave with this id.
    pub fn begin(&mut self, id: u8, code: u8) {
        self.clear();
        self.byte(id);
        self.byte(code);
    }

    /// The whole reply to a request that is not carried out.
    pub fn except(&mut self, id: u8, code: u8, exception: Exception) {
        self.begin(id, code | 0x80);
        self.byte(exception as u8);
        self.finish();
    }

    /// Appends a byte. What there is no room for, which no request leads to, is left out.
    pub fn byte(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length = self.length.saturating_add(1);
        }
    }

    /// Appends a register's value, or an address or a count.
    pub fn word(&mut self, word: u16) {
        let [upper, lower] = word.to_be_bytes();
        self.byte(upper);
        self.byte(lower);
    }

    /// Appends the checksum.
    pub fn finish(&mut self) {
        let sum = crc(self.bytes());
        self.word(sum.swap_bytes());
    }

    /// The bytes so far.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

impl Default for Reply {
    fn default() -> Self {
        Self::new()
    }
}

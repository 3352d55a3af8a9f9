//! The robot's end of the line: what it sends when it likes, and what it hears, with times.

use std::collections::VecDeque;

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;

/// One character at 115 200 Bd, ns.
pub const CHARACTER: u64 = 10 * 1_000_000_000 / 115_200;

/// A master on the line.
#[derive(Debug, Default)]
pub struct Master {
    /// Bytes that are to go out, one after the other.
    pub sends: VecDeque<u8>,
    /// When the last of them began.
    pub sent: Option<VirtualNanos>,
    /// Bytes that have come, each with the end of its stop bit.
    pub heard: Vec<(VirtualNanos, u8)>,
}

/// Its runs start from reset.
impl Store for Master {}

impl Peer for Master {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        self.heard.push((context.now(), word as u8));
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let byte = self.sends.pop_front()?;
        self.sent = Some(now);
        Some(byte.into())
    }
}

impl Master {
    /// What has come since somebody last asked: bytes, and how long after the end of what was sent the first of them
    /// began, µs.
    pub fn reply(&mut self) -> (Vec<u8>, f64) {
        let heard = std::mem::take(&mut self.heard);
        let after = heard
            .first()
            .zip(self.sent)
            .map_or(f64::NAN, |((at, _), sent)| {
                1e-3 * (at.0 as f64 - sent.0 as f64 - 2.0 * CHARACTER as f64)
            });
        (heard.into_iter().map(|(_, byte)| byte).collect(), after)
    }
}

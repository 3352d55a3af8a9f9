//! Messages arrive whole, or not at all.

use proptest::prelude::*;
use softgrip::telemetry::frame::{Frame, SIZE};

/// Reads a message without its last zero, from behind, as rzCOBS has it.
fn decoded(message: &[u8]) -> Vec<u8> {
    let mut bytes = message.iter().rev().copied();
    let mut out = Vec::new();
    while let Some(description) = bytes.next() {
        let mut next = || bytes.next().expect("as many bytes as it says");
        match description {
            0 => panic!("a zero within a message"),
            1..=0x7f => out.extend((0..7).map(|i| match description >> (6 - i) & 1 {
                0 => next(),
                _ => 0,
            })),
            0x80..=0xfe => {
                out.push(0);
                out.extend((0..(description & 0x7f) + 7).map(|_| next()));
            }
            0xff => out.extend((0..134).map(|_| next())),
        }
    }
    out.reverse();
    out
}

/// A ring, and the host that empties it.
struct Channel {
    ring: [u8; SIZE],
    written: usize,
    read: usize,
}

impl Channel {
    /// Sends a message in parts of this length; whether it has fitted.
    fn send(&mut self, message: &[u8], part: usize) -> bool {
        let mut frame = Frame::begin(self.written, self.read);
        for part in message.chunks(part) {
            frame.write(&mut self.ring, part);
        }
        let end = frame.end(&mut self.ring);
        self.written = end.unwrap_or(self.written);
        end.is_some()
    }

    fn take(&mut self) -> Vec<u8> {
        let mut taken = Vec::new();
        while self.read != self.written {
            taken.push(self.ring[self.read]);
            self.read = (self.read + 1) % SIZE;
        }
        taken
    }
}

/// Zeros now and then, or none for long.
fn message() -> impl Strategy<Value = Vec<u8>> {
    let byte = |zeros: u32| prop_oneof![zeros => Just(0u8), 10 => any::<u8>(), 10 => 1u8..];
    prop_oneof![
        prop::collection::vec(byte(10), 0..40),
        prop::collection::vec(1u8.., 0..300),
        prop::collection::vec(byte(1), 0..300),
    ]
}

proptest! {
    #[test]
    fn a_message_arrives_as_it_was_sent_or_is_missing(
        messages in prop::collection::vec((message(), 1usize..60, prop::bool::weighted(0.1)), 1..80),
        start in 0..SIZE,
    ) {
        let mut channel = Channel { ring: [0; SIZE], written: start, read: start };
        let mut sent = Vec::new();
        let mut arrived = Vec::new();
        for (message, part, reads) in messages {
            if channel.send(&message, part) {
                sent.push(message);
            } else {
                // What has not been read, and what stays free.
                let unread = (channel.written + SIZE - channel.read) % SIZE;
                prop_assert!(unread + message.len() + message.len() / 4 + 5 >= SIZE);
            }
            if reads {
                arrived.extend(channel.take());
            }
        }
        arrived.extend(channel.take());
        let mut arrived: Vec<Vec<u8>> = arrived.split(|&byte| byte == 0).map(decoded).collect();
        prop_assert_eq!(arrived.pop(), Some(Vec::new()), "what follows the last zero");
        for (arrived, sent) in arrived.iter_mut().zip(&sent) {
            // The last group is filled up with zeros, and a last run ends in one.
            prop_assert!(arrived.len() >= sent.len() && arrived.len() < sent.len() + 7);
            prop_assert!(arrived.split_off(sent.len()).iter().all(|&byte| byte == 0));
        }
        prop_assert_eq!(arrived, sent);
    }

    #[test]
    fn a_host_that_writes_nonsense_loses_messages_and_nothing_else(
        written in 0..2 * SIZE,
        read in prop_oneof![0..SIZE, any::<usize>()],
        message in message(),
    ) {
        let mut ring = [0xaa; SIZE];
        let mut frame = Frame::begin(written, read);
        frame.write(&mut ring, &message);
        let end = frame.end(&mut ring);
        if written >= SIZE || read >= SIZE {
            prop_assert_eq!(end, None);
            prop_assert!(ring.iter().all(|&byte| byte == 0xaa));
        } else {
            prop_assert!(end.is_none_or(|end| end < SIZE && end != written));
        }
    }
}

/// Where a host stands still, the ring fills up and stays as it is.
#[test]
fn what_has_not_been_read_is_never_written_over() {
    let mut channel = Channel {
        ring: [0; SIZE],
        written: 2000,
        read: 2000,
    };
    let sent = (0..500)
        .filter(|_| channel.send(&[1, 2, 3, 0, 5], 5))
        .count();
    // Six bytes each, of 2047, where a message of five may take ten.
    assert_eq!(sent, 340);
    assert_eq!(channel.take(), [1, 2, 3, 5, 0x68, 0].repeat(340));
    assert!(channel.send(&[1], 1));
}

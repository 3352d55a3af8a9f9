//! The host's side of the channel, on a chip that is an array.

use std::convert::Infallible;

use decode::{Channel, ChannelError, Memory};

/// Where the memory begins, and its ring, which no word begins with.
const RAM: u64 = 0x2000_0000;
const RING: u64 = RAM + 49;
const SIZE: u32 = 16;

struct Chip(Vec<u8>);

impl Memory for Chip {
    type Error = Infallible;

    fn read(&mut self, address: u64, words: &mut [u32]) -> Result<(), Infallible> {
        assert_eq!(address % 4, 0);
        let bytes = &self.0[(address - RAM) as usize..];
        for (word, bytes) in words.iter_mut().zip(bytes.chunks(4)) {
            *word = u32::from_le_bytes(bytes.try_into().expect("a word"));
        }
        Ok(())
    }

    fn write(&mut self, address: u64, word: u32) -> Result<(), Infallible> {
        self.set(address, &word.to_le_bytes());
        Ok(())
    }
}

impl Chip {
    fn started() -> Self {
        let mut chip = Self(vec![0; 128]);
        chip.set(RAM, b"SEGGER RTT");
        for (word, value) in [(4, 1), (7, RING as u32), (8, SIZE)] {
            chip.set(RAM + 4 * word, &value.to_le_bytes());
        }
        chip
    }

    fn set(&mut self, address: u64, bytes: &[u8]) {
        let at = (address - RAM) as usize;
        self.0[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// Sends bytes as the firmware does.
    fn send(&mut self, bytes: &[u8]) {
        let mut written = [0];
        let Ok(()) = self.read(RAM + 36, &mut written);
        for &byte in bytes {
            self.set(RING + u64::from(written[0]), &[byte]);
            written[0] = (written[0] + 1) % SIZE;
        }
        self.set(RAM + 36, &written[0].to_le_bytes());
    }
}

#[test]
fn what_is_sent_is_taken_once_also_beyond_the_end_of_the_ring() {
    let mut chip = Chip::started();
    let mut channel = Channel::new(RAM);
    assert_eq!(channel.take(&mut chip).expect("a channel"), b"");
    for sent in [
        &b"twelve bytes"[..],
        b"over the end",
        b"",
        b"fifteen, at end",
    ] {
        chip.send(sent);
        assert_eq!(channel.take(&mut chip).expect("a channel"), sent);
        assert_eq!(channel.take(&mut chip).expect("a channel"), b"");
    }
    let mut flags = [7];
    let Ok(()) = chip.read(RAM + 44, &mut flags);
    assert_eq!(flags, [0], "the firmware is not asked to wait");
}

#[test]
fn a_chip_that_has_started_again_and_one_without_a_channel_are_told() {
    let mut chip = Chip::started();
    let mut channel = Channel::new(RAM);
    chip.send(b"first run");
    channel.take(&mut chip).expect("a channel");
    let mut chip = Chip::started();
    chip.send(b"second run");
    let error = channel.take(&mut chip).expect_err("another run");
    assert!(matches!(error, ChannelError::Restarted), "{error}");

    let mut nothing = Chip(vec![0xff; 128]);
    let error = Channel::new(RAM).take(&mut nothing).expect_err("nothing");
    assert!(matches!(error, ChannelError::NoChannel), "{error}");
    // An offset beyond the ring's end, as in memory that is being tested.
    let mut chip = Chip::started();
    chip.set(RAM + 36, &SIZE.to_le_bytes());
    let error = Channel::new(RAM).take(&mut chip).expect_err("nothing");
    assert!(matches!(error, ChannelError::NoChannel), "{error}");
}

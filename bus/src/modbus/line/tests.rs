//! Frames out of bytes, by their times.

use super::*;
use std::vec::Vec;

const ID: u8 = 9;
/// A byte at 115 200 Bd, µs.
const BYTE_US: u64 = 87;

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}

fn framed(id: u8, pdu: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::from([id]);
    bytes.extend(pdu);
    let sum = crc(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// A line at 115 200 Bd.
struct Line {
    receiver: Receiver,
    now: u64,
    /// Function codes of the frames so far, and whether what they ask for is good.
    frames: Vec<(u8, bool)>,
}

impl Line {
    fn new() -> Self {
        Self {
            receiver: Receiver::new(ID, Timing::line(115_200)),
            now: 5_000,
            frames: Vec::new(),
        }
    }

    fn look(&mut self) {
        if let Some(frame) = self.receiver.frame(at(self.now)) {
            self.frames.push((frame.code, frame.request.is_ok()));
        }
    }

    fn send(&mut self, bytes: &[u8]) -> &mut Self {
        for &byte in bytes {
            self.now += BYTE_US;
            self.receiver.receive(at(self.now), byte);
            self.look();
        }
        self
    }

    fn wait(&mut self, micros: u64) -> &mut Self {
        self.now += micros;
        self.look();
        self
    }
}

const READ: &[u8] = &[3, 0x07, 0xD0, 0, 3];

#[test]
fn a_known_function_ends_at_its_length_and_an_unknown_one_with_a_silence() {
    let mut line = Line::new();
    line.send(&framed(ID, READ));
    assert_eq!(line.frames, [(3, true)]);
    line.send(&framed(ID, &[16, 3, 0xE8, 0, 1, 2, 0, 0]));
    line.send(&framed(ID, &[23, 0, 0, 0, 1, 0, 0, 0, 1, 2, 7, 7]));
    assert_eq!(line.frames[1..], [(16, true), (23, true)]);
    line.send(&framed(ID, &[0x2B, 14, 1, 0]));
    line.wait(1_749);
    assert_eq!(line.frames.len(), 3);
    line.wait(1);
    assert_eq!(line.frames[3..], [(0x2B, false)]);
    line.wait(10_000);
    assert_eq!(line.frames.len(), 4);
}

#[test]
fn a_silence_in_the_middle_ends_a_frame_and_the_next_one_is_good() {
    let request = framed(ID, READ);
    for cut in 1..request.len() {
        let mut line = Line::new();
        // Whether somebody looks in between or not.
        line.send(&request[..cut]);
        line.now += 1_750;
        line.send(&request);
        assert_eq!(line.frames, [(3, true)], "{cut}");
        assert_eq!(line.receiver.damaged(), 1);
        let mut line = Line::new();
        line.send(&request[..cut]).wait(1_749 - BYTE_US);
        line.send(&request[cut..]);
        assert_eq!(line.frames, [(3, true)], "{cut}");
    }
}

#[test]
fn silences_are_3_5_characters_and_1_75_ms_above_19200() {
    let silences = [9_600, 19_200, 38_400, 115_200, 230_400].map(Timing::line);
    let silences = silences.map(Timing::silence_us);
    assert_eq!(silences, [4_010, 2_005, 1_750, 1_750, 1_750]);
}

#[test]
fn what_other_slaves_are_asked_and_answer_is_no_request_and_blocks_none() {
    let exchanges: [(&[u8], &[u8]); 5] = [
        (READ, &[3, 6, 9, 3, 0x07, 0xD0, 0, 3]),
        (&[6, 3, 0xE8, 0, 9], &[6, 3, 0xE8, 0, 9]),
        (&[16, 3, 0xE8, 0, 1, 2, 9, 9], &[16, 3, 0xE8, 0, 1]),
        (READ, &[0x83, 2]),
        (&[1, 0, 0, 0, 9], &[1, 2, 9, 3]),
    ];
    for id in [1, 3, 8, 10, 247] {
        for (request, answer) in exchanges {
            for pause_us in [0, 100, 2_000] {
                let mut line = Line::new();
                line.send(&framed(id, request)).wait(2_000);
                // The master's next request comes as close behind the answer as can be.
                line.send(&framed(id, answer)).wait(pause_us);
                line.send(&framed(ID, READ));
                assert_eq!(line.frames, [(3, true)], "{id} {answer:02x?} {pause_us}");
            }
        }
    }
}

#[test]
fn answers_of_its_own_that_come_back_are_no_requests() {
    let answers: [&[u8]; 5] = [
        &[3, 2, 0, 0],
        &[3, 6, 9, 3, 0x07, 0xD0, 0, 3],
        &[16, 3, 0xE8, 0, 3],
        &[23, 6, 0, 0, 0, 0, 0, 0],
        &[0x83, 2],
    ];
    for answer in answers {
        let mut line = Line::new();
        line.send(&framed(ID, answer)).wait(2_000);
        assert_eq!(line.frames, [], "{answer:02x?}");
        line.send(&framed(ID, READ));
        assert_eq!(line.frames, [(3, true)]);
    }
}

#[test]
fn a_good_checksum_before_the_end_ends_nothing() {
    // An answer whose first ten bytes are a frame as well.
    let bytes = [9, 4, 6, 0xc0, 0, 0, 0x0f, 5, 0, 0x25, 0];
    assert_eq!(crc(&bytes[..10]), 0);
    let mut line = Line::new();
    line.send(&bytes).wait(2_000);
    assert_eq!(line.frames, []);
}

#[test]
fn one_wrong_bit_is_no_frame_and_is_counted() {
    let request = framed(ID, &[6, 3, 0xE8, 1, 0]);
    for bit in 0..8 * request.len() {
        let mut bytes = request.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let mut line = Line::new();
        line.send(&bytes).wait(2_000);
        assert_eq!(line.frames, [], "bit {bit}");
        assert_eq!(line.receiver.damaged(), 1, "bit {bit}");
        line.send(&request);
        assert_eq!(line.frames, [(6, true)], "bit {bit}");
    }
}

#[test]
fn a_frame_that_is_too_long_is_none() {
    for length in [256, 257, 1_000] {
        let mut line = Line::new();
        line.send(&[ID].repeat(length)).wait(2_000);
        line.send(&framed(ID, READ));
        assert_eq!(line.frames, [(3, true)], "{length}");
        assert_eq!(line.receiver.damaged(), 1);
    }
    // The longest that there is.
    let mut longest = Vec::from([16, 0, 0, 0, 123, 246]);
    longest.extend([0; 246]);
    let mut line = Line::new();
    line.send(&framed(ID, &longest));
    assert_eq!(line.frames, [(16, true)]);
}

#[test]
fn a_request_that_nobody_took_in_time_is_not_answered_any_more() {
    for (micros, frames) in [(100_000, 1), (100_001, 0)] {
        let mut line = Line::new();
        for byte in framed(ID, READ) {
            line.receiver.receive(at(line.now), byte);
        }
        line.wait(micros);
        assert_eq!(line.frames.len(), frames);
    }
    // Another one came behind it: its master has given up.
    let mut line = Line::new();
    for byte in [framed(ID, READ), framed(ID, &[6, 0, 0, 0, 0])].concat() {
        line.receiver.receive(at(line.now), byte);
    }
    line.wait(0).wait(50_000);
    assert_eq!(line.frames, [(6, true)]);
}

#[test]
fn a_broadcast_is_for_this_slave_too() {
    let mut receiver = Receiver::new(ID, Timing::stream());
    for byte in framed(0, READ) {
        receiver.receive(at(0), byte);
    }
    assert!(
        receiver
            .frame(at(0))
            .is_some_and(|frame| frame.is_broadcast)
    );
}

#[test]
fn what_is_forgotten_is_no_beginning_of_what_follows() {
    let mut line = Line::new();
    line.send(&framed(ID, READ)[..5]);
    line.receiver.forget();
    line.send(&framed(ID, READ));
    assert_eq!(line.frames, [(3, true)]);
}

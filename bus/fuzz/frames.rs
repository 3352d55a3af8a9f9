//! Frames that a fuzzer finds, at a gripper that runs and a model of what they may do:
//! `cargo +nightly fuzz run frames` in `bus/` ([cargo-fuzz](https://github.com/rust-fuzz/cargo-fuzz)).
#![no_main]

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/hostile.rs"]
mod hostile;
#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/line.rs"]
mod line;
#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../../tests/host/mock.rs"]
mod mock;

use bus::modbus::crc;
use hostile::Hostile;
use libfuzzer_sys::fuzz_target;

// A byte says how many follow in a frame; with its upper bit set they get the checksum that no fuzzer would guess.
fuzz_target!(|input: &[u8]| {
    let mut hostile = Hostile::new();
    let mut rest = input;
    while let [head, behind @ ..] = rest {
        let (bytes, behind) = behind.split_at(behind.len().min(usize::from(head & 0x7f)));
        let mut frame = bytes.to_vec();
        if head & 0x80 != 0 {
            frame.extend(crc(bytes).to_le_bytes());
        }
        hostile.feed(&frame).expect("what the model has");
        rest = behind;
    }
});

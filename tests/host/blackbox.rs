//! The black box outlives a power cut, whole or not at all.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use fastrand::Rng;
use softgrip::RawFrame;
use softgrip::blackbox::{Memory, Recorder, WORDS, forget, keep, restore, ticks};
use softgrip::fault::Fault;
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, DacCode, Instant};

use crate::flash::{Flash, now};

/// The sector that it has in the STM32F429.
const SECTOR: usize = 16 << 10;
const AT: u32 = SECTOR as u32;

fn memory() -> &'static Memory {
    Box::leak(Box::new([const { AtomicU32::new(u32::MAX) }; WORDS]))
}

fn words(memory: &Memory) -> Vec<u32> {
    memory.iter().map(|word| word.load(Relaxed)).collect()
}

/// Something has come after some noise.
fn stands(seed: u64) -> &'static Memory {
    let mut random = Rng::with_seed(seed);
    let memory = memory();
    let mut recorder = Recorder::new(memory, false);
    for tick in 0.. {
        let frame = RawFrame {
            gauges: std::array::from_fn(|_| AdcCode(30_000 + random.u16(..1_000))),
            ..RawFrame::default()
        };
        if tick == 5_000 {
            let fault = Fault::AirLoss;
            let finger = None;
            recorder.report(Instant::from_micros(5), &Event::Fault { fault, finger });
        }
        if recorder.step(&frame, DacCode(1_000)) {
            break;
        }
    }
    memory
}

#[test]
fn a_black_box_is_there_after_a_power_cut_whole_or_not_at_all() {
    let (before, kept) = (stands(1), stands(2));
    assert!(ticks(&words(kept)).count() > 1_000);
    let mut flash = Flash::<SECTOR>::new(3);
    assert_eq!(restore(&mut flash, AT, memory()), Ok(false));
    now(keep(&mut flash, AT, before)).expect("it is written");
    let log = flash.logged();
    now(keep(&mut flash, AT, kept)).expect("it is written");
    let moments = log.take();
    assert_eq!(moments.len(), 1 + WORDS + 1);
    let mut random = Rng::with_seed(4);
    for moment in moments {
        let mut flash = moment.cut(&mut random);
        let found = memory();
        if restore(&mut flash, AT, found).expect("it reads") {
            let found = words(found);
            assert!(found == words(before) || found == words(kept));
        }
        // And again, with what the cut has left.
        now(keep(&mut flash, AT, kept)).expect("it is written");
        assert_eq!(restore(&mut flash, AT, found), Ok(true));
        assert_eq!(words(found), words(kept));
    }
    assert_eq!(restore(&mut flash, AT, memory()), Ok(true));
    now(forget(&mut flash, AT)).expect("it is erased");
    assert_eq!(restore(&mut flash, AT, memory()), Ok(false));
}

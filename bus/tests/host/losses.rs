//! Losses on the bus: shown, latched, and hidden by nothing.

use crate::line::{Bus, REQUEST, STATUS, Shown};
use crate::mock::adjusted;
use bus::robot::BLACK_BOX_FROM;
use softgrip::Command;
use softgrip::blackbox::{Kept, WORDS, ticks};
use softgrip::grasp::State;
use softgrip::settings::{OnLoss, Settings};
use softgrip::telemetry::Event;

const LOSS: u16 = 0x1030;
/// Whether something stands in the black box.
const STANDS: u16 = 0x110a;

/// Holding an object at full position and force.
fn holding(settings: Settings) -> Bus {
    let mut bus = Bus::activated(settings);
    bus.board.grip = [1.0; 3];
    bus.go(255);
    bus.run(1_500);
    assert_eq!(bus.shown().obj, 2);
    bus
}

fn is_lost(event: &Event) -> bool {
    matches!(event, Event::Lost(_))
}

#[test]
fn a_lost_object_is_readable_in_the_tick_after_the_verdict() {
    let mut bus = holding(Settings::default());
    // A robot that polls as fast as it can: each tick answers.
    for ms in 0..80 {
        bus.board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
        let shown = bus.shown();
        assert_eq!(bus.ticks, 1);
        let lost = bus.board.count(is_lost) > 0;
        assert_eq!(shown.obj, if lost { 3 } else { 2 }, "{ms} ms");
        assert_eq!(shown.pr, 255);
        if lost {
            return;
        }
    }
    panic!("no loss");
}

#[test]
fn the_own_block_says_when_and_how_until_an_acknowledgement() {
    for acknowledge in [
        (|bus: &mut Bus| bus.write(0x1104, &[6])) as fn(&mut Bus),
        |bus| bus.write(REQUEST, &[0]),
    ] {
        let mut bus = holding(Settings::default());
        assert_eq!(bus.read(LOSS, 9)[..6], [0; 6]);
        let before = bus.board.now_ms() as u32;
        bus.drop_object();
        let words = bus.read(LOSS, 9);
        let long = |at: usize| u32::from(words[at]) << 16 | u32::from(words[at + 1]);
        let (cause, onset, flagged) = (words[0], long(1), long(3));
        assert_eq!(cause, 1);
        assert!((before..before + 44).contains(&onset), "{onset}");
        assert!((onset..before + 44).contains(&flagged), "{flagged}");
        // Both are cut to a millisecond.
        let latency = f32::from(words[5]) / 10.0;
        assert!((latency - (flagged - onset) as f32).abs() <= 1.0);
        for evidence in &words[6..] {
            assert!((1..=1_000).contains(evidence), "{evidence}");
        }
        acknowledge(&mut bus);
        assert_eq!(bus.read_one(LOSS), 0);
        assert_eq!(bus.read_one(0x1045), 1, "it has been counted");
    }
}

#[test]
fn a_new_go_to_goes_on_after_a_loss_that_was_shown_and_leaves_it_in_the_own_block() {
    let mut bus = holding(Settings::default());
    bus.drop_object();
    assert_eq!(bus.shown().obj, 3);
    let shown = bus.go(0);
    assert_eq!(shown.obj, 0);
    bus.run(2_000);
    bus.board.grip = [1.0; 3];
    assert_eq!(bus.go(255).obj, 0);
    bus.run(1_500);
    assert_eq!(bus.shown().obj, 2);
    assert_eq!(bus.read_one(LOSS), 1);
}

#[test]
fn a_stream_of_new_positions_hides_no_loss() {
    let mut bus = holding(Settings::default());
    let mut position = 200;
    let mut shows = Vec::new();
    for ms in 0..400 {
        bus.board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
        if ms % 5 == 4 {
            position = if position == 200 { 201 } else { 200 };
            let words = bus.write_read(REQUEST, &[0x0900, position, 0xffff], STATUS, 3);
            shows.push(Shown::of(&words).obj);
        } else {
            bus.tick();
        }
    }
    assert_eq!(bus.board.count(is_lost), 1);
    assert!(shows.contains(&3), "{shows:?}");
    assert_eq!(bus.read_one(LOSS), 1);
    // And after it goes on to move.
    assert_eq!(shows.last(), Some(&0));
}

#[test]
fn a_grip_before_the_loss_was_read_is_refused_and_a_release_is_done() {
    let mut bus = holding(Settings::default());
    bus.drop_object();
    bus.write(REQUEST + 1, &[200]);
    assert_eq!(bus.read(0x1106, 2), [3, 7], "refused: a loss is latched");
    assert_eq!((bus.shown().obj, bus.shown().pr), (3, 200));
    bus.write(REQUEST + 1, &[210]);
    assert_eq!(bus.shown().obj, 0);

    let mut bus = holding(Settings::default());
    bus.drop_object();
    bus.write(REQUEST + 1, &[0]);
    assert_eq!(bus.shown().obj, 0);
    bus.run(2_000);
    assert_eq!(bus.board.state(), State::Idle);
    assert_eq!(bus.shown().obj, 3);
    bus.board.grip = [1.0; 3];
    bus.write(REQUEST + 1, &[255]);
    assert_eq!(bus.shown().obj, 0);
}

#[test]
fn a_go_to_acknowledges_no_fault() {
    let mut bus = holding(Settings::default());
    bus.drop_object();
    assert_eq!(bus.shown().obj, 3);
    bus.pins = Command::Stop;
    bus.run(1);
    bus.pins = Command::Continue;
    bus.write(REQUEST + 1, &[200]);
    bus.run(10);
    assert_eq!(bus.shown().flt, 0xC);
    assert_eq!(bus.read(0x1106, 2), [3, 6], "refused: a fault is latched");
}

#[test]
fn another_pressure_keeps_what_is_held() {
    let mut bus = holding(Settings::default());
    for position in [220, 255, 200] {
        let shown = bus.go(position);
        assert_eq!((shown.obj, shown.pr), (2, position));
        for _ in 0..200 {
            bus.run(4);
            assert_eq!(bus.shown().obj, 2);
        }
    }
    assert_eq!(bus.board.count(is_lost), 0);
}

#[test]
fn what_opens_or_regrips_by_itself_after_a_loss_shows_it_too() {
    for on_loss in [OnLoss::Vent, OnLoss::Regrip] {
        let mut bus = holding(adjusted(|s| {
            s.grip.on_loss = on_loss;
            s.grip.grip_pressure_kpa = 100.0;
        }));
        bus.go(150);
        bus.run(1_500);
        bus.drop_object();
        bus.run(2_000);
        assert_eq!(bus.shown().obj, 3, "{on_loss:?}");
        assert_eq!(bus.read_one(LOSS), 1);
    }
}

#[test]
fn the_black_box_is_read_word_by_word_and_runs_again_once_it_is_cleared() {
    let mut bus = holding(Settings::default());
    assert_eq!(bus.read_one(STANDS), 0);
    bus.drop_object();
    bus.run(200);
    assert_eq!(bus.read_one(STANDS), 1);
    let mut registers = Vec::new();
    while registers.len() < 2 * WORDS {
        let count = 125.min(2 * WORDS - registers.len()) as u16;
        registers.extend(bus.read(BLACK_BOX_FROM + registers.len() as u16, count));
    }
    let (pairs, _) = registers.as_chunks::<2>();
    let words: Vec<u32> = pairs
        .iter()
        .map(|[upper, lower]| u32::from(*upper) << 16 | u32::from(*lower))
        .collect();
    assert_eq!(words[1], 1);
    let kept: Vec<Kept> = ticks(&words).collect();
    assert_eq!(kept.last().map(|kept| kept.tick), Some(words[4] + 99));
    // The command of a grip at full force, which the loss left as it was.
    assert!(kept.len() > 1_000);
    assert!(
        kept[kept.len() - 100..]
            .iter()
            .all(|kept| kept.codes[4] > 2_000)
    );
    // Behind its end nothing can be read, and nowhere anything written.
    let end = (BLACK_BOX_FROM + 2 * WORDS as u16).to_be_bytes();
    assert_eq!(bus.refused(&[3, end[0], end[1], 0, 1]), 2);
    let [upper, lower] = BLACK_BOX_FROM.to_be_bytes();
    assert_eq!(bus.refused(&[6, upper, lower, 0, 0]), 2);
    bus.write(0x1104, &[11]);
    assert_eq!(bus.read_one(STANDS), 0);
}

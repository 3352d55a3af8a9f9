//! The controller with as many fingers as the recipe says that it is built for: two, three or four. `.ci/fingers` builds
//! each.

#[path = "../host/mock.rs"]
#[allow(dead_code, reason = "the other tests use all of it")]
mod mock;

use std::sync::atomic::AtomicU32;

use mock::{GaugeState, MockBoard};
use softgrip::blackbox::{self, Memory, Recorder, ticks};
use softgrip::fault::Fault;
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::telemetry::{Event, Record};
use softgrip::{Command, FINGERS};
use softgrip_settings::{FIELDS, per_finger};

/// Whether somebody has said how many fingers this is built for, and something else has come out.
#[test]
fn there_are_as_many_fingers_as_was_asked_for() {
    let expected = option_env!("SOFTGRIP_FINGERS").unwrap_or("3");
    assert_eq!(FINGERS.to_string(), expected);
}

#[test]
fn each_finger_has_its_settings_and_there_are_no_others() {
    for first in [220, 230, 500, 510] {
        let wanted = per_finger(first);
        let found: Vec<u16> = FIELDS
            .iter()
            .map(|field| field.number)
            .filter(|number| (first..first + 10).contains(number))
            .collect();
        assert_eq!(found, wanted);
    }
    let listed = FIELDS.iter().filter(|field| field.name.ends_with(']'));
    assert_eq!(listed.count(), 4 * FINGERS);
}

#[test]
fn what_is_held_by_all_fingers_is_lost_once_and_at_once() {
    let mut board = MockBoard::holding(Settings::default());
    let before_ms = board.now_ms();
    board.drop_object();
    let lost_ms = board.first(|event| matches!(event, Event::Lost(_)));
    let lost_ms = lost_ms.expect("it is told");
    // It goes from 90 to 10 % in 35 ms.
    assert!(lost_ms < before_ms + 35, "{}", lost_ms - before_ms);
    assert_eq!(board.count(|event| matches!(event, Event::Lost(_))), 1);
}

#[test]
fn a_release_is_no_loss() {
    let mut board = MockBoard::holding(Settings::default());
    board.step(Command::Release);
    board.run(3_000);
    assert_eq!(board.count(|event| matches!(event, Event::Lost(_))), 0);
    assert_eq!(board.state(), State::Idle);
}

#[test]
fn without_the_last_finger_the_others_go_on_unless_one_alone_is_left() {
    let mut board = MockBoard::holding(Settings::default());
    board.gauges[FINGERS - 1] = GaugeState::Open;
    board.run(200);
    let is_open = |event: &Event| {
        let finger = Some(FINGERS as u8 - 1);
        matches!(event, Event::Fault { fault: Fault::GaugeOpen, finger: found } if *found == finger)
    };
    assert_eq!(board.count(is_open), 1);
    if FINGERS == 2 {
        assert_eq!(board.state().fault(), Some(Fault::GaugeOpen));
        return;
    }
    assert!(matches!(board.state(), State::Holding { .. }));
    board.drop_object();
    assert_eq!(board.count(|event| matches!(event, Event::Lost(_))), 1);
}

#[test]
fn a_record_of_any_tick_gives_it_back() {
    let mut board = MockBoard::holding(Settings::default());
    for ms in 0..80 {
        board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); FINGERS];
        let frame = board.sense();
        let outputs = board.act(&frame, Command::Continue);
        let record = Record {
            number: ms,
            longest_tick_us: 50,
            events_lost: 0,
            internal_clock: false,
            frame,
            command: Command::Continue,
            dac: outputs.dac,
            snapshot: outputs.snapshot,
        };
        let mut bytes = [0; Record::BYTES];
        let sent = record.encode(&mut bytes).to_vec();
        assert_eq!(Record::decode(&sent), Ok(record));
    }
}

#[test]
fn the_black_box_has_the_codes_of_every_gauge() {
    let memory: &'static Memory = Box::leak(Box::new(
        [const { AtomicU32::new(u32::MAX) }; blackbox::WORDS],
    ));
    let mut recorder = Recorder::new(memory, false);
    let mut board = MockBoard::holding(Settings::default());
    let mut written = Vec::new();
    for ms in 0..400_u16 {
        if ms >= 200 {
            board.grip = [0.14; FINGERS];
        }
        let frame = board.sense();
        let outputs = board.act(&frame, Command::Continue);
        let mut codes: Vec<u16> = frame.gauges.iter().map(|code| code.0 >> 4).collect();
        codes.extend([frame.monitor.0 >> 4, outputs.dac.0 & 0xfff]);
        written.push(codes);
        recorder.step(&frame, outputs.dac);
    }
    let words: Vec<u32> = (0..blackbox::WORDS)
        .map(|word| blackbox::load(memory, word))
        .collect();
    let read: Vec<Vec<u16>> = ticks(&words).map(|kept| kept.codes.to_vec()).collect();
    assert!(read.len() > 250, "{}", read.len());
    assert_eq!(read, written[..read.len()]);
}

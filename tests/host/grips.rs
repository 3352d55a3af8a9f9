//! Grips at a pressure, at a bend and for a payload.

use crate::mock::MockBoard;
use softgrip::command::{Payload, Refusal};
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::table::{self, FINGER, ObjectKind};
use softgrip::telemetry::Event;
use softgrip::units::{Degrees, Kilograms, Kilopascals, MetresPerSecondSquared};
use softgrip::{Command, Grip};

#[test]
fn a_grip_for_a_payload_takes_the_lowest_pressure_with_the_margin() {
    let payload = Payload {
        kind: ObjectKind::Sphere,
        mass: Kilograms(0.1),
        acceleration: MetresPerSecondSquared(5.0),
    };
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0; 3];
    board.step(Command::Grip(Grip::Payload(payload)));
    board.run(2_000);
    let target = board.state().target();
    let lift = table::lift(&FINGER, ObjectKind::Sphere, target);
    let (lift, _) = lift.expect("the recipe has a grasp");
    // 20 % beyond 0.1 kg × 14.8 m/s².
    assert!((lift.0 - 1.2 * 1.480_665).abs() < 1e-3, "{lift:?}");
    let margin = board.last.as_ref().and_then(|last| last.snapshot.margin);
    assert!(
        margin.is_some_and(|margin| (margin - 0.2).abs() < 0.03),
        "{margin:?}"
    );
}

#[test]
fn a_payload_that_is_too_heavy_is_refused_with_what_would_be_possible() {
    let heavy = |kilograms| {
        Command::Grip(Grip::Payload(Payload {
            kind: ObjectKind::Cylinder,
            mass: Kilograms(kilograms),
            acceleration: MetresPerSecondSquared(10.0),
        }))
    };
    let mut board = MockBoard::new(Settings::default());
    board.step(heavy(0.5));
    let possible = match board.events[0].1 {
        Event::Refused(Refusal::PayloadTooHeavy { possible }) => possible,
        other => panic!("{other:?}"),
    };
    board.events.clear();
    board.step(heavy(0.999 * possible.0));
    assert!(board.events.is_empty(), "{:?}", board.events);
    board.step(heavy(1.001 * possible.0));
    assert_eq!(board.events.len(), 1);
    board.step(heavy(f32::NAN));
    assert_eq!(board.events[1].1, Event::Refused(Refusal::PayloadInvalid));
}

#[test]
fn a_grip_that_cannot_be_is_refused_with_its_reason() {
    let mut board = MockBoard::new(Settings::default());
    for (grip, refusal) in [
        (
            Grip::Pressure(Kilopascals(161.0)),
            Refusal::PressureOutOfRange,
        ),
        (
            Grip::Pressure(Kilopascals(f32::NAN)),
            Refusal::PressureOutOfRange,
        ),
        (
            Grip::Pressure(Kilopascals(0.0)),
            Refusal::PressureOutOfRange,
        ),
        (Grip::Bend(Degrees(120.0)), Refusal::BendOutOfRange),
        (Grip::Bend(Degrees(-1.0)), Refusal::BendOutOfRange),
    ] {
        board.events.clear();
        board.step(Command::Grip(grip));
        assert_eq!(board.events.len(), 1);
        assert_eq!(board.events[0].1, Event::Refused(refusal));
        assert_eq!(board.state(), State::Idle);
    }
}

#[test]
fn a_grip_at_a_bend_goes_to_the_tables_pressure() {
    let mut board = MockBoard::new(Settings::default());
    board.step(Command::Grip(Grip::Bend(Degrees(57.3))));
    board.run(2_000);
    let (pressure, _) = table::pressure_for_bend(&FINGER, Degrees(57.3));
    assert!(
        (board.pressure_kpa - pressure.0).abs() < 1.0,
        "{}",
        board.pressure_kpa
    );
    let bend = board.last.as_ref().map(|last| last.snapshot.bend.0);
    assert!(
        bend.is_some_and(|bend| (bend - 57.3).abs() < 1.0),
        "{bend:?}"
    );
}

#[test]
fn an_empty_close_is_empty_also_when_the_fingers_meet() {
    let meeting = FINGER.meeting_kpa.expect("fingers that meet");
    for kpa in [100.0, 120.0, 140.0, 160.0] {
        let mut board = MockBoard::new(Settings::default());
        board.grip = [1.0; 3];
        board.touch_kpa = meeting;
        board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
        board.run(3_000);
        let empty = |event: &Event| *event == Event::Empty;
        assert_eq!(board.count(empty), 1, "{kpa}: {:?}", board.events);
        // Gripped again after a release it is the same.
        board.step(Command::Release);
        board.run(2_000);
        board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
        board.run(3_000);
        assert_eq!(board.count(empty), 2, "{kpa}: {:?}", board.events);
        // And an object is held.
        board.step(Command::Release);
        board.run(2_000);
        board.touch_kpa = 0.6 * meeting;
        board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
        board.run(3_000);
        let holding = |event: &Event| matches!(event, Event::Holding { .. });
        assert_eq!(board.count(holding), 1, "{kpa}: {:?}", board.events);
    }
}

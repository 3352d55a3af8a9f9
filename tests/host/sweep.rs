//! The free-bend sweep as a command: when it begins, what ends it, and that nothing but a whole one is believed.

use crate::mock::{GaugeState, MockBoard, adjusted};
use softgrip::command::{Refusal, SweepFault};
use softgrip::fault::Fault;
use softgrip::grasp::State;
use softgrip::settings::{Calibration, GaugeSense, Settings};
use softgrip::table::FINGER;
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;
use softgrip::{Answer, Command, Grip};

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));
/// A sweep may take this long, ms.
const LONGEST_MS: u64 = 60_000;

fn rejected(wanted: SweepFault) -> impl Fn(&Event) -> bool {
    move |event| *event == Event::Refused(Refusal::SweepRejected(wanted))
}

/// A gripper whose sweep has been running for two seconds.
fn sweeping() -> MockBoard {
    let mut board = MockBoard::new(Settings::default());
    board.run(500);
    assert_eq!(board.step(Command::Sweep).answer, Some(Answer::Accepted));
    board.run(2_000);
    assert!(matches!(board.state(), State::Sweeping { .. }));
    board
}

/// What the sweep finds, once it is over.
fn finish(board: &mut MockBoard) -> Option<Calibration> {
    for _ in 0..LONGEST_MS {
        board.step(Command::Continue);
        if let Some(found) = board.controller.take_calibration() {
            return Some(found);
        }
        if !matches!(board.state(), State::Sweeping { .. }) {
            return None;
        }
    }
    panic!("longer than a minute");
}

#[test]
fn a_sweep_of_the_recipes_own_fingers_finds_them_and_opens_the_gripper() {
    let mut board = sweeping();
    let found = finish(&mut board).expect("a calibration");
    for (gain, stiffness) in found.gain.into_iter().zip(found.stiffness) {
        assert!(
            (gain - 1.0).abs() < 0.02 && (stiffness - 1.0).abs() < 0.02,
            "{found:?}"
        );
    }
    assert_eq!(found.meeting, None);
    assert!(
        board.controller.take_calibration().is_none(),
        "it is taken once"
    );
    board.run(2_000);
    assert_eq!(board.state(), State::Idle);
    assert_eq!(board.count(|event| matches!(event, Event::Swept { .. })), 1);
    let before = Settings::default();
    let stated = found.stated(&before.values(), &FINGER);
    let settings = before.with(&stated, &FINGER).expect("in range");
    assert!(settings.validate(&FINGER).is_ok());
    assert_eq!(settings.finger.free_bend_gain, found.gain);
    assert_eq!(settings.finger.stiffness, found.stiffness);
    let silicone = settings.finger.silicone;
    let lags_ms = [silicone.inflation_lag_ms, silicone.deflation_lag_ms];
    assert_eq!(lags_ms, found.lag_ms);
    assert_eq!(silicone.hysteresis_percent, found.hysteresis_kpa / 1.6);
}

#[test]
fn a_sweep_widens_what_makes_a_slip_once_and_only_where_nobody_has_chosen_it() {
    let found = finish(&mut sweeping()).expect("a calibration");
    let default = Settings::default().detection.slip_percent;
    let mut after = Vec::new();
    for before_percent in [default, 5.0, 20.0] {
        let mut settings = Settings::default();
        settings.detection.slip_percent = before_percent;
        for _ in 0..2 {
            let stated = found.stated(&settings.values(), &FINGER);
            settings = settings.with(&stated, &FINGER).expect("in range");
        }
        after.push(settings.detection.slip_percent);
    }
    assert_eq!(after, [8.5, 5.0, 20.0]);
}

#[test]
fn a_sweep_begins_with_open_fingers_and_nothing_latched_alone() {
    let mut board = MockBoard::holding(Settings::default());
    let answer = board.step(Command::Sweep).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::NotIdle)));

    let mut board = MockBoard::new(Settings::default());
    board.run(500);
    board.step(Command::Stop);
    let answer = board.step(Command::Sweep).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::FaultLatched)));
}

#[test]
fn a_sweep_that_is_asked_for_again_goes_on_and_a_grip_has_to_wait() {
    let mut board = sweeping();
    assert_eq!(board.step(Command::Sweep).answer, Some(Answer::Unchanged));
    let answer = board.step(GRIP).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::Sweeping)));
    let answer = board.step(Command::Tare).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::NotIdle)));
    assert_eq!(board.step(Command::Sweep).answer, Some(Answer::Unchanged));
    assert!(finish(&mut board).is_some());
}

#[test]
fn a_release_or_a_stop_ends_a_sweep_without_a_result() {
    for (command, fault) in [
        (Command::Release, None),
        (Command::Stop, Some(Fault::Stopped)),
    ] {
        let mut board = sweeping();
        assert_eq!(board.step(command).answer, Some(Answer::Accepted));
        assert_eq!(board.state().fault(), fault);
        assert_eq!(board.state().target(), Kilopascals(0.0));
        assert_eq!(board.count(rejected(SweepFault::Interrupted)), 1);
        assert!(board.controller.take_calibration().is_none());
    }
}

#[test]
fn a_gauge_that_breaks_or_roars_ends_a_sweep() {
    for (state, why) in [
        (GaugeState::Open, SweepFault::Gauge),
        (GaugeState::Noisy(3_000.0), SweepFault::Gauge),
        (GaugeState::Noisy(1_000.0), SweepFault::Noise),
    ] {
        let mut board = sweeping();
        board.gauges[1] = state;
        assert_eq!(finish(&mut board), None, "{why:?}");
        assert_eq!(board.count(rejected(why)), 1, "{:?}", board.events);
    }
}

#[test]
fn a_finger_that_something_holds_up_ends_a_sweep() {
    let mut board = sweeping();
    board.grip = [1.0; 3];
    assert_eq!(finish(&mut board), None);
    assert_eq!(
        board.count(rejected(SweepFault::Contact)),
        1,
        "{:?}",
        board.events
    );
}

#[test]
fn gauges_that_see_contact_alone_tell_nothing_of_a_free_bend() {
    let mut board = MockBoard::new(adjusted(|s| s.finger.gauge_sense = GaugeSense::Contact));
    board.run(500);
    board.step(Command::Sweep);
    assert_eq!(finish(&mut board), None);
    assert_eq!(board.count(rejected(SweepFault::Gauge)), 1);
}

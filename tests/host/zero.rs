//! The zero of the gauges: tares, and drift that is followed.

use crate::mock::{GaugeState, MockBoard};
use softgrip::command::{Refusal, TareFault};
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;
use softgrip::{Answer, Command, Grip};

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));

fn refused(wanted: Refusal) -> impl Fn(&Event) -> bool {
    move |event| *event == Event::Refused(wanted)
}

#[test]
fn a_tare_works_at_rest_and_is_refused_under_pressure() {
    let mut board = MockBoard::new(Settings::default());
    board.run(100);
    board.step(Command::Tare);
    board.run(300);
    assert_eq!(board.count(|event| *event == Event::Tared), 1);
    board.step(GRIP);
    board.step(Command::Tare);
    assert_eq!(
        board.count(|event| *event == Event::Refused(Refusal::NotIdle)),
        1
    );
}

#[test]
fn a_zero_that_drifts_by_20_ue_per_second_turns_no_empty_close_into_a_hold() {
    for rate in [-20.0, 20.0] {
        let mut board = MockBoard::new(Settings::default());
        for ms in 0..40_000 {
            board.gauges = [GaugeState::Offset(rate * ms as f32 * 1e-3); 3];
            board.step(Command::Continue);
        }
        board.step(GRIP);
        board.run(1_500);
        assert!(matches!(board.state(), State::Empty { .. }), "{rate}");
        let snapshot = board
            .last
            .as_ref()
            .map(|last| last.snapshot)
            .expect("a tick");
        for drift in snapshot.drift {
            assert!((drift.0 - 40.0 * rate).abs() < 60.0, "{drift:?}");
        }
        assert!(!snapshot.tare_due);
    }
}

#[test]
fn a_zero_that_has_drifted_too_far_asks_for_a_tare_once_and_is_right_after_it() {
    let mut board = MockBoard::new(Settings::default());
    for ms in 0..80_000 {
        board.gauges = [GaugeState::Offset(-0.02 * ms as f32); 3];
        board.step(Command::Continue);
    }
    assert_eq!(board.count(|event| *event == Event::TareDue), 1);
    assert!(
        board
            .last
            .as_ref()
            .is_some_and(|last| last.snapshot.tare_due)
    );
    board.step(Command::Tare);
    board.run(300);
    assert_eq!(board.count(|event| *event == Event::Tared), 1);
    board.step(GRIP);
    board.run(1_500);
    assert!(matches!(board.state(), State::Empty { .. }));
}

#[test]
fn a_tare_that_is_cut_short_is_answered() {
    for command in [GRIP, Command::Stop] {
        let mut board = MockBoard::new(Settings::default());
        board.run(500);
        assert_eq!(board.step(Command::Tare).answer, Some(Answer::Accepted));
        board.run(100);
        board.step(command);
        board.run(500);
        let interrupted = Refusal::TareRejected(TareFault::Interrupted);
        assert_eq!(board.count(refused(interrupted)), 1, "{command:?}");
        assert_eq!(board.count(|event| *event == Event::Tared), 0);
    }
}

#[test]
fn a_tare_while_a_valve_opens_is_refused_and_changes_nothing() {
    for opens_ms in [0, 20, 100, 150, 180] {
        let mut board = MockBoard::new(Settings::default());
        board.run(1_000);
        board.step(Command::Tare);
        board.run(opens_ms);
        board.valve_forced_kpa = Some(60.0);
        board.run(250 - opens_ms);
        assert_eq!(
            board.count(|event| *event == Event::Tared),
            0,
            "{opens_ms} ms"
        );
        let because = Refusal::TareRejected(TareFault::Pressure);
        assert_eq!(board.count(refused(because)), 1, "{opens_ms} ms");
    }
}

#[test]
fn a_tare_with_something_in_the_grip_or_a_noisy_gauge_is_refused() {
    for (gauge, fault) in [
        (GaugeState::Offset(-900.0), TareFault::Contact),
        (GaugeState::Noisy(900.0), TareFault::Noise),
        (GaugeState::Open, TareFault::Gauge),
    ] {
        let mut board = MockBoard::new(Settings::default());
        board.run(1_500);
        board.gauges[1] = gauge;
        board.run(300);
        board.step(Command::Tare);
        board.run(300);
        let because = Refusal::TareRejected(fault);
        assert_eq!(board.count(refused(because)), 1, "{:?}", board.events);
        assert_eq!(board.count(|event| *event == Event::Tared), 0);
    }
}

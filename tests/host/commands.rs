//! Commands as robots really send them: repeated, pulsed twice, acknowledged all the time, in the middle
//! of something else.

use crate::mock::{GaugeState, MockBoard, adjusted};
use softgrip::command::Refusal;
use softgrip::fault::Fault;
use softgrip::grasp::State;
use softgrip::settings::{OnFault, Settings};
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;
use softgrip::{Answer, Command, Grip};

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));

fn is_holding(event: &Event) -> bool {
    matches!(event, Event::Holding { .. })
}

fn is_lost(event: &Event) -> bool {
    matches!(event, Event::Lost(_))
}

fn is_fault(wanted: Fault) -> impl Fn(&Event) -> bool {
    move |event| matches!(event, Event::Fault { fault, finger: None } if *fault == wanted)
}

fn refused(wanted: Refusal) -> impl Fn(&Event) -> bool {
    move |event| *event == Event::Refused(wanted)
}

/// So many ticks, with the command in every `every`th.
fn run_with(board: &mut MockBoard, command: Command, every: u64, ms: u64) {
    for tick in 0..ms {
        board.step(match tick % every {
            0 => command,
            _ => Command::Continue,
        });
    }
}

fn holding_with(on_fault: OnFault) -> MockBoard {
    MockBoard::holding(adjusted(|s| s.grip.on_fault = on_fault))
}

#[test]
fn the_same_grip_rewritten_at_any_interval_is_one_hold_and_one_loss() {
    for every in [1, 2, 10, 20, 50, 100, 140, 250, 900, 1_500] {
        let mut board = MockBoard::new(Settings::default());
        board.grip = [1.0; 3];
        run_with(&mut board, GRIP, every, 3_000);
        assert_eq!(board.count(is_holding), 1, "every {every} ms");
        let dropped = board.now_ms();
        for ms in 0..80 {
            board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
            run_with(&mut board, GRIP, every, 1);
        }
        run_with(&mut board, GRIP, every.min(500), 2_000);
        assert_eq!(board.count(is_lost), 1, "every {every} ms");
        let lost = board.first(is_lost).expect("a loss");
        assert!(
            lost - dropped <= 24,
            "every {every} ms: {} ms",
            lost - dropped
        );
        // Contacts, the hold and the loss, and nothing about the commands.
        assert_eq!(board.events.len(), 5, "{:?}", board.events);
    }
}

#[test]
fn a_grip_that_differs_by_less_than_the_regulator_resolves_is_the_same_grip() {
    let mut board = MockBoard::holding(Settings::default());
    for tick in 0..1_000 {
        let kpa = 140.0 + if tick % 2 == 0 { 0.05 } else { -0.05 };
        let outputs = board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
        assert_eq!(outputs.answer, Some(Answer::Unchanged));
        assert!(outputs.indicators.holding);
    }
    assert!(board.events.is_empty(), "{:?}", board.events);
}

#[test]
fn a_second_grip_pulse_does_not_take_holding_away() {
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0; 3];
    board.step(Command::Grip(Grip::Default));
    board.run(2_000);
    for _ in 0..5 {
        assert!(board.step(Command::Grip(Grip::Default)).indicators.holding);
        for _ in 0..1_200 {
            assert!(board.step(Command::Continue).indicators.holding);
        }
    }
    assert_eq!(board.count(is_holding), 1);
}

#[test]
fn an_object_is_held_and_watched_all_the_way_to_another_set_point() {
    for kpa in [110.0, 158.0] {
        let mut board = MockBoard::holding(Settings::default());
        let change = Command::Grip(Grip::Pressure(Kilopascals(kpa)));
        assert!(board.step(change).indicators.holding);
        for _ in 0..1_500 {
            assert!(board.step(Command::Continue).indicators.holding);
        }
        assert_eq!(board.count(is_lost), 0, "{kpa} kPa: {:?}", board.events);
        for fall_ms in [1, 40, 120, 300] {
            let mut board = MockBoard::holding(Settings::default());
            board.step(change);
            board.run(fall_ms);
            let dropped = board.now_ms();
            board.drop_object();
            let lost = board.first(is_lost);
            assert!(
                lost.is_some_and(|lost| lost - dropped <= 30),
                "{kpa} kPa, {fall_ms} ms after the change: {lost:?} from {dropped}"
            );
        }
    }
}

#[test]
fn an_acknowledgement_repeated_for_ever_hides_no_fault() {
    for every in [1, 10, 100, 250] {
        // A valve that is stuck.
        let mut board = MockBoard::new(Settings::default());
        board.valve_stuck = true;
        board.step(GRIP);
        run_with(&mut board, Command::Acknowledge, every, 3_000);
        assert_eq!(board.count(is_fault(Fault::NotFollowing)), 1, "{every} ms");
        // All of them are one acknowledgement, which came before the fault.
        assert!(matches!(board.state(), State::Fault { .. }), "{every} ms");

        // A hose that bursts.
        let mut board = MockBoard::holding(Settings::default());
        board.leak_kpa = 0.0;
        let burst = board.now_ms();
        run_with(&mut board, Command::Acknowledge, every, 3_000);
        let told = board.first(is_fault(Fault::AirLoss));
        assert!(told.is_some_and(|told| told - burst <= 50), "{every} ms");
        assert!(matches!(board.state(), State::Fault { .. }), "{every} ms");
        assert_eq!(board.count(is_lost), 0);

        // A gauge whose wire breaks, and one that freezes.
        for bad in [GaugeState::Open, GaugeState::Stuck] {
            let mut board = MockBoard::holding(Settings::default());
            board.gauges[2] = bad;
            run_with(&mut board, Command::Acknowledge, every, 500);
            let of_finger = |event: &Event| {
                matches!(
                    event,
                    Event::Fault {
                        finger: Some(2),
                        ..
                    }
                )
            };
            assert_eq!(board.count(of_finger), 1, "{bad:?}, {every} ms");
        }
    }
}

#[test]
fn an_acknowledged_fault_ends_with_its_cause_and_not_before() {
    let mut board = holding_with(OnFault::Hold);
    board.supply_v = 15.0;
    board.run(100);
    assert_eq!(
        board.step(Command::Acknowledge).answer,
        Some(Answer::Accepted)
    );
    board.run(1_000);
    assert!(matches!(
        board.state(),
        State::Fault {
            fault: Fault::SupplyLow,
            ..
        }
    ));
    assert_eq!(board.count(is_fault(Fault::SupplyLow)), 1);
    board.supply_v = 24.0;
    board.run(500);
    assert!(matches!(board.state(), State::Holding { .. }));
}

#[test]
fn an_acknowledgement_that_is_repeated_does_not_clear_what_comes_after_it() {
    for every in [1, 10, 100, 250] {
        let mut board = MockBoard::holding(Settings::default());
        run_with(&mut board, Command::Acknowledge, every, 300);
        for ms in 0..80 {
            board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
            run_with(&mut board, Command::Acknowledge, every, 1);
        }
        run_with(&mut board, Command::Acknowledge, every, 1_000);
        assert_eq!(board.count(is_lost), 1);
        assert!(board.last.as_ref().is_some_and(|last| last.indicators.lost));
        // A pause, and it is a new one.
        board.run(400);
        board.step(Command::Acknowledge);
        assert!(!board.step(Command::Continue).indicators.lost);
    }
}

#[test]
fn a_stop_that_is_acknowledged_leaves_what_else_is_wrong_latched() {
    let mut board = holding_with(OnFault::Hold);
    board.step(Command::Stop);
    board.supply_v = 15.0;
    board.run(100);
    board.step(Command::Acknowledge);
    board.run(1);
    assert!(matches!(
        board.state(),
        State::Fault {
            fault: Fault::SupplyLow,
            ..
        }
    ));
}

#[test]
fn a_fault_whose_cause_stays_does_not_keep_the_robot_from_putting_the_object_down() {
    let mut board = holding_with(OnFault::Hold);
    // A regulator whose scale is off.
    board.valve_forced_kpa = Some(125.0);
    board.run(2_000);
    assert!(matches!(
        board.state(),
        State::Fault {
            fault: Fault::NotFollowing | Fault::AirLoss,
            ..
        }
    ));
    assert_eq!(board.step(Command::Release).answer, Some(Answer::Accepted));
    assert_eq!(board.commanded_kpa(), 0.0);
    board.valve_forced_kpa = None;
    board.run(1_000);
    board.step(Command::Acknowledge);
    board.run(100);
    assert_eq!(board.state(), State::Idle);
    assert_eq!(board.count(is_lost), 0);
}

#[test]
fn a_release_does_not_let_go_of_what_a_stop_holds() {
    let mut board = holding_with(OnFault::Hold);
    board.step(Command::Stop);
    let answer = board.step(Command::Release).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::FaultLatched)));
    board.run(1_000);
    assert!((board.pressure_kpa - 140.0).abs() < 1.0);
}

#[test]
fn a_stop_while_closing_keeps_the_pressure_that_is_there() {
    for ms in [50, 100, 150, 200, 250, 300, 400] {
        let mut board = MockBoard::new(adjusted(|s| s.grip.on_fault = OnFault::Hold));
        board.step(GRIP);
        board.run(ms);
        let there = board.pressure_kpa;
        board.step(Command::Stop);
        for _ in 0..1_000 {
            board.step(Command::Stop);
            assert!(
                (board.pressure_kpa - there).abs() <= 2.0,
                "{ms} ms: {there} kPa became {}",
                board.pressure_kpa
            );
        }
        // An acknowledgement goes on from there, and a grip to where it was going.
        board.step(Command::Acknowledge);
        board.run(1_000);
        assert!((board.pressure_kpa - there).abs() <= 2.0);
        board.step(GRIP);
        board.run(1_000);
        assert!((board.pressure_kpa - 140.0).abs() < 1.0);
    }
}

#[test]
fn a_held_object_that_falls_after_a_stop_in_a_change_of_pressure_is_lost() {
    for kpa in [110.0, 155.0] {
        for (stop_ms, fall_ms) in [(1, 0), (1, 100), (60, 0), (60, 30), (60, 1_000), (200, 500)] {
            let mut board = holding_with(OnFault::Hold);
            board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
            board.run(stop_ms);
            board.step(Command::Stop);
            board.run(fall_ms);
            assert_eq!(board.count(is_lost), 0, "{kpa} kPa, {stop_ms}, {fall_ms}");
            board.drop_object();
            assert_eq!(board.count(is_lost), 1, "{kpa} kPa, {stop_ms}, {fall_ms}");
            board.step(Command::Acknowledge);
            board.run(1_000);
            assert_eq!(board.count(is_lost), 1);
            assert!(
                board
                    .last
                    .as_ref()
                    .is_some_and(|last| !last.indicators.lost)
            );
        }
    }
}

#[test]
fn a_gauge_that_has_failed_is_no_finger_that_touches() {
    let mut board = MockBoard::holding(Settings::default());
    board.gauges[0] = GaugeState::Open;
    board.run(100);
    board.step(Command::Release);
    board.run(1_500);
    let touching = |board: &MockBoard| board.last.as_ref().map(|last| last.snapshot.touching);
    assert_eq!(touching(&board), Some([false; 3]));
    board.events.clear();
    // A dead finger and one other are no grip; two that live are.
    for (grip, holds) in [([1.0, 1.0, 0.0], false), ([1.0, 1.0, 1.0], true)] {
        board.grip = grip;
        board.step(GRIP);
        board.run(1_500);
        assert_eq!(board.count(is_holding), usize::from(holds), "{grip:?}");
        board.step(Command::Release);
        board.run(1_500);
    }
}

#[test]
fn a_grip_that_two_dead_gauges_could_not_judge_is_refused() {
    let mut board = MockBoard::new(Settings::default());
    board.gauges[0] = GaugeState::Open;
    board.gauges[1] = GaugeState::Short;
    board.run(100);
    board.step(Command::Acknowledge);
    board.run(100);
    let answer = board.step(GRIP).answer;
    assert_eq!(answer, Some(Answer::Refused(Refusal::FaultLatched)));
}

#[test]
fn released_is_said_of_what_was_touched_alone() {
    for (grip, released) in [([0.0; 3], 0), ([1.0; 3], 1)] {
        for ms in [1, 60, 400, 2_000] {
            let mut board = MockBoard::new(Settings::default());
            board.grip = grip;
            board.step(GRIP);
            board.run(ms);
            let touched = board
                .last
                .as_ref()
                .is_some_and(|last| last.snapshot.touching != [false; 3]);
            board.step(Command::Release);
            board.run(2_000);
            let said = board.count(|event| *event == Event::Released);
            assert_eq!(said, released * usize::from(touched), "{grip:?}, {ms} ms");
        }
    }
}

#[test]
fn a_supply_gap_is_ridden_through_for_19_ms_and_a_fault_at_20() {
    for (gap_ms, faults) in [(10, 0), (19, 0), (20, 1)] {
        let mut board = holding_with(OnFault::Hold);
        board.supply_v = 15.0;
        board.run(gap_ms);
        board.supply_v = 24.0;
        board.run(500);
        let told = board.count(is_fault(Fault::SupplyLow));
        assert_eq!(told, faults, "{gap_ms} ms");
    }
}

#[test]
fn a_new_rise_never_starts_above_the_pressure_that_is_measured() {
    // Regulators that are slower and faster than the settings say.
    for lag_ms in [20.0, 60.0, 200.0] {
        for turn_ms in [20, 60, 100, 150, 250] {
            let mut board = MockBoard::holding(Settings::default());
            board.valve_lag_ms = lag_ms;
            board.step(Command::Release);
            board.run(turn_ms);
            let mut before = board.commanded_kpa();
            for ms in 0..200 {
                board.step(if ms == 0 { GRIP } else { Command::Continue });
                let now = board.commanded_kpa();
                // 0.4 kPa of slew, 0.8 kPa of proportional action, 0.2 kPa of rounding and noise.
                let most = before.max(board.pressure_kpa) + 1.4;
                assert!(now <= most, "{lag_ms}, {turn_ms}: {now} after {before}");
                before = now;
            }
        }
    }
}

#[test]
fn a_halt_keeps_the_pressure_of_a_rise_and_changes_nothing_else() {
    for ms in [80, 150, 250] {
        let mut board = MockBoard::new(Settings::default());
        board.step(GRIP);
        board.run(ms);
        let there = board.pressure_kpa;
        assert_eq!(board.step(Command::Halt).answer, Some(Answer::Accepted));
        board.run(1_500);
        let now = board.pressure_kpa;
        assert!((now - there).abs() < 3.0, "{ms} ms: {there} became {now}");
        assert!(matches!(board.state(), State::Empty { .. }));
        // The same grip is a new one after it.
        assert_eq!(board.step(GRIP).answer, Some(Answer::Accepted));
    }
    // Too little to close anything is let out.
    let mut board = MockBoard::new(Settings::default());
    board.step(GRIP);
    board.step(Command::Halt);
    board.run(500);
    assert_eq!(board.state(), State::Idle);
    // On the way to another pressure the hold goes on.
    let mut board = MockBoard::holding(Settings::default());
    board.step(Command::Grip(Grip::Pressure(Kilopascals(158.0))));
    board.run(20);
    assert!(board.step(Command::Halt).indicators.holding);
    board.run(1_000);
    assert!(matches!(board.state(), State::Holding { .. }));
    board.drop_object();
    assert_eq!(board.count(is_lost), 1);
    // Elsewhere there is nothing to halt.
    for command in [Command::Release, Command::Stop, Command::Continue] {
        let mut board = MockBoard::holding(Settings::default());
        board.step(command);
        let state = board.state();
        let halted = board.step(Command::Halt);
        assert_eq!(halted.answer, Some(Answer::Unchanged));
        assert_eq!(halted.snapshot.state, state);
    }
}

#[test]
fn a_set_point_moves_by_the_share_of_the_slew_that_was_asked_for() {
    for (asked, share) in [
        (0.1, 0.1),
        (0.5, 0.5),
        (1.0, 1.0),
        (2.0, 1.0),
        (f32::NAN, 1.0),
        (0.0, 0.01),
        (-1.0, 0.01),
        (f32::NEG_INFINITY, 0.01),
    ] {
        let mut board = MockBoard::new(Settings::default());
        board.step(Command::Slew(asked));
        board.step(GRIP);
        board.run(50);
        let before = board.step(Command::Continue).snapshot.setpoint.0;
        let moved = board.step(Command::Continue).snapshot.setpoint.0 - before;
        // 400 kPa/s.
        assert!((moved - 0.4 * share).abs() < 1e-4, "{asked}: {moved}");
    }
}

#[test]
fn every_command_has_one_answer_and_no_command_has_none() {
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0; 3];
    assert_eq!(board.step(Command::Continue).answer, None);
    let accepted = Some(Answer::Accepted);
    let unchanged = Some(Answer::Unchanged);
    for (command, expected) in [
        (Command::Alive, accepted),
        (Command::Acknowledge, accepted),
        (Command::Acknowledge, unchanged),
        (Command::Tare, accepted),
        (Command::Tare, unchanged),
        (Command::Slew(0.5), accepted),
        (Command::Halt, unchanged),
        (Command::Release, unchanged),
        (GRIP, accepted),
        (GRIP, unchanged),
        (Command::Tare, Some(Answer::Refused(Refusal::NotIdle))),
        (Command::Stop, accepted),
        (GRIP, Some(Answer::Refused(Refusal::FaultLatched))),
        (GRIP, Some(Answer::Refused(Refusal::FaultLatched))),
        (Command::Acknowledge, accepted),
        (GRIP, accepted),
        (Command::Release, accepted),
    ] {
        if command == Command::Stop {
            board.run(300);
        }
        assert_eq!(board.step(command).answer, expected, "{command:?}");
    }
    // Said once, however often it was asked.
    assert_eq!(board.count(refused(Refusal::FaultLatched)), 1);
}

//! What the controller must do on a mocked board; every test is named after the behaviour it pins.

use crate::mock::{GaugeState, MockBoard, adjusted};
use softgrip::command::Refusal;
use softgrip::detect::LossCause;
use softgrip::fault::Fault;
use softgrip::grasp::State;
use softgrip::settings::{OnFault, OnLoss, Settings};
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;
use softgrip::{Command, Grip};

fn is_lost(event: &Event) -> bool {
    matches!(event, Event::Lost(_))
}

fn is_fault(wanted: Fault) -> impl Fn(&Event) -> bool {
    move |event| matches!(event, Event::Fault { fault, .. } if *fault == wanted)
}

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));

#[test]
fn a_grasp_is_contact_then_holding_and_each_is_said_once() {
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0; 3];
    board.step(GRIP);
    board.run(3_000);
    for finger in 0..3 {
        assert_eq!(board.count(|event| *event == Event::Contact { finger }), 1);
    }
    assert_eq!(board.events.len(), 4, "{:?}", board.events);
    assert!(matches!(
        board.events[3].1,
        Event::Holding {
            touching: [true, true, true]
        }
    ));
    assert!(
        board
            .last
            .as_ref()
            .is_some_and(|last| last.indicators.holding)
    );
}

#[test]
fn an_empty_close_is_told_from_a_grasp_within_200_ms_of_reaching_the_set_point() {
    let mut board = MockBoard::new(Settings::default());
    board.step(GRIP);
    while (board.pressure_kpa - 140.0).abs() > 3.0 {
        board.run(1);
    }
    let reached = board.now_ms();
    board.run(1_000);
    let empty = board.first(|event| *event == Event::Empty);
    assert!(
        empty.is_some_and(|ms| ms - reached <= 200),
        "{:?}",
        board.events
    );
    assert_eq!(board.events.len(), 1, "{:?}", board.events);
}

#[test]
fn a_dropped_object_is_reported_once_within_20_ms_and_stays_latched() {
    let mut board = MockBoard::holding(Settings::default());
    let dropped = board.now_ms();
    board.drop_object();
    board.run(2_000);
    assert_eq!(board.count(is_lost), 1);
    // The drop begins at full grip: 90 % is reached 4 ms later.
    let lost = board.first(is_lost).expect("a loss");
    assert!(lost - dropped <= 4 + 20, "{} ms", lost - dropped);
    assert!(board.last.as_ref().is_some_and(|last| last.indicators.lost));

    board.step(Command::Release);
    board.run(2_000);
    assert!(board.last.as_ref().is_some_and(|last| last.indicators.lost));
    assert_eq!(board.count(|event| *event == Event::Released), 0);
    board.step(GRIP);
    assert_eq!(
        board.count(|event| *event == Event::Refused(Refusal::LostLatched)),
        1
    );
    board.step(Command::Acknowledge);
    let indicators = board.step(Command::Continue).indicators;
    assert!(indicators.ready && !indicators.lost);
}

#[test]
fn a_latched_loss_says_when_how_and_by_which_fingers() {
    let mut board = MockBoard::holding(Settings::default());
    board.drop_object();
    board.run(100);
    let loss = board.last.as_ref().and_then(|last| last.snapshot.lost);
    let loss = loss.expect("a latched loss");
    assert_eq!(loss.cause, LossCause::Collapse);
    assert!(loss.latency_us() <= 20_000, "{} µs", loss.latency_us());
    for fall in loss.evidence {
        assert!(
            fall.is_some_and(|fall| (0.1..0.9).contains(&fall)),
            "{fall:?}"
        );
    }
}

#[test]
fn on_a_loss_the_fingers_stay_or_open_as_the_settings_say() {
    for (on_loss, kpa) in [(OnLoss::Hold, 140.0), (OnLoss::Vent, 0.0)] {
        let mut board = MockBoard::holding(adjusted(|s| s.grip.on_loss = on_loss));
        board.drop_object();
        board.grip = [0.0; 3];
        board.run(2_000);
        assert_eq!(board.count(is_lost), 1, "{on_loss:?}");
        assert!((board.pressure_kpa - kpa).abs() < 1.0, "{on_loss:?}");
        assert!(board.last.as_ref().is_some_and(|last| last.indicators.lost));
    }
}

#[test]
fn a_regrip_closes_harder_once_and_says_whether_something_is_there() {
    let settings = adjusted(|s| {
        s.grip.on_loss = OnLoss::Regrip;
        s.grip.regrip_raise_kpa = 15.0;
    });
    let mut board = MockBoard::holding(settings);
    let fall = |board: &mut MockBoard| {
        board.drop_object();
        board.grip = [0.0; 3];
    };
    fall(&mut board);
    assert_eq!(board.count(|event| *event == Event::Regripping), 1);
    // It is caught again ...
    for ms in 0..50 {
        board.grip = [ms as f32 / 50.0; 3];
        board.run(1);
    }
    board.run(2_000);
    assert_eq!(
        board.count(|event| matches!(event, Event::Holding { .. })),
        1
    );
    assert!((board.pressure_kpa - 155.0).abs() < 1.0);
    assert!(board.last.as_ref().is_some_and(|last| last.indicators.lost));
    // ... and lost again: said again, without a second attempt.
    fall(&mut board);
    board.run(2_000);
    assert_eq!(board.count(is_lost), 2);
    assert_eq!(board.count(|event| *event == Event::Regripping), 1);
    assert!(matches!(board.state(), State::Empty { .. }));

    // Nothing to catch: closed on nothing, and no second loss.
    let mut board = MockBoard::holding(settings);
    fall(&mut board);
    board.run(2_000);
    assert_eq!(board.count(is_lost), 1);
    assert_eq!(board.count(|event| *event == Event::Empty), 1);

    // Never above the limit.
    let mut board = MockBoard::holding({
        let mut settings = settings;
        settings.regulator.max_pressure_kpa = 150.0;
        settings
    });
    fall(&mut board);
    board.run(2_000);
    assert!((board.state().target().0 - 150.0).abs() < 1e-3);
}

#[test]
fn a_grasp_with_two_fingers_is_reported_as_such_and_its_loss_is_told() {
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0, 0.0, 1.0];
    board.step(GRIP);
    board.run(2_000);
    let partial = Event::Holding {
        touching: [true, false, true],
    };
    assert_eq!(
        board.count(|event| *event == partial),
        1,
        "{:?}",
        board.events
    );
    for ms in 0..80 {
        let fall = (1.0 - ms as f32 / 44.0).max(0.14);
        board.grip = [fall, 0.0, fall];
        board.run(1);
    }
    assert_eq!(board.count(is_lost), 1);
}

#[test]
fn a_host_that_falls_silent_is_a_fault_and_without_a_timeout_it_may() {
    let mut board = MockBoard::holding(Settings::default());
    board.run(5_000);
    assert!(board.events.is_empty(), "{:?}", board.events);

    // With open fingers it may, for a robot may start later.
    let mut board = MockBoard::new(adjusted(|s| s.grip.host_timeout_ms = 50.0));
    board.run(5_000);
    assert!(board.events.is_empty(), "{:?}", board.events);
    board.step(Command::Grip(Grip::Default));
    for _ in 0..500 {
        board.step(Command::Alive);
    }
    let spoke = board.now_ms();
    board.run(100);
    let silent = board.first(is_fault(Fault::HostSilent));
    assert_eq!(silent, Some(spoke + 51));
}

#[test]
fn a_commanded_release_is_released_and_never_lost() {
    let mut board = MockBoard::holding(Settings::default());
    board.step(Command::Release);
    // The object leaves in the very tick of the command, as fast as any drop.
    board.drop_object();
    board.run(2_000);
    assert_eq!(board.count(is_lost), 0);
    assert_eq!(board.count(|event| *event == Event::Released), 1);
    assert_eq!(board.state(), State::Idle);
}

#[test]
fn a_burst_hose_is_an_air_loss_within_50_ms_and_never_lost() {
    let mut board = MockBoard::holding(Settings::default());
    board.leak_kpa = 0.0;
    let burst = board.now_ms();
    board.run(2_000);
    let reported = board
        .first(|event| *event == Event::AirLoss)
        .expect("an air loss");
    assert!(reported - burst <= 50, "{} ms", reported - burst);
    assert_eq!(board.count(is_lost), 0);
    assert_eq!(board.count(is_fault(Fault::AirLoss)), 1);
}

#[test]
fn a_slow_leak_is_an_air_loss_and_never_lost() {
    let mut board = MockBoard::holding(Settings::default());
    for tick in 0..20_000 {
        board.leak_kpa = 140.0 - tick as f32 / 200.0;
        board.run(1);
    }
    assert_eq!(board.count(|event| *event == Event::AirLoss), 1);
    assert_eq!(board.count(is_lost), 0);
}

#[test]
fn a_regulator_that_never_follows_is_a_fault() {
    let mut board = MockBoard::new(Settings::default());
    board.valve_stuck = true;
    board.step(GRIP);
    board.run(1_000);
    // 8 kPa of deviation are reached 60 ms into the ramp, and 300 ms are allowed from there.
    let fault = board.first(is_fault(Fault::NotFollowing));
    assert!(fault.is_some_and(|ms| ms <= 450), "{:?}", board.events);
}

#[test]
fn a_supply_that_falls_short_by_less_than_a_fault_still_grips_and_still_tells_a_loss() {
    let mut board = MockBoard::new(Settings::default());
    board.leak_kpa = 134.0;
    board.grip = [1.0; 3];
    board.step(GRIP);
    board.run(2_000);
    assert_eq!(
        board.count(|event| matches!(event, Event::Holding { .. })),
        1
    );
    board.drop_object();
    assert_eq!(board.count(is_lost), 1);
}

#[test]
fn over_pressure_vents_in_the_same_tick_even_where_faults_hold() {
    let mut board = MockBoard::holding(adjusted(|s| s.grip.on_fault = OnFault::Hold));
    board.pressure_kpa = 180.0;
    let outputs = board.step(Command::Continue);
    assert_eq!(outputs.dac.0, 0);
    assert_eq!(board.count(is_fault(Fault::OverPressure)), 1);
}

#[test]
fn stop_acts_in_its_tick_and_does_what_the_settings_say() {
    for (on_fault, vents) in [(OnFault::Vent, true), (OnFault::Hold, false)] {
        let mut board = MockBoard::holding(adjusted(|s| s.grip.on_fault = on_fault));
        let outputs = board.step(Command::Stop);
        assert_eq!(outputs.dac.0 == 0, vents, "{on_fault:?}");
        board.run(1_000);
        assert_eq!(board.pressure_kpa < 10.0, vents, "{on_fault:?}");
        assert_eq!(board.count(is_fault(Fault::Stopped)), 1);
        board.step(GRIP);
        assert_eq!(
            board.count(|event| *event == Event::Refused(Refusal::FaultLatched)),
            1
        );
    }
}

#[test]
fn acknowledging_a_fault_does_not_drop_what_is_held() {
    let mut board = MockBoard::holding(adjusted(|s| s.grip.on_fault = OnFault::Hold));
    board.step(Command::Stop);
    board.run(500);
    board.step(Command::Acknowledge);
    board.run(1_000);
    assert!((board.pressure_kpa - 140.0).abs() < 3.0);
    assert!(matches!(board.state(), State::Holding { .. }));
    assert_eq!(board.count(is_lost), 0);
}

#[test]
fn one_failed_gauge_is_reported_and_two_fingers_still_tell_a_loss() {
    for bad in [GaugeState::Open, GaugeState::Short, GaugeState::Stuck] {
        let mut board = MockBoard::holding(Settings::default());
        board.gauges[1] = bad;
        let broken = board.now_ms();
        board.run(500);
        let reported = board
            .first(|event| {
                matches!(
                    event,
                    Event::Fault {
                        finger: Some(1),
                        ..
                    }
                )
            })
            .expect("a gauge fault");
        assert!(reported - broken <= 20, "{bad:?}: {} ms", reported - broken);
        assert!(matches!(board.state(), State::Holding { .. }), "{bad:?}");
        assert_eq!(board.count(is_lost), 0, "{bad:?}");
        board.drop_object();
        assert_eq!(board.count(is_lost), 1, "{bad:?}");
    }
}

#[test]
fn two_failed_gauges_are_a_fault_because_losses_would_go_unseen() {
    let mut board = MockBoard::holding(Settings::default());
    board.gauges[0] = GaugeState::Open;
    board.gauges[2] = GaugeState::Open;
    board.run(10);
    assert!(matches!(
        board.state(),
        State::Fault {
            fault: Fault::GaugeOpen,
            ..
        }
    ));
}

#[test]
fn late_frames_are_bridged_for_four_ticks_and_a_fault_at_the_fifth() {
    let mut board = MockBoard::holding(Settings::default());
    board.late = true;
    board.run(4);
    board.late = false;
    board.run(10);
    assert!(board.events.is_empty(), "{:?}", board.events);
    board.late = true;
    board.run(5);
    assert_eq!(board.count(is_fault(Fault::AdcStale)), 1);
}

#[test]
fn a_sagging_supply_is_a_fault_and_a_dip_is_not() {
    let mut board = MockBoard::holding(Settings::default());
    board.supply_v = 15.0;
    board.run(5);
    board.supply_v = 24.0;
    board.run(50);
    assert!(board.events.is_empty(), "{:?}", board.events);
    board.supply_v = 15.0;
    board.run(20);
    assert_eq!(board.count(is_fault(Fault::SupplyLow)), 1);
}

#[test]
fn a_restart_under_pressure_vents_without_a_false_fault() {
    for noise in [0.0, 30.0] {
        let mut board = MockBoard::new(Settings::default());
        board.noise_ue = noise;
        board.inflate(140.0);
        board.run(2_000);
        assert!(board.events.is_empty(), "{:?}", board.events);
        assert!(board.pressure_kpa < 1.0);
    }
}

#[test]
fn a_supply_that_comes_late_is_no_fault() {
    let mut board = MockBoard::new(Settings::default());
    board.supply_v = 0.0;
    board.run(900);
    board.supply_v = 24.0;
    board.run(500);
    assert!(board.events.is_empty(), "{:?}", board.events);
}

#[test]
fn an_object_that_vanishes_while_the_pressure_changes_is_lost() {
    let mut board = MockBoard::holding(Settings::default());
    board.step(Command::Grip(Grip::Pressure(Kilopascals(150.0))));
    board.run(5);
    board.drop_object();
    board.grip = [0.0; 3];
    board.run(1_000);
    assert_eq!(board.count(is_lost), 1);
}

//! Every fault in every state: how soon it is seen, what is latched, what the output does, what
//! clears it, and that none of them is ever taken for a lost object.

use crate::mock::{GaugeState, MockBoard, adjusted};
use softgrip::fault::{Fault, RULES, Rule, SafeOutput};
use softgrip::frontend::RAIL;
use softgrip::grasp::State;
use softgrip::settings::{OnFault, Settings};
use softgrip::table::FINGER;
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, Kilopascals, Millivolts};
use softgrip::{Command, Controller, Grip, RawFrame};

/// The states in the order of [`softgrip::fault::Rule::shows`].
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Idle,
    Closing,
    Holding,
    Empty,
    Sweeping,
    Releasing,
    Fault,
}

const PLACES: [Place; 7] = [
    Place::Idle,
    Place::Closing,
    Place::Holding,
    Place::Empty,
    Place::Sweeping,
    Place::Releasing,
    Place::Fault,
];

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));

/// A board whose host speaks, in a state.
fn board_in(place: Place, on_fault: OnFault) -> MockBoard {
    let mut board = MockBoard::new(adjusted(|s| {
        s.grip.on_fault = on_fault;
        s.grip.host_timeout_ms = 200.0;
    }));
    alive(&mut board, 1_100);
    let empty = matches!(place, Place::Empty | Place::Sweeping);
    board.grip = [if empty { 0.0 } else { 1.0 }; 3];
    if place == Place::Sweeping {
        board.step(Command::Sweep);
        alive(&mut board, 5_000);
    } else if place != Place::Idle {
        board.step(GRIP);
        alive(
            &mut board,
            if place == Place::Closing { 250 } else { 1_500 },
        );
    }
    match place {
        Place::Releasing => {
            board.step(Command::Release);
            alive(&mut board, 30);
        }
        Place::Fault => {
            board.step(Command::Stop);
        }
        Place::Idle | Place::Closing | Place::Holding | Place::Empty | Place::Sweeping => {}
    }
    let found = match board.state() {
        State::Idle => Place::Idle,
        State::Closing { .. } => Place::Closing,
        State::Holding { .. } => Place::Holding,
        State::Empty { .. } => Place::Empty,
        State::Sweeping { .. } => Place::Sweeping,
        State::Releasing { .. } => Place::Releasing,
        State::Fault { .. } => Place::Fault,
    };
    assert_eq!(found, place);
    board.events.clear();
    board
}

/// Ticks in which the host speaks.
fn alive(board: &mut MockBoard, ms: u64) {
    for _ in 0..ms {
        board.step(Command::Alive);
    }
}

/// Makes it happen; gives what the robot says from now on.
fn cause(board: &mut MockBoard, fault: Fault, place: Place) -> Command {
    let two = |board: &mut MockBoard, state| {
        board.gauges[0] = state;
        board.gauges[2] = state;
    };
    let mut force = |kpa: f32| {
        board.pressure_kpa = kpa;
        board.valve_forced_kpa = Some(kpa);
    };
    match fault {
        Fault::OverPressure => force(180.0),
        Fault::NotFollowing => force(match place {
            Place::Idle => 60.0,
            Place::Closing | Place::Holding | Place::Empty | Place::Sweeping | Place::Fault => {
                155.0
            }
            Place::Releasing => 160.0,
        }),
        Fault::AirLoss => board.leak_kpa = 0.0,
        Fault::MonitorHigh => board.monitor_wire = Some(AdcCode(65_000)),
        Fault::MonitorLost => board.monitor_wire = Some(AdcCode(0)),
        Fault::SupplyLow => board.supply_v = 15.0,
        Fault::RailOff => board.rail = Millivolts(3_100),
        Fault::GaugeOpen => two(board, GaugeState::Open),
        Fault::GaugeShort => two(board, GaugeState::Short),
        Fault::GaugeStuck => two(board, GaugeState::Stuck),
        Fault::GaugeSaturated => two(board, GaugeState::Saturated),
        Fault::GaugeJump => two(board, GaugeState::Offset(-9_000.0)),
        // 5 200 µε rms.
        Fault::GaugeNoisy => two(board, GaugeState::Noisy(3_000.0)),
        Fault::AdcStale => board.late = true,
        Fault::AdcOverrun => board.overrun = true,
        Fault::Stopped => return Command::Stop,
        Fault::HostSilent => return Command::Continue,
        Fault::SettingsInvalid | Fault::Internal => unreachable!("they show at the start alone"),
    }
    Command::Alive
}

fn repair(board: &mut MockBoard) {
    board.gauges = [GaugeState::Good; 3];
    board.leak_kpa = f32::MAX;
    board.valve_forced_kpa = None;
    board.monitor_wire = None;
    board.late = false;
    board.overrun = false;
    board.supply_v = 24.0;
    board.rail = RAIL;
}

/// What the settings of [`board_in`] add to the time of a rule, ms.
fn allowance_ms(fault: Fault) -> u64 {
    match fault {
        Fault::NotFollowing => 300,
        Fault::HostSilent => 200,
        _ => 0,
    }
}

/// The latched fault.
fn latched(board: &MockBoard) -> Option<Fault> {
    match board.state() {
        State::Fault { fault, .. } => Some(fault),
        _ => None,
    }
}

fn is(wanted: Fault) -> impl Fn(&Event) -> bool {
    move |event| matches!(event, Event::Fault { fault, finger: None } if *fault == wanted)
}

fn lost(board: &MockBoard) -> usize {
    board.count(|event| matches!(event, Event::Lost(_)))
}

fn walk(fault: Fault, place: Place, on_fault: OnFault) {
    let what = format!("{fault:?} in {place:?}, {on_fault:?}");
    let rule = fault.rule();
    let vents = on_fault == OnFault::Vent || rule.output == SafeOutput::Vent;
    let mut board = board_in(place, on_fault);
    let before = board.state().target().0;
    let said = cause(&mut board, fault, place);

    // Seen in time, and the output is safe in the same tick.
    let most = u64::from(rule.within_ms) + allowance_ms(fault);
    let already = place == Place::Fault;
    if already && !vents && rule.watches {
        // Nothing is left to take away.
        for _ in 0..most + 100 {
            board.step(said);
        }
        assert_eq!(latched(&board), Some(Fault::Stopped), "{what}");
        assert_eq!(lost(&board), 0, "{what}");
        return;
    }
    let took = (1..=most).find(|_| {
        board.step(said);
        board.count(is(fault)) > 0
    });
    assert!(
        took.is_some(),
        "{what}: not in {most} ms: {:?}",
        board.events
    );
    let code = if already { Fault::Stopped } else { fault };
    assert_eq!(latched(&board), Some(code), "{what}");
    if vents {
        assert_eq!(board.commanded_kpa(), 0.0, "{what}");
    }
    let there = board.pressure_kpa;

    // It stays so, is said once, and is no loss.
    for _ in 0..600 {
        board.step(said);
    }
    assert_eq!(board.count(is(fault)), 1, "{what}");
    assert_eq!(latched(&board), Some(code), "{what}");
    assert_eq!(lost(&board), 0, "{what}: {:?}", board.events);
    let kept = board.state().target().0;
    match (vents, place) {
        (true, _) => assert_eq!(kept, 0.0, "{what}"),
        // On its way up, the pressure that is there; without a measurement, the one that should be.
        (false, Place::Closing) => {
            let most = match fault {
                Fault::MonitorLost | Fault::AdcStale | Fault::AdcOverrun => 8.0,
                _ => 0.1,
            };
            assert!((kept - there.min(before)).abs() <= most, "{what}: {kept}");
        }
        // Nothing is in the grip.
        (false, Place::Sweeping) => assert_eq!(kept, 0.0, "{what}"),
        (false, _) => assert_eq!(kept, before, "{what}"),
    }
    // 10 kPa of trim and 0.8 kPa of proportional action at the most.
    assert!((board.commanded_kpa() - kept).abs() <= 11.0, "{what}");

    // An acknowledgement does not clear what still is.
    board.step(Command::Acknowledge);
    for _ in 0..most.max(300) + 100 {
        board.step(said);
    }
    // Without pressure, an empty hose and a dead wire look like what they should, and nobody need speak; and a step has
    // been made once and for all.
    let vanished = match fault {
        Fault::AirLoss | Fault::MonitorLost | Fault::HostSilent => kept <= 0.0,
        Fault::GaugeJump => true,
        _ => false,
    };
    assert!(
        vanished || latched(&board).is_some(),
        "{what}: cleared too early"
    );

    // It clears what has been repaired.
    repair(&mut board);
    alive(&mut board, 600);
    board.step(Command::Acknowledge);
    alive(&mut board, 600);
    assert_eq!(latched(&board), None, "{what}: {:?}", board.events);
    assert_eq!(lost(&board), 0, "{what}: {:?}", board.events);
}

#[test]
fn every_fault_in_every_state_is_seen_in_time_safe_latched_and_cleared() {
    for Rule { fault, shows, .. } in RULES {
        for (place, shows) in PLACES.into_iter().zip(shows) {
            if shows && !(place == Place::Fault && fault == Fault::Stopped) {
                for on_fault in [OnFault::Hold, OnFault::Vent] {
                    // A vented fault has nothing left to lose.
                    if place != Place::Fault || on_fault == OnFault::Hold {
                        walk(fault, place, on_fault);
                    }
                }
            }
        }
    }
}

#[test]
fn what_the_table_calls_invisible_says_nothing() {
    for Rule { fault, shows, .. } in RULES {
        for (place, shows) in PLACES.into_iter().zip(shows) {
            if !shows && !matches!(fault, Fault::SettingsInvalid | Fault::Internal) {
                let mut board = board_in(place, OnFault::Hold);
                let said = cause(&mut board, fault, place);
                for _ in 0..500 {
                    board.step(said);
                }
                assert_eq!(board.count(is(fault)), 0, "{fault:?} in {place:?}");
                assert_eq!(lost(&board), 0, "{fault:?} in {place:?}");
            }
        }
    }
}

#[test]
fn a_program_that_had_to_restart_starts_safe_and_says_so() {
    for fault in [Fault::Internal, Fault::SettingsInvalid] {
        let active = Settings::default()
            .validate(&FINGER)
            .expect("good settings");
        let mut board = MockBoard::new(Settings::default());
        board.controller = Controller::starting_with(Some(fault), &FINGER, active);
        board.step(GRIP);
        board.run(100);
        assert_eq!(board.count(is(fault)), 1);
        assert_eq!(board.commanded_kpa(), 0.0);
        board.step(Command::Acknowledge);
        board.run(100);
        let expected = (!fault.rule().acknowledges).then_some(fault);
        assert_eq!(latched(&board), expected);
    }
}

#[test]
fn the_numbers_of_all_faults_differ_and_rise() {
    let codes = RULES.map(|rule| rule.fault.code());
    assert!(codes.is_sorted_by(|a, b| a < b), "{codes:?}");
    for rule in RULES {
        assert_eq!(*rule.fault.rule(), rule);
    }
}

#[test]
fn an_object_that_falls_during_a_stop_that_holds_is_still_reported() {
    let mut board = board_in(Place::Fault, OnFault::Hold);
    for ms in 0..80 {
        board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
        board.step(Command::Stop);
    }
    assert_eq!(lost(&board), 1);
    assert_eq!(latched(&board), Some(Fault::Stopped));
}

#[test]
fn a_frame_that_is_all_zero_is_no_panic_and_no_loss() {
    let mut board = board_in(Place::Holding, OnFault::Hold);
    for _ in 0..100 {
        let now = softgrip::units::Instant::from_micros(board.now_us);
        board.now_us += 1_000;
        let frame = RawFrame::default();
        let outputs = board.controller.step(now, &frame, Command::Continue);
        assert!(
            !outputs
                .events
                .iter()
                .any(|event| matches!(event, Event::Lost(_)))
        );
    }
}

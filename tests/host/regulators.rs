//! Regulators other than the one that the settings describe: faster, slower, with a slew limit of their own and
//! with a dead time.

use crate::mock::MockBoard;
use fastrand::Rng;
use softgrip::fault::Fault;
use softgrip::frontend::FrontEnd;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;
use softgrip::{Command, Grip};

fn grip(kpa: f32) -> Command {
    Command::Grip(Grip::Pressure(Kilopascals(kpa)))
}

fn is_wrong(event: &Event) -> bool {
    matches!(
        event,
        Event::Fault { .. } | Event::AirLoss | Event::Lost(_) | Event::Slip { .. }
    )
}

/// A board with a regulator of 20 to 200 ms, a slew from 100 kPa/s to none, and a dead time of up to 150 ms.
fn any_board(rng: &mut Rng) -> MockBoard {
    let mut board = MockBoard::new(Settings::default());
    board.seed(rng.u32(1..));
    board.valve_lag_ms = 20.0 * 10f32.powf(rng.f32());
    board.valve_slew_kpa = match rng.u8(..3) {
        0 => f32::MAX,
        _ => 0.1 * 50f32.powf(rng.f32()),
    };
    board.valve_dead_ms = match rng.u8(..3) {
        0 => 0,
        _ => rng.u8(..=150),
    };
    board
}

fn named(board: &MockBoard) -> String {
    format!(
        "lag {} ms, slew {} kPa/ms, dead time {} ms: {:?}",
        board.valve_lag_ms, board.valve_slew_kpa, board.valve_dead_ms, board.events
    )
}

#[test]
fn no_regulator_that_works_is_a_fault_and_every_grip_is_judged() {
    let mut rng = Rng::with_seed(14);
    for _ in 0..1_000 {
        let mut board = any_board(&mut rng);
        let kpa = |rng: &mut Rng| 90.0 + 65.0 * rng.f32();
        board.grip = match rng.u8(..4) {
            0 => [0.0; 3],
            _ => [1.0; 3],
        };
        let held = board.grip[0] > 0.0;
        board.run(100);
        board.step(grip(kpa(&mut rng)));
        board.run(4_500);
        let seen = |board: &MockBoard, event: fn(&Event) -> bool| board.count(event);
        let judged = match held {
            true => seen(&board, |event| matches!(event, Event::Holding { .. })),
            false => seen(&board, |event| matches!(event, Event::Empty)),
        };
        assert_eq!(judged, 1, "{}", named(&board));
        if held {
            board.step(grip(kpa(&mut rng)));
            board.run(4_000);
        }
        board.step(Command::Release);
        board.run(4_000);
        assert_eq!(board.count(is_wrong), 0, "{}", named(&board));
        assert!(board.pressure_kpa < 1.0, "{}", named(&board));
    }
}

#[test]
fn a_regulator_that_stops_on_its_way_is_a_fault_after_300_ms_however_slow_it_was() {
    let mut rng = Rng::with_seed(15);
    let mut late = 0;
    for _ in 0..200 {
        let mut board = any_board(&mut rng);
        board.grip = [1.0; 3];
        board.step(grip(140.0));
        while board.valve_kpa() < 50.0 {
            board.run(1);
        }
        board.valve_stuck = true;
        let stuck = board.now_ms();
        // The air behind the valve goes on; the monitor shows it until it changes by less than a code.
        let mut still = None;
        for _ in 0..2_500 {
            board.run(1);
            let behind = (board.valve_kpa() - board.pressure_kpa).abs();
            if still.is_none() && behind < FrontEnd::REFERENCE.monitor_kpa_per_code {
                still = Some(board.now_ms());
            }
        }
        let told = board.first(|event| {
            matches!(
                event,
                Event::Fault {
                    fault: Fault::NotFollowing,
                    ..
                }
            )
        });
        let latest = still.expect("the air has come to rest") + 300;
        assert!(told.is_some_and(|ms| ms <= latest), "{}", named(&board));
        // Five time constants, unless the last 3 kPa of progress come later still.
        let usual = stuck + 300 + 5 * board.valve_lag_ms as u64 + 50;
        late += u32::from(told.is_some_and(|ms| ms > usual));
    }
    assert!(late <= 1, "{late}");
}

#[test]
fn a_regulator_that_is_not_the_settings_is_learned_and_told_in_its_first_grip() {
    let mut rng = Rng::with_seed(16);
    let mut learned = 0;
    for _ in 0..200 {
        let mut board = any_board(&mut rng);
        board.grip = [1.0; 3];
        board.run(100);
        board.step(grip(140.0));
        board.run(4_500);
        // The set-point rises by 0.4 kPa/ms.
        let ramp_ms = 140.0 / board.valve_slew_kpa.min(0.4);
        let delay_ms =
            board.valve_lag_ms + f32::from(board.valve_dead_ms) + 0.5 * (ramp_ms - 350.0);
        let told = board.events.iter().find_map(|(_, event)| match *event {
            Event::Regulator { delay_ms } => Some(f32::from(delay_ms)),
            _ => None,
        });
        if let Some(told_ms) = told {
            learned += 1;
            let off = (told_ms - delay_ms).abs();
            assert!(
                off < 10.0 + 0.15 * delay_ms,
                "{delay_ms} ms: {}",
                named(&board)
            );
        } else {
            assert!(
                (40.0..140.0).contains(&delay_ms),
                "{delay_ms} ms: {}",
                named(&board)
            );
        }
    }
    assert!(learned > 100, "{learned}");
}

//! Settings that change while the controller runs, and what is known of each gauge.

use crate::mock::{GaugeState, MockBoard, adjusted};
use softgrip::command::Refusal;
use softgrip::frontend::FrontEnd;
use softgrip::grasp::State;
use softgrip::settings::{Active, Settings};
use softgrip::table::FINGER;
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, Kilopascals};
use softgrip::{Command, Controller, Grip};

fn active(settings: Settings) -> Active {
    settings.validate(&FINGER).expect("good settings")
}

#[test]
fn other_settings_leave_a_hold_as_it_is_and_judge_it_from_then_on() {
    let mut board = MockBoard::holding(Settings::default());
    let stricter = adjusted(|settings| {
        settings.regulator.slew_kpa_per_s = 50.0;
        settings.detection.slip_percent = 1.0;
        settings.gauge.tare_ue = [0.0; 3];
    });
    assert_eq!(board.controller.apply(active(stricter)), Ok(()));
    board.run(2_000);
    assert!(matches!(board.state(), State::Holding { .. }));
    assert_eq!(board.events, []);
    assert!((board.commanded_kpa() - 140.0).abs() < 3.0);
    // The new slew: 400 kPa/s would be there in 50 ms.
    board.step(Command::Grip(Grip::Pressure(Kilopascals(160.0))));
    board.run(100);
    assert!(board.commanded_kpa() < 150.0, "{}", board.commanded_kpa());
    board.run(2_000);
    board.drop_object();
    board.run(200);
    assert_eq!(board.count(|event| matches!(event, Event::Lost(_))), 1);
}

#[test]
fn a_lower_limit_waits_until_the_gripper_is_open() {
    let lower = active(adjusted(|settings| {
        settings.regulator.max_pressure_kpa = 100.0;
        settings.grip.grip_pressure_kpa = 90.0;
    }));
    let mut board = MockBoard::holding(Settings::default());
    assert_eq!(board.controller.apply(lower), Err(Refusal::NotIdle));
    assert_eq!(*board.controller.active(), active(Settings::default()));
    board.step(Command::Release);
    assert_eq!(board.controller.apply(lower), Err(Refusal::NotIdle));
    board.run(3_000);
    assert_eq!(board.state(), State::Idle);
    assert_eq!(board.controller.apply(lower), Ok(()));
    board.step(Command::Grip(Grip::Default));
    board.run(1_500);
    assert!((board.commanded_kpa() - 90.0).abs() < 3.0);
    assert_eq!(board.count(|event| matches!(event, Event::Fault { .. })), 0);
}

#[test]
fn a_tare_survives_a_restart_in_the_settings() {
    let offset = [GaugeState::Offset(-1_900.0); 3];
    // At once, before any drift could be followed.
    let felt = |settings: Settings| {
        let mut board = MockBoard::new(settings);
        board.gauges = offset;
        let [felt, ..] = board.step(Command::Continue).snapshot.residual;
        felt.expect("a usable gauge").0
    };
    assert!(felt(Settings::default()) > 1_800.0);
    let mut board = MockBoard::new(Settings::default());
    board.gauges = offset;
    board.run(100);
    board.step(Command::Tare);
    board.run(300);
    let tare_ue = board.controller.tare_ue();
    for tare in tare_ue {
        assert!((tare + 1_900.0).abs() < 20.0, "{tare_ue:?}");
    }
    let tared = adjusted(|settings| settings.gauge.tare_ue = tare_ue);
    assert_eq!(Controller::new(&FINGER, active(tared)).tare_ue(), tare_ue);
    assert!(felt(tared).abs() < 100.0);
}

#[test]
fn a_gauges_gain_scales_its_strain_and_not_where_its_amplifier_ends() {
    let settings = adjusted(|settings| settings.gauge.gain = [0.8, 1.0, 1.25]);
    let front_end = FrontEnd::of(&settings.front_end, settings.gauge.gain);
    let code = FrontEnd::REFERENCE.gauge_code(1, softgrip::units::Microstrain(4_000.0));
    let strains = front_end.strains(&[AdcCode(code as u16); 3]);
    for (strain, expected) in strains.into_iter().zip([3_200.0, 4_000.0, 5_000.0]) {
        assert!((strain.0 - expected).abs() < 5.0, "{strains:?}");
    }
    for gauge in 0..3 {
        let mut board = MockBoard::new(settings);
        board.run(100);
        board.gauges[gauge] = GaugeState::Saturated;
        board.run(20);
        let failed = |event: &Event| matches!(event, Event::Fault { finger: Some(finger), .. } if usize::from(*finger) == gauge);
        assert_eq!(board.count(failed), 1, "{gauge}: {:?}", board.events);
    }
}

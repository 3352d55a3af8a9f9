//! What must hold for any commands and any readings at all.

use crate::mock::{MockBoard, adjusted};
use proptest::prelude::*;
use softgrip::command::Motion;
use softgrip::frontend::FrontEnd;
use softgrip::grasp::{Purpose, State};
use softgrip::settings::{OnFault, OnLoss, Settings};
use softgrip::table::FINGER;
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, Degrees, Instant, Kilopascals};
use softgrip::{Command, Controller, Grip, RawFrame};

fn any_command() -> impl Strategy<Value = Command> {
    prop_oneof![
        8 => Just(Command::Continue),
        1 => Just(Command::Grip(Grip::Default)),
        1 => any::<u32>().prop_map(|bits| Command::Grip(Grip::Pressure(Kilopascals(f32::from_bits(bits))))),
        1 => (0.0f32..200.0).prop_map(|kpa| Command::Grip(Grip::Pressure(Kilopascals(kpa)))),
        1 => any::<u32>().prop_map(|bits| Command::Grip(Grip::Bend(Degrees(f32::from_bits(bits))))),
        1 => (0.0f32..100.0).prop_map(|deg| Command::Grip(Grip::Bend(Degrees(deg)))),
        1 => Just(Command::Release),
        1 => Just(Command::Stop),
        2 => Just(Command::Acknowledge),
        1 => Just(Command::Alive),
        1 => Just(Command::Motion(Motion::Still)),
        1 => Just(Command::Motion(Motion::Moving)),
        1 => Just(Command::Tare),
        1 => Just(Command::Halt),
        1 => any::<u32>().prop_map(|bits| Command::Slew(f32::from_bits(bits))),
    ]
}

fn any_frame() -> impl Strategy<Value = RawFrame> {
    (
        any::<[u16; 3]>(),
        any::<u16>(),
        any::<u16>(),
        0u16..3,
        prop::bool::weighted(0.05),
    )
        .prop_map(|(gauges, monitor, supply, scans, overrun)| RawFrame {
            gauges: gauges.map(AdcCode),
            monitor: AdcCode(monitor),
            supply: AdcCode(supply),
            rail: softgrip::frontend::RAIL,
            scans,
            overrun,
            carried: false,
        })
}

fn any_settings() -> impl Strategy<Value = Settings> {
    (
        prop::bool::ANY,
        prop_oneof![Just(OnLoss::Hold), Just(OnLoss::Vent), Just(OnLoss::Regrip)],
        prop_oneof![Just(0.0f32), Just(300.0)],
    )
        .prop_map(|(hold, on_loss, host_timeout_ms)| {
            adjusted(|s| {
                s.regulator.max_pressure_kpa = 150.0;
                s.grip.on_fault = if hold { OnFault::Hold } else { OnFault::Vent };
                s.grip.on_loss = on_loss;
                s.grip.host_timeout_ms = host_timeout_ms;
            })
        })
}

/// Whether an object can be lost from here: it is held, or was when the set-point changed.
fn can_lose(state: &State) -> bool {
    state.is_holding()
        || matches!(
            state,
            State::Closing {
                purpose: Purpose::Change,
                ..
            }
        )
}

/// Whether the diagram in `src/grasp.rs` has a way from one state to the other.
fn follows(from: &State, to: &State) -> bool {
    use State::{Closing, Empty, Fault, Holding, Idle, Releasing};
    match (from, to) {
        (_, Fault { .. } | Closing { .. }) => true,
        (Idle, Idle) => true,
        (Closing { .. }, Holding { .. } | Empty { .. } | Releasing { .. }) => true,
        (Holding { .. }, Holding { .. } | Empty { .. } | Releasing { .. }) => true,
        (Empty { .. }, Empty { .. } | Releasing { .. }) => true,
        (Releasing { .. }, Releasing { .. } | Idle) => true,
        // An acknowledged fault may find the fingers open in the same tick.
        (Fault { .. }, Releasing { .. } | Idle) => true,
        _ => false,
    }
}

proptest! {
    #[test]
    fn any_input_keeps_the_limits_and_the_diagram(
        inputs in prop::collection::vec((any_frame(), any_command(), 1u16..400), 1..40),
        jump_us in 0u64..10_000,
        settings in any_settings(),
    ) {
        let front_end = FrontEnd::REFERENCE;
        let active = settings.validate(&FINGER).expect("good settings");
        let mut controller = Controller::new(&FINGER, active);
        let mut now = 0;
        let mut state = State::Idle;
        for (frame, command, ticks) in inputs {
            for tick in 0..ticks {
                now += 1_000 + jump_us * u64::from(tick % 7 == 0);
                let command = if tick == 0 { command } else { Command::Continue };
                let outputs = controller.step(Instant::from_micros(now), &frame, command);
                let kpa = front_end.commanded(outputs.dac).0;
                prop_assert!((0.0..=150.03).contains(&kpa), "{} kPa", kpa);
                let next = outputs.snapshot.state;
                prop_assert!(follows(&state, &next), "{:?} to {:?}", state, next);
                if outputs.events.iter().any(|event| matches!(event, Event::Lost(_))) {
                    prop_assert!(can_lose(&state), "lost from {:?}", state);
                    prop_assert!(command != Command::Release, "lost on release");
                }
                state = next;
                prop_assert_eq!(outputs.events.lost(), 0);
            }
        }
    }

    #[test]
    fn a_release_at_any_moment_of_any_drop_is_never_lost(
        before_ms in 0u64..20, noise in 0.0f32..400.0, side in 0.0f32..1.0,
    ) {
        let mut board = MockBoard::holding(Settings::default());
        board.noise_ue = noise;
        board.run(before_ms);
        board.step(Command::Release);
        for ms in 0..200 {
            let fall = (1.0 - ms as f32 / 40.0).max(0.0);
            board.grip = [fall, fall.powf(side), 1.0 - side + side * fall];
            board.run(1);
        }
        board.run(1_500);
        prop_assert_eq!(board.count(|event| matches!(event, Event::Lost(_))), 0);
    }

    #[test]
    fn a_steady_hold_is_silent_at_any_noise_and_pressure(
        kpa in 100.0f32..160.0, noise in 0.0f32..600.0,
    ) {
        let mut board = MockBoard::new(Settings::default());
        board.noise_ue = noise;
        board.grip = [1.0; 3];
        board.step(Command::Grip(Grip::Pressure(Kilopascals(kpa))));
        board.run(1_500);
        board.events.clear();
        board.run(3_000);
        prop_assert!(board.events.is_empty(), "{:?}", board.events);
    }
}

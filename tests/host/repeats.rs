//! A command that is repeated is the same command: drivers rewrite it every 10 ms, programmable controllers
//! pulse their outputs, people press twice.

use crate::mock::{GaugeState, MockBoard, adjusted};
use crate::torture::plant::{Happening, Plant};
use proptest::prelude::*;
use softgrip::settings::{OnFault, OnLoss, Settings};
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, Degrees, Kilopascals};
use softgrip::{Command, Grip};

const GRIP: Command = Command::Grip(Grip::Pressure(Kilopascals(140.0)));

/// What is said once, and how long nothing else is said then.
type Said = (Command, u32);

fn any_command() -> impl Strategy<Value = Command> {
    prop_oneof![
        2 => Just(GRIP),
        2 => Just(Command::Grip(Grip::Default)),
        2 => (80.0f32..160.0).prop_map(|kpa| Command::Grip(Grip::Pressure(Kilopascals(kpa)))),
        1 => (30.0f32..90.0).prop_map(|deg| Command::Grip(Grip::Bend(Degrees(deg)))),
        // Refused, again and again.
        1 => Just(Command::Grip(Grip::Pressure(Kilopascals(170.0)))),
        1 => Just(Command::Grip(Grip::Pressure(Kilopascals(f32::NAN)))),
        2 => Just(Command::Release),
        2 => Just(Command::Stop),
        3 => Just(Command::Acknowledge),
        1 => Just(Command::Tare),
    ]
}

/// Commands of which none is its neighbour.
fn any_commands() -> impl Strategy<Value = Vec<Said>> {
    let gap = prop_oneof![1u32..50, 50u32..1_500];
    prop::collection::vec((any_command(), gap), 1..=8).prop_map(|mut said| {
        // By what is written, for no NaN equals another.
        said.dedup_by_key(|(command, _)| format!("{command:?}"));
        said
    })
}

fn any_happening() -> impl Strategy<Value = Happening> {
    let gauge = prop_oneof![
        Just(GaugeState::Good),
        Just(GaugeState::Open),
        Just(GaugeState::Stuck),
        Just(GaugeState::Offset(-9_000.0)),
    ];
    prop_oneof![
        3 => Just(Happening::PutIn([true; 3])),
        1 => Just(Happening::PutIn([true, false, true])),
        3 => Just(Happening::Fall),
        1 => Just(Happening::ValveStuck),
        1 => Just(Happening::Burst),
        2 => Just(Happening::AirRepaired),
        3 => (0usize..3, gauge).prop_map(|(finger, state)| Happening::Gauge(finger, state)),
        1 => (1u16..50).prop_map(Happening::SupplyDip),
        1 => (1u16..8).prop_map(Happening::Late),
        1 => Just(Happening::MonitorWire(Some(AdcCode(0)))),
        1 => Just(Happening::MonitorWire(None)),
    ]
}

fn any_settings() -> impl Strategy<Value = Settings> {
    let on_loss = prop_oneof![Just(OnLoss::Hold), Just(OnLoss::Vent), Just(OnLoss::Regrip)];
    (any::<bool>(), on_loss).prop_map(|(hold, on_loss)| {
        adjusted(|s| {
            s.grip.on_fault = if hold { OnFault::Hold } else { OnFault::Vent };
            s.grip.on_loss = on_loss;
        })
    })
}

/// The tick at which each command is said, one after the other from the first, and the end.
fn schedule(said: &[Said]) -> (Vec<(u32, Command)>, u32) {
    let mut at = 10;
    let commands = said
        .iter()
        .map(|&(command, gap)| {
            let now = at;
            at += gap;
            (now, command)
        })
        .collect();
    (commands, at + 1_500)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn commands_repeated_at_any_intervals_do_what_they_do_once(
        said in any_commands(),
        history in prop::collection::vec((0u32..10_000, any_happening()), 0..5),
        intervals in prop::collection::vec(1u32..=500, 1..10),
        settings in any_settings(),
    ) {
        let (commands, end) = schedule(&said);
        let mut board = MockBoard::new(settings);
        board.run(1_100);
        let mut once = Plant::new(board);
        once.happen(Happening::PutIn([true; 3]));
        let mut repeated = once.clone();
        let mut intervals = intervals.iter().cycle();
        let mut latest = Command::Continue;
        let mut again = u32::MAX;
        for tick in 0..end {
            for &(_, happening) in history.iter().filter(|(at, _)| *at % end == tick) {
                once.happen(happening);
                repeated.happen(happening);
            }
            let new = commands.iter().find(|(at, _)| *at == tick).map(|&(_, command)| command);
            latest = new.unwrap_or(latest);
            // What is said anew within a second of its last repetition would not be known as new.
            let rests = commands.iter().any(|&(at, command)| {
                format!("{command:?}") == format!("{latest:?}")
                    && (tick + 1..=tick + 1_000).contains(&at)
            });
            let repeats = new.is_some() || again == tick && !rests;
            if repeats {
                let interval = *intervals.next().expect("it goes on for ever");
                again = tick
                    + match latest {
                        // A button that is pressed more slowly than three times a second is pressed again.
                        Command::Acknowledge => interval.min(299),
                        _ => interval,
                    };
            }
            let expected = once.step(new.unwrap_or(Command::Continue));
            let found = repeated.step(if repeats { latest } else { Command::Continue });
            prop_assert_eq!(
                found.snapshot.state, expected.snapshot.state,
                "at {} after {:?}", tick, latest
            );
            prop_assert_eq!(&found.events, &expected.events, "at {} after {:?}", tick, latest);
            prop_assert_eq!(found.dac, expected.dac, "at {} after {:?}", tick, latest);
        }
    }
}

/// Says it every so many ticks.
fn say_every(board: &mut MockBoard, command: Command, period: u64, ticks: u64) {
    for tick in 0..ticks {
        let command = match tick % period {
            0 => command,
            _ => Command::Continue,
        };
        board.step(command);
    }
}

fn is_lost(event: &Event) -> bool {
    matches!(event, Event::Lost(_))
}

#[test]
fn a_grip_that_is_rewritten_all_the_time_is_one_grip_and_its_loss_is_told_once_and_in_time() {
    for period in [1, 2, 10, 50, 100, 140, 250] {
        let mut board = MockBoard::new(Settings::default());
        board.grip = [1.0; 3];
        say_every(&mut board, GRIP, period, 3_000);
        let holds = board.count(|event| matches!(event, Event::Holding { .. }));
        assert_eq!(holds, 1, "every {period} ms: {:?}", board.events);
        let fell = board.now_ms();
        for ms in 0..1_000u64 {
            board.grip = [(1.0 - ms as f32 / 44.0).max(0.14); 3];
            board.step(match ms % period {
                0 => GRIP,
                _ => Command::Continue,
            });
        }
        assert_eq!(board.count(is_lost), 1, "every {period} ms");
        let told = board.first(is_lost).expect("just counted");
        // The fall begins at full grip: 90 % is reached 4 ms later.
        assert!(
            told - fell <= 4 + 20,
            "every {period} ms: {} ms",
            told - fell
        );
    }
}

/// Something that breaks so long after the grip, ms: 150 is while the pressure rises, 1 500 in a hold.
type Cause = (&'static str, u64, fn(&mut MockBoard));
/// Causes of which nothing shows any more once the controller, on its way up, keeps the pressure that is
/// there: the next grip finds them again.
const SHOWS_ON_A_GRIP: [&str; 2] = ["a hose that bursts on the way", "a stuck valve"];

const CAUSES: [Cause; 7] = [
    ("a hose that bursts on the way", 150, |board| {
        board.leak_kpa = 0.0
    }),
    ("a hose that bursts in a hold", 1_500, |board| {
        board.leak_kpa = 0.0
    }),
    ("a stuck valve", 150, |board| board.valve_stuck = true),
    ("an open gauge on the way", 150, |board| {
        board.gauges[1] = GaugeState::Open
    }),
    ("an open gauge in a hold", 1_500, |board| {
        board.gauges[1] = GaugeState::Open
    }),
    ("a stuck gauge on the way", 150, |board| {
        board.gauges[1] = GaugeState::Stuck
    }),
    ("a stuck gauge in a hold", 1_500, |board| {
        board.gauges[1] = GaugeState::Stuck
    }),
];

/// When the fault is told, ms from its cause, and whether the output FAULT then stays on for as long as the
/// cause is there. The operator says one of these commands every so many ticks.
fn told(cause: &Cause, said: &[Command], period: usize) -> (Option<u64>, bool) {
    let mut board = MockBoard::new(Settings::default());
    board.grip = [1.0; 3];
    board.run(1_100);
    board.step(GRIP);
    let (_, after_ms, breaks) = cause;
    board.run(*after_ms);
    let broke = board.now_ms();
    breaks(&mut board);
    let mut stays = true;
    let mut told = None;
    for tick in 0..4_000 {
        let command = match (tick + period / 2) % period {
            0 if !said.is_empty() => said[tick / period % said.len()],
            _ => Command::Continue,
        };
        let outputs = board.step(command);
        if told.is_none() {
            told = board
                .first(|event| matches!(event, Event::Fault { .. }))
                .map(|ms| ms - broke);
        }
        stays &= told.is_none() || outputs.indicators.fault;
    }
    (told, stays)
}

#[test]
fn an_acknowledgement_again_and_again_hides_no_fault_whose_cause_is_there() {
    let pulses = [Command::Acknowledge];
    // Each of these is a command of its own.
    let presses = [Command::Acknowledge, Command::Alive];
    let mut hidden = Vec::new();
    for cause in &CAUSES {
        let (expected, _) = told(cause, &[], 1_000);
        assert!(expected.is_some(), "{} is told", cause.0);
        for said in [&pulses[..], &presses[..]] {
            for period in [10, 250, 1_200] {
                let mut found = told(cause, said, period);
                found.1 |= SHOWS_ON_A_GRIP.contains(&cause.0);
                if found != (expected, true) {
                    let stays = if found.1 { "stays" } else { "goes" };
                    hidden.push(format!(
                        "{}, {said:?} every {period} ms: told after {:?} ms, not {expected:?}; FAULT {stays}",
                        cause.0, found.0,
                    ));
                }
            }
        }
    }
    assert!(hidden.is_empty(), "{}", hidden.join("\n"));
}

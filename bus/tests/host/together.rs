//! Digital inputs and bus at once: every combination, in every state, has the result that docs/registers.md says.

use crate::line::{Bus, REQUEST, writing};
use crate::mock::MockBoard;
use softgrip::settings::{OnFault, Settings};
use softgrip::table::{self, FINGER};
use softgrip::units::Degrees;
use softgrip::{Command, Grip};

/// A gripper in each of its states.
fn states() -> Vec<(&'static str, Bus)> {
    let open = || Bus::activated(Settings::default());
    let closed = |touches: bool| {
        let mut bus = open();
        bus.board.grip = [if touches { 1.0 } else { 0.0 }; 3];
        bus.go(200);
        bus.run(2_000);
        bus
    };
    let mut closing = open();
    closing.go(200);
    closing.run(100);
    let mut releasing = closed(true);
    releasing.go(0);
    releasing.run(50);
    let mut sweeping = open();
    sweeping.write(0x1104, &[8]);
    sweeping.run(500);
    let mut lost = closed(true);
    lost.drop_object();
    assert_eq!(lost.shown().obj, 3);
    let fault = |on_fault| {
        let mut bus = Bus::activated(crate::mock::adjusted(|s| s.grip.on_fault = on_fault));
        bus.board.grip = [1.0; 3];
        bus.go(200);
        bus.run(2_000);
        bus.board.supply_v = 15.0;
        bus.run(100);
        bus.shown();
        bus
    };
    let mut stopped = closed(true);
    stopped.pins = Command::Stop;
    stopped.run(3);
    stopped.pins = Command::Continue;
    vec![
        ("idle", open()),
        ("closing", closing),
        ("holding", closed(true)),
        ("empty", closed(false)),
        ("releasing", releasing),
        ("sweeping", sweeping),
        ("lost", lost),
        ("fault, vented", fault(OnFault::Vent)),
        ("fault, held", fault(OnFault::Hold)),
        ("stopped", stopped),
    ]
}

/// The grip of a go-to with all force.
fn grip(position: u8) -> Command {
    let full = FINGER.rows[FINGER.rows.len() - 1].tip_angle_deg;
    let bend = Degrees(f32::from(position) / 255.0 * full);
    Command::Grip(Grip::Pressure(table::pressure_for_bend(&FINGER, bend).0))
}

/// What the bus may ask for, and the commands that it means.
fn requests(state: &str) -> Vec<(Vec<u8>, Vec<Command>)> {
    let go = |position: u8, command| {
        // A loss that has been shown is acknowledged with it.
        let acknowledges = (state == "lost").then_some(Command::Acknowledge);
        let commands = acknowledges.into_iter().chain([command]).collect();
        let pdu = writing(REQUEST, &[0x0900, position.into(), 0xffff]);
        (pdu, commands)
    };
    let own = |number, command| (writing(0x1104, &[number]), vec![command]);
    let reset = vec![Command::Halt, Command::Acknowledge];
    vec![
        (vec![3, 0x07, 0xD0, 0, 3], vec![]),
        (writing(0x2000 + 802, &[0x42A0, 0]), vec![]),
        go(254, grip(254)),
        go(1, Command::Release),
        (writing(REQUEST, &[0]), reset),
        (writing(REQUEST, &[0x1100]), vec![Command::Release]),
        own(1, Command::Grip(Grip::Default)),
        own(4, Command::Release),
        own(5, Command::Stop),
        own(6, Command::Acknowledge),
        own(7, Command::Tare),
        own(8, Command::Sweep),
        own(10, Command::Halt),
    ]
}

const PINS: [Command; 5] = [
    Command::Continue,
    Command::Grip(Grip::Default),
    Command::Release,
    Command::Stop,
    Command::Acknowledge,
];

/// What the inputs want in the tick `at`, and the bus in the others: what is carried out, and whether something of the
/// bus's is dropped.
fn rule(pins: Command, at: usize, bus: &[Command]) -> (Vec<Command>, bool) {
    let mut commands = bus.to_vec();
    let mut dropped = false;
    let at = at.min(commands.len());
    let behind = commands.split_off(at);
    match pins {
        Command::Continue => {}
        Command::Stop => {
            commands.push(pins);
            return (commands, !behind.is_empty());
        }
        _ => commands.push(pins),
    }
    for command in behind {
        let closes = matches!(command, Command::Grip(_) | Command::Sweep);
        if pins == Command::Release && closes {
            dropped = true;
        } else {
            commands.push(command);
        }
    }
    (commands, dropped)
}

/// What a gripper does when it gets these commands, one in a tick.
fn alone(board: &MockBoard, commands: &[Command], ticks: u32) -> MockBoard {
    let mut board = board.clone();
    for tick in 0..ticks as usize {
        board.step(commands.get(tick).copied().unwrap_or(Command::Continue));
    }
    board
}

#[test]
fn inputs_come_first_a_stop_drops_the_bus_and_a_release_what_would_close() {
    let mut walked = 0;
    for (state, start) in states() {
        for (pdu, bus_commands) in requests(state) {
            // In the first tick of the request, and in the second one where it has several.
            let ticks = 0..bus_commands.len().max(1);
            for (at, pins) in ticks.flat_map(|at| PINS.map(|pins| (at, pins))) {
                let mut start = start.clone();
                (start.pins, start.pins_in) = (pins, at as u32);
                let mut bus = start.clone();
                let answer = bus.ask(&pdu);
                let name = format!("{state}, {pins:?} in tick {at}, {pdu:02x?}");
                if answer[0] & 0x80 != 0 {
                    // Settings in a sweep.
                    assert_eq!((state, answer[1]), ("sweeping", 6), "{name}");
                    continue;
                }
                let (commands, dropped) = rule(pins, at, &bus_commands);
                let reference = alone(&start.board, &commands, bus.ticks);
                let (did, should) = (bus.board.last.clone(), reference.last);
                let (did, should) = (did.expect("a tick"), should.expect("a tick"));
                assert_eq!(did.snapshot, should.snapshot, "{name}");
                assert_eq!((did.dac, did.indicators), (should.dac, should.indicators));
                if pins == Command::Stop {
                    assert!(did.snapshot.state.fault().is_some(), "{name}");
                }
                assert_eq!(bus.ticks as usize, commands.len().max(1), "{name}");
                let result = bus.read_one(0x1106);
                assert_eq!(result == 4, dropped, "{name}: {result}");
                walked += 1;
            }
        }
    }
    // Ten states with thirteen requests each, the reset and two more where a loss is latched in two ticks.
    assert_eq!(walked, 5 * (10 * 14 + 2 - 1));
}

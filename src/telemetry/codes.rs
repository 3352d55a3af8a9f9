//! The numbers that commands, states, faults and causes have in a record.

use crate::command::{Command, Grip, Motion, Payload};
use crate::detect::LossCause;
use crate::fault::{Fault, RULES};
use crate::grasp::{Purpose, State};
use crate::table::ObjectKind;
use crate::units::{Degrees, Instant, Kilograms, Kilopascals, MetresPerSecondSquared};

/// A command's code and its numbers.
pub fn code_of(command: Command) -> (u8, [f32; 2]) {
    let one = |code, number| (code, [number, 0.0]);
    match command {
        Command::Continue => one(0, 0.0),
        Command::Alive => one(1, 0.0),
        Command::Motion(Motion::Moving) => one(2, 0.0),
        Command::Motion(Motion::Still) => one(3, 0.0),
        Command::Slew(share) => one(4, share),
        Command::Grip(Grip::Default) => one(5, 0.0),
        Command::Grip(Grip::Pressure(pressure)) => one(6, pressure.0),
        Command::Grip(Grip::Bend(bend)) => one(7, bend.0),
        Command::Grip(Grip::Payload(payload)) => {
            let code = match payload.kind {
                ObjectKind::Sphere => 8,
                ObjectKind::Cylinder => 9,
            };
            (code, [payload.mass.0, payload.acceleration.0])
        }
        Command::Release => one(10, 0.0),
        Command::Halt => one(11, 0.0),
        Command::Stop => one(12, 0.0),
        Command::Acknowledge => one(13, 0.0),
        Command::Tare => one(14, 0.0),
        Command::Sweep => one(15, 0.0),
    }
}

/// The command of a code.
pub fn command_of(code: u8, [first, second]: [f32; 2]) -> Option<Command> {
    let payload = |kind| {
        Command::Grip(Grip::Payload(Payload {
            kind,
            mass: Kilograms(first),
            acceleration: MetresPerSecondSquared(second),
        }))
    };
    Some(match code {
        0 => Command::Continue,
        1 => Command::Alive,
        2 => Command::Motion(Motion::Moving),
        3 => Command::Motion(Motion::Still),
        4 => Command::Slew(first),
        5 => Command::Grip(Grip::Default),
        6 => Command::Grip(Grip::Pressure(Kilopascals(first))),
        7 => Command::Grip(Grip::Bend(Degrees(first))),
        8 => payload(ObjectKind::Sphere),
        9 => payload(ObjectKind::Cylinder),
        10 => Command::Release,
        11 => Command::Halt,
        12 => Command::Stop,
        13 => Command::Acknowledge,
        14 => Command::Tare,
        15 => Command::Sweep,
        _ => return None,
    })
}

/// A state's code, its moment, and its target.
pub fn code_of_state(state: &State) -> (u8, Option<Instant>, Kilopascals) {
    match *state {
        State::Idle => (0, None, Kilopascals(0.0)),
        State::Closing {
            target,
            reached,
            purpose,
        } => {
            let code = match purpose {
                Purpose::Grip => 1,
                Purpose::Change => 2,
                Purpose::Regrip => 3,
            };
            (code, reached, target)
        }
        State::Holding { target, since } => (4, Some(since), target),
        State::Empty { target } => (5, None, target),
        State::Sweeping { target } => (6, None, target),
        State::Releasing { since, holding } => {
            (7 + u8::from(holding), Some(since), Kilopascals(0.0))
        }
        State::Fault {
            target, watching, ..
        } => (9 + u8::from(watching), None, target),
    }
}

/// The state of a code.
pub fn state_of(
    code: u8,
    since: Instant,
    has_since: bool,
    target: Kilopascals,
    fault: u8,
) -> Option<State> {
    let closing = |purpose| State::Closing {
        target,
        reached: has_since.then_some(since),
        purpose,
    };
    Some(match code {
        0 => State::Idle,
        1 => closing(Purpose::Grip),
        2 => closing(Purpose::Change),
        3 => closing(Purpose::Regrip),
        4 => State::Holding { target, since },
        5 => State::Empty { target },
        6 => State::Sweeping { target },
        7 | 8 => State::Releasing {
            since,
            holding: code == 8,
        },
        9 | 10 => State::Fault {
            fault: fault_of(fault)?,
            target,
            watching: code == 10,
        },
        _ => return None,
    })
}

fn fault_of(code: u8) -> Option<Fault> {
    let rule = RULES.iter().find(|rule| rule.fault.code() == code)?;
    Some(rule.fault)
}

/// The cause of a number.
pub fn cause_of(number: u32) -> Option<LossCause> {
    Some(match number {
        0 => LossCause::Collapse,
        1 => LossCause::OneSided,
        2 => LossCause::Missing,
        _ => return None,
    })
}

/// A cause's number.
pub fn number_of(cause: LossCause) -> u32 {
    match cause {
        LossCause::Collapse => 0,
        LossCause::OneSided => 1,
        LossCause::Missing => 2,
    }
}

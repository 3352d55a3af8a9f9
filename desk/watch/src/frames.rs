//! Ticks as they stand in a recording: the converters' codes and the commands, from which the controller does all
//! the rest again.

use anyhow::{Context, bail, ensure};
use softgrip::command::{Command, Grip, Motion, Payload};
use softgrip::table::ObjectKind;
use softgrip::units::{
    AdcCode, DacCode, Degrees, Instant, Kilograms, Kilopascals, MetresPerSecondSquared, Millivolts,
};
use softgrip::{FINGERS, RawFrame, TICK_US};

use crate::protobuf::{self, Value, Writer};
use crate::tick::Tick;

/// Between two ticks as a rule, µs.
const PERIOD_US: i64 = TICK_US as i64;

/// The message of some ticks that follow one another by their numbers.
pub fn encode(ticks: &[Tick]) -> Writer {
    let mut message = Writer::new();
    let Some(first) = ticks.first() else {
        return message;
    };
    message.whole(1, first.number.into());
    message.whole(2, first.now.micros());
    let later = |pair: &[Tick]| {
        let later_us = pair[1].now.micros_since(pair[0].now) as i64 - PERIOD_US;
        later_us.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    };
    message.signed(3, ticks.windows(2).map(later));
    for (column, field) in COLUMNS.into_iter().enumerate() {
        let mut before = 0;
        message.signed(
            field,
            ticks.iter().map(|tick| {
                let value = i32::from(code_of(tick, column));
                value - std::mem::replace(&mut before, value)
            }),
        );
    }
    let places = |is_so: fn(&Tick) -> bool| {
        let places = (0..).zip(ticks);
        places.filter_map(move |(at, tick)| is_so(tick).then_some(at))
    };
    message.unsigned(12, places(|tick| tick.frame.overrun));
    message.unsigned(13, places(|tick| tick.frame.carried));
    for (at, tick) in (0..).zip(ticks) {
        let (command, numbers) = of_command(&tick.command);
        if command != 0 {
            let mut given = Writer::new();
            given.whole(1, at);
            given.whole(2, command);
            for (field, number) in (3..).zip(numbers.into_iter().flatten()) {
                given.float(field, number);
            }
            message.message(14, &given);
        }
    }
    message
}

/// Numbers of the fields of the gauges' codes, as many as a gripper may have, and of the other codes.
const GAUGES: [u32; 4] = [4, 5, 6, 15];
const OTHERS: [u32; 5] = [7, 8, 9, 10, 11];
/// Codes of a tick.
const CODES: usize = FINGERS + OTHERS.len();
/// The fields of a tick's codes: gauges, monitor, supply, rail, scans, converter.
const COLUMNS: [u32; CODES] = columns();

const fn columns() -> [u32; CODES] {
    let mut columns = [0; CODES];
    let mut column = 0;
    while column < CODES {
        columns[column] = match column < FINGERS {
            true => GAUGES[column],
            false => OTHERS[column - FINGERS],
        };
        column += 1;
    }
    columns
}

/// One of the codes of a tick.
fn code_of(tick: &Tick, column: usize) -> u16 {
    let frame = &tick.frame;
    match column.checked_sub(FINGERS) {
        None => frame.gauges[column].0,
        Some(0) => frame.monitor.0,
        Some(1) => frame.supply.0,
        Some(2) => frame.rail.0,
        Some(3) => frame.scans,
        Some(_) => tick.dac.0,
    }
}

/// The ticks of a message.
///
/// # Errors
/// If it is none of ticks, or its columns are of different length.
pub fn decode(message: &[u8]) -> anyhow::Result<Vec<Tick>> {
    let (mut number, mut t_us) = (0, 0);
    let mut later_us = Vec::new();
    let mut columns = [const { Vec::new() }; CODES];
    let (mut overrun, mut carried, mut commands) = (Vec::new(), Vec::new(), Vec::new());
    for (field, value) in protobuf::fields(message)? {
        match field {
            1 => number = u32::try_from(value.whole()?)?,
            2 => t_us = value.whole()?,
            3 => later_us = value.signed()?,
            12 => overrun = value.unsigned()?,
            13 => carried = value.unsigned()?,
            14 => commands.push(command(value)?),
            _ => {
                if let Some(place) = COLUMNS.iter().position(|column| *column == field) {
                    columns[place] = column(value)?;
                }
            }
        }
    }
    let count = columns[0].len();
    ensure!(
        columns.iter().all(|column| column.len() == count) && later_us.len() + 1 == count.max(1),
        "columns of different length"
    );
    let mut ticks = Vec::with_capacity(count);
    for (at, place) in (0..count).zip(0..) {
        let code = |column: usize| columns[column][at];
        if let Some(before) = at.checked_sub(1) {
            let since_us = PERIOD_US + i64::from(later_us[before]);
            let since_us = u64::try_from(since_us).context("time runs backwards")?;
            t_us = t_us
                .checked_add(since_us)
                .context("a time is out of range")?;
        }
        ticks.push(Tick {
            number: number.wrapping_add(place),
            now: Instant::from_micros(t_us),
            frame: RawFrame {
                gauges: std::array::from_fn(|gauge| AdcCode(code(gauge))),
                monitor: AdcCode(code(FINGERS)),
                supply: AdcCode(code(FINGERS + 1)),
                rail: Millivolts(code(FINGERS + 2)),
                scans: code(FINGERS + 3),
                overrun: overrun.contains(&place),
                carried: carried.contains(&place),
            },
            command: Command::Continue,
            dac: DacCode(code(FINGERS + 4)),
        });
    }
    for (at, command) in commands {
        let tick = ticks.get_mut(at).context("a command beyond the ticks")?;
        tick.command = command;
    }
    Ok(ticks)
}

/// The codes of a column.
fn column(value: Value<'_>) -> anyhow::Result<Vec<u16>> {
    let mut code = 0_i32;
    let codes = value.signed()?.into_iter().map(|more| {
        code = code.checked_add(more).context("a code is out of range")?;
        u16::try_from(code).context("a code is out of range")
    });
    codes.collect()
}

/// The number of a command, and the numbers that belong to it; 0 for none.
fn of_command(command: &Command) -> (u64, [Option<f32>; 2]) {
    let one = |number| [Some(number), None];
    match *command {
        Command::Continue => (0, [None; 2]),
        Command::Alive => (1, [None; 2]),
        Command::Motion(Motion::Moving) => (2, [None; 2]),
        Command::Motion(Motion::Still) => (3, [None; 2]),
        Command::Slew(share) => (4, one(share)),
        Command::Grip(Grip::Default) => (5, [None; 2]),
        Command::Grip(Grip::Pressure(kpa)) => (6, one(kpa.0)),
        Command::Grip(Grip::Bend(degrees)) => (7, one(degrees.0)),
        Command::Grip(Grip::Payload(payload)) => {
            let number = match payload.kind {
                ObjectKind::Sphere => 8,
                ObjectKind::Cylinder => 9,
            };
            let numbers = [Some(payload.mass.0), Some(payload.acceleration.0)];
            (number, numbers)
        }
        Command::Release => (10, [None; 2]),
        Command::Halt => (11, [None; 2]),
        Command::Stop => (12, [None; 2]),
        Command::Acknowledge => (13, [None; 2]),
        Command::Tare => (14, [None; 2]),
        Command::Sweep => (15, [None; 2]),
    }
}

/// A command, and the place of its tick.
fn command(value: Value<'_>) -> anyhow::Result<(usize, Command)> {
    let (mut at, mut number, mut numbers) = (0, 0, [0.0; 2]);
    for (field, value) in protobuf::fields(value.bytes()?)? {
        match field {
            1 => at = value.whole()? as usize,
            2 => number = value.whole()?,
            3 => numbers[0] = value.float()?,
            4 => numbers[1] = value.float()?,
            _ => {}
        }
    }
    let [first, second] = numbers;
    let payload = |kind| {
        Command::Grip(Grip::Payload(Payload {
            kind,
            mass: Kilograms(first),
            acceleration: MetresPerSecondSquared(second),
        }))
    };
    let command = match number {
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
        _ => bail!("command {number} is unknown: a newer program has recorded this"),
    };
    Ok((at, command))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_read_as_they_were_written() {
        let commands = [
            Command::Continue,
            Command::Alive,
            Command::Motion(Motion::Still),
            Command::Motion(Motion::Moving),
            Command::Slew(0.3),
            Command::Grip(Grip::Default),
            Command::Grip(Grip::Pressure(Kilopascals(140.1))),
            Command::Grip(Grip::Bend(Degrees(-0.5))),
            Command::Grip(Grip::Payload(Payload {
                kind: ObjectKind::Sphere,
                mass: Kilograms(0.08),
                acceleration: MetresPerSecondSquared(5.0),
            })),
            Command::Grip(Grip::Payload(Payload {
                kind: ObjectKind::Cylinder,
                mass: Kilograms(0.08),
                acceleration: MetresPerSecondSquared(5.0),
            })),
            Command::Release,
            Command::Halt,
            Command::Stop,
            Command::Acknowledge,
            Command::Tare,
            Command::Sweep,
        ];
        let ticks: Vec<Tick> = (0_u16..)
            .zip(commands)
            .map(|(n, command)| Tick {
                number: 7 + u32::from(n),
                now: Instant::from_micros(5_000_000_123 + 1_000 * u64::from(n) + u64::from(n % 3)),
                frame: RawFrame {
                    gauges: [0, 40_000 * (n % 2), u16::MAX - n].map(AdcCode),
                    monitor: AdcCode(n * n),
                    supply: AdcCode(43_000),
                    rail: Millivolts(3_300),
                    scans: n % 2,
                    overrun: n == 3,
                    carried: n > 10,
                },
                command,
                dac: DacCode(300 - n),
            })
            .collect();
        assert_eq!(decode(encode(&ticks).bytes()).expect("ticks"), ticks);
        assert_eq!(decode(encode(&[]).bytes()).expect("none"), []);
    }

    #[test]
    fn a_message_that_is_none_of_ticks_is_refused() {
        let mut message = Writer::new();
        message.signed(4, [1, 2].into_iter());
        assert!(decode(message.bytes()).is_err());
        let mut message = Writer::new();
        for field in 4..12 {
            message.signed(field, [-1].into_iter());
        }
        assert!(decode(message.bytes()).is_err());
    }

    #[test]
    fn a_time_beyond_the_clocks_end_is_refused() {
        let mut message = Writer::new();
        message.whole(2, u64::MAX);
        message.signed(3, [0].into_iter());
        for field in 4..12 {
            message.signed(field, [1, 0].into_iter());
        }
        let error = decode(message.bytes()).expect_err("no such time");
        assert!(error.to_string().contains("out of range"), "{error}");
    }
}

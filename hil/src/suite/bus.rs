//! The bus, with a robot at the other end: it is answered in time, and nothing that it sends delays a tick.

use anyhow::Context as _;
use bus::modbus::crc;
use bus::robot::{Item, REGISTERS, SETTINGS_FROM};
use sim::scenario::Scenario;
use softgrip::Command;

use super::test::{Context, Outcome, Test};
use crate::bench::{self, Setup};
use crate::closed_loop::{Loop, REST, fingers, pins_at_rest};
use crate::line::Master;
use crate::moment::Moment;
use crate::recording::{Recording, Replay};
use crate::rtt::Host;

pub const TESTS: [Test; 3] = [
    Test {
        name: "bus: a grasp",
        about: "by the compatible block, polled 100 times a second: activated, held, lost while being carried, told on the bus",
        run: grasp,
    },
    Test {
        name: "bus: a flood of garbage",
        about: "with framing errors, 1000 snapshots a second and settings being stored: no late tick, and the next request is answered",
        run: flood,
    },
    Test {
        name: "bus: settings",
        about: "written, stored on command, in use after the next start; id and rate of the line as well",
        run: settings,
    },
];

/// The slave's id as delivered.
const ID: u8 = 9;
/// The compatible block, written and read.
const REQUEST: u16 = 0x03e8;
const STATUS: u16 = 0x07d0;
/// Stores the settings (docs/registers.md).
const SAVE: u16 = 9;
/// A request is answered within this, µs.
const REPLY_US: f64 = 3_000.0;

/// A frame with its checksum.
fn frame(id: u8, function: u8, words: &[u16], bytes: &[u8]) -> Vec<u8> {
    let mut frame = vec![id, function];
    frame.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    frame.extend(bytes);
    let sum = crc(&frame);
    frame.extend(sum.to_le_bytes());
    frame
}

/// Asks for registers.
fn read(id: u8, from: u16, count: u16) -> Vec<u8> {
    frame(id, 4, &[from, count], &[])
}

/// Writes registers.
fn write(id: u8, from: u16, values: &[u16]) -> Vec<u8> {
    let mut bytes = vec![2 * values.len() as u8];
    bytes.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    frame(id, 16, &[from, values.len() as u16], &bytes)
}

/// The registers in a reply to a reading; none if it is no such reply.
fn registers(id: u8, reply: &[u8]) -> Option<Vec<u16>> {
    let [got, 4, _, values @ .., _, _] = reply else {
        return None;
    };
    let (pairs, rest) = values.as_chunks::<2>();
    let good = *got == id && crc(reply) == 0 && rest.is_empty();
    good.then(|| pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect())
}

fn master<'a>(moment: &'a mut Moment<'_>) -> &'a mut Master {
    moment.session.board_mut().master()
}

/// What the robot sees: object status and the latched loss, and when.
#[derive(Debug, Default)]
struct Seen {
    replies: u32,
    unanswered: u32,
    slowest_us: f64,
    objects: Vec<u16>,
    told_ms: Option<u64>,
    lost_ms: Option<u64>,
}

/// The robot asks for something every 10 ms, in turn: it writes its command, as drivers repeat it, and reads all of
/// the compatible block.
fn poll(seen: &mut Seen, moment: &mut Moment<'_>, position: u8) {
    let ms = moment.ms;
    if moment.indicators().lost {
        seen.lost_ms.get_or_insert(ms);
    }
    if !ms.is_multiple_of(10) {
        return;
    }
    let (reply, after_us) = master(moment).reply();
    if ms > 100 {
        match reply.is_empty() {
            true => seen.unanswered += 1,
            false => {
                seen.replies += 1;
                seen.slowest_us = f64::max(seen.slowest_us, after_us);
            }
        }
        if let Some([status, fault_echo, _]) = registers(ID, &reply).as_deref() {
            let object = status >> 14;
            if seen.objects.last() != Some(&object) {
                seen.objects.push(object);
            }
            if seen.objects.contains(&2) && object == 3 && fault_echo & 0xff == u16::from(position)
            {
                seen.told_ms.get_or_insert(ms);
            }
        }
    }
    if ms >= 100 {
        let action = match ms {
            100..200 => 0x0000,
            200..500 => 0x0100,
            _ => 0x0900,
        };
        let asks = match (ms / 10) % 2 {
            0 => write(ID, REQUEST, &[action, position.into(), 0xffff]),
            _ => read(ID, STATUS, 3),
        };
        master(moment).sends.extend(asks);
    }
}

fn grasp(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let setup = Setup {
        telemetry_us: 1_000,
        ..Setup::new(context.image, Host::Reading)
    };
    let scenario = Scenario {
        mass_kg: 0.3,
        ..Scenario::default()
    };
    let plant = Loop::new(&scenario, fingers()?);
    let kept = (plant, Seen::default(), 0);
    let ((_, seen, _), record) = bench::run(&setup, kept, move |(plant, seen, rested), moment| {
        *rested += u64::from(!plant.step(moment));
        // The robot's wires say nothing; the bus does.
        moment.set_levels(REST);
        poll(seen, moment, 255);
        Ok(*rested < 300)
    })?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    let recording = Recording::of(&record.messages)?;
    outcome.at_most("messages lost", recording.dropped.into(), "", 0.0);
    let commands = recording.ticks.iter();
    let commands = commands.filter(|tick| tick.command != Command::Continue);
    outcome.must(commands.count() > 0, "no record has a command from the bus");
    let replay = Replay::of(&recording)?;
    outcome.at_most(
        "ticks and events that the host's controller does not do again, bit for bit",
        replay.differing as f64,
        "",
        0.0,
    );
    outcome.failures.extend(replay.differences);
    outcome.number("replies", seen.replies.into(), "");
    outcome.at_most("requests without a reply", seen.unanswered.into(), "", 0.0);
    outcome.at_most("slowest reply", seen.slowest_us, "µs", REPLY_US);
    outcome.must(
        seen.objects.ends_with(&[0, 2, 3]),
        format!("the object status went {:?}, not to 0, 2, 3", seen.objects),
    );
    match (seen.lost_ms, seen.told_ms) {
        (Some(lost), Some(told)) => outcome.at_most(
            "from the output LOST to the answer that says so, asked for every 20 ms and looked at after 10",
            told as f64 - lost as f64,
            "ms",
            30.0,
        ),
        missing => outcome.failures.push(format!("lost and told: {missing:?}")),
    }
    Ok(outcome)
}

fn flood(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let tare = context.image.variable("TARE")?.address;
    let setup = Setup {
        telemetry_us: 1_000,
        ..Setup::new(context.image, Host::Reading)
    };
    // Garbage from 200 ms on, an answer to a good request after it.
    const QUIET_MS: u64 = 5_000;
    let kept = (0x9e37_79b9u32, Vec::new());
    let ((_, reply), record) = bench::run(&setup, kept, move |(noise, reply), moment| {
        let ms = moment.ms;
        moment.set_pins(&pins_at_rest());
        moment.set_levels(REST);
        if ms == 200 {
            moment.session.board_mut().garble(100_000);
        }
        if (200..QUIET_MS).contains(&ms) {
            if ms % 1_200 == 300 {
                moment.set_word(tare, 1)?;
            }
            for _ in 0..12 {
                // xorshift
                *noise ^= *noise << 13;
                *noise ^= *noise >> 17;
                *noise ^= *noise << 5;
                // Beginnings of requests to this slave among it, and breaks.
                let bytes = match *noise % 7 {
                    0 => vec![ID, 4, 7],
                    1 => vec![0; 11],
                    2 => read(ID + 1, STATUS, 3),
                    _ => noise.to_le_bytes().to_vec(),
                };
                let sends = &mut master(moment).sends;
                if sends.len() < 24 {
                    sends.extend(bytes);
                }
            }
        }
        if ms == QUIET_MS {
            moment.session.board_mut().garble(0);
            let master = master(moment);
            master.sends.clear();
        }
        if ms == QUIET_MS + 30 {
            let master = master(moment);
            master.heard.clear();
            master.sends.extend(read(ID, STATUS, 6));
        }
        if ms == QUIET_MS + 40 {
            *reply = master(moment).reply().0;
        }
        Ok(ms < QUIET_MS + 40)
    })?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    outcome.must(
        registers(ID, &reply).is_some_and(|registers| registers.len() == 6),
        format!("the request after it is answered by {reply:02x?}"),
    );
    Ok(outcome)
}

/// The register of a setting's upper half.
fn setting(number: u16) -> u16 {
    SETTINGS_FROM + 2 * number
}

/// The two registers of a value.
fn halves(value: f32) -> [u16; 2] {
    let bits = value.to_bits();
    [(bits >> 16) as u16, bits as u16]
}

fn settings(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let command = REGISTERS
        .iter()
        .find(|register| register.item == Item::Command)
        .context("no register takes commands")?
        .address;
    // What is asked, each 50 ms.
    let asks = move |id: u8| {
        [
            write(id, setting(301), &halves(9.5)),
            // Out of its range, and half a value.
            write(id, setting(301), &halves(-1.0)),
            write(id, setting(301), &halves(9.5)[..1]),
            write(id, setting(900), &halves(17.0)),
            write(id, command, &[SAVE]),
            read(id, setting(301), 2),
        ]
    };
    let run = |settings: Option<Vec<u8>>, id: u8| {
        let setup = Setup {
            settings,
            ..Setup::new(context.image, Host::Reading)
        };
        let kept = (Vec::new(), Vec::new());
        bench::run(&setup, kept, move |(replies, flash), moment| {
            moment.set_pins(&pins_at_rest());
            moment.set_levels(REST);
            let turn = moment.ms / 50;
            if moment.ms % 50 == 0 && turn >= 2 {
                let master = master(moment);
                if turn > 2 {
                    replies.push(master.reply().0);
                }
                if let Some(asks) = asks(id).get(turn as usize - 2) {
                    master.sends.extend(asks);
                }
            }
            *flash = moment.session.board_mut().flash().bytes();
            Ok(moment.ms < 900)
        })
    };
    let ((replies, flash), record) = run(None, ID)?;
    let mut outcome = Outcome::default();
    super::timing::jitter(&record, &mut outcome);
    let kinds: Vec<Option<u8>> = replies.iter().map(|reply| reply.get(1).copied()).collect();
    outcome.must(
        kinds.starts_with(&[
            Some(16),
            Some(16 | 0x80),
            Some(16 | 0x80),
            Some(16),
            Some(16),
            Some(4),
        ]),
        format!("the replies are {replies:02x?}"),
    );
    outcome.must(
        record.message(0, "settings stored").is_some(),
        "nothing was stored",
    );
    let ((replies, _), _) = run(Some(flash), 17)?;
    let kept = replies.get(5).and_then(|reply| registers(17, reply));
    outcome.must(
        kept.as_deref() == Some(&halves(9.5)),
        format!("after the next start the new id is answered by {replies:02x?}"),
    );
    Ok(outcome)
}

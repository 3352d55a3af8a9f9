//! The shield of `hardware/` and the firmware agree: constants, pins, and what each fault of the circuit looks like.
//!
//! `hardware/build` writes the constants and pins from the circuit, `hardware/simulate` the codes by simulating it.

use crate::mock::MockBoard;
use softgrip::command::Refusal;
use softgrip::fault::{Fault, RULES};
use softgrip::frontend::{FrontEnd, Settings as FrontEndSettings};
use softgrip::settings::Settings;
use softgrip::table::FINGER;
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, DacCode, Kilopascals};
use softgrip::{Command, Grip, RawFrame};
use softgrip_settings::FIELDS;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

const FE: FrontEnd = FrontEnd::REFERENCE;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn circuit() -> Table {
    include_str!("../../hardware/front_end.toml")
        .parse()
        .expect("hardware/front_end.toml is TOML")
}

fn text<'a>(table: &'a Table, key: &str) -> &'a str {
    table[key].as_str().expect(key)
}

fn tables<'a>(table: &'a Table, key: &str) -> impl Iterator<Item = &'a Table> {
    let list = table[key].as_array().expect(key);
    list.iter().map(|value| value.as_table().expect(key))
}

#[test]
fn the_defaults_of_the_front_end_are_those_of_the_circuit() {
    let circuit = circuit();
    let constants = circuit["front_end"].as_table().expect("a table");
    let number = |name: &str| match constants.get(name) {
        Some(Value::Float(number)) => *number as f32,
        other => panic!("hardware/front_end.toml: {name} is {other:?}"),
    };
    let settings = FIELDS
        .iter()
        .filter_map(|field| Some((field, field.name.strip_prefix("front_end.")?)));
    let mut count = 0;
    for (field, name) in settings {
        assert_eq!(field.default, number(name), "{name}");
        count += 1;
    }
    assert_eq!(count, constants.len());
    // What the firmware computes with.
    let FrontEndSettings {
        gauge_zero_v,
        gauge_full_scale_v,
        command_zero_v,
        ..
    } = Settings::default().front_end;
    assert_eq!(gauge_zero_v, number("gauge_zero_v"));
    assert_eq!(gauge_full_scale_v, number("gauge_full_scale_v"));
    assert_eq!(command_zero_v, number("command_zero_v"));
}

/// In the order of the converter's scan, then the rest.
const SIGNALS: [&str; 17] = [
    "GAUGE1", "GAUGE2", "GAUGE3", "MONITOR", "SUPPLY", "COMMAND", "GRIP", "RELEASE", "STOP", "ACK",
    "READY", "HOLDING", "LOST", "FAULT", "RXD", "TXD", "DE",
];

#[test]
fn every_board_has_each_signal_once_and_no_pin_twice() {
    for board in tables(&circuit(), "board") {
        let name = text(board, "name");
        let signals: Vec<&Table> = tables(board, "signals").collect();
        let names: Vec<&str> = signals.iter().map(|signal| text(signal, "name")).collect();
        assert_eq!(names, SIGNALS, "{name}");
        for place in ["pin", "header"] {
            let places: BTreeSet<&str> = signals.iter().map(|signal| text(signal, place)).collect();
            assert_eq!(places.len(), SIGNALS.len(), "{name}: a {place} twice");
        }
    }
}

#[test]
fn every_boards_file_takes_the_pins_of_the_circuit_in_the_order_of_the_scan() {
    let mut found = 0;
    for board in tables(&circuit(), "board") {
        let file = text(board, "file");
        // The shield fits boards that the firmware does not know yet.
        let Ok(source) = std::fs::read_to_string(root().join(file)) else {
            continue;
        };
        found += 1;
        let pin = |signal: &str| {
            let mut signals = tables(board, "signals");
            let signal = signals.find(|found| text(found, "name") == signal);
            text(signal.expect("there is one"), "pin")
        };
        // Where the file takes it, as `p.PA3` or as `GPIOA, 3`.
        let place = |pin: &str| {
            let (port, number) = pin.split_at(2);
            let words = [
                format!("p.{pin}"),
                format!("GPIO{}, {number}", port.trim_start_matches('P')),
            ];
            let found = words.iter().find_map(|word| {
                let mut places = source.match_indices(word).map(|(at, _)| at);
                places.find(|&at| {
                    !source[at + word.len()..].starts_with(|c: char| c.is_ascii_digit())
                })
            });
            found.unwrap_or_else(|| panic!("{file} does not take {pin}"))
        };
        let scan: Vec<usize> = SIGNALS[..5].iter().map(|name| place(pin(name))).collect();
        assert!(scan.is_sorted(), "{file}: {scan:?}");
        // Each by the field that it becomes.
        for (signal, field) in [
            ("GRIP", "grip"),
            ("RELEASE", "release"),
            ("STOP", "stop"),
            ("ACK", "acknowledge"),
            ("READY", "ready"),
            ("HOLDING", "holding"),
            ("LOST", "lost"),
            ("FAULT", "fault"),
        ] {
            let line = source[..place(pin(signal))].lines().last();
            let line = line.expect("a line").trim_start();
            assert!(line.starts_with(&format!("{field}: ")), "{file}: {line}");
        }
        let serial: Vec<usize> = SIGNALS[14..].iter().map(|name| place(pin(name))).collect();
        assert!(serial.is_sorted(), "{file}: {serial:?}");
        // Channel 1 of the converter, on each of these chips.
        assert_eq!(pin("COMMAND"), "PA4");
    }
    assert!(found > 0);
}

#[test]
fn scales_are_monotone_and_cover_what_the_finger_needs() {
    let most = Settings::of(&softgrip::settings::FACTORY)
        .regulator
        .max_pressure_kpa;
    assert!(most >= 160.0);
    let codes = (0..=4_095u16).map(|step| AdcCode(step * 16));
    let strain = |code| FE.strains(&[code; 3])[2].0;
    assert!(codes.clone().map(strain).is_sorted_by(|a, b| a < b));
    assert!(
        codes
            .clone()
            .map(|code| FE.pressure(code).0)
            .is_sorted_by(|a, b| a < b)
    );
    assert!(
        codes
            .map(|code| FE.supply(code).0)
            .is_sorted_by(|a, b| a < b)
    );
    let commands = (0..=1_600).map(|tenth| FE.command(Kilopascals(0.1 * tenth as f32)));
    assert!(commands.clone().is_sorted_by(|a, b| a < b));
    assert!(commands.max() <= Some(DacCode(4_095)));
    // Below its zero the converter's buffer ends, and nothing is commanded.
    assert_eq!(FE.command(Kilopascals(0.0)), DacCode(0));
    assert_eq!(FE.commanded(DacCode(0)), Kilopascals(0.0));
    assert_eq!(FE.commanded(DacCode(374)), Kilopascals(0.0));
    // The highest pressure is no fault of the wire where the rail is at its lowest, 5 % off.
    let highest = FE.monitor_code(Kilopascals(most + 5.0)) / 0.95;
    assert!(highest < f32::from(FE.monitor_high_above.0), "{highest}");
    // Free fingers at their highest pressure are on the scale.
    let free = FINGER.rows.map(|row| row.free_strain_ue);
    assert!(free.into_iter().all(|ue| ue < FE.amplifier.full_scale.0));
}

/// Codes of a file of `hardware/codes`, from the tick of the fault on.
fn codes(name: &str) -> Vec<AdcCode> {
    let file: PathBuf = root().join(format!("hardware/codes/{name}.csv"));
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{file:?}: {e}"));
    let code = |line: &str| AdcCode(line.split_once(',').expect(line).1.parse().expect(line));
    text.lines().skip(1).map(code).collect()
}

/// Ticks after the fault in which something is reported first, and all that is.
fn seen(
    board: &mut MockBoard,
    name: &str,
    put: impl Fn(&mut RawFrame, AdcCode),
) -> Vec<(u64, Fault, Option<u8>)> {
    board.events.clear();
    let codes = codes(name);
    let began_ms = board.now_ms();
    for tick in 0..400 {
        let mut frame = board.sense();
        put(&mut frame, codes[tick.min(codes.len() - 1)]);
        let outputs = board.act(&frame, Command::Continue);
        let now = board.now_ms() - began_ms;
        board
            .events
            .extend(outputs.events.iter().map(|&event| (now, event)));
        board.last = Some(outputs);
    }
    let fault = |&(ms, event): &(u64, Event)| match event {
        Event::Fault { fault, finger } => Some((ms, fault, finger)),
        _ => None,
    };
    board.events.iter().filter_map(fault).collect()
}

fn within_ms(fault: Fault) -> u64 {
    let rule = RULES.iter().find(|rule| rule.fault == fault);
    u64::from(rule.expect("every fault has a rule").within_ms)
}

fn at_rest() -> MockBoard {
    let mut board = MockBoard::new(Settings::default());
    board.run(1_100);
    board
}

#[test]
fn a_broken_shorted_or_swapped_wire_of_a_gauge_is_its_fault_within_its_time() {
    for (name, fault) in [
        ("gauge-open-sig", Fault::GaugeOpen),
        ("gauge-open-gnd", Fault::GaugeOpen),
        ("gauge-unplugged", Fault::GaugeOpen),
        ("gauge-short-sig-exc", Fault::GaugeOpen),
        ("gauge-swapped-sig-exc", Fault::GaugeOpen),
        ("gauge-open-exc", Fault::GaugeShort),
        ("gauge-short-sig-gnd", Fault::GaugeShort),
        ("gauge-short-exc-gnd", Fault::GaugeShort),
        ("gauge-swapped-sig-gnd", Fault::GaugeShort),
        ("gauge-beyond-scale", Fault::GaugeSaturated),
    ] {
        for finger in 0..3 {
            let mut board = at_rest();
            let found = seen(&mut board, name, |frame, code| frame.gauges[finger] = code);
            let [(ms, which, Some(of))] = found[..] else {
                panic!("{name}: {found:?}");
            };
            assert_eq!((which, usize::from(of)), (fault, finger), "{name}");
            assert!(ms <= within_ms(fault), "{name}: after {ms} ms");
        }
    }
}

#[test]
fn a_finger_that_swings_beyond_the_scale_and_back_is_no_fault() {
    let mut board = at_rest();
    board.touch_kpa = 1e3;
    board.step(Command::Grip(Grip::Pressure(Kilopascals(160.0))));
    board.run(2_500);
    let name = "gauge-swings-beyond-scale";
    let AdcCode(from) = codes(name)[0];
    let found = seen(&mut board, name, |frame, AdcCode(code)| {
        let AdcCode(now) = frame.gauges[1];
        let swung = now + (code - from.min(code));
        frame.gauges[1] = AdcCode(swung);
    });
    assert_eq!(found, []);
    // It did leave the scale.
    let highest = codes(name).into_iter().max().expect("some");
    assert!(highest > FE.amplifier.linear[1] && highest < FE.amplifier.open_above);
}

/// At rest such a gauge shows nothing: its bridge is upside down, and its strain negative.
#[test]
fn a_gauge_whose_exc_and_gnd_are_swapped_is_refused_by_the_sweep() {
    let mut board = at_rest();
    let mut refused = false;
    for tick in 0..60_000 {
        let mut frame = board.sense();
        let AdcCode(code) = frame.gauges[1];
        frame.gauges[1] = AdcCode((2.0 * FE.amplifier.zero - f32::from(code)) as u16);
        let command = if tick == 0 {
            Command::Sweep
        } else {
            Command::Continue
        };
        let outputs = board.act(&frame, command);
        let over = |event: &Event| matches!(event, Event::Swept { .. } | Event::Refused(_));
        if let Some(event) = outputs.events.iter().find(|&event| over(event)) {
            refused = matches!(event, Event::Refused(Refusal::SweepRejected(_)));
            break;
        }
    }
    assert!(refused);
    assert!(board.controller.take_calibration().is_none());
}

#[test]
fn a_reference_that_is_lost_fails_all_gauges_within_their_time() {
    let mut board = MockBoard::holding(Settings::default());
    let found = seen(&mut board, "reference-lost", |frame, code| {
        frame.gauges = [code; 3];
    });
    let shorts = found.iter().filter(|(ms, fault, _)| {
        *fault == Fault::GaugeShort && *ms <= within_ms(Fault::GaugeShort)
    });
    assert!(shorts.count() >= 3, "{found:?}");
}

#[test]
fn a_monitor_whose_wire_breaks_is_lost_within_its_time() {
    let mut board = MockBoard::holding(Settings::default());
    let found = seen(&mut board, "monitor-open", |frame, code| {
        frame.monitor = code
    });
    let &(ms, first, _) = found.first().expect("a fault");
    assert_eq!(first, Fault::MonitorLost);
    assert!(ms <= within_ms(first), "after {ms} ms");
}

#[test]
fn a_monitor_with_24_v_on_its_wire_vents_within_its_time() {
    let mut board = MockBoard::holding(Settings::default());
    let found = seen(&mut board, "monitor-24v", |frame, code| {
        frame.monitor = code
    });
    // On its way up it passes pressures that are too high.
    let &(ms, first, _) = found.first().expect("a fault");
    assert!(
        matches!(first, Fault::OverPressure | Fault::MonitorHigh),
        "{found:?}"
    );
    assert!(ms <= within_ms(Fault::MonitorHigh), "after {ms} ms");
    assert_eq!(board.commanded_kpa(), 0.0);
    // It ends above all of them.
    assert!(codes("monitor-24v").last() > Some(&FE.monitor_high_above));
}

#[test]
fn a_supply_that_fails_is_told_within_its_time() {
    let mut board = MockBoard::holding(Settings::default());
    let name = "supply-fails";
    let found = seen(&mut board, name, |frame, code| frame.supply = code);
    let &(ms, first, _) = found.first().expect("a fault");
    assert_eq!(first, Fault::SupplyLow);
    // The divider's capacitor sees it a little later.
    let least = Settings::default().grip.supply_min_v;
    let low = codes(name)
        .into_iter()
        .position(|code| FE.supply(code).0 < least);
    let since = low.expect("it falls below") as u64;
    assert!(ms - since <= within_ms(first), "after {ms} ms");
}

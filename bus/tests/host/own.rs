//! The own block: commands, values, settings, and what it refuses.

use crate::line::{Bus, ID, REQUEST};
use crate::mock::{GaugeState, adjusted};
use bus::robot::{Access, REGISTERS, SETTINGS_FROM};
use softgrip::Command;
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;

const STATE: u16 = 0x1010;
const PARAMETERS: u16 = 0x1100;
const COMMAND: u16 = 0x1104;
const RESULT: u16 = 0x1106;

fn float(words: &[u16]) -> f32 {
    f32::from_bits(u32::from(words[0]) << 16 | u32::from(words[1]))
}

fn halves(value: f32) -> [u16; 2] {
    let bits = value.to_bits();
    [(bits >> 16) as u16, bits as u16]
}

fn setting(number: u16) -> u16 {
    SETTINGS_FROM + 2 * number
}

#[test]
fn it_grips_at_a_pressure_and_for_a_payload_without_an_activation() {
    let mut bus = Bus::new(Settings::default());
    bus.board.grip = [1.0; 3];
    // 100 kPa, all in one request.
    bus.write(PARAMETERS + 3, &[1_000, 2]);
    assert_eq!(bus.read_one(STATE), 2);
    bus.run(2_000);
    assert_eq!(bus.read_one(STATE), 3);
    let pressure = bus.read_one(0x1013);
    assert!((990..=1_010).contains(&pressure), "{pressure}");
    assert_eq!(bus.read(RESULT, 2), [1, 0]);
    bus.write(COMMAND, &[4]);
    assert_eq!(bus.read_one(STATE), 5);
    bus.run(2_000);
    assert_eq!(bus.read_one(STATE), 1);

    // 60 g at 2 m/s², a cylinder.
    bus.write(PARAMETERS, &[60, 2_000, 1, 0, 3]);
    bus.run(2_000);
    assert_eq!(bus.read_one(STATE), 3);
    let margin = bus.read_one(0x1017);
    assert!((150..=250).contains(&margin), "{margin}");
    // The pressure of the settings.
    bus.write(COMMAND, &[1]);
    bus.run(2_000);
    assert_eq!(bus.read_one(0x1014), 1_400);
}

#[test]
fn what_is_refused_is_there_with_its_number_and_what_would_be_possible() {
    let mut bus = Bus::new(Settings::default());
    bus.write(PARAMETERS, &[60_000, 0, 0, 0, 3]);
    let words = bus.read(RESULT, 3);
    assert_eq!(words[..2], [3, 4]);
    assert!((100..=400).contains(&words[2]), "{} g", words[2]);
    // That much is lifted.
    bus.write(PARAMETERS, &[words[2], 0, 0, 0, 3]);
    assert_eq!(bus.read_one(RESULT), 1);
    // A sweep needs open fingers.
    bus.write(COMMAND, &[8]);
    assert_eq!(bus.read(RESULT, 2), [3, 8]);
    assert_eq!(bus.read_one(0x1046), 2);
}

#[test]
fn values_out_of_their_range_change_nothing() {
    let mut bus = Bus::new(Settings::default());
    bus.write(PARAMETERS, &[1, 2, 1, 1_600]);
    for (address, values) in [
        (PARAMETERS + 2, vec![2]),
        (PARAMETERS + 3, vec![1_601]),
        (COMMAND, vec![12]),
        (COMMAND + 1, vec![2]),
        // All or nothing.
        (PARAMETERS, vec![9, 9, 9]),
        (PARAMETERS, vec![9, 9, 0, 0, 1, 7]),
    ] {
        let pdu = crate::line::writing(address, &values);
        assert_eq!(bus.refused(&pdu), 3, "{address:#x} {values:?}");
        assert_eq!(bus.read(PARAMETERS, 6), [1, 2, 1, 1_600, 0, 0]);
    }
    assert_eq!(bus.board.state(), State::Idle);
}

#[test]
fn every_register_reads_and_only_those_that_may_be_written_are() {
    let mut bus = Bus::new(Settings::default());
    for register in REGISTERS {
        let count = register.item.shape().count();
        bus.read_by(3, register.address, count);
        bus.read_by(4, register.address, count);
        let pdu = crate::line::writing(register.address, &vec![0; count.into()]);
        match register.item.access() {
            Access::ReadWrite => assert_eq!(bus.ask(&pdu), pdu[..5], "{register:?}"),
            Access::Read => assert_eq!(bus.refused(&pdu), 2, "{register:?}"),
        }
    }
    // Beside them there is nothing.
    for address in [0, 0x03E7, 0x03EB, 0x07D6, 0x0FFF, 0x1008, 0x1026, 0x110B] {
        assert_eq!(
            bus.refused(&[3, (address >> 8) as u8, address as u8, 0, 1]),
            2
        );
    }
}

#[test]
fn a_halt_a_stop_and_an_acknowledgement_do_what_they_say() {
    let mut bus = Bus::new(Settings::default());
    bus.write(COMMAND, &[1]);
    bus.run(250);
    let there = bus.board.pressure_kpa;
    bus.write(COMMAND, &[10]);
    bus.run(1_000);
    assert!((bus.board.pressure_kpa - there).abs() < 3.0);
    bus.write(COMMAND, &[5]);
    assert_eq!(bus.read(STATE, 2), [6, 48]);
    bus.run(400);
    bus.write(COMMAND, &[6]);
    bus.run(2);
    assert_eq!(bus.read_one(STATE + 1), 0);
}

#[test]
fn a_tare_and_a_sweep_are_counted_once_they_have_succeeded() {
    let mut bus = Bus::new(Settings::default());
    bus.run(500);
    bus.write(COMMAND, &[7]);
    assert_eq!(bus.read(0x1047, 1), [0]);
    bus.run(2_000);
    assert_eq!(bus.read(0x1046, 2), [0, 1]);
    bus.write(COMMAND, &[8]);
    assert_eq!(bus.read_one(STATE), 7);
    // Settings are for later.
    let pdu = crate::line::writing(setting(401), &halves(100.0));
    assert_eq!(bus.refused(&pdu), 6);
    bus.run(120_000);
    assert_eq!(bus.read_one(STATE), 1);
    let swept = bus
        .board
        .count(|event| matches!(event, Event::Swept { .. }));
    let words = bus.read(0x1046, 3);
    assert_eq!((usize::from(words[2]), words[0]), (swept, 1 - swept as u16));
    bus.write(setting(401), &halves(100.0));
}

#[test]
fn the_hint_about_the_arm_reaches_the_controller() {
    let mut bus = Bus::new(Settings::default());
    bus.write(COMMAND + 1, &[1]);
    assert_eq!(bus.read_one(RESULT), 1);
    assert_eq!(bus.read_one(COMMAND + 1), 1);
}

#[test]
fn settings_are_read_and_written_by_number_as_a_whole_between_two_ticks() {
    let mut bus = Bus::new(Settings::default());
    assert_eq!(float(&bus.read(setting(400), 2)), 140.0);
    // 500 to 502 lie side by side.
    let words = bus.read(setting(500), 6);
    assert_eq!(words, [halves(1.0); 3].concat());
    assert_eq!(bus.read_one(0x1109), 0);
    bus.write(setting(400), &halves(90.5));
    assert_eq!(float(&bus.read(setting(400), 2)), 90.5);
    assert_eq!(bus.board.controller.active().grip_pressure().0, 90.5);
    assert_eq!(bus.read_one(0x1109), 1);

    bus.write(COMMAND, &[9]);
    assert!(bus.work.expect("done").save);
    bus.robot.stored(true);
    assert_eq!(bus.read_one(0x1109), 0);
}

#[test]
fn settings_that_cannot_be_are_refused_and_nothing_is_changed() {
    let mut bus = Bus::new(Settings::default());
    let before = bus.values;
    let [upper, lower] = halves(120.0);
    for (address, values, exception) in [
        // Half a value, and one and a half.
        (setting(400), vec![upper], 2),
        (setting(400) + 1, vec![lower], 2),
        (setting(400), vec![upper, lower, upper], 2),
        // No such settings.
        (setting(399), vec![upper, lower], 2),
        (setting(1_999), vec![upper, lower], 2),
        (setting(0x7ff), vec![upper, lower, upper, lower], 2),
        // Out of range, no number, no choice, no whole id.
        (setting(400), halves(0.5).to_vec(), 3),
        (setting(400), halves(f32::NAN).to_vec(), 3),
        (setting(406), halves(2.0).to_vec(), 3),
        (setting(900), halves(9.5).to_vec(), 3),
        // Not together with another.
        (setting(100), halves(100.0).to_vec(), 3),
        // All or nothing.
        (
            setting(500),
            [halves(1.5), halves(9.0), halves(1.0)].concat(),
            3,
        ),
    ] {
        let pdu = crate::line::writing(address, &values);
        assert_eq!(bus.refused(&pdu), exception, "{address:#x} {values:04x?}");
        assert_eq!(bus.values, before);
    }
    assert_eq!(bus.read_one(0x1109), 0);
    assert_eq!(bus.read(0x1042, 1), [12]);
}

#[test]
fn reading_settings_that_there_are_none_of_is_refused() {
    let mut bus = Bus::new(Settings::default());
    for number in [0, 99, 399, 0x7ff] {
        let [upper, lower] = setting(number).to_be_bytes();
        assert_eq!(bus.refused(&[3, upper, lower, 0, 2]), 2, "{number}");
    }
    for number in [100, 901] {
        bus.read(setting(number), 2);
    }
}

#[test]
fn the_finger_the_version_and_the_limits_are_there() {
    let mut bus = Bus::new(adjusted(|s| s.regulator.max_pressure_kpa = 150.0));
    let words = bus.read(0x1000, 8);
    assert_eq!(words[0], bus::robot::MAP_VERSION);
    let version: Vec<u16> = env!("CARGO_PKG_VERSION")
        .split('.')
        .map(|number| number.parse().expect("a number"))
        .collect();
    assert_eq!(words[1], 256 * version[0] + version[1]);
    let table = &softgrip::table::FINGER;
    let hash = u64::from(words[2]) << 16 | u64::from(words[3]);
    assert_eq!(hash, table.inputs_hash >> 32);
    assert_eq!(words[6], 1_500);
    let bend = table.rows[table.rows.len() - 1].tip_angle_deg;
    assert!((f32::from(words[7]) / 10.0 - bend).abs() < 0.06);
    bus.run(5_000);
    let words = bus.read(0x1004, 2);
    let uptime = u64::from(words[0]) << 16 | u64::from(words[1]);
    assert_eq!(uptime, bus.board.now_ms());
}

#[test]
fn a_request_before_the_answer_to_another_is_busy_and_takes_nothing_from_it() {
    for id in [ID, 0] {
        let mut bus = Bus::activated(Settings::default());
        let close = Bus::framed_for(id, &crate::line::writing(REQUEST, &[0x0900, 255, 0xffff]));
        let read = Bus::framed(&[3, 0x07, 0xD0, 0, 3]);
        let take = |bus: &mut Bus, bytes: &[u8]| {
            let now = bus.now();
            bytes
                .iter()
                .for_each(|&byte| bus.receiver.receive(now, byte));
            let frame = bus.receiver.frame(now).expect("a frame");
            bus.robot
                .request(now, &frame, &mut bus.values, &mut bus.reply)
        };
        let work = take(&mut bus, &close).expect("accepted");
        bus.link.ask(work.wishes);
        assert_eq!(take(&mut bus, &read), None);
        assert_eq!(bus.reply.bytes()[..3], [ID, 0x83, 6]);
        let answer = bus.tick().expect("done in one tick");
        assert_eq!(answer.is_empty(), id == 0);
        assert_eq!(bus.shown().obj, 0);
        // A control tick that never answers blocks nobody for ever.
        take(&mut bus, &read).expect("accepted");
        bus.board.now_us += 100_001;
        take(&mut bus, &read).expect("accepted");
    }
}

#[test]
fn a_broadcast_is_done_and_not_answered() {
    let mut bus = Bus::activated(Settings::default());
    let close = crate::line::writing(REQUEST, &[0x0900, 255, 0xffff]);
    assert_eq!(bus.exchange(&Bus::framed_for(0, &close)), []);
    assert_eq!((bus.shown().pr, bus.shown().obj), (255, 0));
    // Nor is one that is refused.
    let wrong = crate::line::writing(COMMAND, &[99]);
    assert_eq!(bus.exchange(&Bus::framed_for(0, &wrong)), []);
    bus.shown();
}

#[test]
fn a_robot_that_says_nothing_for_the_time_of_the_settings_is_a_fault_and_any_request_is_a_word() {
    let settings = adjusted(|s| s.grip.host_timeout_ms = 200.0);
    // Reads, writes of the same, broadcasts.
    for pdu in [
        vec![3, 0x07, 0xD0, 0, 1],
        crate::line::writing(REQUEST, &[0, 0, 0]),
    ] {
        let mut bus = Bus::new(settings);
        bus.write(COMMAND, &[1]);
        for id in [9, 0].repeat(10) {
            bus.run(190);
            bus.exchange(&Bus::framed_for(id, &pdu));
            assert_eq!(bus.board.state().fault(), None);
        }
        // For others, or wrong: no word.
        for bytes in [Bus::framed_for(8, &pdu), Bus::framed(&[3, 0, 0, 0, 1])] {
            bus.run(150);
            bus.exchange(&bytes);
        }
        assert!(matches!(bus.board.state(), State::Fault { .. }));
    }
}

#[test]
fn a_stop_drops_what_the_bus_wanted_and_says_so() {
    let mut bus = Bus::activated(Settings::default());
    bus.pins = Command::Stop;
    bus.write(REQUEST, &[0x0900, 255, 0xffff]);
    assert_eq!(bus.read(RESULT, 1), [4]);
    assert_eq!(bus.shown().flt, 0xC);
    bus.pins = Command::Continue;
    // Nothing comes of it later.
    bus.run(1_000);
    assert_eq!(bus.board.pressure_kpa.round(), 0.0);
}

#[test]
fn values_are_those_of_the_tick() {
    let mut bus = Bus::new(Settings::default());
    bus.board.grip = [1.0, 0.9, 0.8];
    bus.write(PARAMETERS, &[60, 2_000, 0, 0, 3]);
    for ms in [100, 400, 1_500, 3_000] {
        bus.run(ms);
        let words = bus.read(0x1010, 0x16);
        let snapshot = bus.board.last.as_ref().expect("a tick").snapshot;
        let signed = |number: Option<f32>, parts: f32| match number {
            Some(number) => (parts * number).round() as i16 as u16,
            None => 0x8000,
        };
        let one = |number: f32, parts| signed(Some(number), parts);
        let residual = snapshot.residual.map(|ue| signed(ue.map(|ue| ue.0), 1.0));
        let noise = snapshot.noise.map(|ue| one(ue.0, 10.0));
        let drift = snapshot.drift.map(|ue| one(ue.0, 1.0));
        let bit = |on: bool, bit: u16| u16::from(on) << bit;
        assert_eq!(
            words[2],
            bit(snapshot.state.is_holding(), 0) | bit(snapshot.tare_due, 2)
        );
        assert_eq!(
            words[3..8],
            [
                signed(snapshot.pressure.map(|kpa| kpa.0), 10.0),
                one(snapshot.setpoint.0, 10.0),
                one(snapshot.bend.0, 10.0),
                signed(snapshot.level, 1e3),
                signed(snapshot.margin, 1e3),
            ]
        );
        let [a, b, c] = snapshot.touching;
        assert_eq!(words[8], bit(a, 0) | bit(b, 1) | bit(c, 2));
        assert_eq!(words[9..12], residual);
        assert_eq!(words[12..15], noise);
        assert_eq!(words[15..18], drift);
    }
    let snapshot = bus.board.last.as_ref().expect("a tick").snapshot;
    assert!(snapshot.level.is_some() && snapshot.margin.is_some());
    assert!(snapshot.touching == [true; 3]);
}

#[test]
fn a_tare_that_is_due_and_a_drift_that_is_tracked_are_shown() {
    let mut bus = Bus::new(Settings::default());
    bus.run(2_000);
    // The zero of a gauge creeps away.
    for ms in 0..220_000 {
        bus.board.gauges[1] = GaugeState::Offset(ms as f32 * 5e-3);
        bus.run(1);
    }
    let snapshot = bus.board.last.as_ref().expect("a tick").snapshot;
    assert!(snapshot.tare_due, "{snapshot:?}");
    assert_eq!(bus.read_one(0x1012), 4);
    let drift: Vec<i16> = bus
        .read(0x101F, 3)
        .iter()
        .map(|word| word.cast_signed())
        .collect();
    assert!(drift[1] > 50 && drift[1] > 2 * drift[0].abs(), "{drift:?}");
}

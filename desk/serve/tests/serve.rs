//! Clients of the virtual gripper, good ones and others. Only order and content count: the machine may be busy.
#![cfg(unix)]

mod client;

use std::thread;
use std::time::Duration;

use client::{Gripper, LONG, Way, framed, read, tcp, tty, write};
use serve::port::Port;

fn on_tcp(script: &str) -> (Gripper, Way) {
    let port = Port::tcp("127.0.0.1:0".parse().expect("an address")).expect("a port");
    let gripper = Gripper::start(port, script);
    let way = tcp(&gripper.name);
    (gripper, way)
}

fn on_tty() -> Gripper {
    Gripper::start(Port::tty(None).expect("a pseudo-terminal"), "")
}

/// Closes until something is held.
fn grip(way: &mut Way) {
    way.write([0, 0, 0]);
    way.write([0x0100, 0, 0]);
    while way.read(0x07D0) >> 12 & 3 != 3 {}
    way.write([0x0900, 255, 0xFFFF]);
    let mut object = 0;
    while object == 0 {
        object = way.read(0x07D0) >> 14;
    }
    assert_eq!(object, 2);
}

#[test]
fn requests_are_answered_and_a_client_follows_another_on_both_kinds_of_port() {
    let gripper = on_tty();
    let (on_tcp, _) = on_tcp("");
    for count in 1..=3_u16 {
        for mut way in [tty(&gripper.name), tcp(&on_tcp.name)] {
            way.write([0, count, 0]);
            assert_eq!(way.read(0x07D1), count);
        }
    }
    let (said, summary) = gripper.end();
    assert_eq!(summary.answers, 6);
    let clients = said.iter().filter(|line| line.contains("has opened"));
    assert_eq!(clients.count(), 3, "{said:?}");
    let (said, summary) = on_tcp.end();
    assert_eq!(summary.answers, 6);
    assert!(said.len() >= 3, "{said:?}");
}

#[test]
fn what_is_no_request_is_answered_with_an_exception_or_not_at_all_and_the_next_one_is_served() {
    let (gripper, mut way) = on_tcp("");
    for (pdu, exception) in [
        (&[5, 0, 0, 0xff, 0][..], 1),
        (&[43, 14, 1, 0], 1),
        (&[3, 0x40, 0, 0, 1], 2),
        (&[3, 0x07, 0xD0, 0, 7], 2),
        (&[6, 0x07, 0xD0, 0, 1], 2),
        (&[16, 0x03, 0xE8, 0, 4, 8, 0, 0, 0, 0, 0, 0, 0, 0], 2),
        (&[3, 0x07, 0xD0, 0, 0], 3),
        (&[3, 0x07, 0xD0, 0, 126], 3),
        (&[6, 0x11, 0x02, 0, 9], 3),
    ] {
        let answer = way.ask(&framed(pdu), 5);
        assert_eq!(answer, framed(&[pdu[0] | 0x80, exception]), "{pdu:?}");
    }
    let mut damaged = read(0x07D0, 1);
    damaged[7] ^= 1;
    let mut foreign = read(0x07D0, 1);
    foreign[0] = 10;
    let broadcast = {
        let mut frame = vec![0, 6, 0x03, 0xE9, 0, 55];
        let sum = bus::modbus::crc(&frame);
        frame.extend(sum.to_le_bytes());
        frame
    };
    let noise: Vec<u8> = (0..600_u32).map(|n| (n * 97 + 13) as u8).collect();
    for rubbish in [&damaged[..], &foreign, &[9, 3, 7], &noise, &broadcast] {
        way.send(rubbish);
        assert!(way.is_silent(), "{rubbish:02x?}");
    }
    // The broadcast was one, though.
    assert_eq!(way.read(0x07D1), 55);
    gripper.end();
}

#[test]
fn a_flood_of_rubbish_stops_nothing() {
    let rubbish: Vec<u8> = (0..997_u32).map(|n| (n * n * 31 + n) as u8).collect();
    let (on_tcp, tcp) = on_tcp("");
    let on_tty = on_tty();
    let tty = tty(&on_tty.name);
    for (gripper, mut way) in [(on_tcp, tcp), (on_tty, tty)] {
        way.write([0, 3, 0]);
        let taken = way.flood(&rubbish, Duration::from_secs(1));
        assert!(taken > 100_000, "{taken}");
        way.write([0, 4, 0]);
        assert_eq!(way.read(0x07D1), 4);
        let (_, summary) = gripper.end();
        assert!(summary.ticks > 500, "{summary:?}");
    }
}

#[test]
fn two_requests_in_one_piece_are_both_answered_and_one_in_two_pieces_is_too() {
    let (gripper, mut way) = on_tcp("");
    let mut both = write([0, 11, 0]);
    both.extend(read(0x07D1, 1));
    way.send(&both);
    let answer = way.receive(8 + 7, LONG);
    assert_eq!(answer[8..], framed(&[3, 2, 0, 11]));
    // A machine that is too busy to pass the second half on within 20 ms makes two bad frames of it.
    let halves = read(0x07D1, 1);
    let answered = (0..50).any(|_| {
        way.send(&halves[..4]);
        thread::sleep(Duration::from_millis(2));
        way.send(&halves[4..]);
        way.receive(7, client::SILENCE).len() == 7
    });
    assert!(answered);
    gripper.end();
}

#[test]
fn a_client_that_has_gone_leaves_nothing_to_the_next_one() {
    let mut gripper = on_tty();
    for round in 0..50_u16 {
        // Killed before it has read, and with a request on the way.
        let mut way = tty(&gripper.name);
        way.write([0, 200, 0]);
        way.send(&read(0x07D0, 6));
        if round % 2 == 0 {
            thread::sleep(Duration::from_millis(10));
        }
        way.send(&read(0x07D0, 6));
        drop(way);
        gripper.wait_for_so_many(2 * usize::from(round) + 1, "has gone");
        thread::sleep(Duration::from_millis(u64::from(round % 25)));

        let mut way = tty(&gripper.name);
        let answer = way.ask(&write([0, round, 0]), 8);
        assert_eq!(answer, framed(&[16, 0x03, 0xE8, 0, 3]), "round {round}");
        assert_eq!(way.read(0x07D1), round);
        drop(way);
        gripper.wait_for_so_many(2 * usize::from(round) + 2, "has gone");
    }
    gripper.end();
}

#[test]
fn a_client_that_does_not_read_does_not_stop_the_gripper() {
    let (mut on_tcp, mut tcp) = on_tcp("");
    let mut on_tty = on_tty();
    let mut tty = tty(&on_tty.name);
    for (gripper, way) in [(&mut on_tcp, &mut tcp), (&mut on_tty, &mut tty)] {
        grip(way);
        gripper.wait_for("holding");
        for _ in 0..600 {
            way.send(&read(0x07D0, 6));
            thread::sleep(Duration::from_millis(2));
        }
    }
    for gripper in [on_tcp, on_tty] {
        let (_, summary) = gripper.end();
        assert!(summary.ticks > 1200, "{summary:?}");
    }
}

#[test]
fn a_new_client_takes_the_place_of_the_old_one_on_tcp() {
    let (gripper, mut old) = on_tcp("");
    old.write([0, 1, 0]);
    let mut new = tcp(&gripper.name);
    new.write([0, 2, 0]);
    assert_eq!(new.read(0x07D1), 2);
    let (said, _) = gripper.end();
    assert!(said[1].contains("takes the place"), "{said:?}");
}

#[test]
fn a_script_acts_on_events_and_registers_and_ends_it() {
    let script = "\
        [[step]]\n when = { event = 'holding' }\n after_s = 0.1\n arm = 'lift'\n accel_m_s2 = 2.0\n\
        [[step]]\n when = { register = 0x03EA, equals = 0x1234 }\n object = 'pull out'\n\
        [[step]]\n when = { event = 'lost' }\n supply_v = 24.5\n\
        [[step]]\n when = { register = 0x07D0, mask = 0xC000, equals = 0xC000 }\n fault = 'gauge-open:2'\n\
        [[step]]\n when = { event = 'fault' }\n fault = 'none'\n\
        [[step]]\n arm = 'lift'\n accel_m_s2 = 2.0\n\
        [[step]]\n arm = 'lower'\n accel_m_s2 = 2.0\n\
        [[step]]\n when = { register = 0x03E9, equals = 0 }\n object = 'appear'\n\
        [[step]]\n supply_v = 12.0\n\
        [[step]]\n when = { event = 'fault' }\n end = true\n";
    let (mut gripper, mut way) = on_tcp(script);
    grip(&mut way);
    gripper.wait_for("the arm is lifted");
    way.write([0x0900, 255, 0x1234]);
    gripper.wait_for("LOST");
    gripper.wait_for("FAULT 16");
    gripper.wait_for("the arm is lowered");
    while way.read(0x07D0) >> 14 != 3 {}
    way.write([0x0900, 0, 0xFFFF]);
    gripper.wait_for("an object appears");
    gripper.wait_for("FAULT 5");
    gripper.wait_for("the end");
    let (said, _) = gripper.end();
    let order = [
        "holding",
        "line 1: the arm is lifted",
        "line 6: the object is pulled out",
        "LOST",
        "24.5 V",
        "breaks: gauge-open, finger 2",
        "FAULT 16",
        "whole again",
        "the arm stays: it is up already",
        "the arm is lowered",
        "an object appears",
        "12 V",
        "FAULT 5",
        "the end",
    ];
    let mut lines = said.iter();
    for text in order {
        assert!(lines.any(|line| line.contains(text)), "{text}: {said:#?}");
    }
}

#[test]
fn a_stable_name_leads_to_the_terminal_and_is_gone_in_the_end() {
    let dir = tempfile::tempdir().expect("a folder");
    let link = dir.path().join("gripper");
    for _ in 0..2 {
        let gripper = Gripper::start(Port::tty(Some(&link)).expect("a link"), "");
        assert_eq!(gripper.name, link.display().to_string());
        let mut way = tty(&link);
        way.write([0, 9, 0]);
        let taken = Port::tty(Some(&link)).err().expect("it is taken");
        assert!(
            taken.to_string().contains("is taken: it leads to /dev/"),
            "{taken}"
        );
        assert_eq!(way.read(0x07D1), 9);
        gripper.end();
        assert!(link.symlink_metadata().is_err());
        // What a killed one leaves is replaced.
        std::os::unix::fs::symlink(dir.path().join("nowhere"), &link).expect("a link");
    }
    std::fs::remove_file(&link).expect("the link");
    std::fs::write(&link, "").expect("a file");
    let file = Port::tty(Some(&link)).err().expect("a file is in the way");
    assert!(file.to_string().contains("no link"), "{file}");
    let nowhere = dir.path().join("no/such/folder");
    let error = format!("{:#}", Port::tty(Some(&nowhere)).err().expect("no folder"));
    assert!(error.contains("a folder that you may write to"), "{error}");
}

#[test]
fn a_tcp_port_that_is_taken_is_named() {
    let port = Port::tcp("127.0.0.1:0".parse().expect("an address")).expect("a port");
    let again = Port::tcp(port.name().parse().expect("an address"));
    let error = format!("{:#}", again.err().expect("it is taken"));
    assert!(
        error.contains(&port.name()) && error.contains("another port"),
        "{error}"
    );
}

//! What real drivers of the Robotiq convention need, each by its name.

use crate::line::{Bus, ID, REQUEST, STATUS, Shown};
use softgrip::settings::Settings;

#[test]
fn the_published_frame_of_an_activation_has_its_published_answer() {
    let mut bus = Bus::new(Settings::default());
    let request = [
        0x09, 0x10, 0x03, 0xE8, 0x00, 0x03, 0x06, 0, 0, 0, 0, 0, 0, 0x73, 0x30,
    ];
    let answer = [0x09, 0x10, 0x03, 0xE8, 0x00, 0x03, 0x01, 0x30];
    assert_eq!(bus.exchange(&request), answer);
    assert_eq!(ID, 9);
}

#[test]
fn one_to_six_status_registers_are_read_by_03_and_04_alike_and_the_last_three_are_0() {
    let mut bus = Bus::activated(Settings::default());
    bus.go(200);
    bus.run(1_500);
    let all = bus.read(STATUS, 6);
    assert_eq!(all[3..], [0; 3]);
    for count in 1..=6 {
        for function in [3, 4] {
            let words = bus.read_by(function, STATUS, count);
            assert_eq!(words, all[..usize::from(count)], "{function} {count}");
        }
    }
    // A driver wants exactly 17 bytes.
    let request = Bus::framed(&[3, 0x07, 0xD0, 0, 6]);
    assert_eq!(bus.exchange(&request).len(), 17);
}

#[test]
fn a_write_of_one_or_two_registers_leaves_the_others_as_they_were() {
    let mut bus = Bus::activated(Settings::default());
    bus.write(REQUEST, &[0x0100, 10, 0x2030]);
    bus.write(REQUEST, &[0x0900]);
    assert_eq!(bus.read(REQUEST, 3), [0x0900, 10, 0x2030]);
    bus.write(REQUEST + 1, &[20]);
    assert_eq!(bus.read(REQUEST, 3), [0x0900, 20, 0x2030]);
    bus.write(REQUEST + 1, &[30, 0x4050]);
    assert_eq!(bus.read(REQUEST, 3), [0x0900, 30, 0x4050]);
    bus.write(REQUEST + 2, &[0x6070]);
    assert_eq!(bus.read(REQUEST, 3), [0x0900, 30, 0x6070]);
    let one = [6, 0x03, 0xE9, 0, 40];
    assert_eq!(bus.ask(&one), one);
    assert_eq!(bus.read(REQUEST, 3), [0x0900, 40, 0x6070]);
    assert_eq!(bus.shown().pr, 40);
}

#[test]
fn function_23_writes_before_it_reads() {
    let mut bus = Bus::activated(Settings::default());
    let words = bus.write_read(REQUEST, &[0x0900, 255, 0xffff], STATUS, 3);
    let shown = Shown::of(&words);
    assert_eq!((shown.pr, shown.gto, shown.obj), (255, true, 0));
}

#[test]
fn a_write_shows_in_the_next_answer() {
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST, &[0, 0, 0]);
    assert_eq!(bus.shown().sta, 0);
    bus.write(REQUEST, &[0x0100, 0, 0]);
    let shown = bus.shown();
    assert_eq!((shown.act, shown.sta), (true, 1));
    bus.run(200);
    assert_eq!(bus.shown().sta, 3);
    for position in [200, 0, 100, 255, 3] {
        let shown = bus.go(position);
        assert_eq!((shown.obj, shown.pr), (0, position));
        bus.run(3_000);
        assert_eq!(bus.shown().obj, 3);
    }
}

#[test]
fn gpr_echoes_rpr_also_without_an_activation() {
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST, &[0, 100, 0]);
    assert_eq!(bus.shown().pr, 100);
    bus.run(1_000);
    let shown = bus.shown();
    assert_eq!((shown.cu, shown.flt), (0, 0));
}

#[test]
fn the_same_command_rewritten_at_100_hz_changes_nothing() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.grip = [1.0; 3];
    let command = [0x0900, 220, 0xffff];
    bus.write(REQUEST, &command);
    for _ in 0..200 {
        bus.run(8);
        bus.write(REQUEST, &command);
    }
    assert_eq!(bus.shown().obj, 2);
    let before = bus.board.events.len();
    for _ in 0..200 {
        bus.run(7);
        bus.write(REQUEST, &command);
        assert_eq!(bus.shown().obj, 2);
    }
    assert_eq!(bus.board.events.len(), before);
    // Nor does it take a loss away.
    bus.board.grip = [0.0; 3];
    bus.run(200);
    for _ in 0..200 {
        bus.run(7);
        bus.write(REQUEST, &command);
        let shown = bus.shown();
        assert_eq!((shown.obj, shown.pr), (3, 220));
    }
}

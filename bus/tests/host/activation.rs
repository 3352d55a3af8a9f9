//! Activation and automatic release, as drivers know them.

use crate::line::{Bus, REQUEST, STATUS, Shown};
use softgrip::Command;
use softgrip::grasp::State;
use softgrip::settings::Settings;

#[test]
fn an_activation_takes_at_least_100_ms_and_ends_when_the_fingers_are_open_or_after_3_s() {
    // Open fingers.
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST, &[0, 0, 0]);
    let ms = activation_ms(&mut bus);
    assert!((100..=110).contains(&ms), "{ms} ms");
    // Closed ones.
    bus.go(255);
    bus.run(1_500);
    bus.write(REQUEST, &[0]);
    let ms = activation_ms(&mut bus);
    assert!((200..=1_500).contains(&ms), "{ms} ms");
    bus.run(500);
    assert_eq!(bus.shown().po, 3);
    // Fingers that a stop holds closed.
    bus.go(255);
    bus.run(1_500);
    bus.pins = Command::Stop;
    bus.run(1);
    bus.write(REQUEST, &[0]);
    let ms = activation_ms(&mut bus);
    assert!((2_990..=3_010).contains(&ms), "{ms} ms");
}

/// From rACT 0→1 to gSTA = 3.
fn activation_ms(bus: &mut Bus) -> u64 {
    bus.write(REQUEST, &[0x0100]);
    let began = bus.board.now_ms();
    assert_eq!(bus.shown().sta, 1);
    for _ in 0..1_000 {
        bus.run(4);
        let shown = bus.shown();
        if shown.sta == 3 {
            return bus.board.now_ms() - began;
        }
        assert_eq!(shown.sta, 1);
    }
    panic!("no activation");
}

#[test]
fn a_go_to_during_the_activation_is_fault_5_and_done_after_it() {
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST, &[0, 0, 0]);
    // Activation with rGTO set, as a driver does; rPR 0 is where the fingers are.
    bus.write(REQUEST, &[0x0900]);
    assert_eq!((bus.shown().sta, bus.shown().flt), (1, 5));
    bus.run(200);
    let shown = bus.shown();
    assert_eq!((shown.sta, shown.flt, shown.obj), (3, 0, 3));

    bus.write(REQUEST, &[0, 0, 0]);
    bus.write(REQUEST, &[0x0900, 255, 0xffff]);
    bus.run(200);
    // The first answer after the activation does not say that it has been done.
    let shown = bus.shown();
    assert_eq!((shown.sta, shown.obj), (3, 0));
    // The next request starts it.
    assert_eq!(bus.shown().obj, 0);
    bus.run(3_000);
    let shown = bus.shown();
    assert_eq!((shown.obj, shown.pr), (3, 255));
    assert!(shown.po > 200);
}

#[test]
fn after_a_restart_ract_counts_once_it_has_been_0() {
    let mut bus = Bus::new(Settings::default());
    // A driver that writes in a loop, as it did before.
    for _ in 0..100 {
        let words = bus.write_read(REQUEST, &[0x0900, 255, 0xffff], STATUS, 3);
        let shown = Shown::of(&words);
        assert_eq!((shown.act, shown.sta, shown.flt), (false, 0, 5));
        bus.run(7);
    }
    assert_eq!(bus.board.state(), State::Idle);
    bus.write(REQUEST, &[0, 0, 0]);
    bus.write(REQUEST, &[0x0100, 0, 0]);
    bus.run(200);
    assert_eq!((bus.shown().sta, bus.shown().flt), (3, 0));
}

#[test]
fn ract_0_clears_gflt_at_once() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.supply_v = 15.0;
    bus.run(1_100);
    assert_eq!(bus.shown().flt, 0xA);
    bus.write(REQUEST, &[0, 0, 0]);
    assert_eq!(bus.shown().flt, 0);
    // Nor does ract 1 alone show any while it activates, once the cause is gone.
    bus.board.supply_v = 24.0;
    bus.run(100);
    bus.write(REQUEST, &[0x0100, 0, 0]);
    assert_eq!((bus.shown().sta, bus.shown().flt), (1, 0));
    bus.run(200);
    assert_eq!((bus.shown().sta, bus.shown().flt), (3, 0));
}

#[test]
fn an_automatic_release_shows_b_then_f_until_an_activation_with_ract_0_or_1() {
    for action in [0x1100, 0x1900, 0x1000] {
        let mut bus = Bus::activated(Settings::default());
        bus.board.grip = [1.0; 3];
        bus.go(255);
        bus.run(1_500);
        assert_eq!(bus.shown().obj, 2);
        bus.write(REQUEST, &[action]);
        assert_eq!(bus.shown().flt, 0xB);
        bus.run(2_000);
        let shown = bus.shown();
        assert_eq!((shown.flt, shown.po, shown.cu), (0xF, 3, 0), "{action:#x}");
        // Nothing moves until then.
        bus.write(REQUEST, &[action & 0xef00, 200, 0xffff]);
        bus.write(REQUEST, &[action & 0xef00 | 0x0800, 100, 0xffff]);
        bus.run(500);
        assert_eq!(bus.shown().po, 3);
        bus.write(REQUEST, &[0, 0, 0]);
        assert_eq!(bus.shown().flt, 0);
        bus.write(REQUEST, &[0x0100, 0, 0]);
        bus.run(200);
        assert_eq!((bus.shown().sta, bus.shown().flt), (3, 0));
        assert_eq!(bus.go(255).obj, 0);
    }
}

#[test]
fn a_write_of_another_register_is_no_ract_0() {
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST + 1, &[100, 0xffff]);
    bus.write(REQUEST, &[0x0100]);
    bus.run(200);
    assert_eq!((bus.shown().act, bus.shown().sta), (false, 0));
}

#[test]
fn a_go_to_that_waits_for_the_activation_is_dropped_with_it() {
    for action in [0, 0x1100] {
        let mut bus = Bus::new(Settings::default());
        bus.write(REQUEST, &[0, 0, 0]);
        bus.write(REQUEST, &[0x0900, 255, 0xffff]);
        assert_eq!(bus.shown().obj, 0);
        bus.write(REQUEST, &[action]);
        bus.run(200);
        let shown = bus.shown();
        assert_eq!((shown.obj, shown.po), (3, 3), "{action:#x}");
    }
}

#[test]
fn a_go_to_that_waits_is_dropped_by_a_stop_and_by_a_command_of_the_own_block() {
    for stops in [false, true] {
        let mut bus = Bus::new(Settings::default());
        bus.write(REQUEST, &[0, 0, 0]);
        if stops {
            bus.pins = Command::Stop;
        }
        bus.write(REQUEST, &[0x0900, 255, 0xffff]);
        bus.pins = Command::Continue;
        bus.run(400);
        // What is said of the arm is no such command.
        bus.write(0x1105, &[1]);
        let obj = bus.clone().shown().obj;
        assert_eq!(obj, if stops { 3 } else { 0 });
        // Release, or an acknowledgement of the stop.
        bus.write(0x1104, &[if stops { 6 } else { 4 }]);
        bus.run(4_000);
        bus.shown();
        bus.run(1_000);
        let shown = bus.shown();
        assert_eq!((shown.sta, shown.po, shown.obj), (3, 3, 3), "{stops}");
    }
}

//! What real drivers of the Robotiq convention need, each by its name.

use crate::line::{Bus, ID, REQUEST, STATUS, Shown};
use crate::mock::{GaugeState, adjusted};
use softgrip::Command;
use softgrip::grasp::State;
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
    bus.drop_object();
    for _ in 0..200 {
        bus.run(7);
        bus.write(REQUEST, &command);
        let shown = bus.shown();
        assert_eq!((shown.obj, shown.pr), (3, 220));
    }
}

#[test]
fn faults_show_as_the_convention_has_them_and_kflt_is_0() {
    // What latches, and what it shows.
    type Breaks = fn(&mut Bus);
    let cases: [(Breaks, u8); 5] = [
        (|bus| bus.board.supply_v = 15.0, 0xA),
        (|bus| bus.board.valve_forced_kpa = Some(175.0), 0xE),
        (|bus| bus.board.late = true, 0xC),
        (|bus| bus.pins = Command::Stop, 0xC),
        (|bus| bus.run(600), 9),
    ];
    for (break_it, shown) in cases {
        let mut bus = Bus::activated(adjusted(|s| s.grip.host_timeout_ms = 500.0));
        for _ in 0..12 {
            bus.run(100);
            assert_eq!(bus.shown().flt, 0);
        }
        bus.board.grip = [1.0; 3];
        bus.go(255);
        break_it(&mut bus);
        for _ in 0..20 {
            bus.run(100);
            bus.shown();
        }
        assert_eq!(bus.shown().flt, shown);
    }
    // rGTO without rACT.
    let mut bus = Bus::new(Settings::default());
    bus.write(REQUEST, &[0x0800, 0, 0]);
    assert_eq!(bus.shown().flt, 7);
    bus.write(REQUEST, &[0]);
    assert_eq!(bus.shown().flt, 0);
}

#[test]
fn one_gauge_of_three_is_no_gflt_and_shows_in_the_own_block() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.gauges[1] = GaugeState::Open;
    bus.run(100);
    assert_eq!(bus.shown().flt, 0);
    assert_eq!(bus.read(0x1022, 3), [0, 16, 0]);
}

#[test]
fn rgto_0_holds_the_grasp_and_acknowledges_nothing() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.grip = [1.0; 3];
    bus.go(255);
    bus.run(1_500);
    assert_eq!(bus.shown().obj, 2);
    // A driver sends this after each grasp.
    bus.write(REQUEST, &[0x0100, 0, 0]);
    bus.run(1_000);
    let shown = bus.shown();
    assert_eq!((shown.obj, shown.gto, shown.pr), (2, false, 0));
    bus.drop_object();
    assert_eq!(bus.shown().obj, 3);
    bus.write(REQUEST, &[0x0900, 0, 0]);
    bus.write(REQUEST, &[0x0100, 0, 0]);
    assert_eq!(bus.read_one(0x1030), 1, "the loss is latched");
}

#[test]
fn rgto_0_while_closing_keeps_the_pressure_that_is_there() {
    for ms in [100, 200, 300] {
        let mut bus = Bus::activated(Settings::default());
        bus.go(255);
        bus.run(ms);
        let there = bus.board.pressure_kpa;
        bus.write(REQUEST, &[0x0100]);
        bus.run(1_000);
        let now = bus.board.pressure_kpa;
        assert!((now - there).abs() < 3.0, "{ms}: {there} became {now}");
        assert_eq!(bus.shown().obj, 3);
        // And another go-to goes on.
        bus.write(REQUEST, &[0x0900]);
        assert_eq!(bus.shown().obj, 0);
        bus.run(1_500);
        assert!((bus.board.pressure_kpa - 160.0).abs() < 2.0);
    }
    // At once there is nothing to keep.
    let mut bus = Bus::activated(Settings::default());
    bus.go(255);
    bus.write(REQUEST, &[0x0100]);
    bus.run(500);
    assert_eq!(bus.board.state(), State::Idle);
}

#[test]
fn gpo_is_3_for_open_fingers_and_230_for_closed_ones() {
    let mut bus = Bus::activated(Settings::default());
    assert_eq!(bus.shown().po, 3);
    let mut before = 3;
    for position in [50, 100, 150, 200, 255] {
        bus.go(position);
        bus.run(3_000);
        let shown = bus.shown();
        // Free fingers bend as far as is asked for.
        let wanted = 3.0 + 227.0 * f32::from(position) / 255.0;
        assert!((f32::from(shown.po) - wanted).abs() <= 3.0, "{shown:?}");
        assert!(shown.po > before);
        before = shown.po;
    }
    assert!((228..=230).contains(&before));
}

#[test]
fn an_opening_goes_on_when_rgto_goes() {
    let mut bus = Bus::activated(Settings::default());
    bus.go(255);
    bus.run(1_500);
    bus.go(0);
    bus.run(50);
    bus.write(REQUEST, &[0x0100]);
    assert_eq!(bus.shown().obj, 0);
    bus.run(1_500);
    assert_eq!(bus.board.state(), State::Idle);
}

#[test]
fn rsp_is_how_fast_and_rfr_how_hard_and_both_act_with_the_next_go_to() {
    // Time to half the pressure, ms.
    let rise = |speed: u16| {
        let mut bus = Bus::activated(Settings::default());
        bus.write(REQUEST, &[0x0900, 255, speed << 8 | 255]);
        let began = bus.board.now_ms();
        while bus.board.pressure_kpa < 80.0 {
            bus.run(1);
        }
        bus.board.now_ms() - began
    };
    // 80 kPa at 400 and 40 kPa/s, and the lag of the air.
    let (fast, slow) = (rise(255), rise(0));
    assert!((200..350).contains(&fast), "{fast}");
    assert!((2_000..2_200).contains(&slow), "{slow}");

    let mut bus = Bus::activated(Settings::default());
    for (force, kpa) in [(0, 80.0), (255, 160.0), (128, 120.2)] {
        bus.write(REQUEST + 2, &[0xff00 | force]);
        let before = bus.board.pressure_kpa;
        bus.run(1_000);
        assert!((bus.board.pressure_kpa - before).abs() < 2.0);
        bus.write(REQUEST, &[0x0100, 255]);
        bus.write(REQUEST, &[0x0900]);
        bus.run(3_000);
        let there = bus.board.pressure_kpa;
        assert!((there - kpa).abs() < 1.0, "{force}: {there}");
    }
}

#[test]
fn rubbish_is_refused_by_number_or_not_answered_and_the_next_good_request_is() {
    let mut bus = Bus::activated(Settings::default());
    let refused: [(&[u8], u8); 9] = [
        (&[5, 0x03, 0xE8, 0xff, 0], 1),
        (&[43, 14, 1, 0], 1),
        (&[3, 0x03, 0xE7, 0, 1], 2),
        (&[3, 0x07, 0xD0, 0, 7], 2),
        (&[4, 0xff, 0xff, 0, 2], 2),
        (&[6, 0x07, 0xD0, 0, 1], 2),
        (&[3, 0x07, 0xD0, 0, 0], 3),
        (&[3, 0x07, 0xD0, 0, 126], 3),
        (&[16, 0x03, 0xE8, 0, 1, 4, 0, 0, 0, 0], 3),
    ];
    for (pdu, exception) in refused {
        assert_eq!(bus.refused(pdu), exception, "{pdu:02x?}");
        bus.shown();
    }
    let read = [3, 0x07, 0xD0, 0, 3];
    let mut bad = Bus::framed(&read);
    bad[4] ^= 1;
    let good = Bus::framed(&read);
    let silent = [
        bad,
        Bus::framed_for(8, &read),
        Bus::framed_for(0, &read),
        good[..6].to_vec(),
        vec![0xff; 300],
        // Its own answers, as an echo of the line.
        Bus::framed(&[3, 6, 0, 0, 0, 0, 0, 0]),
        Bus::framed(&[0x83, 2]),
    ];
    for bytes in silent {
        assert_eq!(bus.exchange(&bytes), [], "{bytes:02x?}");
        bus.run(21);
        assert_eq!(bus.exchange(&good).len(), 11);
    }
    // What is behind a good request is nothing.
    let mut long = good.clone();
    long.extend([1, 2, 3]);
    assert_eq!(bus.exchange(&long).len(), 11);
    bus.run(21);
    assert_eq!(bus.exchange(&good).len(), 11);
}

#[test]
fn gflt_9_needs_a_time_that_the_settings_state() {
    let mut bus = Bus::activated(Settings::default());
    bus.run(5_000);
    assert_eq!(bus.shown().flt, 0);
}

#[test]
fn an_answer_that_would_be_late_is_not_sent() {
    let mut bus = Bus::activated(Settings::default());
    let read = Bus::framed(&[3, 0x07, 0xD0, 0, 3]);
    // The request has lain somewhere for longer than any driver waits.
    for &byte in &read {
        bus.receiver.receive(bus.now(), byte);
    }
    bus.run(101);
    assert!(bus.receiver.frame(bus.now()).is_none());
    for &byte in &read {
        bus.receiver.receive(bus.now(), byte);
    }
    bus.run(99);
    assert!(bus.receiver.frame(bus.now()).is_some());
}

#[test]
fn an_answer_leaves_at_most_three_ticks_after_its_request() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.grip = [1.0; 3];
    let mut most = 0;
    for (position, speed_force) in [(200, 0xffff), (0, 0x0000), (255, 0x8080)] {
        bus.write(REQUEST, &[0x0900, position, speed_force]);
        most = most.max(bus.ticks);
        bus.run(3_000);
        bus.shown();
        assert_eq!(bus.ticks, 1);
    }
    // Acknowledgement of a loss, speed and grip.
    bus.drop_object();
    assert_eq!(bus.shown().obj, 3);
    bus.write(REQUEST, &[0x0900, 100, 0x1010]);
    assert_eq!(most.max(bus.ticks), 3);
}

#[test]
fn a_release_in_a_fault_that_holds_shows_that_the_fingers_open() {
    let mut bus = Bus::activated(Settings::default());
    bus.board.grip = [1.0; 3];
    bus.go(255);
    bus.run(1_500);
    bus.board.supply_v = 15.0;
    bus.run(100);
    let shown = bus.shown();
    assert_eq!((shown.obj, shown.flt), (3, 0xA));
    assert_eq!(bus.go(0).obj, 0);
    bus.run(2_000);
    let shown = bus.shown();
    assert_eq!((shown.obj, shown.flt, shown.cu), (3, 0xA, 0));
}

#[test]
fn a_speed_that_a_stop_has_dropped_is_asked_for_again() {
    let mut bus = Bus::activated(Settings::default());
    bus.pins = Command::Stop;
    bus.write(REQUEST, &[0x0900, 255, 0x00ff]);
    bus.pins = Command::Continue;
    bus.run(400);
    bus.write(0x1104, &[6]);
    bus.run(1_000);
    bus.write(REQUEST + 1, &[254]);
    bus.run(500);
    // 20 kPa at 40 kPa/s, and less for the lag.
    let there = bus.board.pressure_kpa;
    assert!((10.0..20.0).contains(&there), "{there}");
}

#[test]
fn an_answer_whose_tick_comes_late_is_not_sent() {
    let read = Bus::framed(&[3, 0x07, 0xD0, 0, 3]);
    for (late_us, length) in [(99_000, 11), (99_001, 0)] {
        let mut bus = Bus::activated(Settings::default());
        let now = bus.now();
        read.iter()
            .for_each(|&byte| bus.receiver.receive(now, byte));
        let frame = bus.receiver.frame(now).expect("a frame");
        let work = bus
            .robot
            .request(now, &frame, &mut bus.values, &mut bus.reply);
        bus.link.ask(work.expect("accepted").wishes);
        bus.board.now_us += late_us;
        assert_eq!(bus.tick().expect("a status").len(), length);
        // And the next one is answered.
        bus.shown();
    }
}

#[test]
fn what_a_driver_takes_for_fully_open_releases_and_is_no_loss() {
    // robotiq2f writes 12 for 85 mm.
    for position in [0, 3, 12] {
        let mut bus = Bus::activated(Settings::default());
        bus.board.grip = [1.0; 3];
        bus.go(255);
        bus.run(1_500);
        assert_eq!(bus.shown().obj, 2);
        bus.go(position);
        for ms in 0..400 {
            bus.board.grip = [1.0 - ms as f32 / 400.0; 3];
            bus.run(1);
        }
        bus.run(1_500);
        assert_eq!(bus.board.state(), State::Idle, "{position}");
        assert_eq!(bus.read_one(0x1030), 0, "{position}");
    }
}

//! Commands that come once, again, too late, or cannot be.

use super::*;
use crate::Grip;

fn pressure(kpa: f32) -> Command {
    Command::Grip(Grip::Pressure(Kilopascals(kpa)))
}

#[test]
fn a_grip_lies_above_zero_and_up_to_the_limit() {
    let refused = |refusal| Some(Answer::Refused(refusal));
    for (kpa, answer) in [
        (160.0, Some(Answer::Accepted)),
        (160.1, refused(Refusal::PressureOutOfRange)),
        (0.1, Some(Answer::Accepted)),
        (0.0, refused(Refusal::PressureOutOfRange)),
        (-1.0, refused(Refusal::PressureOutOfRange)),
        (f32::NAN, refused(Refusal::PressureOutOfRange)),
    ] {
        let mut bench = Bench::new(|_| ());
        assert_eq!(bench.step(pressure(kpa)), answer, "{kpa}");
    }
    // As bends: a finger is bent by pressure alone, and by 160 kPa at most.
    for (bend, answer) in [
        (40.0, Some(Answer::Accepted)),
        (0.0, refused(Refusal::BendOutOfRange)),
        (-1.0, refused(Refusal::BendOutOfRange)),
        (1_000.0, refused(Refusal::BendOutOfRange)),
        (f32::NAN, refused(Refusal::BendOutOfRange)),
    ] {
        let mut bench = Bench::new(|_| ());
        let grip = Command::Grip(Grip::Bend(Degrees(bend)));
        assert_eq!(bench.step(grip), answer, "{bend}");
    }
    // The finger could bend further than the limit lets it.
    let mut bench = Bench::new(|_| ());
    bench.active.max_pressure = Kilopascals(50.0);
    let bend = crate::table::bend(&FINGER, Kilopascals(60.0)).0;
    let answer = bench.step(Command::Grip(Grip::Bend(bend)));
    assert_eq!(answer, refused(Refusal::BendOutOfRange));
}

#[test]
fn a_grip_is_refused_while_a_fault_or_a_loss_is_latched() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.lose();
    let refused = Some(Answer::Refused(Refusal::LostLatched));
    assert_eq!(bench.step(pressure(100.0)), refused);
    bench.step(Command::Stop);
    let refused = Some(Answer::Refused(Refusal::FaultLatched));
    assert_eq!(bench.step(pressure(100.0)), refused);
}

#[test]
fn a_command_that_comes_again_within_a_second_is_the_same_and_has_the_same_refusal() {
    let mut bench = Bench::new(|_| ());
    let refused = Some(Answer::Refused(Refusal::PressureOutOfRange));
    assert_eq!(bench.step(pressure(0.0)), refused);
    bench.told();
    bench.run(10);
    assert_eq!(bench.step(pressure(0.0)), refused);
    // Told once.
    assert_eq!(bench.told(), []);
    assert_eq!(bench.step(pressure(100.0)), Some(Answer::Accepted));
    // After a second it is another one.
    for (pause_ms, answer) in [(998, Answer::Unchanged), (999, Answer::Accepted)] {
        let mut bench = Bench::new(|_| ());
        bench.step(Command::Tare);
        bench.run(pause_ms);
        assert_eq!(bench.step(Command::Tare), Some(answer), "{pause_ms}");
    }
}

#[test]
fn a_stop_is_obeyed_however_often_it_comes() {
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.step(Command::Stop), Some(Answer::Accepted));
    assert_eq!(bench.step(Command::Stop), Some(Answer::Accepted));
    // A release before an acknowledgement is refused: whoever stops does not want to drop.
    let refused = Some(Answer::Refused(Refusal::FaultLatched));
    assert_eq!(bench.step(Command::Release), refused);
}

#[test]
fn a_tare_starts_at_rest_and_once() {
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.step(Command::Tare), Some(Answer::Accepted));
    bench.zero.taring = true;
    bench.run(1_500);
    assert_eq!(bench.step(Command::Tare), Some(Answer::Unchanged));
    let mut bench = Bench::new(|_| ());
    bench.step(GRIP);
    let refused = Some(Answer::Refused(Refusal::NotIdle));
    assert_eq!(bench.step(Command::Tare), refused);
}

#[test]
fn a_set_point_within_half_a_kilopascal_is_the_same() {
    for (kpa, answer) in [
        (140.4, Answer::Unchanged),
        (139.6, Answer::Unchanged),
        (140.6, Answer::Accepted),
        (139.4, Answer::Accepted),
    ] {
        let mut bench = Bench::holding([true; 3], |_| ());
        assert_eq!(bench.step(pressure(kpa)), Some(answer), "{kpa}");
        assert_eq!(
            matches!(bench.state(), State::Holding { .. }),
            answer == Answer::Unchanged
        );
    }
}

#[test]
fn a_grip_around_nothing_is_tried_again_by_another_command_alone() {
    let empty = || {
        let mut bench = Bench::new(|_| ());
        bench.step(GRIP);
        bench.blow(140.0);
        bench.run(1_500);
        assert!(matches!(bench.state(), State::Empty { .. }));
        bench
    };
    let mut bench = empty();
    assert_eq!(bench.step(GRIP), Some(Answer::Unchanged));
    assert!(matches!(bench.state(), State::Empty { .. }));
    // To the same set-point, by another grip.
    assert_eq!(bench.step(pressure(140.0)), Some(Answer::Accepted));
    let mut bench = empty();
    assert_eq!(bench.step(pressure(120.0)), Some(Answer::Accepted));
    let mut bench = empty();
    bench.step(Command::Acknowledge);
    assert_eq!(bench.step(GRIP), Some(Answer::Unchanged));
}

#[test]
fn a_payload_belongs_to_its_grip() {
    let payload = |grams: f32| Payload {
        kind: crate::table::ObjectKind::Sphere,
        mass: crate::units::Kilograms(1e-3 * grams),
        acceleration: crate::units::MetresPerSecondSquared(1.0),
    };
    let grip = |grams: f32| Command::Grip(Grip::Payload(payload(grams)));
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.supervisor.payload(), None);
    assert_eq!(bench.step(grip(20.0)), Some(Answer::Accepted));
    assert_eq!(bench.supervisor.payload(), Some(payload(20.0)));
    let State::Closing { target, .. } = bench.state() else {
        panic!("{:?}", bench.state());
    };
    // The lowest pressure that lifts a fifth more.
    let margin = payload(20.0).margin(&FINGER, target);
    assert!(
        margin.is_some_and(|share| (share - 0.2).abs() < 0.01),
        "{margin:?}"
    );
    // The same pressure for no payload is another grip, but no other pressure.
    assert_eq!(bench.step(pressure(target.0)), Some(Answer::Accepted));
    assert_eq!(bench.supervisor.payload(), None);
    assert_eq!(
        bench.step(pressure(target.0 + 0.1)),
        Some(Answer::Unchanged)
    );
    bench.step(grip(20.0));
    bench.step(Command::Release);
    assert_eq!(bench.supervisor.payload(), None);
}

#[test]
fn a_release_lets_go_of_what_a_fault_holds_but_a_stop() {
    let mut bench = Bench::holding([true; 3], |settings| settings.host_timeout_ms = 300.0);
    bench.run(200);
    assert!(bench.state().is_holding());
    assert_eq!(bench.state().fault(), Some(Fault::HostSilent));
    bench.told();
    assert_eq!(bench.step(Command::Release), Some(Answer::Accepted));
    assert_eq!(bench.told(), [Event::Released]);
    assert_eq!(bench.state().target(), Kilopascals(0.0));
    // Once.
    bench.run(1_500);
    assert_eq!(bench.step(Command::Release), Some(Answer::Unchanged));
    assert_eq!(bench.told(), []);
}

#[test]
fn a_release_while_closing_is_of_what_touches() {
    for (touching, is_told) in [([false, true, false], true), ([false; 3], false)] {
        let mut bench = Bench::new(|_| ());
        bench.step(GRIP);
        bench.contact.touching = touching;
        bench.blow(50.0);
        bench.run(10);
        bench.told();
        bench.step(Command::Release);
        bench.contact.touching = [false; 3];
        bench.run(10);
        assert_eq!(bench.told() == [Event::Released], is_told);
    }
    // What an empty gripper touches is not held.
    let mut bench = Bench::new(|_| ());
    bench.step(GRIP);
    bench.blow(140.0);
    bench.contact.touching = [true, false, false];
    bench.run(200);
    bench.told();
    bench.step(Command::Release);
    bench.blow(0.0);
    bench.run(10);
    assert_eq!(bench.told(), []);
}

#[test]
fn an_acknowledgement_within_300_ms_of_the_last_is_the_same_one() {
    for (pause_ms, answer) in [(298, Answer::Unchanged), (299, Answer::Accepted)] {
        let mut bench = Bench::new(|_| ());
        assert_eq!(bench.step(Command::Acknowledge), Some(Answer::Accepted));
        bench.run(pause_ms);
        let again = bench.step(Command::Acknowledge);
        assert_eq!(again, Some(answer), "{pause_ms}");
        bench.step(Command::Stop);
        bench.run(1);
        // After something new it is a new one.
        let of_the_stop = bench.step(Command::Acknowledge);
        assert_eq!(of_the_stop, Some(Answer::Accepted));
    }
}

#[test]
fn an_acknowledgement_says_nothing_of_what_fails_in_its_tick_or_after_it() {
    let mut bench = Bench::new(|_| ());
    bench.run(10);
    bench.reading.stale_ticks = 5;
    bench.step(Command::Acknowledge);
    bench.reading.stale_ticks = 0;
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::AdcStale));
    // Nor of what fails in the next one.
    let mut bench = Bench::new(|_| ());
    bench.run(10);
    bench.step(Command::Acknowledge);
    bench.reading.stale_ticks = 5;
    bench.run(1);
    bench.reading.stale_ticks = 0;
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::AdcStale));
}

#[test]
fn after_an_acknowledged_latch_the_robots_last_command_is_a_new_one() {
    // A loss.
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.lose();
    bench.step(Command::Acknowledge);
    assert_eq!(bench.supervisor.lost(), None);
    assert_eq!(bench.step(GRIP), Some(Answer::Accepted));
    // A gauge that has failed, alone.
    for latched in [false, true] {
        let mut bench = Bench::new(|_| ());
        bench.step(Command::Tare);
        if latched {
            bench.reading.gauges[0] = Gauge::Failed(crate::fault::GaugeFault::Open);
        }
        bench.run(1);
        bench.step(Command::Acknowledge);
        let answer = if latched {
            Answer::Accepted
        } else {
            Answer::Unchanged
        };
        assert_eq!(bench.step(Command::Tare), Some(answer), "{latched}");
    }
}

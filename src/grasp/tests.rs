//! What each state does, by what is commanded and seen.

mod commands;
mod faults;

use super::*;
use crate::condition::{Gauge, Monitor, Reading};
use crate::table::{FINGER, Range};
use crate::units::{Degrees, Microstrain, Volts};
use crate::zero::ZeroReport;
use std::vec::Vec;

const GRIP: Command = Command::Grip(crate::Grip::Default);

/// A supervisor, and what it sees: at first a gripper at rest.
struct Bench {
    supervisor: Supervisor,
    active: Active,
    reading: Reading,
    air: Air,
    contact: Contact,
    zero: ZeroReport,
    verdict: Verdict,
    now_us: u64,
    events: Vec<Event>,
}

impl Bench {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::default();
        change(&mut settings);
        let limit = Kilopascals(160.0);
        let meeting = crate::estimate::Settings::default().active(&FINGER).meeting;
        let mut bench = Self {
            supervisor: Supervisor::new(None),
            active: settings.active(limit, meeting),
            reading: Reading {
                gauges: [Gauge::Valid(Microstrain(0.0)); FINGERS],
                noise_variance: [400.0; FINGERS],
                monitor: Monitor::Missing,
                supply: Some(Volts(24.0)),
                rail_is_off: false,
                stale_ticks: 0,
                overrun: false,
            },
            air: Air {
                measured: None,
                expected: None,
                deviating_us: 0,
                deviated: Instant::from_micros(0),
            },
            contact: Contact {
                residual: [Some(Microstrain(0.0)); FINGERS],
                touching: [false; FINGERS],
                mean: None,
                free: Microstrain(0.0),
                bend: Degrees(0.0),
                range: Range::Inside,
                known: true,
            },
            zero: ZeroReport {
                tare: None,
                taring: false,
                tare_due: false,
            },
            verdict: Verdict::Unarmed,
            now_us: 0,
            events: Vec::new(),
        };
        bench.blow(0.0);
        bench
    }

    /// The pressure that is measured, and expected.
    fn blow(&mut self, kpa: f32) {
        self.air.measured = Some(Kilopascals(kpa));
        self.air.expected = Some(Kilopascals(kpa));
        self.reading.monitor = Monitor::Valid(Kilopascals(kpa));
    }

    fn step(&mut self, command: Command) -> Option<Answer> {
        self.now_us += 1_000;
        let mut events = Events::new();
        let situation = Situation {
            reading: &self.reading,
            air: &self.air,
            contact: &self.contact,
            zero: &self.zero,
            verdict: self.verdict,
        };
        let answer = self.supervisor.step(
            Instant::from_micros(self.now_us),
            command,
            &situation,
            &FINGER,
            &self.active,
            &mut events,
        );
        self.events.extend(events.iter().copied());
        answer
    }

    fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            self.step(Command::Continue);
        }
    }

    fn state(&self) -> State {
        self.supervisor.state()
    }

    /// The events since the last call.
    fn told(&mut self) -> Vec<Event> {
        core::mem::take(&mut self.events)
    }

    /// Holding with these fingers at 140 kPa, and nothing told.
    fn holding(touching: [bool; FINGERS], change: impl FnOnce(&mut Settings)) -> Self {
        let mut bench = Self::new(change);
        bench.step(GRIP);
        bench.blow(140.0);
        bench.contact.touching = touching;
        bench.run(200);
        assert!(matches!(bench.state(), State::Holding { .. }));
        bench.verdict = Verdict::Holding;
        bench.told();
        bench
    }

    /// One tick with a loss.
    fn lose(&mut self) {
        self.verdict = Verdict::Lost {
            onset: Instant::from_micros(self.now_us),
            cause: LossCause::Collapse,
            evidence: [None; FINGERS],
        };
        self.step(Command::Continue);
        self.verdict = Verdict::Unarmed;
    }
}

fn closing_to(kpa: f32, is_reached: bool) -> impl Fn(State) -> bool {
    move |state| match state {
        State::Closing {
            target, reached, ..
        } => (target.0 - kpa).abs() < 1e-3 && reached.is_some() == is_reached,
        _ => false,
    }
}

#[test]
fn a_set_point_is_reached_within_3_kpa_or_where_a_good_regulator_ends() {
    for (measured, expected, deviating_us, is_reached) in [
        (136.8, 137.0, 0, false),
        (137.2, 137.0, 0, true),
        (143.2, 145.0, 0, false),
        (142.8, 145.0, 0, true),
        // 7 kPa short is no fault, but as good as it gets.
        (133.0, 139.4, 0, false),
        (133.0, 139.6, 0, true),
        (133.0, 140.4, 0, true),
        (133.0, 140.6, 0, false),
        (130.0, 140.0, 1_000, false),
    ] {
        let mut bench = Bench::new(|_| ());
        // Long after the pressure deviated last.
        bench.run(300);
        bench.step(GRIP);
        bench.blow(measured);
        bench.air.expected = Some(Kilopascals(expected));
        bench.air.deviating_us = deviating_us;
        if deviating_us > 0 {
            bench.air.deviated = Instant::from_micros(bench.now_us);
        }
        bench.step(Command::Continue);
        let state = bench.state();
        assert!(
            closing_to(140.0, is_reached)(state),
            "{measured} {expected}: {state:?}"
        );
    }
    // Without a measurement the model tells.
    let mut bench = Bench::new(|_| ());
    // Long after the pressure deviated last.
    bench.run(300);
    bench.step(GRIP);
    bench.air.measured = None;
    bench.air.expected = Some(Kilopascals(140.0));
    bench.step(Command::Continue);
    assert!(closing_to(140.0, true)(bench.state()));
}

#[test]
fn a_grip_is_judged_150_ms_after_its_set_point_was_reached() {
    for (touching, expected) in [
        (
            [true, false, true],
            Event::Holding {
                touching: [true, false, true],
            },
        ),
        ([false, true, false], Event::Empty),
    ] {
        let mut bench = Bench::new(|_| ());
        bench.step(GRIP);
        bench.blow(140.0);
        bench.contact.touching = touching;
        bench.run(150);
        assert!(closing_to(140.0, true)(bench.state()));
        bench.told();
        bench.run(1);
        assert_eq!(bench.told(), [expected]);
        assert_eq!(bench.state().is_holding(), expected != Event::Empty);
    }
}

#[test]
fn a_grip_is_not_judged_while_its_pressure_is_off_or_the_fingers_shape_unknown() {
    let mut bench = Bench::new(|_| ());
    bench.step(GRIP);
    bench.blow(140.0);
    bench.run(10);
    bench.air.deviating_us = 1_000;
    bench.run(200);
    bench.air.deviating_us = 0;
    bench.contact.known = false;
    bench.run(200);
    assert_eq!(bench.told(), []);
    bench.contact.known = true;
    bench.run(1);
    assert_eq!(bench.told(), [Event::Empty]);
}

#[test]
fn each_finger_that_touches_is_told_once_in_a_grip() {
    let mut bench = Bench::new(|_| ());
    bench.step(GRIP);
    bench.run(10);
    bench.contact.touching = [false, true, false];
    bench.run(10);
    assert_eq!(bench.told(), [Event::Contact { finger: 1 }]);
    bench.contact.touching = [true, false, false];
    bench.run(10);
    bench.contact.touching = [true, true, false];
    bench.run(10);
    assert_eq!(bench.told(), [Event::Contact { finger: 0 }]);
    // In the next one again.
    bench.step(Command::Release);
    bench.run(10);
    bench.told();
    bench.step(GRIP);
    bench.run(1);
    assert_eq!(
        bench.told(),
        [Event::Contact { finger: 0 }, Event::Contact { finger: 1 }]
    );
}

#[test]
fn what_is_watched_is_what_is_held_also_on_its_way_to_another_pressure() {
    let mut bench = Bench::holding([true, true, false], |_| ());
    let watch = |bench: &Bench| bench.supervisor.watch(Motion::Still);
    let held = Watch {
        motion: Motion::Still,
        carrying: [true, true, false],
        pressure_changes: false,
        fingers_follow: false,
    };
    assert_eq!(watch(&bench), Some(held));
    bench.step(Command::Grip(crate::Grip::Pressure(Kilopascals(120.0))));
    let changing = Watch {
        pressure_changes: true,
        ..held
    };
    assert_eq!(watch(&bench), Some(changing));
    bench.blow(120.0);
    bench.run(1);
    let following = Watch {
        fingers_follow: true,
        ..held
    };
    assert_eq!(watch(&bench), Some(following));
    bench.run(200);
    assert_eq!(watch(&bench), Some(held));
    let mut closing = Bench::new(|_| ());
    closing.step(GRIP);
    assert_eq!(watch(&closing), None);
}

#[test]
fn what_is_held_at_another_pressure_needs_the_fingers_that_carried_it_and_can_still_tell() {
    // Two fingers, and one if the other one's gauge has failed; never none.
    for (missing, touching, is_held) in [
        ([false, false, false], [true, true, false], true),
        ([false, false, false], [true, false, false], false),
        ([true, false, false], [false, true, false], true),
        ([true, false, false], [false, false, false], false),
        ([true, true, false], [false, false, false], false),
        // The third did not carry.
        ([false, false, true], [true, false, false], false),
    ] {
        let mut bench = Bench::holding([true, true, false], |_| ());
        bench.step(Command::Grip(crate::Grip::Pressure(Kilopascals(120.0))));
        for (residual, missing) in bench.contact.residual.iter_mut().zip(missing) {
            if missing {
                *residual = None;
            }
        }
        bench.contact.touching = touching;
        bench.blow(120.0);
        bench.run(200);
        let is_lost = bench.supervisor.lost().map(|loss| loss.cause);
        let expected = if is_held {
            None
        } else {
            Some(LossCause::Missing)
        };
        assert_eq!(is_lost, expected, "{missing:?} {touching:?}");
    }
}

#[test]
fn a_loss_is_latched_and_the_fingers_do_what_the_settings_say() {
    for (on_loss, expected) in [
        (
            OnLoss::Hold,
            State::Empty {
                target: Kilopascals(140.0),
            },
        ),
        (
            OnLoss::Vent,
            State::Releasing {
                since: Instant::from_micros(202_000),
                holding: false,
            },
        ),
    ] {
        let mut bench = Bench::holding([true; 3], |settings| settings.on_loss = on_loss);
        bench.lose();
        let loss = bench.supervisor.lost().expect("a loss");
        assert_eq!(bench.told(), [Event::Lost(loss)]);
        assert_eq!(bench.state(), expected);
        assert_eq!(loss.flagged, Instant::from_micros(202_000));
    }
}

#[test]
fn a_regrip_closes_harder_once_and_not_beyond_the_limit() {
    let regrips = |raise_kpa: f32| {
        Bench::holding([true; 3], |settings| {
            settings.on_loss = OnLoss::Regrip;
            settings.regrip_raise_kpa = raise_kpa;
        })
    };
    for (raise_kpa, tightened_kpa) in [(15.0, 155.0), (30.0, 160.0)] {
        let mut bench = regrips(raise_kpa);
        bench.lose();
        assert!(
            closing_to(tightened_kpa, false)(bench.state()),
            "{:?}",
            bench.state()
        );
        assert!(bench.told().contains(&Event::Regripping));
        // Caught, and lost again: enough.
        bench.blow(tightened_kpa);
        bench.run(200);
        assert!(bench.state().is_holding());
        let first = bench.supervisor.lost();
        bench.told();
        bench.lose();
        let again = bench.told();
        assert!(matches!(again[..], [Event::Lost(_)]), "{again:?}");
        assert_eq!(bench.supervisor.lost(), first);
        assert!(matches!(bench.state(), State::Empty { .. }));
    }
    let mut bench = regrips(0.0);
    bench.lose();
    assert!(matches!(bench.state(), State::Empty { .. }));
}

#[test]
fn a_slip_is_told_when_it_begins() {
    let mut bench = Bench::holding([true; 3], |_| ());
    for _ in 0..2 {
        bench.verdict = Verdict::Slipping { rate: 0.5 };
        bench.run(50);
        assert_eq!(bench.told(), [Event::Slip { rate: 0.5 }]);
        bench.verdict = Verdict::Holding;
        bench.run(50);
        assert_eq!(bench.told(), []);
    }
}

#[test]
fn air_that_is_lost_in_a_hold_is_told_and_a_fault() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.verdict = Verdict::AirLoss;
    bench.run(1);
    let told = bench.told();
    assert_eq!(told[0], Event::AirLoss);
    assert_eq!(bench.state().fault(), Some(Fault::AirLoss));
}

#[test]
fn a_release_of_what_is_held_is_told_when_contact_has_gone_or_the_fingers_are_open_or_after_a_second()
 {
    // Contact goes.
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.step(Command::Release);
    bench.run(100);
    assert_eq!(bench.told(), []);
    bench.contact.touching = [false; 3];
    bench.run(10);
    assert_eq!(bench.told(), [Event::Released]);
    assert!(matches!(
        bench.state(),
        State::Releasing { holding: false, .. }
    ));
    // The fingers open, below 6 kPa.
    for (kpa, is_open) in [(6.1, false), (5.9, true)] {
        let mut bench = Bench::holding([true; 3], |_| ());
        bench.step(Command::Release);
        bench.blow(kpa);
        bench.run(1);
        assert_eq!(bench.told() == [Event::Released], is_open, "{kpa}");
        assert_eq!(bench.state() == State::Idle, is_open, "{kpa}");
    }
    // Contact stays: a thousand ticks and one.
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.step(Command::Release);
    bench.run(1_000);
    assert_eq!(bench.told(), []);
    bench.run(1);
    assert_eq!(bench.told(), [Event::Released]);
}

#[test]
fn a_release_of_nothing_is_not_told() {
    let mut bench = Bench::new(|_| ());
    bench.step(GRIP);
    bench.blow(140.0);
    bench.run(200);
    bench.told();
    bench.step(Command::Release);
    bench.blow(0.0);
    bench.run(10);
    assert_eq!((bench.told(), bench.state()), (Vec::new(), State::Idle));
}

#[test]
fn a_tare_is_answered_when_it_ends_and_asked_for_once() {
    let mut bench = Bench::new(|_| ());
    bench.zero.tare_due = true;
    bench.run(10);
    assert_eq!(bench.told(), [Event::TareDue]);
    bench.zero.tare = Some(Ok(()));
    bench.zero.tare_due = false;
    bench.run(1);
    assert_eq!(bench.told(), [Event::Tared]);
    let fault = crate::command::TareFault::Noise;
    bench.zero.tare = Some(Err(fault));
    bench.run(1);
    assert_eq!(bench.told(), [Event::Refused(Refusal::TareRejected(fault))]);
    bench.zero.tare = None;
    bench.zero.tare_due = true;
    bench.run(2);
    assert_eq!(bench.told(), [Event::TareDue]);
}

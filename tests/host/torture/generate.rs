//! Random sequences: what robots and operators say, and what breaks.

use crate::mock::GaugeState;
use crate::torture::plant::Happening;
use crate::torture::promises::WEAK_KPA;
use crate::torture::season::{STARTS, Season, between, pick};
use crate::torture::sequence::{Action, Sequence};
use fastrand::Rng;
use softgrip::command::{Motion, Payload};
use softgrip::table::ObjectKind;
use softgrip::units::{AdcCode, Degrees, Kilograms, Kilopascals, MetresPerSecondSquared};
use softgrip::{Command, Grip};

/// Shortest and longest sequence, ticks; most are short.
const TICKS: [f32; 2] = [300.0, 3_000.0];
/// One sequence in so many ends in a repair, which takes longer than most sequences.
const RECOVERS: u8 = 8;

/// What may break in a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    /// Nothing; only the object comes and goes.
    None,
    /// One gauge, again and again.
    Gauge,
    /// Air, supply, monitor and converter.
    Air,
    /// Anything at any time.
    Any,
}

/// A random sequence.
pub fn sequence(rng: &mut Rng, season: &Season) -> Sequence {
    let ticks = TICKS[0] + (TICKS[1] - TICKS[0]) * rng.f32().powi(3);
    let mut sequence = Sequence {
        start: pick(rng, &STARTS),
        noise_seed: rng.u32(1..),
        ticks: ticks as u32,
        actions: Vec::new(),
        recovers: season.is_matched() && rng.u8(..RECOVERS) == 0,
    };
    let trouble = pick(
        rng,
        &[Trouble::None, Trouble::Gauge, Trouble::Air, Trouble::Any],
    );
    let finger = rng.usize(..3);
    for _ in 0..rng.u8(..10) {
        add_command(rng, &mut sequence, season);
    }
    for _ in 0..rng.u8(..6) {
        add_object(rng, &mut sequence);
    }
    for _ in 0..rng.u8(..5) {
        let kind = match trouble {
            Trouble::None => continue,
            Trouble::Gauge => Trouble::Gauge,
            Trouble::Air => Trouble::Air,
            Trouble::Any => pick(rng, &[Trouble::Gauge, Trouble::Air]),
        };
        if kind == Trouble::Gauge {
            let finger = if trouble == Trouble::Any {
                rng.usize(..3)
            } else {
                finger
            };
            add_gauge(rng, &mut sequence, finger);
        } else {
            add_air(rng, &mut sequence);
        }
    }
    sequence.actions.sort_by_key(|(at, _)| *at);
    sequence
}

fn add_command(rng: &mut Rng, sequence: &mut Sequence, season: &Season) {
    let command = command(rng, season.settings.regulator.max_pressure_kpa);
    let mut at = rng.u32(..sequence.ticks);
    sequence.actions.push((at, Action::Say(command)));
    // Drivers repeat themselves, operators press twice.
    if rng.u8(..3) == 0 {
        let period = pick(rng, &[1, 2, 10, 50, 140, 250, 900]);
        for _ in 0..rng.u8(1..6) {
            at += period;
            sequence.actions.push((at, Action::Say(command)));
        }
    }
    if season.settings.grip.host_timeout_ms > 0.0 && rng.u8(..8) == 0 {
        let ticks = rng.u16(50..700);
        sequence.actions.push((at, Action::Silence(ticks)));
    }
}

fn command(rng: &mut Rng, max_kpa: f32) -> Command {
    let pressure = |kpa| Command::Grip(Grip::Pressure(Kilopascals(kpa)));
    match rng.u8(..25) {
        0..4 => Command::Grip(Grip::Default),
        4..8 => pressure(between(rng, WEAK_KPA + 5.0, max_kpa)),
        8 => pressure(between(rng, 0.1, WEAK_KPA)),
        9 => Command::Grip(Grip::Bend(Degrees(between(rng, 35.0, 85.0)))),
        10 => Command::Grip(Grip::Payload(Payload {
            kind: pick(rng, &[ObjectKind::Sphere, ObjectKind::Cylinder]),
            mass: Kilograms(between(rng, 0.01, 0.3)),
            acceleration: MetresPerSecondSquared(between(rng, 0.0, 10.0)),
        })),
        11 => pressure(pick(rng, &[f32::NAN, -1.0, 0.0, 161.0, f32::INFINITY])),
        12..15 => Command::Release,
        15..17 => Command::Stop,
        17..20 => Command::Acknowledge,
        20..22 => Command::Tare,
        24 => Command::Sweep,
        22 => Command::Alive,
        _ => Command::Motion(pick(rng, &[Motion::Still, Motion::Moving])),
    }
}

fn add_object(rng: &mut Rng, sequence: &mut Sequence) {
    let happening = match rng.u8(..10) {
        0..4 => Happening::Fall,
        4 => Happening::Sideways {
            last: rng.usize(..3),
            after_ms: rng.u16(150..390),
        },
        5 => Happening::SlideOut {
            rise: between(rng, 0.0, 0.4),
            ms: rng.u16(50..500),
        },
        _ => {
            let mut fingers = [true; 3];
            fingers[rng.usize(..3)] = rng.bool();
            Happening::PutIn(fingers)
        }
    };
    let at = rng.u32(..sequence.ticks);
    sequence.actions.push((at, Action::Happen(happening)));
}

fn add_gauge(rng: &mut Rng, sequence: &mut Sequence, finger: usize) {
    // A step of less than 4 000 µε in two gauges at once is what a loss is; no gauge does that here.
    let jump = pick(rng, &[-9_000.0, -6_000.0, 6_000.0, 9_000.0]);
    let state = pick(
        rng,
        &[
            GaugeState::Open,
            GaugeState::Short,
            GaugeState::Stuck,
            GaugeState::Saturated,
            GaugeState::Offset(jump),
            GaugeState::Noisy(3_000.0),
        ],
    );
    let broken = Happening::Gauge(finger, state);
    add_for_a_while(
        rng,
        sequence,
        broken,
        Happening::Gauge(finger, GaugeState::Good),
    );
}

fn add_air(rng: &mut Rng, sequence: &mut Sequence) {
    let broken = match rng.u8(..12) {
        0 => Happening::ValveStuck,
        1 => Happening::ValveForced(between(rng, 0.0, 175.0)),
        2 => Happening::ValveLag(between(rng, 0.3, 3.0)),
        3 => Happening::Leak(between(rng, 60.0, 155.0)),
        4 => Happening::Burst,
        5..7 => Happening::SupplyDip(rng.u16(1..=50)),
        7 => Happening::MonitorWire(Some(AdcCode(0))),
        8 => Happening::MonitorWire(Some(AdcCode(65_000))),
        9..11 => Happening::Late(rng.u16(1..8)),
        _ => Happening::Overrun(rng.u16(1..8)),
    };
    let good = match broken {
        Happening::MonitorWire(_) => Happening::MonitorWire(None),
        _ => Happening::AirRepaired,
    };
    add_for_a_while(rng, sequence, broken, good);
}

/// Short faults are the harder ones; some last.
fn add_for_a_while(rng: &mut Rng, sequence: &mut Sequence, broken: Happening, good: Happening) {
    let at = rng.u32(..sequence.ticks);
    let ms = match rng.u8(..3) {
        0 => rng.u32(1..40),
        1 => rng.u32(40..600),
        _ => u32::MAX,
    };
    sequence.actions.push((at, Action::Happen(broken)));
    sequence
        .actions
        .push((at.saturating_add(ms), Action::Happen(good)));
}

//! The fingers under pressure, in small steps, and without again.

use std::collections::VecDeque;

use softgrip::estimate::{Casting, GaugeSense};
use softgrip::fault::Fault;
use softgrip::settings::{Settings, Values};
use softgrip::table::{self, FINGER};
use softgrip::units::{FINGERS, Kilopascals};
use watch::{Answer, Observation, Wish};

use crate::finding::{Finding, Step, Verdict};
use crate::limits::{
    ANSWER_S, DELAY_MS, HOLD_S, OVERSHOOT_KPA, PRESSURE_KPA, RELEASE_S, RESTS_KPA, SETTLE_S,
    STEP_KPA, STRAIN_FAILS_SHARE, STRAIN_WARNS_SHARE, WINDOW_S,
};
use crate::response::{self, Response};
use crate::rest::state;
use crate::session::{Halt, Session, mean};

/// Where the controller feels something in a grip that is to be empty.
const HELD_ADVICE: &str = "take out what is in the grip; if nothing is, tare and sweep (docs/calibration.md), and check again";

/// What a pressure has come to.
struct Held {
    /// Mean measured pressure, kPa.
    kpa: f32,
    /// Mean strain of each finger, µε.
    strain_ue: [Option<f32>; FINGERS],
}

/// Raises the pressure in steps up to the top, kPa. `rest`: what was seen before; `is_table_known`: strain can be judged.
pub fn pressure(
    session: &mut Session,
    top_kpa: f32,
    rest: &[Observation],
    is_table_known: bool,
    tell: &mut dyn FnMut(Finding),
) -> Result<(), Halt> {
    let mut held = vec![Held::of(&session.settings, rest)];
    let mut responses = Vec::new();
    let mut target = 0.0;
    while target < top_kpa {
        target = (target + STEP_KPA).min(top_kpa);
        let before = held.last().map_or(0.0, |held| held.kpa);
        let trace = match hold(session, target)? {
            Ok(trace) => trace,
            Err(finding) => {
                tell(finding);
                break;
            }
        };
        let window = last(&trace, WINDOW_S);
        let here = Held::of(&session.settings, window);
        responses.extend(response::of(&trace, before, here.kpa));
        let is_near = (here.kpa - target).abs() <= PRESSURE_KPA;
        let is_holding = session.latest.holding == Some(true);
        tell(
            Finding::judged(
                Step::Pressure,
                format!("pressure at {target} kPa"),
                format!("{target} ± {PRESSURE_KPA} kPa"),
                format!("{:.1} kPa", here.kpa),
                is_near,
            )
            .look_at("the regulator's scale and the settings of [front_end]"),
        );
        if is_holding {
            tell(
                Finding::judged(Step::Pressure, "grip", "empty", "something is held", false)
                    .look_at(HELD_ADVICE),
            );
        }
        held.push(here);
        if !is_near || is_holding {
            break;
        }
    }
    regulator(&responses, tell);
    let [rest, held @ ..] = &held[..] else {
        return Ok(());
    };
    fingers(&session.settings, rest, held, is_table_known, tell);
    Ok(())
}

/// Goes to a pressure, and waits until it rests. Gives all looks meanwhile, or what is in the way.
fn hold(session: &mut Session, target: f32) -> Result<Result<Vec<Observation>, Finding>, Halt> {
    let step = Step::Pressure;
    let what = format!("pressure at {target} kPa");
    let expected = format!("{target} ± {PRESSURE_KPA} kPa");
    session.catch_up()?;
    session.take_trace();
    let first = session.latest;
    session.is_pressed = true;
    if let Answer::Refused(why) = session.wish(Wish::GripAt(target))? {
        let seen = format!("refused: {why}");
        return Ok(Err(Finding::judged(step, what, expected, seen, false)));
    }
    let mut window = VecDeque::new();
    let mut since_s = None;
    let limit_s = SETTLE_S + slewing_s(&session.settings, target);
    let is_over = |seen: &Observation| {
        let gauges = seen.gauge_fault.iter().flatten();
        let is_wrong = seen.fault != Some(0) || seen.lost == Some(true);
        if is_wrong || gauges.into_iter().any(|number| *number != 0) {
            return true;
        }
        let (Some(t_s), Some(kpa)) = (seen.t_s, seen.pressure_kpa) else {
            return false;
        };
        window.push_back((t_s, kpa));
        while window
            .front()
            .is_some_and(|(then_s, _)| t_s - then_s > WINDOW_S)
        {
            window.pop_front();
        }
        let is_there = seen
            .setpoint_kpa
            .is_some_and(|kpa| (kpa - target).abs() < 0.2);
        if !is_there {
            return false;
        }
        let since_s = *since_s.get_or_insert(t_s);
        let lowest = window.iter().map(|(_, kpa)| *kpa).fold(f32::MAX, f32::min);
        let highest = window.iter().map(|(_, kpa)| *kpa).fold(f32::MIN, f32::max);
        t_s - since_s >= HOLD_S && highest - lowest <= RESTS_KPA && state(seen) != "closing"
    };
    let rests = session.until(limit_s, is_over)?;
    if let Some(mut finding) = session.failed(step, "none") {
        finding.what = format!("{}, on the way to {target} kPa", finding.what);
        if let Some(kpa) = session.latest.pressure_kpa {
            finding.seen = format!("{} at {kpa:.1} kPa", finding.seen);
        }
        return Ok(Err(finding));
    }
    if session.latest.lost == Some(true) {
        let finding = Finding::judged(step, "grip", "empty", "something was lost", false);
        return Ok(Err(finding.look_at(HELD_ADVICE)));
    }
    if !rests {
        let kpa = session.latest.pressure_kpa;
        let kpa = kpa.map_or("not known".into(), |kpa| format!("{kpa:.1} kPa"));
        let seen = format!("{kpa}, and not at rest after {limit_s:.1} s");
        let finding = Finding::judged(step, what, expected, seen, false);
        return Ok(Err(finding.look_at("the regulator, and the hoses: a leak")));
    }
    let looks = [first].into_iter().chain(session.take_trace());
    Ok(Ok(looks.collect()))
}

/// How long the set-point may take to a pressure, s: a robot may have slowed it down to a tenth (rSP, `docs/registers.md`).
fn slewing_s(values: &Values, kpa: f32) -> f64 {
    let slew = Settings::of(values).regulator.slew_kpa_per_s;
    f64::from(10.0 * kpa / slew)
}

/// The looks of the last so many seconds.
fn last(looks: &[Observation], for_s: f64) -> &[Observation] {
    let end_s = looks.last().and_then(|seen| seen.t_s).unwrap_or_default();
    let is_early = |seen: &Observation| seen.t_s.is_none_or(|t_s| end_s - t_s > for_s);
    &looks[looks.partition_point(is_early)..]
}

/// What is told of the regulator by the steps that it was measured in.
fn regulator(responses: &[Response], tell: &mut dyn FnMut(Finding)) {
    let step = Step::Pressure;
    let [what, over] = ["regulator's delay", "regulator's overshoot"];
    let expected = format!("{} to {} ms", DELAY_MS.start(), DELAY_MS.end());
    let most = format!("{OVERSHOOT_KPA} kPa at most");
    if responses.is_empty() {
        let why = "the pressure has not come to rest once";
        for (what, expected) in [(what, expected), (over, most)] {
            tell(Finding::new(step, what, expected, why, Verdict::NotTried));
        }
        return;
    }
    let sum: f64 = responses.iter().map(|response| response.delay_ms).sum();
    let delay_ms = sum / responses.len() as f64;
    let is_plausible = DELAY_MS.contains(&delay_ms);
    tell(
        Finding::judged(
            step,
            what,
            expected,
            format!("{delay_ms:.0} ms"),
            is_plausible,
        )
        .look_at("a monitor that shows the command, or a long or narrow hose"),
    );
    let overshoot = responses.iter().map(|response| response.overshoot_kpa);
    let kpa = overshoot.fold(0.0, f32::max);
    tell(
        Finding::judged(
            step,
            over,
            most,
            format!("{kpa:.1} kPa"),
            kpa <= OVERSHOOT_KPA,
        )
        .look_at("the regulator's own settings, or a volume that is too small for it"),
    );
}

impl Held {
    fn of(values: &Values, looks: &[Observation]) -> Self {
        let kpa = mean(looks, |seen| seen.pressure_kpa).unwrap_or_default();
        let strain_ue = std::array::from_fn(|finger| {
            // All sources tell what is lacking of a free finger's strain.
            let lacks = mean(looks, |seen| seen.residual_ue[finger])?;
            Some(free_ue(values, finger, kpa) - lacks)
        });
        Self { kpa, strain_ue }
    }
}

/// Strain of a free finger by the table and the settings, µε.
fn free_ue(values: &Values, finger: usize, kpa: f32) -> f32 {
    let settings = Settings::of(values).finger;
    let (gain, stiffness) = (settings.free_bend_gain[finger], settings.stiffness[finger]);
    let strain = |kpa: f32| table::free_strain(&FINGER, Kilopascals(kpa)).0.0;
    let share = strain(kpa) / strain(FINGER.max_pressure_kpa).max(1.0);
    Casting::of(&FINGER, gain, stiffness).ratio(share) * strain(kpa)
}

/// Each finger's strain against its table.
fn fingers(
    values: &Values,
    rest: &Held,
    held: &[Held],
    is_table_known: bool,
    tell: &mut dyn FnMut(Finding),
) {
    let settings = Settings::of(values).finger;
    let meeting_kpa = match settings.meeting_kpa > 0.0 {
        true => Some(settings.meeting_kpa),
        false => FINGER.meeting_kpa,
    };
    let is_free = |held: &&Held| meeting_kpa.is_none_or(|meeting| held.kpa < 0.95 * meeting);
    let free: Vec<&Held> = held.iter().take_while(is_free).collect();
    let why = match (is_table_known, settings.gauge_sense, free.last()) {
        (false, ..) => "the table of the gripper's finger is not this program's",
        (_, GaugeSense::Contact, _) => "by its settings the gauges see contact alone",
        (.., None) => "no pressure has come to rest",
        (.., Some(highest)) => {
            for finger in 0..FINGERS {
                tell(strain(values, finger, rest, &free, highest));
            }
            return;
        }
    };
    tell(Finding::new(
        Step::Pressure,
        "strain of the fingers",
        "as the table says",
        why,
        Verdict::NotTried,
    ));
}

/// One finger's strain against its table, at the highest of some pressures.
fn strain(values: &Values, finger: usize, rest: &Held, free: &[&Held], highest: &Held) -> Finding {
    let free_ue = |kpa: f32| free_ue(values, finger, kpa);
    let wanted = free_ue(highest.kpa) - free_ue(rest.kpa);
    let what = format!("strain of finger {}", finger + 1);
    let expected = format!(
        "rises with each step, to {wanted:.0} ± {:.0} µε at {:.0} kPa",
        STRAIN_WARNS_SHARE * wanted,
        highest.kpa
    );
    let rise = |held: &Held| Some(held.strain_ue[finger]? - rest.strain_ue[finger]?);
    let rises: Option<Vec<f32>> = free.iter().map(|held| rise(held)).collect();
    let Some(rises) = rises else {
        return Finding::judged(Step::Pressure, what, expected, "not known", false);
    };
    let seen: Vec<String> = rises.iter().map(|ue| format!("{ue:.0}")).collect();
    let seen = format!("{} µε", seen.join(", "));
    let top = rises.last().copied().unwrap_or_default();
    let is_rising = rises.is_sorted_by(|a, b| a < b) && rises.first().is_some_and(|ue| *ue > 0.0);
    let off = (top - wanted).abs() / wanted.max(1.0);
    let (verdict, advice) = match off {
        _ if top < -STRAIN_WARNS_SHARE * wanted => (
            Verdict::Failed,
            "it falls: EXC and GND are swapped at this finger's plug, or the gauge is on the wrong side",
        ),
        _ if !is_rising || off > STRAIN_FAILS_SHARE => (
            Verdict::Failed,
            "the gain of this gauge's amplifier, the recipe, and the finger: blocked, leaking, or its gauge has come off",
        ),
        _ if off > STRAIN_WARNS_SHARE => (
            Verdict::Warned,
            "tare and sweep (docs/calibration.md), and check again: then it is within, or gain, recipe or finger are wrong",
        ),
        _ => (Verdict::Passed, ""),
    };
    Finding::new(Step::Pressure, what, expected, seen, verdict).look_at(advice)
}

/// Lets the pressure go, and acknowledges what has been latched meanwhile. A stop is whoever's who pressed it.
pub fn release(session: &mut Session, tell: &mut dyn FnMut(Finding)) -> Result<(), Halt> {
    let step = Step::Release;
    let began_s = session.t_s();
    let from_kpa = session.latest.setpoint_kpa.unwrap_or_default();
    let answer = session.wish(Wish::Release)?;
    let limit_s = RELEASE_S + slewing_s(&session.settings, from_kpa);
    let is_gone = session.until(limit_s, |seen| {
        seen.setpoint_kpa == Some(0.0) && seen.pressure_kpa.is_some_and(|kpa| kpa <= PRESSURE_KPA)
    })?;
    session.is_pressed = !is_gone;
    let kpa = session.latest.pressure_kpa;
    let kpa = kpa.map_or("not known".into(), |kpa| format!("{kpa:.1} kPa"));
    let mut seen = format!("{kpa} after {:.2} s", session.t_s() - began_s);
    if let (Answer::Refused(why), false) = (answer, is_gone) {
        seen = format!("{seen}; refused: {why}");
    }
    let expected = format!("{PRESSURE_KPA} kPa at most within {limit_s:.1} s");
    tell(
        Finding::judged(step, "pressure", expected, seen, is_gone)
            .look_at("close the air; then the regulator's exhaust, and the stop circuit"),
    );
    let latched = session.latest.fault.unwrap_or_default();
    let is_stop = latched == u16::from(Fault::Stopped.code());
    if is_stop || latched == 0 && session.latest.lost != Some(true) {
        return Ok(());
    }
    session.wish(Wish::Acknowledge)?;
    let is_clear = |seen: &Observation| seen.fault == Some(0) && seen.lost == Some(false);
    match session.until(ANSWER_S, is_clear)? {
        true => tell(Finding::judged(
            step,
            "acknowledgement",
            "nothing is latched",
            "nothing is latched",
            true,
        )),
        false => {
            let number = session.latest.fault.unwrap_or_default();
            tell(Finding::fault(
                step,
                "acknowledgement",
                "nothing is latched",
                number,
            ));
        }
    }
    Ok(())
}

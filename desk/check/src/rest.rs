//! Which gripper it is, and every channel without pressure.

use settings::FIELDS;
use softgrip::fault::{Fault, GaugeFault};
use softgrip::table::FINGER;
use softgrip::units::FINGERS;
use watch::Observation;
use watch::fields::STATES;

use crate::finding::{Finding, Step, Verdict};
use crate::limits::{
    DRIFT_WARNS_UE, GOOD_NOISE_UE, NOISE_FAILS_UE, NOISE_WARNS_UE, PRESSURE_KPA, REST_S,
    ZERO_FAILS_UE, ZERO_WARNS_UE,
};
use crate::session::{Session, mean};

/// Whether the gripper's table is that of this build.
pub fn is_table_known(session: &Session) -> bool {
    let here = format!("{:016x}", FINGER.inputs_hash);
    !session.about.table.is_empty() && here.starts_with(&session.about.table)
}

/// Which gripper it is, and whether something is latched.
pub fn identity(session: &Session, tell: &mut dyn FnMut(Finding)) {
    let step = Step::Identity;
    let about = &session.about;
    let here = format!("{:016x}, {}", FINGER.inputs_hash, FINGER.recipe);
    let verdict = match is_table_known(session) {
        true => Verdict::Passed,
        false => Verdict::Warned,
    };
    tell(
        Finding::new(step, "finger table", here, about.table.clone(), verdict).look_at(
            "the gripper was built for another recipe than this program: strain cannot be judged",
        ),
    );
    let mine = env!("CARGO_PKG_VERSION");
    // The registers tell major and minor number alone.
    let is_same = mine == about.version || mine.starts_with(&format!("{}.", about.version));
    let verdict = match is_same {
        true => Verdict::Passed,
        false => Verdict::Warned,
    };
    tell(
        Finding::new(step, "version", mine, about.version.clone(), verdict)
            .look_at("flash the gripper, or take the softgrip of its version"),
    );
    let what = "latched fault";
    match session.latest.fault {
        Some(0) => tell(Finding::judged(step, what, "none", "none", true)),
        Some(number) => tell(Finding::fault(step, what, "none", number)),
        None => tell(Finding::judged(step, what, "none", "not told", false)),
    }
    if session.latest.lost == Some(true) {
        tell(
            Finding::judged(step, "latched loss", "none", "an object was lost", false)
                .look_at("acknowledge it"),
        );
    }
}

/// Settings that differ from this build's: name, value, and what it was built with.
pub fn differing(session: &Session) -> Vec<(&'static str, f32, f32)> {
    let factory = softgrip::settings::FACTORY;
    let rows = FIELDS.iter().zip(session.found.all()).zip(factory.all());
    rows.filter(|((_, is), was)| is != was)
        .map(|((field, is), was)| (field.name, *is, *was))
        .collect()
}

/// Every channel, of which this was seen for [`REST_S`].
pub fn rest(session: &Session, looks: &[Observation], tell: &mut dyn FnMut(Finding)) {
    let step = Step::Rest;
    for finger in 0..FINGERS {
        gauge(finger, looks, tell);
    }
    let expected = format!("0 ± {PRESSURE_KPA} kPa");
    let pressure = mean(looks, |seen| seen.pressure_kpa);
    let is_near = pressure.is_some_and(|kpa| kpa.abs() <= PRESSURE_KPA);
    let seen = pressure.map_or("not known".into(), |kpa| format!("{kpa:.1} kPa"));
    tell(
        Finding::judged(step, "pressure", expected, seen, is_near)
            .look_at("the monitor's wire, its divider, and that the regulator vents"),
    );
    let setpoint = mean(looks, |seen| seen.setpoint_kpa);
    let state = state(&session.latest);
    let is_idle = setpoint == Some(0.0) && state == "idle";
    let seen = setpoint.map_or("not known".into(), |kpa| format!("{kpa:.1} kPa, {state}"));
    tell(
        Finding::judged(step, "set-point", "0 kPa, idle", seen, is_idle)
            .look_at("release, and acknowledge what is latched; nobody else may command"),
    );
    let low = u16::from(Fault::SupplyLow.code());
    let least_v = softgrip::settings::Settings::of(&session.settings)
        .grip
        .supply_min_v;
    let expected = format!("above {least_v} V");
    if looks.iter().any(|seen| seen.fault == Some(low)) {
        tell(Finding::fault(step, "supply", expected, low));
        return;
    }
    let (seen, verdict) = match session.latest.fault {
        Some(0) => ("not reported low", Verdict::Passed),
        _ => ("another fault hides it", Verdict::NotTried),
    };
    tell(Finding::new(step, "supply", expected, seen, verdict));
}

/// In which state the gripper is, in a word.
pub fn state(seen: &Observation) -> &'static str {
    let number = seen.state.map(usize::from);
    let word = number.and_then(|number| STATES.get(number));
    word.copied().unwrap_or("unknown")
}

/// One gauge at rest.
fn gauge(finger: usize, looks: &[Observation], tell: &mut dyn FnMut(Finding)) {
    let step = Step::Rest;
    let named = |what: &str| format!("gauge {}, {what}", finger + 1);
    let failed = looks
        .iter()
        .find_map(|seen| seen.gauge_fault[finger].filter(|number| *number != 0));
    if let Some(number) = failed {
        tell(Finding::fault(step, named("fault"), "none", number));
        return;
    }
    tell(Finding::judged(step, named("fault"), "none", "none", true));
    noise(
        step,
        &named("noise"),
        mean(looks, |seen| seen.noise_ue[finger]),
        tell,
    );
    let zero = mean(looks, |seen| seen.residual_ue[finger]);
    let verdict = match zero.map(f32::abs) {
        Some(ue) if ue <= ZERO_WARNS_UE => Verdict::Passed,
        Some(ue) if ue <= ZERO_FAILS_UE => Verdict::Warned,
        _ => Verdict::Failed,
    };
    let seen = in_ue(zero);
    let expected = format!("0 ± {ZERO_WARNS_UE} µε");
    tell(
        Finding::new(step, named("residual"), expected, seen, verdict).look_at(
            "tare it (docs/calibration.md); if that is refused, the bridge's resistors and the gauge's bond",
        ),
    );
    let third = looks.len() / 3;
    let ends = [&looks[..third], &looks[looks.len() - third..]];
    let [first, last] = ends.map(|looks| mean(looks, |seen| seen.residual_ue[finger]));
    let moved = first.zip(last).map(|(first, last)| last - first);
    let verdict = match moved {
        Some(ue) if ue.abs() <= DRIFT_WARNS_UE => Verdict::Passed,
        _ => Verdict::Warned,
    };
    let tracked = mean(looks, |seen| seen.drift_ue[finger]);
    let seen = format!(
        "{}; tracked since the tare: {}",
        in_ue(moved),
        in_ue(tracked)
    );
    let expected = format!("0 ± {DRIFT_WARNS_UE} µε in {REST_S} s");
    tell(
        Finding::new(step, named("drift"), expected, seen, verdict)
            .look_at("tare it, wait until the board is warm, and touch no finger"),
    );
}

fn noise(step: Step, what: &str, noise: Option<f32>, tell: &mut dyn FnMut(Finding)) {
    let expected = format!("{GOOD_NOISE_UE} µε rms of a good board; {NOISE_WARNS_UE} at most");
    match noise {
        Some(ue) if ue > NOISE_FAILS_UE => {
            let noisy = Fault::from(GaugeFault::Noisy).code().into();
            let mut finding = Finding::fault(step, what, expected, noisy);
            finding.seen = format!("{ue:.1} µε, {}", finding.seen);
            tell(finding);
        }
        _ => {
            let verdict = match noise {
                Some(ue) if ue <= NOISE_WARNS_UE => Verdict::Passed,
                Some(_) => Verdict::Warned,
                None => Verdict::Failed,
            };
            let advice = "the cable's shield, and what it runs beside; the robot's motors";
            tell(Finding::new(step, what, expected, in_ue(noise), verdict).look_at(advice));
        }
    }
}

fn in_ue(ue: Option<f32>) -> String {
    ue.map_or("not known".into(), |ue| format!("{ue:.1} µε"))
}

//! The losses as rows of CSV.

use finger::object::Object;

use crate::trial::{Classification, ControllerReport, Loss, Trial};

/// Names of the CSV columns; files of users depend on them.
const COLUMNS: [&str; 25] = [
    "knowledge",
    "index",
    "noise_ue",
    "object",
    "diameter_mm",
    "mass_kg",
    "pressure_kpa",
    "friction",
    "depth_mm",
    "accel_m_s2",
    "first_finger_deg",
    "push_x_n",
    "push_y_n",
    "push_z_n",
    "push_start_s",
    "push_rise_s",
    "slide_s",
    "onset_s",
    "moved_onset_mm",
    "warned_s",
    "moved_warned_mm",
    "reported_s",
    "moved_reported_mm",
    "latency_ms",
    "verdict",
];

/// The names of the columns, as a line.
pub fn header() -> String {
    COLUMNS.join(",") + "\n"
}

/// A trial as a line; none if nothing was lost. No field needs quotes: they are numbers and names.
pub fn row(trial: &Trial) -> Option<String> {
    let loss = trial.loss.as_ref()?;
    Some(fields(trial, loss).join(",") + "\n")
}

fn fields(trial: &Trial, loss: &Loss) -> [String; COLUMNS.len()] {
    let case = &trial.case;
    let (scenario, gripped) = (&case.setup.scenario, case.setup.gripped());
    let (Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. }) = gripped.object;
    let number = |x: f64, decimals: usize| format!("{x:.decimals$}");
    let maybe = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.3}"));
    let push = case.push;
    let (reported_s, moved_mm) = match trial.report {
        ControllerReport::Lost { t_s, moved_mm } => (Some(t_s), Some(f64::from(moved_mm))),
        ControllerReport::Nothing | ControllerReport::Other { .. } => (None, None),
    };
    let (latency_ms, verdict) = match trial.classification() {
        Classification::Reported(ms) => (Some(ms), "reported".to_string()),
        other => (None, format!("{other:?}").to_lowercase()),
    };
    [
        case.knowledge.name().to_string(),
        case.index.to_string(),
        trial.noise_ue.to_string(),
        scenario.object.to_string(),
        number(2e3 * radius_m, 2),
        number(scenario.mass_kg, 4),
        number(scenario.pressure_kpa, 2),
        number(scenario.friction, 3),
        number(1e3 * gripped.depth_m, 2),
        number(scenario.accel_m_s2, 2),
        number(case.setup.gripper.hand.first_finger_deg, 1),
        maybe(push.map(|push| push.force_n[0])),
        maybe(push.map(|push| push.force_n[1])),
        maybe(push.map(|push| push.force_n[2])),
        maybe(push.map(|push| push.start_s)),
        maybe(push.map(|push| push.rise_s)),
        number(loss.slide_s, 3),
        number(loss.onset_s, 3),
        number(loss.moved_onset_mm.into(), 2),
        maybe(loss.warning.map(|(t_s, _)| t_s)),
        maybe(loss.warning.map(|(_, mm)| f64::from(mm))),
        maybe(reported_s),
        maybe(moved_mm),
        maybe(latency_ms),
        verdict,
    ]
}

//! Side views of fingers and object at selected instants of a run.

use std::fmt::Write;

use finger::grasp::Grasp;
use finger::object::Object;
use sim::arm::Phase;
use sim::run::{Outcome, Pose, Run};
use sim::scenario::ObjectKind;
use softgrip::telemetry::Event;

use crate::charts;

/// Width and height of a picture, pixels, and pixels per metre.
const SIZE: (f64, f64) = (200.0, 200.0);
const SCALE: f64 = 1050.0;
/// The palm's place in a picture.
const PALM: (f64, f64) = (SIZE.0 / 2.0, 34.0);
/// Height of a run's title.
const TITLE: f64 = 30.0;
/// Pictures in a row.
const COLUMNS: usize = 4;

/// Draws runs of the gripper that three fingers make, one below the other.
pub fn film(grasp: &Grasp, runs: &[Run]) -> String {
    let (mut strips, mut top) = (String::new(), 0.0);
    for run in runs {
        top += strip(&mut strips, grasp, run, top);
    }
    let width = SIZE.0 * COLUMNS as f64;
    charts::standalone(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{top}\" viewBox=\"0 0 {width} {top}\" font-family=\"sans-serif\">\n{strips}</svg>\n"
    ))
}

/// Draws one run from `top` on, and gives its height.
fn strip(out: &mut String, grasp: &Grasp, run: &Run, top: f64) -> f64 {
    let outcome = match run.outcome {
        Outcome::Hold => "held",
        Outcome::Pick => "lost in the lift",
        Outcome::Transfer => "lost in the carry",
    };
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "<text x=\"10\" y=\"{}\" font-size=\"15\" fill=\"#282C34\">{}: {outcome}</text>",
        top + 20.0,
        crate::words::title(&run.scenario),
    );
    let frames = frames(run);
    for (n, (title, pose)) in frames.iter().enumerate() {
        let _ = writeln!(
            out,
            "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">{}<text x=\"8\" y=\"16\" font-size=\"12\" fill=\"#282C34\">{:.2} s  {title}</text></svg>",
            SIZE.0 * (n % COLUMNS) as f64,
            SIZE.1 * (n / COLUMNS) as f64 + top + TITLE,
            SIZE.0,
            SIZE.1,
            picture(grasp, run.scenario.object, pose),
            pose.t_s,
        );
    }
    SIZE.1 * frames.len().div_ceil(COLUMNS) as f64 + TITLE
}

/// The instants: one of each phase, and those at which something happened.
fn frames(run: &Run) -> Vec<(String, &Pose)> {
    let start = |phase: Phase| {
        let mut samples = run.samples.iter();
        samples
            .find(|sample| sample.truth.arm.phase == phase)
            .map(|sample| sample.truth.t_s)
    };
    let (Some(grip), Some(lift), Some(carry), Some(place), Some(release)) = (
        start(Phase::Grip),
        start(Phase::Lift),
        start(Phase::Carry),
        start(Phase::Place),
        start(Phase::Release),
    ) else {
        return Vec::new();
    };
    let said = |wanted: fn(&Event) -> bool| {
        let mut events = run.events.iter();
        events
            .find(|timed| wanted(&timed.event))
            .map(|timed| timed.t_s)
    };
    let mut instants = vec![
        (grip, "above the object"),
        ((grip + lift) / 2.0, "closing"),
        (lift, "about to lift"),
        ((lift + carry) / 2.0, "lifting"),
        ((carry + place) / 2.0, "carrying"),
        (release, "about to release"),
    ];
    instants
        .extend(said(|event| matches!(event, Event::Contact { .. })).map(|t| (t, "first contact")));
    instants
        .extend(said(|event| matches!(event, Event::Slip { .. })).map(|t| (t, "slip reported")));
    instants.extend(said(|event| matches!(event, Event::Lost(_))).map(|t| (t, "loss reported")));
    instants.extend(said(|event| matches!(event, Event::Released)).map(|t| (t, "released")));
    instants.extend(run.slid_at_s.map(|t| (t, "has slid 20 mm")));
    // What follows a loss shows empty fingers only.
    if let Some(end) = run.flagged_at_s.or(run.slid_at_s) {
        instants.retain(|(t, _)| *t <= end);
    }
    instants.sort_by(|a, b| a.0.total_cmp(&b.0));
    let nearest = |t: f64| {
        run.poses
            .iter()
            .min_by(|a, b| (a.t_s - t).abs().total_cmp(&(b.t_s - t).abs()))
    };
    instants
        .into_iter()
        .filter_map(|(t, title)| Some((title.to_string(), nearest(t)?)))
        .collect()
}

/// Palm, fingers and object, seen along y; fingers further away are paler.
fn picture(grasp: &Grasp, kind: ObjectKind, pose: &Pose) -> String {
    let at = |point: [f64; 3]| (PALM.0 + SCALE * point[0], PALM.1 - SCALE * point[2]);
    let mut fingers: Vec<_> = pose.links_m.iter().collect();
    fingers.sort_by(|a, b| b[0][0][1].total_cmp(&a[0][0][1]));
    let thickness = 2.0 * SCALE * grasp.link_radius_m;
    let mut out = String::new();
    let palm = SCALE * grasp.palm_radius_m + thickness / 2.0;
    let _ = write!(
        out,
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"8\" fill=\"#6E7682\"/>",
        PALM.0 - palm,
        PALM.1 - 8.0,
        2.0 * palm,
    );
    let mut behind = true;
    for finger in fingers {
        // The object stands on the axis, so it comes before the first finger with y ≤ 0.
        if behind && finger[0][0][1] < 1e-9 {
            out.push_str(&object(grasp, kind, pose, at(pose.object_m)));
            behind = false;
        }
        let mut path = String::new();
        for (n, link) in finger.iter().enumerate() {
            let (x, y) = at(link[0]);
            let _ = write!(path, "{}{x:.1} {y:.1}", if n == 0 { "M" } else { "L" });
        }
        let (x, y) = at(finger[finger.len() - 1][1]);
        let _ = write!(
            out,
            "<path d=\"{path}L{x:.1} {y:.1}\" fill=\"none\" stroke=\"#0072B2\" stroke-opacity=\"{}\" stroke-width=\"{thickness:.1}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>",
            if behind { 0.35 } else { 0.8 },
        );
    }
    out
}

fn object(grasp: &Grasp, kind: ObjectKind, pose: &Pose, (x, y): (f64, f64)) -> String {
    let look = "fill=\"#E69F00\" fill-opacity=\"0.75\"";
    let gripped = match kind {
        ObjectKind::Sphere => grasp.sphere,
        ObjectKind::Cylinder => grasp.cylinder,
    };
    match gripped.object {
        Object::Sphere { radius_m } => {
            let radius = SCALE * radius_m;
            format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" {look}/>")
        }
        Object::Cylinder { radius_m, height_m } => {
            let (radius, height) = (SCALE * radius_m, SCALE * height_m);
            let [along, _, up] = pose.object_axis;
            format!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\" transform=\"rotate({:.1} {x:.1} {y:.1})\" {look}/>",
                x - radius,
                y - height / 2.0,
                2.0 * radius,
                along.atan2(up).to_degrees(),
            )
        }
    }
}

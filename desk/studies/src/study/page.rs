//! The study as one HTML page that needs nothing else: figures inline, no script, no network.

mod figures;

use std::fmt::Write;

use finger::recipe::Recipe;
use softgrip::telemetry::Event;

use crate::charts;
use crate::report;
use crate::sim::{Outcome, Run};
use crate::study::{self, Band, Case, Stated, Varied};

const STYLE: &str = include_str!("html/report.css");

/// Everything that the report shows.
pub struct Study<'a> {
    /// The fingers.
    pub recipe: &'a Recipe,
    /// The programme.
    pub cases: &'a [Case],
    /// The programme under changes.
    pub varied: &'a [Varied],
    /// Edge cases over ranges, by their number in the programme.
    pub bands: &'a [(usize, Vec<Band>)],
}

/// A page in the style of the house, from its title and its body.
pub fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>\n{STYLE}{}\n</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        charts::dark_rules()
    )
}

/// The report.
pub fn report(study: &Study) -> anyhow::Result<String> {
    let mut out = String::new();
    introduction(&mut out, study);
    outcomes(&mut out, study);
    sensitivity(&mut out, study);
    for figure in figures::all(study)? {
        let _ = writeln!(
            out,
            "<figure>\n<h2>{}</h2>\n{}\n<figcaption>{}</figcaption>\n</figure>",
            figure.title, figure.svg, figure.caption
        );
    }
    limits(&mut out);
    Ok(page("softgrip: the paper's experiments, replayed", &out))
}

fn introduction(out: &mut String, study: &Study) {
    let counts = |wanted| {
        let agreeing = study
            .cases
            .iter()
            .filter(|case| case.agrees() == Some(wanted));
        agreeing.count()
    };
    let (right, wrong) = (counts(true), counts(false));
    let mistakes = study
        .cases
        .iter()
        .filter(|case| case.run.mistake().is_some())
        .count();
    let verdict = match mistakes {
        0 => "made no mistake: no loss reported while an object was held, one in every loss, none on release".into(),
        n => format!("was wrong in {n} of them"),
    };
    // Writing to a String cannot fail.
    let _ = write!(
        out,
        "<h1>The paper's experiments, replayed</h1>\n<p>Twelve pick-and-place runs of <i>Innovative Development of a Soft Robotic Gripper: Mathematical Modelling and Grasping Capability Analysis</i> on the simulated gripper, at 140 kPa, under the controller that is flashed. Fingers: recipe <b>{}</b>. The physics agrees with <b>{right} of the {}</b> outcomes that the paper states. The controller {verdict}.</p>\n",
        escape(&study.recipe.name),
        right + wrong,
    );
}

fn outcomes(out: &mut String, study: &Study) {
    out.push_str("<h2>What the paper says, the physics did and the controller said</h2>\n<div class=\"wide\"><table>\n<tr><th>run</th><th>paper says</th><th>physics did</th><th></th><th>controller said</th><th>latency</th><th>robust</th></tr>\n");
    for (n, case) in study.cases.iter().enumerate() {
        let run = &case.run;
        let agrees = match case.agrees() {
            Some(true) => "<td class=\"good\">✓ agrees</td>",
            Some(false) => "<td class=\"bad\">✗ differs</td>",
            None => "<td></td>",
        };
        let robust = match study::robust(study.cases, study.varied, n) {
            true => "yes",
            false => "edge",
        };
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td title=\"{}\">{}</td><td>{}</td>{agrees}<td>{}</td><td>{}</td><td>{robust}</td></tr>",
            report::title(&run.scenario),
            case.experiment.words,
            stated(case.stated),
            physics(run),
            controller(run),
            run.latency_ms()
                .map_or(String::new(), |ms| format!("{ms:.0} ms").replace('-', "−")),
        );
    }
    out.push_str("</table></div>\n<p class=\"note\">Latency counts from the moment when the true contact residual, summed over the fingers, has fallen to 90 % of its plateau for good; it is negative where one finger empties before the sum shows it. Robust: the outcome is the same under every change of the gripper in the next table.</p>\n<p class=\"note\">Of the 250 g sphere at 2 m/s² the paper says only that it falls, and of 5 and 10 m/s² that it falls “immediately in the picking step”, which implies the transfer for 2. Lifting at 2 m/s² takes m (g + a) = 2.95 N, carrying 2.50 N: what survives the lift survives the carry, so no gripper that holds by friction at rest does what is implied.</p>\n<ul class=\"note\">\n");
    for experiment in &study::EXPERIMENTS {
        let _ = writeln!(
            out,
            "<li>{} {:.0} g: “{}”.</li>",
            experiment.object,
            1e3 * experiment.mass_kg,
            experiment.words
        );
    }
    out.push_str("</ul>\n");
}

fn stated(stated: Stated) -> &'static str {
    match stated {
        Stated::Hold => "held",
        Stated::Pick => "falls while picked",
        Stated::Transfer => "falls in the transfer",
        Stated::Fall => "falls",
        Stated::Unstated => "—",
    }
}

fn physics(run: &Run) -> String {
    let slid = run.slid_at_s.unwrap_or_default();
    match run.outcome {
        Outcome::Hold => "held".into(),
        Outcome::Pick => format!("fell in the lift, {slid:.2} s"),
        Outcome::Transfer => format!("fell in the carry, {slid:.2} s"),
    }
}

/// What it reported, in a few words.
fn controller(run: &Run) -> String {
    let first = |wanted: fn(&Event) -> bool| {
        let mut events = run.events.iter();
        events
            .find(|timed| wanted(&timed.event))
            .map(|timed| timed.t_s)
    };
    let mut words = Vec::new();
    words.extend(first(|e| matches!(e, Event::Slip { .. })).map(|t| format!("slip {t:.2} s")));
    match (run.lost_reports(), run.flagged_at_s) {
        (0, _) | (_, None) => words.push("no loss".into()),
        (1, Some(t)) => words.push(format!("lost {t:.2} s, once")),
        (n, Some(t)) => words.push(format!("lost {t:.2} s, {n} times")),
    }
    words.extend(first(|e| matches!(e, Event::Released)).map(|_| "released".into()));
    words.extend(first(|e| matches!(e, Event::Fault { .. })).map(|t| format!("FAULT {t:.2} s")));
    words.join(", ")
}

fn sensitivity(out: &mut String, study: &Study) {
    out.push_str("<h2>What hangs on a millimetre</h2>\n<p>Every run again with one change at a time: <b>h</b>eld, lost in the <b>p</b>ick or in the <b>t</b>ransfer. Outlined where the outcome is not that of the first line; ! where the controller was wrong. The controller is calibrated to the changed stiffness, as by a free-bend sweep. A palm radius smaller by 1 mm cannot be: the open fingers would stand inside the object.</p>\n<div class=\"wide\"><table class=\"grid\">\n<tr><th></th>");
    for experiment in &study::EXPERIMENTS {
        let _ = write!(
            out,
            "<th colspan=\"{}\">{} {:.0} g</th>",
            study::ACCELERATIONS.len(),
            experiment.object,
            1e3 * experiment.mass_kg
        );
    }
    out.push_str("</tr>\n<tr><th>m/s²</th>");
    for case in study.cases {
        let _ = write!(out, "<th>{}</th>", case.run.scenario.accel_m_s2);
    }
    out.push_str("</tr>\n<tr><th>as it is</th>");
    for case in study.cases {
        out.push_str(&cell(
            case.run.outcome,
            case.run.outcome,
            case.run.mistake().is_some(),
        ));
    }
    out.push_str("</tr>\n");
    for varied in study.varied {
        let _ = write!(out, "<tr><th>{}</th>", varied.name);
        for (n, case) in study.cases.iter().enumerate() {
            let wrong = varied.mistakes[n].is_some();
            out.push_str(&cell(varied.outcomes[n], case.run.outcome, wrong));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</table></div>\n<p class=\"note\">The last two lines are the convergence with the step of the rigid-body engine; the controller ticks at 1 ms in all of them.</p>\n");
    for (n, bands) in study.bands {
        let _ = writeln!(
            out,
            "<h3>On the edge: {}</h3>\n<div class=\"wide\"><table class=\"grid\">",
            report::title(&study.cases[*n].run.scenario)
        );
        for band in bands {
            let _ = write!(out, "<tr><th rowspan=\"2\">{}</th>", band.name);
            for value in &band.values {
                let _ = write!(out, "<td>{value}</td>");
            }
            out.push_str("</tr>\n<tr>");
            for &outcome in &band.outcomes {
                out.push_str(&cell(outcome, study.cases[*n].run.outcome, false));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</table></div>\n");
    }
}

fn cell(outcome: Outcome, reference: Outcome, wrong: bool) -> String {
    let letter = match outcome {
        Outcome::Hold => "h",
        Outcome::Pick => "p",
        Outcome::Transfer => "t",
    };
    let other = if outcome == reference { "" } else { " other" };
    let mark = if wrong { "!" } else { "" };
    format!(
        "<td class=\"{}{other}\" title=\"{}\">{letter}{mark}</td>",
        outcome.name(),
        outcome.name()
    )
}

fn limits(out: &mut String) {
    out.push_str(
        "<h2>What this is not</h2>\n<ul>\n\
        <li>Each finger is a chain of six rigid links on springs, as in the paper, not a continuum; contact is that of round links with the object, not of soft skin.</li>\n\
        <li>Friction is that of Coulomb, the same at rest and sliding. The paper has 0.8 and 0.75, and no law between them; the line “friction 0.75 while sliding” above takes the second where the surfaces move against each other by more than 1 mm/s.</li>\n\
        <li>The simulated fingers pass through one another where they close on nothing. A real pair meets, so an empty close looks different on a real gripper.</li>\n\
        <li>Palm radius, grasp depth, jerk ramp, damping and the heights and lengths of the moves are not in the paper. They were chosen so that the stated outcomes come out; the table above says how far that goes.</li>\n\
        <li>The gauges' place and distance from the neutral axis are not in the paper either, so strains have the right course and a free scale. The paper's curves are pictures without numbers, and are not drawn here.</li>\n\
        <li>Noise is white and small; drift with temperature, leaks and cables are not simulated. Regulator, lags and creep are stated in twin/gripper.toml and are not fitted to any outcome.</li>\n\
        </ul>\n",
    );
}

/// A text as HTML shows it.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

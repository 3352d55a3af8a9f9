//! The study as one self-contained HTML page.

use finger::recipe::Recipe;
use maud::{Markup, html};
use report::html::{figure, page};
use report::words;
use sim::run::{Outcome, Run};
use softgrip::telemetry::Event;

use super::figures;
use super::{Band, Case, Varied, robust};
use crate::paper::{ACCELERATIONS, EXPERIMENTS, Stated};

/// Content of the report.
pub struct StudyPage<'a> {
    /// Recipe of the fingers.
    pub recipe: &'a Recipe,
    /// The twelve runs of the paper.
    pub cases: &'a [Case],
    /// The programme under changes.
    pub varied: &'a [Varied],
    /// Edge cases over ranges, by their number in the programme.
    pub bands: &'a [(usize, Vec<Band>)],
}

/// The study as an HTML page.
///
/// # Errors
/// If a figure cannot be drawn.
pub fn report(study: &StudyPage) -> anyhow::Result<String> {
    let figures = figures::all(study.recipe, study.cases)?;
    let body = html! {
        (introduction(study))
        (outcomes(study))
        (sensitivity(study))
        @for (n, bands) in study.bands { (edge(&study.cases[*n].run, bands)) }
        @for shown in figures { (figure(Some(&shown.title), &shown.svg, &shown.caption)) }
        (limits())
    };
    Ok(page("softgrip: the paper's experiments, simulated", &body))
}

fn introduction(study: &StudyPage) -> Markup {
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
    html! {
        h1 { "The paper's experiments, simulated" }
        p {
            "Twelve pick-and-place runs of "
            i { "Innovative Development of a Soft Robotic Gripper: Mathematical Modelling and Grasping Capability Analysis" }
            " on the simulated gripper, at 140 kPa, under the controller that is flashed. Fingers: recipe "
            b { (study.recipe.name) }
            ". The physics agrees with "
            b { (right) " of the " (right + wrong) }
            " outcomes that the paper states. The controller " (verdict) "."
        }
    }
}

fn outcomes(study: &StudyPage) -> Markup {
    html! {
        h2 { "Outcomes: paper, simulation and controller" }
        div class="wide" {
            table {
                tr {
                    th { "run" } th { "paper" } th { "simulation" } th {}
                    th { "controller" } th { "latency" } th { "robust" }
                }
                @for n in 0..study.cases.len() { (outcome(study, n)) }
            }
        }
        p class="note" {
            "Latency is measured from the moment when the true contact residual, summed over the fingers, falls below 90 % of its plateau for good; it is negative where one finger loses contact before the sum drops. Robust: the outcome is the same under every change of the gripper in the next table."
        }
        p class="note" {
            "Of the 250 g sphere at 2 m/s² the paper says only that it falls, and of 5 and 10 m/s² that it falls “immediately in the picking step”, which implies the transfer for 2. Lifting at 2 m/s² takes m (g + a) = 2.95 N, carrying 2.50 N: what survives the lift survives the carry, so no gripper that holds by friction at rest does what is implied."
        }
        ul class="note" {
            @for experiment in &EXPERIMENTS {
                li {
                    (experiment.object) " " (grams(experiment.mass_kg)) " g: “" (experiment.words) "”."
                }
            }
        }
    }
}

/// A row of the outcomes.
fn outcome(study: &StudyPage, n: usize) -> Markup {
    let case = &study.cases[n];
    let run = &case.run;
    let latency = run.latency_ms();
    let latency = latency.map_or(String::new(), |ms| format!("{ms:.0} ms").replace('-', "−"));
    html! {
        tr {
            td { (words::title(&run.scenario)) }
            td title=(case.experiment.words) { (stated(case.stated)) }
            td { (physics(run)) }
            @match case.agrees() {
                Some(true) => { td class="good" { "✓ agrees" } }
                Some(false) => { td class="bad" { "✗ differs" } }
                None => { td {} }
            }
            td { (controller(run)) }
            td { (latency) }
            td { (if robust(study.cases, study.varied, n) { "yes" } else { "edge" }) }
        }
    }
}

fn grams(mass_kg: f64) -> String {
    format!("{:.0}", 1e3 * mass_kg)
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

/// The controller's reports as a short text.
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

fn sensitivity(study: &StudyPage) -> Markup {
    html! {
        h2 { "Sensitivity" }
        p {
            "Every run, repeated with one change at a time: " b { "h" } "eld, lost in the " b { "p" } "ick or in the " b { "t" } "ransfer. Outlined where the outcome differs from the first row; ! where the controller was wrong. The controller is calibrated to the changed stiffness, as by a free-bend sweep. A palm radius smaller by 1 mm is impossible: the open fingers would be inside the object."
        }
        div class="wide" {
            table class="grid" {
                tr {
                    th {}
                    @for experiment in &EXPERIMENTS {
                        th colspan=(ACCELERATIONS.len()) {
                            (experiment.object) " " (grams(experiment.mass_kg)) " g"
                        }
                    }
                }
                tr {
                    th { "m/s²" }
                    @for case in study.cases { th { (case.run.scenario.accel_m_s2) } }
                }
                tr {
                    th { "as it is" }
                    @for case in study.cases {
                        (cell(case.run.outcome, case.run.outcome, case.run.mistake().is_some()))
                    }
                }
                @for varied in study.varied {
                    tr {
                        th { (varied.name) }
                        @for (n, case) in study.cases.iter().enumerate() {
                            (cell(varied.outcomes[n], case.run.outcome, varied.mistakes[n].is_some()))
                        }
                    }
                }
            }
        }
        p class="note" {
            "The last two rows show the convergence with the time step of the rigid-body engine; the control tick is 1 ms in all of them."
        }
    }
}

/// An edge case over ranges of its parameters.
fn edge(run: &Run, bands: &[Band]) -> Markup {
    html! {
        h3 { "Edge case: " (words::title(&run.scenario)) }
        div class="wide" {
            table class="grid" {
                @for band in bands {
                    tr {
                        th rowspan="2" { (band.name) }
                        @for value in &band.values { td { (value) } }
                    }
                    tr {
                        @for &outcome in &band.outcomes { (cell(outcome, run.outcome, false)) }
                    }
                }
            }
        }
    }
}

fn cell(outcome: Outcome, reference: Outcome, wrong: bool) -> Markup {
    let letter = match outcome {
        Outcome::Hold => "h",
        Outcome::Pick => "p",
        Outcome::Transfer => "t",
    };
    html! {
        td class={ (outcome.name()) @if outcome != reference { " other" } } title=(outcome.name()) {
            (letter) @if wrong { "!" }
        }
    }
}

fn limits() -> Markup {
    html! {
        h2 { "Known limitations" }
        ul {
            li { "Each finger is a chain of six rigid links on springs, as in the paper, not a continuum; contact is that of round links with the object, not of soft skin." }
            li { "Friction is Coulomb friction with one coefficient. The paper states 0.8 and 0.75 without a law between them; the row “friction 0.75 while sliding” above uses the second where the surfaces slide faster than 1 mm/s." }
            li { "Palm radius, grasp depth, jerk ramp, damping and the heights and lengths of the moves are not in the paper. They were chosen to reproduce the stated outcomes; the table above shows how sensitive that is." }
            li { "The gauges' place and distance from the neutral axis are not in the paper either, so strains have the right course and a free scale. The paper's curves are pictures without numbers, and are not drawn here." }
            li { "Noise is white and small; drift with temperature, leaks and cables are not simulated. Regulator, lags and creep are stated in desk/sim/gripper.toml and are not fitted to any outcome." }
        }
    }
}

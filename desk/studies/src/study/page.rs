//! The study as one HTML page that needs nothing else: figures inline, no script, no network.

use finger::recipe::Recipe;
use maud::{Markup, html};
use report::html::{figure, page};
use report::words;
use sim::run::{Outcome, Run};
use softgrip::telemetry::Event;

use super::figures;
use super::{Band, Case, Varied, robust};
use crate::paper::{ACCELERATIONS, EXPERIMENTS, Stated};

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

/// The report.
pub fn report(study: &Study) -> anyhow::Result<String> {
    let figures = figures::all(study.recipe, study.cases)?;
    let body = html! {
        (introduction(study))
        (outcomes(study))
        (sensitivity(study))
        @for (n, bands) in study.bands { (edge(&study.cases[*n].run, bands)) }
        @for shown in figures { (figure(Some(&shown.title), &shown.svg, &shown.caption)) }
        (limits())
    };
    Ok(page("softgrip: the paper's experiments, replayed", &body))
}

fn introduction(study: &Study) -> Markup {
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
        h1 { "The paper's experiments, replayed" }
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

fn outcomes(study: &Study) -> Markup {
    html! {
        h2 { "What the paper says, the physics did and the controller said" }
        div class="wide" {
            table {
                tr {
                    th { "run" } th { "paper says" } th { "physics did" } th {}
                    th { "controller said" } th { "latency" } th { "robust" }
                }
                @for n in 0..study.cases.len() { (outcome(study, n)) }
            }
        }
        p class="note" {
            "Latency counts from the moment when the true contact residual, summed over the fingers, has fallen to 90 % of its plateau for good; it is negative where one finger empties before the sum shows it. Robust: the outcome is the same under every change of the gripper in the next table."
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
fn outcome(study: &Study, n: usize) -> Markup {
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

fn sensitivity(study: &Study) -> Markup {
    html! {
        h2 { "What hangs on a millimetre" }
        p {
            "Every run again with one change at a time: " b { "h" } "eld, lost in the " b { "p" } "ick or in the " b { "t" } "ransfer. Outlined where the outcome is not that of the first line; ! where the controller was wrong. The controller is calibrated to the changed stiffness, as by a free-bend sweep. A palm radius smaller by 1 mm cannot be: the open fingers would stand inside the object."
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
            "The last two lines are the convergence with the step of the rigid-body engine; the controller ticks at 1 ms in all of them."
        }
    }
}

/// An edge case over ranges of its parameters.
fn edge(run: &Run, bands: &[Band]) -> Markup {
    html! {
        h3 { "On the edge: " (words::title(&run.scenario)) }
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
        h2 { "What this is not" }
        ul {
            li { "Each finger is a chain of six rigid links on springs, as in the paper, not a continuum; contact is that of round links with the object, not of soft skin." }
            li { "Friction is that of Coulomb, the same at rest and sliding. The paper has 0.8 and 0.75, and no law between them; the line “friction 0.75 while sliding” above takes the second where the surfaces move against each other by more than 1 mm/s." }
            li { "The simulated fingers pass through one another where they close on nothing. A real pair meets, so an empty close looks different on a real gripper." }
            li { "Palm radius, grasp depth, jerk ramp, damping and the heights and lengths of the moves are not in the paper. They were chosen so that the stated outcomes come out; the table above says how far that goes." }
            li { "The gauges' place and distance from the neutral axis are not in the paper either, so strains have the right course and a free scale. The paper's curves are pictures without numbers, and are not drawn here." }
            li { "Noise is white and small; drift with temperature, leaks and cables are not simulated. Regulator, lags and creep are stated in desk/sim/gripper.toml and are not fitted to any outcome." }
        }
    }
}

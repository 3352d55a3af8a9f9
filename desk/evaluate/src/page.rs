//! The evaluation as one HTML page that needs nothing else.

use maud::{Markup, html};
use report::html::{figure, page as whole};

use crate::evaluation::Evaluation;
use crate::options::Options;
use crate::summary::Summary;
use crate::{figures, tables, words};

/// The page.
pub fn page(
    evaluation: &Evaluation,
    summary: &Summary,
    options: &Options,
) -> anyhow::Result<String> {
    let latencies = figures::latencies(&evaluation.sample.trials)?;
    let roc = figures::roc(summary)?;
    let wrong = words::wrong(&evaluation.sample.trials);
    let alarms = words::alarms(&evaluation.tallies);
    let body = html! {
        (introduction(options))
        @for table in tables::all(summary) { (table.html()) }
        (figure(None, &latencies, &"Share of the losses that are reported within a time after the collapse of the grip, for three levels of gauge noise."))
        (figure(None, &roc, &figures::roc_caption()))
        @if !wrong.is_empty() || !alarms.is_empty() {
            h2 { "Everything that went wrong" }
            div class="wide" { pre { (wrong) (alarms) } }
        }
        (method())
    };
    Ok(whole("softgrip: latency and false alarms", &body))
}

fn introduction(options: &Options) -> Markup {
    let Options {
        seed,
        losses,
        hours,
        ..
    } = options;
    html! {
        h1 { "How soon, and how often for nothing" }
        p {
            "The controller that is flashed, on " (losses) " random losses per class of fingers of the simulated gripper and on " (hours) " h of holding and moving at each level of noise (a tenth of that at the highest). Seed " (seed) ". "
            code { "softgrip evaluate --losses " (losses) " --hours " (hours) " --seed " (seed) }
            " measures it again."
        }
    }
}

fn method() -> Markup {
    html! {
        h2 { "How it is measured" }
        ul {
            li { "Losses: object, size, mass, pressure, friction, place in the grip, acceleration, direction, stiffness of each finger, gain and drift of each gauge, creep, regulator and its ripple are drawn at random; half of the runs are left to inertia, half get a push: downwards, sideways or anywhere, at once or in half a second, at rest or on the way." }
            li { "The physics of a run is simulated once, in closed loop with the controller at 20 µε; its strains and pressures are then measured again with other noise. Gauge noise does not reach the physics before a report: the regulator listens to its monitor alone, and the reaction to a loss is to hold." }
            li { "False alarms: a fast gripper without rigid bodies, in closed loop with the controller. How a held object answers to the arm, and how it gives way under knocks, is identified on the simulated gripper at the start of each evaluation, for two kinds of object at four pressures and two loads." }
            li { "The detector was tuned on seeds below 1000, and none of them is used here." }
            li { "All of this is a simulation: six rigid links for a finger, Coulomb friction, white gauge noise. A real gripper will differ; the command that measured this measures another recipe as well." }
        }
    }
}

//! The evaluation as one self-contained HTML page.

use maud::{Markup, html};
use report::html::{figure, page as whole};

use crate::about::About;
use crate::evaluation::Evaluation;
use crate::summary::Summary;
use crate::{details, figures, tables};

/// The HTML page with all tables and figures of an evaluation.
///
/// # Errors
/// If the drawing library fails.
pub fn page(evaluation: &Evaluation, summary: &Summary) -> anyhow::Result<String> {
    let latencies = figures::latencies(&evaluation.sample)?;
    let roc = figures::roc(summary)?;
    let wrong = evaluation.sample.wrong();
    let alarms = details::alarms(&evaluation.tallies);
    let body = html! {
        (introduction(&summary.about))
        @for table in tables::all(summary) { (table.html()) }
        (figure(None, &latencies, &"Share of the losses that are reported within a time after the collapse of the grip, for three levels of gauge noise."))
        (figure(None, &roc, &figures::roc_caption()))
        @if !wrong.is_empty() || !alarms.is_empty() {
            h2 { "All errors" }
            div class="wide" { pre { (wrong) (alarms) } }
        }
        (method())
    };
    Ok(whole(
        "softgrip: detection latency and false-alarm rate",
        &body,
    ))
}

fn introduction(about: &About) -> Markup {
    let About {
        seed,
        losses,
        hours,
        ..
    } = about;
    html! {
        h1 { "Detection latency and false-alarm rate" }
        p {
            "The controller of the firmware on " (losses) " random losses per class of fingers of the simulated gripper and on " (hours) " h of operation without a loss at each level of noise (a tenth of that at the highest). Seed " (seed) ". "
            code { "softgrip evaluate --losses " (losses) " --hours " (hours) " --seed " (seed) }
            " repeats it."
        }
    }
}

fn method() -> Markup {
    html! {
        h2 { "Method" }
        ul {
            li { "Losses: object, size, mass, pressure, friction, place in the grip, acceleration, direction, stiffness of each finger, gain and drift of each gauge, creep, regulator and its ripple are drawn at random; in half of the runs inertia alone acts, in the other half there is a push: downwards, sideways or anywhere, suddenly or within half a second, at rest or in motion." }
            li { "The physics of a run is simulated once, in closed loop with the controller at 20 µε; its strains and pressures are then measured again with other noise. Gauge noise does not influence the physics before a report: the regulator follows its own monitor, and the reaction to a loss is to hold." }
            li { "False alarms: a fast surrogate without rigid bodies, in closed loop with the controller. The response of a held object to the arm, and its sliding under knocks, are identified on the simulated gripper at the start of each evaluation, for two kinds of object at four pressures and two loads. Hard motion is the time with moves, hard starts, emergency stops, vibration and bumps." }
            li { "The detector was tuned on seeds below 1000." }
            li { "All of this is a simulation: six rigid links for a finger, Coulomb friction, white gauge noise. A real gripper will differ; the same command evaluates other recipes." }
        }
    }
}

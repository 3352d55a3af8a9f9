//! The evaluation as one HTML page that needs nothing else.

use std::fmt::Write;

use super::summary::Summary;
use super::{Evaluation, Options, figures, report, tables};
use crate::html;

/// The page.
pub fn page(
    evaluation: &Evaluation,
    summary: &Summary,
    options: &Options,
) -> anyhow::Result<String> {
    let mut body = format!(
        "<h1>How soon, and how often for nothing</h1>\n<p>The controller that is flashed, on {} random losses per class of fingers of the simulated gripper and on {} h of holding and moving at each level of noise (a tenth of that at the highest). Seed {}. <code>softgrip evaluate --losses {} --hours {} --seed {}</code> measures it again.</p>\n",
        options.losses, options.hours, options.seed, options.losses, options.hours, options.seed
    );
    for table in tables::all(summary) {
        body += &table.html();
    }
    let figures = [
        (
            figures::latencies(&evaluation.sample.trials)?,
            "Share of the losses that are reported within a time after the collapse of the grip, for three levels of gauge noise.".to_string(),
        ),
        (figures::roc(summary)?, figures::roc_caption()),
    ];
    for (svg, caption) in figures {
        // Writing to a String cannot fail.
        let _ = writeln!(
            body,
            "<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>"
        );
    }
    let wrong = report::wrong(&evaluation.sample.trials);
    let alarms = report::alarms(&evaluation.tallies);
    if !wrong.is_empty() || !alarms.is_empty() {
        let _ = writeln!(
            body,
            "<h2>Everything that went wrong</h2>\n<div class=\"wide\"><pre>{}{}</pre></div>",
            html::escape(&wrong),
            html::escape(&alarms)
        );
    }
    body.push_str(METHOD);
    Ok(html::page("softgrip: latency and false alarms", &body))
}

const METHOD: &str = "<h2>How it is measured</h2>\n<ul>\n\
    <li>Losses: object, size, mass, pressure, friction, place in the grip, acceleration, direction, stiffness of each finger, gain and drift of each gauge, creep, regulator and its ripple are drawn at random; half of the runs are left to inertia, half get a push: downwards, sideways or anywhere, at once or in half a second, at rest or on the way.</li>\n\
    <li>The physics of a run is simulated once, in closed loop with the controller at 20 µε; its strains and pressures are then measured again with other noise. Gauge noise does not reach the physics before a report: the regulator listens to its monitor alone, and the reaction to a loss is to hold.</li>\n\
    <li>False alarms: a fast gripper without rigid bodies, in closed loop with the controller. How a held object answers to the arm, and how it gives way under knocks, is identified on the simulated gripper at the start of each evaluation, for two kinds of object at four pressures and two loads.</li>\n\
    <li>The detector was tuned on seeds below 1000, and none of them is used here.</li>\n\
    <li>All of this is a simulation: six rigid links for a finger, Coulomb friction, white gauge noise. A real gripper will differ; the command that measured this measures another recipe as well.</li>\n\
    </ul>\n";

//! What the controller is worth: how soon it reports a loss, and how often it cries wolf.
//!
//! ```text
//! case ─► record (twin) ─► latency ─┬─► summary ─► tables, figures, page
//!              └─► roc ◄─ baselines │
//! bench (twin) ─► response, slide ─► hand ─► life ◄─ routine
//!                                              └─► alarms ─┘
//! ```

pub mod case;
pub mod meter;
pub mod record;
mod store;

pub mod latency;

pub mod bench;
pub mod response;
pub mod slide;

pub mod hand;
pub mod routine;

pub mod alarms;
mod life;

pub mod baselines;
pub mod roc;

pub mod statistics;
pub mod summary;

mod figures;
mod page;
pub mod report;
pub mod tables;

use std::path::{Path, PathBuf};

use anyhow::ensure;
use indicatif::ProgressBar;
use softgrip::settings::Settings;
use softgrip::table::ObjectKind;

use case::KNOWLEDGE;
use summary::Summary;

use crate::setup::Setup;
use crate::{charts, files};

/// Noise of the gauges, µε rms.
pub const NOISE_UE: [f64; 3] = [20.0, 100.0, 400.0];

/// Share of the hours at the highest level of noise, which nobody should have.
const FEWER_HOURS: f64 = 0.1;

/// What is to be evaluated.
#[derive(Debug, Clone)]
pub struct Options {
    /// Seed of everything. The detector's parameters were chosen on seeds below 1000.
    pub seed: u64,
    /// True losses to be found for each class of knowledge.
    pub losses: usize,
    /// Hours of holding and moving at each level of noise.
    pub hours: f64,
    /// Directory of simulated losses that are kept, for work on the detector.
    pub recordings: Option<PathBuf>,
    /// The controller's settings, but for each case's calibration.
    pub settings: Settings,
}

/// Everything that is measured.
pub struct Evaluation {
    /// The losses.
    pub sample: latency::Sample,
    /// The false alarms, at each level of noise.
    pub tallies: Vec<alarms::Tally>,
    /// Latency against false alarms: the controller first, then the rules of others.
    pub curves: Vec<roc::Curve>,
}

/// The highest pressure of the cases, kPa.
const HIGHEST_KPA: f32 = 160.0;

/// Refuses fingers that cannot grip as hard as the cases ask for, or of which nobody knows what they lift.
///
/// # Errors
/// With what the recipe would have to give.
pub fn check(base: &Setup) -> anyhow::Result<()> {
    for kind in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let known = base.table().lift_known_to(kind).map_or(0.0, |kpa| kpa.0);
        ensure!(
            known >= HIGHEST_KPA,
            "evaluate grips at 100 to {HIGHEST_KPA} kPa: the recipe {} tells the lift up to {known} kPa only",
            base.table().recipe
        );
    }
    Ok(())
}

/// Measures everything, in parallel; the result does not depend on how many threads there are.
pub fn run(base: &Setup, options: &Options, bar: &ProgressBar) -> anyhow::Result<Evaluation> {
    check(base)?;
    let hours = |noise_ue| options.hours * if noise_ue > 100.0 { FEWER_HOURS } else { 1.0 };
    let swept_h = roc::SWEEP_SHARE * options.hours;
    let sum_h = NOISE_UE.into_iter().map(hours).sum::<f64>() + roc::EVIDENCE.len() as f64 * swept_h;
    bar.set_length(KNOWLEDGE.len() as u64 * options.losses as u64 + (3600.0 * sum_h) as u64);
    let sample = latency::sample(base, options, bar)?;
    let responses = alarms::responses(base)?;
    let tallies = NOISE_UE
        .into_iter()
        .map(|noise_ue| {
            let compared = noise_ue == roc::NOISE_UE;
            let hours = hours(noise_ue);
            alarms::tally(base, options, &responses, noise_ue, hours, compared, bar)
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let swept = roc::EVIDENCE
        .into_iter()
        .map(|factor| {
            let options = Options {
                settings: roc::with_evidence(&options.settings, factor),
                ..options.clone()
            };
            alarms::tally(
                base,
                &options,
                &responses,
                roc::NOISE_UE,
                swept_h,
                false,
                bar,
            )
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let compared = tallies.iter().find(|tally| tally.noise_ue == roc::NOISE_UE);
    let curves = compared.map_or(Vec::new(), |tally| {
        roc::curves(&sample.races, tally, &swept)
    });
    Ok(Evaluation {
        sample,
        tallies,
        curves,
    })
}

/// Writes page, charts, numbers and losses to a directory.
pub fn write(
    evaluation: &Evaluation,
    summary: &Summary,
    options: &Options,
    dir: &Path,
) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(summary)? + "\n";
    let trials = &evaluation.sample.trials;
    let page = page::page(evaluation, summary, options)?;
    let roc = charts::standalone(&figures::roc(summary)?);
    let latency = charts::standalone(&figures::latencies(trials)?);
    files::write(dir, "evaluation.json", json.as_bytes())?;
    files::write(dir, "losses.csv", &latency::losses_csv(trials)?)?;
    files::write(dir, "roc.svg", roc.as_bytes())?;
    files::write(dir, "latency.svg", latency.as_bytes())?;
    files::write(dir, "report.html", page.as_bytes())
}

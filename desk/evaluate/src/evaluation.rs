//! The whole evaluation: losses, false alarms and operating curves, in parallel.

use anyhow::ensure;
use sim::setup::Setup;
use softgrip::table::{self, ObjectKind};

use crate::case::KNOWLEDGE;
use crate::options::{NOISE_UE, Options};
use crate::tally::Tally;
use crate::{alarms, latency, roc};

/// The raw results of an evaluation.
pub struct Evaluation {
    /// Random losses, at every level of noise.
    pub sample: latency::Sample,
    /// False reports in operation without losses, one tally per level of noise.
    pub tallies: Vec<Tally>,
    /// Latency against false alarms: the controller first, then the rules of others.
    pub curves: Vec<roc::Curve>,
}

/// Losses and seconds that [`run`] will report as done.
pub fn steps(options: &Options) -> u64 {
    let swept_h = roc::SWEEP_SHARE * options.hours;
    let hours = NOISE_UE
        .into_iter()
        .map(|noise_ue| options.hours_at(noise_ue));
    let sum_h = hours.sum::<f64>() + roc::EVIDENCE.len() as f64 * swept_h;
    KNOWLEDGE.len() as u64 * options.losses as u64 + (3600.0 * sum_h) as u64
}

/// The highest pressure of the cases, kPa.
const HIGHEST_KPA: f32 = 160.0;

/// Refuses fingers that cannot grip as hard as the cases ask for, or of which nobody knows what they lift.
///
/// # Errors
/// If the table gives no lift up to the highest pressure of the cases; the message names the pressure
/// up to which it does.
pub fn check(base: &Setup) -> anyhow::Result<()> {
    for kind in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let known = table::lift_known_to(base.table(), kind).map_or(0.0, |kpa| kpa.0);
        ensure!(
            known >= HIGHEST_KPA,
            "evaluate grips at 100 to {HIGHEST_KPA} kPa: the recipe {} tells the lift up to {known} kPa only",
            base.table().recipe
        );
    }
    Ok(())
}

/// Measures everything, in parallel; the result does not depend on how many threads there are. `done` is
/// told how many more of [`steps`] are done.
///
/// # Errors
/// As [`check`]; if a case cannot be simulated, or a recording cannot be read or written.
pub fn run(
    base: &Setup,
    options: &Options,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Evaluation> {
    check(base)?;
    let sample = latency::sample(base, options, done)?;
    let models = alarms::models(base)?;
    let tallies = NOISE_UE
        .into_iter()
        .map(|noise_ue| {
            let compared = noise_ue == roc::NOISE_UE;
            let hours = options.hours_at(noise_ue);
            alarms::tally(base, options, &models, noise_ue, hours, compared, done)
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let swept_h = roc::SWEEP_SHARE * options.hours;
    let swept = roc::EVIDENCE
        .into_iter()
        .map(|factor| {
            let options = Options {
                settings: roc::with_evidence(&options.settings, factor),
                ..options.clone()
            };
            alarms::tally(base, &options, &models, roc::NOISE_UE, swept_h, false, done)
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

//! What each imperfection of real fingers costs: the evaluation with one of them at a time, and with all.

use rayon::prelude::*;
use report::json::round;
use report::table::Table;
use serde::Serialize;
use sim::hand::Hand;
use sim::setup::Setup;

use crate::alarms::{self, Group};
use crate::case::{KNOWLEDGE, Knowledge};
use crate::identified_model::IdentifiedModel;
use crate::options::Options;
use crate::statistics::Histogram;
use crate::tally::Tally;
use crate::trial::{Classification, Trial};
use crate::{evaluation, latency};

/// Noise of the gauges, µε rms: a decent amplifier.
const NOISE_UE: f64 = 20.0;

/// Cases drawn at a time.
const BATCH: u64 = 16;

/// One imperfection: its name, and how ideal fingers take it over from those with all of them.
type Effect = (&'static str, fn(&mut Setup, &Setup));

#[rustfmt::skip]
const EFFECTS: [Effect; 7] = [
    ("ideal", |_, _| ()),
    ("slower deflation", |s, all| s.gripper.hand.deflation_lag_ms = all.gripper.hand.deflation_lag_ms),
    ("hysteresis", |s, all| s.gripper.hand.hysteresis_percent = all.gripper.hand.hysteresis_percent),
    ("creep", |s, all| s.gripper.hand.creep_percent = all.gripper.hand.creep_percent),
    ("fingers that touch", |s, all| s.gripper.hand.fingers_touch = all.gripper.hand.fingers_touch),
    ("castings", |s, all| s.castings.clone_from(&all.castings)),
    ("all", |s, all| s.clone_from(all)),
];

/// What fingers with one imperfection cost, for one class of calibration.
#[derive(Debug, Clone, Serialize)]
pub struct Cost {
    /// Name of the imperfection.
    pub effect: &'static str,
    /// Class of calibration of the losses.
    pub knowledge: Knowledge,
    /// Number of true losses.
    pub losses: usize,
    /// Median latency, ms.
    pub p50_ms: Option<f64>,
    /// 99 % quantile of the latency, ms.
    pub p99_ms: Option<f64>,
    /// Losses that were not reported within [`crate::trial::MISSED_MS`].
    pub missed: usize,
    /// Runs that ended in an air loss, a fault or *empty* instead.
    pub misnamed: usize,
    /// Grips that were not recognised before the lift.
    pub not_recognised: usize,
    /// Reports of *lost* while the object was held.
    pub false_alarms: usize,
    /// False reports in hours without a loss, of calibrated fingers.
    pub hours: Option<Rates>,
}

/// False reports per hour.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Rates {
    /// Of *lost*.
    pub lost: f64,
    /// Of a slip.
    pub slips: f64,
    /// Of a fault or an air loss.
    pub faults: f64,
}

/// Losses and seconds that [`measure`] will report as done.
pub fn steps(options: &Options) -> u64 {
    let losses = KNOWLEDGE.len() as u64 * options.losses as u64;
    EFFECTS.len() as u64 * (losses + (3600.0 * options.hours) as u64)
}

/// Measures fingers without, with each and with all of the imperfections of `base`; `castings` and touching
/// fingers are among them in any case. All see the same random losses and hours.
///
/// # Errors
/// As [`evaluation::run`].
pub fn measure(
    base: &Setup,
    castings: &Hand,
    options: &Options,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Vec<Cost>> {
    evaluation::check(base)?;
    let (ideal, all) = (ideal(base), with_all(base, castings));
    let models = alarms::models(&ideal)?;
    let mut costs = Vec::new();
    for (effect, apply) in EFFECTS {
        let mut setup = ideal.clone();
        apply(&mut setup, &all);
        let tally = hours(&setup, options, &models, done)?;
        for knowledge in KNOWLEDGE {
            let hours = (knowledge == Knowledge::Calibrated).then(|| Rates::of(&tally));
            let trials = losses(&setup, options, knowledge, done)?;
            costs.push(Cost::of(effect, knowledge, &trials, hours));
        }
    }
    Ok(costs)
}

/// The trials of one class of calibration, up to the last loss that is wanted.
fn losses(
    setup: &Setup,
    options: &Options,
    knowledge: Knowledge,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Vec<Trial>> {
    let (mut trials, mut found, mut next) = (Vec::new(), 0, 0);
    while found < options.losses {
        let batch: Vec<Vec<Trial>> = (next..next + BATCH)
            .into_par_iter()
            .map(|index| latency::trials_of(setup, options, knowledge, index))
            .collect::<anyhow::Result<_>>()?;
        next += BATCH;
        let of_noise = |trial: &Trial| trial.noise_ue == NOISE_UE;
        for trial in batch.into_iter().flatten().filter(of_noise) {
            if found < options.losses {
                let lost = usize::from(trial.loss.is_some());
                found += lost;
                done(lost as u64);
                trials.push(trial);
            }
        }
    }
    Ok(trials)
}

/// False reports in hours without a loss.
fn hours(
    setup: &Setup,
    options: &Options,
    models: &[IdentifiedModel],
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Tally> {
    let group = Group {
        noise_ue: NOISE_UE,
        hours: options.hours,
        evidence: None,
        compared: false,
    };
    let tallies: Vec<Tally> = alarms::stretches(&[group])
        .par_iter()
        .map(|stretch| {
            let tally = stretch.count(setup, options, models)?;
            done(stretch.seconds());
            Ok(tally)
        })
        .collect::<anyhow::Result<_>>()?;
    let mut sum = Tally::none(NOISE_UE);
    for tally in tallies {
        sum.add(tally);
    }
    Ok(sum)
}

/// The same fingers without any of the imperfections.
fn ideal(base: &Setup) -> Setup {
    let mut setup = base.clone();
    setup.castings = None;
    let hand = &mut setup.gripper.hand;
    hand.deflation_lag_ms = hand.inflation_lag_ms;
    hand.hysteresis_percent = 0.0;
    hand.creep_percent = 0.0;
    hand.fingers_touch = false;
    setup
}

/// The same fingers with all of them.
fn with_all(base: &Setup, castings: &Hand) -> Setup {
    let mut setup = base.clone();
    setup.castings = Some(castings.clone());
    setup.gripper.hand.fingers_touch = true;
    setup
}

impl Cost {
    fn of(
        effect: &'static str,
        knowledge: Knowledge,
        trials: &[Trial],
        hours: Option<Rates>,
    ) -> Self {
        let count = |kind| trials.iter().filter(|t| t.classification() == kind).count();
        let mut latencies = Histogram::default();
        for trial in trials {
            if let Classification::Reported(ms) = trial.classification() {
                latencies.add(ms);
            }
        }
        let at = |share| latencies.quantile(share);
        Self {
            effect,
            knowledge,
            losses: trials.iter().filter(|trial| trial.loss.is_some()).count(),
            p50_ms: at(0.5),
            p99_ms: at(0.99),
            missed: count(Classification::Missed),
            misnamed: count(Classification::Misnamed),
            not_recognised: count(Classification::NotRecognised),
            false_alarms: count(Classification::FalseAlarm),
            hours,
        }
    }
}

impl Rates {
    fn of(tally: &Tally) -> Self {
        let total = tally.total();
        let per_hour = |count: u64| round(3600.0 * count as f64 / total.time_s.max(1.0), 3);
        Self {
            lost: per_hour(total.lost),
            slips: per_hour(total.slips),
            faults: per_hour(total.faults),
        }
    }
}

/// The costs as a table.
pub fn table(costs: &[Cost]) -> Table {
    let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.0}"));
    let row = |cost: &Cost| {
        let mut cells = vec![
            format!("{}, {}", cost.effect, cost.knowledge.name()),
            cost.losses.to_string(),
            ms(cost.p50_ms),
            ms(cost.p99_ms),
        ];
        let counts = [
            cost.missed,
            cost.misnamed,
            cost.not_recognised,
            cost.false_alarms,
        ];
        cells.extend(counts.map(|n| n.to_string()));
        let rates = cost.hours.map(|r| [r.lost, r.slips, r.faults]);
        cells.extend(match rates {
            Some(rates) => rates.map(|rate| rate.to_string()),
            None => ["-"; 3].map(String::from),
        });
        cells
    };
    Table {
        title: format!("What each imperfection of the fingers costs, gauges with {NOISE_UE} µε rms"),
        head: vec![
            "fingers",
            "losses",
            "p50 ms",
            "p99 ms",
            "missed",
            "misnamed",
            "unrecognised",
            "false",
            "lost/h",
            "slips/h",
            "faults/h",
        ],
        rows: costs.iter().map(row).collect(),
        note: "Each row has the ideal fingers and one imperfection, the last all of them, on the same random losses and hours. In the hours without a loss the fingers are calibrated, of one mould, and do not meet.".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_has_its_own_imperfection_and_the_last_has_all() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
        let recipe = finger::recipe::load(path.as_ref()).expect("the recipe");
        let base = Setup::of(&recipe).expect("a setup");
        let castings = Hand::cast(&recipe, 1).expect("three fingers");
        let (ideal, all) = (ideal(&base), with_all(&base, &castings));
        let rows: Vec<String> = EFFECTS
            .iter()
            .map(|(_, apply)| {
                let mut setup = ideal.clone();
                apply(&mut setup, &all);
                format!("{setup:?}")
            })
            .collect();
        for (n, row) in rows.iter().enumerate() {
            assert_eq!(rows.iter().position(|other| other == row), Some(n));
        }
        let mut together = ideal.clone();
        for (_, apply) in &EFFECTS[..EFFECTS.len() - 1] {
            apply(&mut together, &all);
        }
        assert_eq!(rows.last(), Some(&format!("{together:?}")));
    }
}

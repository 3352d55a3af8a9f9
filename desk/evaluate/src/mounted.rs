//! What a free-bend sweep is worth to the detector: random hands, each known by the recipe, by a sweep, and exactly.
//!
//! All three see the same fingers, losses and hours. The losses are of the simulated gripper with the castings as they
//! are. In the hours the surrogate has of each casting its stiffness and its gauge, within 0.3 % rms of it
//! ([`softgrip::estimate::casting`]); an object presses on its fingers as on the recipe's at the pressure at which those
//! are bent alike. Fingers that hang from the gripper are bent less by their own weight, by a tenth: whoever knows them
//! exactly knows that, as a sweep does, and the recipe does not.

use std::collections::BTreeMap;

use anyhow::Context;
use finger::recipe::Recipe;
use rayon::prelude::*;
use report::json::round;
use report::table::Table;
use serde::Serialize;
use sim::hand::Hand;
use sim::setup::Setup;
use sim::sweep::{self, Swept};
use softgrip::estimate::Calibration;
use softgrip::settings::Settings;

use crate::alarms::{self, Group};
use crate::calibration::{calibrated, equipped, mounted};
use crate::case::Case;
use crate::finding::Response;
use crate::identified_model::IdentifiedModel;
use crate::options::Options;
use crate::record::Recording;
use crate::sample::Counts;
use crate::summary::Quantiles;
use crate::tally::Count;
use crate::trial::{ControllerReport, judge};

/// How the controller knows its fingers, in the order of the rows.
const KNOWN_BY: [&str; 3] = ["recipe", "sweep", "exact"];

/// Random hands.
#[derive(Debug, Clone, Copy)]
pub struct Hands {
    /// The first one is the castings of this seed.
    pub first: u64,
    /// Number of hands. Each has its share of the losses and hours.
    pub count: u32,
}

/// How the controller did on all hands, by one way of knowing them.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// How it knew the fingers: by the recipe, by a sweep, or exactly, as far as settings can say it.
    pub known_by: &'static str,
    /// Number of true losses.
    pub losses: usize,
    /// Quantiles of the latency, ms.
    #[serde(flatten)]
    pub ms: Quantiles,
    /// Losses that were not reported within [`crate::trial::MISSED_MS`].
    pub missed: usize,
    /// Runs that ended in an air loss, a fault or *empty* instead.
    pub misnamed: usize,
    /// Grips that were not recognised before the lift.
    pub not_recognised: usize,
    /// Runs in which nothing was lost.
    pub held: usize,
    /// Reports of *lost* while the object was held.
    pub false_alarms: usize,
    /// Operation without a loss, h.
    pub hours: f64,
    /// False reports of *lost* in these hours.
    pub lost: u64,
    /// False warnings of a slip in these hours.
    pub slips: u64,
    /// False faults and air losses in these hours.
    pub faults: u64,
    /// What was reported instead of the truth, losses and hours together, by event.
    pub instead: BTreeMap<String, u64>,
}

/// All rows.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// Known by the recipe, by a sweep, and exactly.
    pub rows: [Row; 3],
    /// Why some hands were left out, by seed: their sweep was refused.
    pub refused: Vec<(u64, String)>,
}

/// What one way of knowing one hand led to.
#[derive(Default)]
struct Seen {
    trials: Vec<(Response, bool)>,
    operation: Count,
    instead: Vec<String>,
}

/// Losses and seconds that [`measure`] will report as done, if no sweep is refused.
pub fn steps(options: &Options, hands: Hands) -> u64 {
    let losses = losses_of_each(options, hands) as u64 * u64::from(hands.count);
    losses + KNOWN_BY.len() as u64 * (3600.0 * options.hours) as u64
}

fn losses_of_each(options: &Options, hands: Hands) -> usize {
    options.losses.div_ceil(hands.count as usize)
}

/// Sweeps random hands, and judges the controller on the same losses and hours with each way of knowing them.
///
/// # Errors
/// If the recipe cannot be cast or gripped with, or a case cannot be simulated.
pub fn measure(
    recipe: &Recipe,
    base: &Setup,
    options: &Options,
    hands: Hands,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Measured> {
    crate::evaluation::check(base)?;
    let mut alike = base.clone();
    alike.castings = None;
    let models = alarms::models(&alike)?;
    let results: Vec<(u64, Result<[Seen; 3], String>)> = (0..hands.count)
        .into_par_iter()
        .map(|n| {
            let seed = hands.first + u64::from(n);
            let mut setup = base.clone();
            let castings = Hand::cast(recipe, seed);
            setup.castings = Some(castings.with_context(|| format!("castings of seed {seed}"))?);
            let (setup, _) = equipped(setup, seed);
            let swept = match sweep::sweep(&setup, &options.settings) {
                Ok(swept) => swept,
                Err(why) => return Ok((seed, Err(format!("{why:#}")))),
            };
            let mut share = options.clone();
            share.seed = options.seed.wrapping_add(u64::from(n));
            share.losses = losses_of_each(options, hands);
            share.hours = options.hours / f64::from(hands.count);
            Ok((seed, Ok(of_hand(&setup, &swept, &share, &models, done)?)))
        })
        .collect::<anyhow::Result<_>>()?;
    let (mut seen, mut refused) = ([(); 3].map(|()| Vec::new()), Vec::new());
    for (seed, result) in results {
        match result {
            Ok(of_hand) => seen
                .iter_mut()
                .zip(of_hand)
                .for_each(|(all, s)| all.push(s)),
            Err(why) => refused.push((seed, why)),
        }
    }
    let mut names = KNOWN_BY.into_iter();
    let rows = seen.map(|seen| Row::of(names.next().unwrap_or_default(), &seen));
    Ok(Measured { rows, refused })
}

/// The same losses and hours of one hand, with each way of knowing it.
fn of_hand(
    setup: &Setup,
    swept: &Swept,
    options: &Options,
    models: &[IdentifiedModel],
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<[Seen; 3]> {
    let likeness = setup.hand().likeness(&setup.chain);
    let exact = exact(setup, swept)?;
    let known = [options.settings, calibrated(setup, swept)?, exact];
    let mut seen = [(); 3].map(|()| Seen::default());
    let noise_ue = setup.scenario.noise_ue;
    let (mut found, mut index) = (0, 0);
    while found < options.losses {
        let case = Case::mounted(setup, options.seed, index);
        index += 1;
        let recording = Recording::of(&case, setup.table(), &exact, noise_ue)?;
        for (seen, settings) in seen.iter_mut().zip(&known) {
            let trial = judge(&case, &recording, noise_ue, settings, setup)?;
            if let ControllerReport::Other { event, .. } = &trial.report {
                seen.instead.push(format!("{event:?}"));
            }
            let response = Response::of(&trial, false);
            seen.trials.push((response, trial.loss.is_some()));
        }
        let lost = seen[0].trials.last().is_some_and(|(_, lost)| *lost);
        found += usize::from(lost);
        done(lost.into());
    }
    let group = Group {
        noise_ue,
        hours: options.hours,
        evidence: None,
        compared: false,
    };
    for (seen, settings) in seen.iter_mut().zip(known) {
        let mut options = options.clone();
        options.settings = settings;
        for stretch in alarms::stretches(&[group]) {
            let tally = stretch.count_mounted(setup, &options, models, &likeness)?;
            seen.operation += tally.total();
            let events = tally.alarms.into_iter().map(|alarm| alarm.event);
            seen.instead
                .extend(events.filter(|event| !event.starts_with("Lost")));
            done(stretch.seconds());
        }
    }
    Ok(seen)
}

/// The settings of a hand whose every number is known. Where the fingers meet, nobody knows better than a sweep.
fn exact(setup: &Setup, swept: &Swept) -> anyhow::Result<Settings> {
    let likeness = mounted(setup);
    let (hand, regulator) = (&setup.gripper.hand, &setup.gripper.regulator);
    let hysteresis_kpa = 0.01 * hand.hysteresis_percent * setup.chain.max_pressure_kpa();
    let calibration = Calibration {
        gain: likeness.gain.map(|gain| gain as f32),
        stiffness: likeness.stiffness.map(|stiffness| stiffness as f32),
        hysteresis_kpa: hysteresis_kpa as f32,
        lag_ms: [hand.inflation_lag_ms, hand.deflation_lag_ms].map(|ms| ms as f32),
        regulator_ms: Some(regulator.lag_ms as f32),
        error_percent: likeness.error_percent as f32,
        ..swept.calibration
    };
    let settings = calibrated(
        setup,
        &Swept {
            calibration,
            ..swept.clone()
        },
    )?;
    let creep = [
        (253, hand.creep_percent as f32),
        (254, hand.creep_time_s as f32),
    ];
    let settings = settings.with(&creep, setup.table());
    settings.map_err(|error| anyhow::anyhow!("exact: {error}"))
}

impl Row {
    fn of(known_by: &'static str, seen: &[Seen]) -> Self {
        let mut counts = Counts::default();
        let (mut operation, mut instead) = (Count::default(), BTreeMap::new());
        for seen in seen {
            for (response, is_loss) in &seen.trials {
                counts.add(response, *is_loss);
            }
            operation += seen.operation;
            for event in &seen.instead {
                *instead.entry(event.clone()).or_default() += 1;
            }
        }
        Self {
            known_by,
            losses: counts.losses,
            ms: Quantiles::of(&counts.reported_ms),
            missed: counts.missed,
            misnamed: counts.misnamed,
            not_recognised: counts.not_recognised,
            held: counts.held,
            false_alarms: counts.false_alarms,
            hours: round(operation.time_s / 3600.0, 2),
            lost: operation.lost,
            slips: operation.slips,
            faults: operation.faults,
            instead,
        }
    }
}

/// The results as a table.
pub fn table(measured: &Measured, hands: Hands) -> Table {
    let row = |row: &Row| {
        let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.0}"));
        let mut cells = vec![row.known_by.to_string(), row.losses.to_string()];
        cells.extend([row.ms.p50, row.ms.p95, row.ms.p99].map(ms));
        let counts = [
            row.missed,
            row.misnamed,
            row.not_recognised,
            row.false_alarms,
        ];
        cells.extend(counts.map(|n| n.to_string()));
        cells.push(row.hours.to_string());
        cells.extend([row.lost, row.slips, row.faults].map(|n| n.to_string()));
        cells
    };
    Table {
        title: format!(
            "The detector on {} random hands",
            hands.count as usize - measured.refused.len()
        ),
        head: vec![
            "known by",
            "losses",
            "p50 ms",
            "p95 ms",
            "p99 ms",
            "missed",
            "misnamed",
            "unrecognised",
            "false",
            "hours",
            "lost",
            "slips",
            "faults",
        ],
        rows: measured.rows.iter().map(row).collect(),
        note: format!(
            "Each row has the same hands, losses and hours; gauges with 20, 100 or 300 µε rms, regulators of 20 to 200 ms. In the hours without a loss the fingers do not meet. {} sweeps were refused.",
            measured.refused.len()
        ),
    }
}

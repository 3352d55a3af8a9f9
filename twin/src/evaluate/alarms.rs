//! How often the controller cries wolf: hours of holding and moving in which nothing is lost.

use anyhow::Context;
use indicatif::ProgressBar;
use rayon::prelude::*;
use softgrip::TICK_US;
use softgrip::telemetry::Event;
use softgrip::units::Kilopascals;

use super::Options;
use super::baselines::{Baselines, RULES};
use super::bench;
use super::life::Life;
use super::response::Response;
use super::routine::Activity;
use crate::scenario::ObjectKind;
use crate::setup::Setup;

pub(super) const TICK_S: f64 = 1e-6 * TICK_US as f64;
/// Grips that are identified: each kind of object, at these pressures, …
const PRESSURES_KPA: [f64; 4] = [100.0, 120.0, 140.0, 160.0];
/// … as heavy as these shares of what the grip lifts at 10 m/s².
const LOADS: [f64; 2] = [0.25, 0.5];
/// Longest stretch of one random stream, h.
const BLOCK_H: f64 = 0.5;

/// What is done for a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Programme {
    /// Grip after grip, with everything in between.
    Shift,
    /// One grip for as long as it lasts.
    LongHold,
    /// Grips during which one gauge goes bad.
    BadGauge,
}

/// A stretch of time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub programme: Programme,
    pub noise_ue: f64,
    pub index: u64,
    pub ticks: u64,
}

/// What was counted during one activity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Count {
    /// Time, s.
    pub time_s: f64,
    /// How often it happened.
    pub times: u64,
    /// False reports of *lost*.
    pub lost: u64,
    /// False warnings of a slip: the object had not given way.
    pub slips: u64,
    /// Faults and air losses that were none.
    pub faults: u64,
}

impl std::ops::AddAssign for Count {
    fn add_assign(&mut self, other: Self) {
        self.time_s += other.time_s;
        self.times += other.times;
        self.lost += other.lost;
        self.slips += other.slips;
        self.faults += other.faults;
    }
}

/// A false report, so that it can be found again.
#[derive(Debug, Clone)]
pub struct Alarm {
    /// Noise of the gauges, µε.
    pub noise_ue: f64,
    /// Number of its block.
    pub block: u64,
    /// Time in that block, s.
    pub t_s: f64,
    /// What was going on.
    pub activity: Activity,
    /// How, in detail.
    pub detail: String,
    /// What was reported.
    pub event: Event,
}

/// What was counted at one level of noise.
#[derive(Debug, Clone)]
pub struct Tally {
    /// Noise of the gauges, µε.
    pub noise_ue: f64,
    /// By activity, in the order of [`Activity::ALL`].
    pub counts: [Count; Activity::ALL.len()],
    /// The false reports of *lost* and the faults.
    pub alarms: Vec<Alarm>,
    /// The greatest score of every baseline in each hold, if they were compared.
    pub scores: Vec<[f32; RULES]>,
}

/// The grips of the generator.
pub fn responses(base: &Setup) -> anyhow::Result<Vec<Response>> {
    let mut setups = Vec::new();
    for object in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let mut setup = base.clone();
        setup.scenario.object = object;
        let closing = bench::closing(&setup);
        for pressure_kpa in PRESSURES_KPA {
            for load in LOADS {
                let mut setup = setup.clone();
                setup.scenario.pressure_kpa = pressure_kpa;
                let kind = match object {
                    ObjectKind::Sphere => softgrip::table::ObjectKind::Sphere,
                    ObjectKind::Cylinder => softgrip::table::ObjectKind::Cylinder,
                };
                let pressure = Kilopascals(pressure_kpa as f32);
                let (lift, _) = base
                    .table()
                    .lift(kind, pressure)
                    .with_context(|| format!("the lift of the {object} at {pressure_kpa} kPa is not known: fingers and object find no equilibrium"))?;
                setup.scenario.mass_kg = load * f64::from(lift.0) / (9.80665 + 10.0);
                setups.push((setup, closing.clone()));
            }
        }
    }
    setups
        .into_par_iter()
        .map(|(setup, closing)| Response::with(&setup, closing))
        .collect()
}

/// Counts false reports in so many hours at a level of noise; `compared` with other rules or alone.
pub fn tally(
    base: &Setup,
    options: &Options,
    responses: &[Response],
    noise_ue: f64,
    hours: f64,
    compared: bool,
    bar: &ProgressBar,
) -> anyhow::Result<Tally> {
    let counted: Vec<Tally> = blocks(hours, noise_ue)
        .par_iter()
        .map(|block| {
            let mut life = Life::new(base, options, responses, block)?;
            life.baselines = compared.then(Baselines::default);
            let tally = life.live(block);
            bar.inc((block.ticks as f64 * TICK_S) as u64);
            Ok(tally)
        })
        .collect::<anyhow::Result<_>>()?;
    let mut sum = Tally::none(noise_ue);
    for tally in counted {
        for (sum, count) in sum.counts.iter_mut().zip(tally.counts) {
            *sum += count;
        }
        sum.alarms.extend(tally.alarms);
        sum.scores.extend(tally.scores);
    }
    Ok(sum)
}

/// Eight tenths of the hours in shifts, one in long holds, one with a bad gauge.
fn blocks(hours: f64, noise_ue: f64) -> Vec<Block> {
    let mut blocks = Vec::new();
    for (programme, share, longest_h) in [
        (Programme::Shift, 0.8, BLOCK_H),
        (Programme::LongHold, 0.1, 1.0),
        (Programme::BadGauge, 0.1, BLOCK_H),
    ] {
        let number = (share * hours / longest_h).ceil();
        let ticks = (share * hours / number * 3600.0 / TICK_S) as u64;
        for _ in 0..number as u64 {
            blocks.push(Block {
                programme,
                noise_ue,
                index: blocks.len() as u64,
                ticks,
            });
        }
    }
    blocks
}

impl Tally {
    pub(super) fn none(noise_ue: f64) -> Self {
        Self {
            noise_ue,
            counts: [Count::default(); Activity::ALL.len()],
            alarms: Vec::new(),
            scores: Vec::new(),
        }
    }

    /// Everything together.
    pub fn total(&self) -> Count {
        let mut total = Count::default();
        for count in self.counts {
            total += count;
        }
        total
    }

    /// Hard motion alone.
    pub fn hard_motion(&self) -> Count {
        let mut total = Count::default();
        for (activity, count) in Activity::ALL.iter().zip(self.counts) {
            if activity.is_hard_motion() {
                total += count;
            }
        }
        total
    }
}

//! False-alarm rate: the controller in hours of simulated operation in which no object is lost.

use anyhow::Context;
use finger::capability::GRAVITY_M_S2;
use rayon::prelude::*;
use sim::hand::Likeness;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use softgrip::table;
use softgrip::units::Kilopascals;

use crate::baselines::Baselines;
use crate::identified_model::IdentifiedModel;
use crate::options::{self, NOISE_UE, Options};
use crate::tally::Tally;
use crate::workload::{Block, Programme, TICK_S, Workload};
use crate::{rig, roc};

/// Grips that are identified: each kind of object, at these pressures, …
const PRESSURES_KPA: [f64; 4] = [100.0, 120.0, 140.0, 160.0];
/// … as heavy as these shares of what the grip lifts at 10 m/s².
const LOADS: [f64; 2] = [0.25, 0.5];
/// Longest stretch of one random stream, h.
const BLOCK_H: f64 = 0.5;

/// Identifies the objects that the workload grips: every kind, pressure and load.
///
/// # Errors
/// If the lift at one of the pressures is unknown, or an object does not respond to acceleration.
pub fn models(base: &Setup) -> anyhow::Result<Vec<IdentifiedModel>> {
    let mut setups = Vec::new();
    for object in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let mut setup = base.clone();
        setup.scenario.object = object;
        let closing = rig::closing(&setup);
        for pressure_kpa in PRESSURES_KPA {
            for load in LOADS {
                let mut setup = setup.clone();
                setup.scenario.pressure_kpa = pressure_kpa;
                let kind = match object {
                    ObjectKind::Sphere => table::ObjectKind::Sphere,
                    ObjectKind::Cylinder => table::ObjectKind::Cylinder,
                };
                let pressure = Kilopascals(pressure_kpa as f32);
                let (lift, _) = table::lift(base.table(), kind, pressure)
                    .with_context(|| format!("the lift of the {object} at {pressure_kpa} kPa is not known: fingers and object find no equilibrium"))?;
                setup.scenario.mass_kg = load * f64::from(lift.0) / (GRAVITY_M_S2 + 10.0);
                setups.push((setup, closing.clone()));
            }
        }
    }
    setups
        .into_par_iter()
        .map(|(setup, closing)| IdentifiedModel::with(&setup, closing))
        .collect()
}

/// Hours at one level of noise and one setting of the controller.
#[derive(Debug, Clone, Copy)]
pub struct Group {
    /// Noise of the gauges, µε.
    pub noise_ue: f64,
    /// Simulated operation, h.
    pub hours: f64,
    /// Factor on the controller's evidence limit; none for the settings as they are.
    pub evidence: Option<f32>,
    /// Whether the published rules run, too.
    pub compared: bool,
}

/// The hours of an evaluation: at each of [`NOISE_UE`], then at each of [`roc::EVIDENCE`].
pub fn groups(hours: f64) -> Vec<Group> {
    let usual = NOISE_UE.map(|noise_ue| Group {
        noise_ue,
        hours: options::hours_at(hours, noise_ue),
        evidence: None,
        compared: noise_ue == roc::NOISE_UE,
    });
    let swept = roc::EVIDENCE.map(|factor| Group {
        noise_ue: roc::NOISE_UE,
        hours: roc::SWEEP_SHARE * hours,
        evidence: Some(factor),
        compared: false,
    });
    usual.into_iter().chain(swept).collect()
}

/// A block, and the group to which it counts.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// Place among the groups.
    pub group: usize,
    evidence: Option<f32>,
    compared: bool,
    block: Block,
}

impl Stretch {
    /// Simulated operation, s.
    pub fn seconds(&self) -> u64 {
        (self.block.ticks as f64 * TICK_S) as u64
    }

    /// Counts the false reports in it.
    ///
    /// # Errors
    /// If the settings are not valid.
    pub fn count(
        &self,
        base: &Setup,
        options: &Options,
        models: &[IdentifiedModel],
    ) -> anyhow::Result<Tally> {
        let mut options = options.clone();
        if let Some(factor) = self.evidence {
            options.settings = roc::with_evidence(&options.settings, factor);
        }
        let mut workload = Workload::new(base, &options, models, &self.block)?;
        workload.baselines = self.compared.then(Baselines::default);
        Ok(workload.finish(&self.block))
    }

    /// The same with fingers as they were cast, on the regulator of `setup`.
    ///
    /// # Errors
    /// If the settings are not valid.
    pub fn count_mounted(
        &self,
        setup: &Setup,
        options: &Options,
        models: &[IdentifiedModel],
        fingers: &Likeness,
    ) -> anyhow::Result<Tally> {
        let mut workload = Workload::new(setup, options, models, &self.block)?;
        workload.mount(fingers, setup.gripper.regulator.lag_ms);
        Ok(workload.finish(&self.block))
    }
}

/// All stretches of the groups, in the order in which they are summed up.
pub fn stretches(groups: &[Group]) -> Vec<Stretch> {
    let groups = groups.iter().enumerate();
    let all = groups.flat_map(|(group, about)| {
        let blocks = blocks(about.hours, about.noise_ue).into_iter();
        blocks.map(move |block| Stretch {
            group,
            evidence: about.evidence,
            compared: about.compared,
            block,
        })
    });
    all.collect()
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

//! False-alarm rate: the controller in hours of simulated operation in which no object is lost.

use anyhow::Context;
use finger::capability::GRAVITY_M_S2;
use rayon::prelude::*;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use softgrip::table;
use softgrip::units::Kilopascals;

use crate::baselines::Baselines;
use crate::identified_model::IdentifiedModel;
use crate::options::Options;
use crate::rig;
use crate::tally::Tally;
use crate::workload::{Block, Programme, TICK_S, Workload};

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

/// Counts false reports in the hours of one level of noise. With `compared` the published rules run too.
///
/// # Errors
/// If the settings are not valid.
pub fn tally(
    base: &Setup,
    options: &Options,
    models: &[IdentifiedModel],
    noise_ue: f64,
    hours: f64,
    compared: bool,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Tally> {
    let counted: Vec<Tally> = blocks(hours, noise_ue)
        .par_iter()
        .map(|block| {
            let mut workload = Workload::new(base, options, models, block)?;
            workload.baselines = compared.then(Baselines::default);
            let tally = workload.finish(block);
            done((block.ticks as f64 * TICK_S) as u64);
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

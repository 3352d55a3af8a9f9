//! Detection latency: a random loss on the simulated gripper, measured at each level of noise.

use std::ops::ControlFlow;

use sim::events;
use sim::setup::Setup;

use crate::case::{Case, Knowledge};
use crate::finding::Finding;
use crate::options::{NOISE_UE, Options};
use crate::record::Recording;
use crate::roc::Race;
use crate::store;
use crate::trial::{Trial, judge, seconds};

/// Noise at which the physics is simulated in closed loop, µε.
const RECORDED_AT_UE: f64 = 20.0;
/// What the statistics need of one case.
///
/// # Errors
/// If the case cannot be simulated, or its recording cannot be read or written.
pub fn finding(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
) -> anyhow::Result<Finding> {
    let (case, recording) = prepare(base, options, knowledge, index)?;
    let trials = judge_all(&case, &recording, options, base)?;
    let race = Race::run(&case, &recording, &options.settings, base)?;
    Ok(Finding::of(&case, &trials, race, options.slowest > 0))
}

/// The trials of one case, one per level of noise.
///
/// # Errors
/// If the case cannot be simulated, or its recording cannot be read or written.
pub fn trials_of(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
) -> anyhow::Result<Vec<Trial>> {
    let (case, recording) = prepare(base, options, knowledge, index)?;
    judge_all(&case, &recording, options, base)
}

fn judge_all(
    case: &Case,
    recording: &Recording,
    options: &Options,
    base: &Setup,
) -> anyhow::Result<Vec<Trial>> {
    NOISE_UE
        .iter()
        .map(|&noise_ue| judge(case, recording, noise_ue, &options.settings, base))
        .collect()
}

/// A case and its recording, simulated or found.
pub(crate) fn prepare(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
) -> anyhow::Result<(Case, Recording)> {
    let case = Case::draw(base, base.table(), options.seed, knowledge, index);
    let simulate = || Recording::of(&case, base.table(), &options.settings, RECORDED_AT_UE);
    let recording = match &options.recordings {
        Some(dir) => store::recording(dir, &case, &options.settings, RECORDED_AT_UE, simulate)?,
        None => simulate()?,
    };
    Ok((case, recording))
}

/// One case as CSV, one row per tick: the true state, and what the controller measured at a level of noise
/// (µε rms).
///
/// # Errors
/// If the case cannot be simulated, or its recording cannot be read or written.
pub fn trace(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
    noise_ue: f64,
) -> anyhow::Result<Vec<u8>> {
    let (case, recording) = prepare(base, options, knowledge, index)?;
    let controller = case.controller(base.table(), &options.settings)?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "t_s",
        "true_residual_sum_ue",
        "moved_mm",
        "slid_mm",
        "pressure_kpa",
        "residual1_ue",
        "residual2_ue",
        "residual3_ue",
        "level",
        "state",
        "events",
    ])?;
    let mut rows = Vec::new();
    recording.replay(&case, noise_ue, controller, |tick, truth, outputs| {
        let seen = outputs.snapshot;
        let state = format!("{:?}", seen.state);
        let events: Vec<_> = outputs.events.iter().map(events::name).collect();
        let mut record = vec![
            format!("{:.3}", seconds(tick)),
            format!("{:.1}", truth.residual_ue),
            format!("{:.3}", truth.moved_mm),
            format!("{:.3}", truth.slid_mm),
            format!("{:.2}", truth.pressure_kpa),
        ];
        // A gauge that gave nothing leaves its field empty.
        let residuals = seen.residual;
        record.extend(residuals.map(|r| r.map_or(String::new(), |r| format!("{:.1}", r.0))));
        record.push(seen.level.map_or(String::new(), |l| format!("{l:.4}")));
        let name = state.split([' ', '(']).next();
        record.push(name.unwrap_or_default().to_lowercase());
        record.push(events.join(" "));
        rows.push(record);
        ControlFlow::Continue(())
    });
    for row in &rows {
        writer.write_record(row)?;
    }
    Ok(writer.into_inner()?)
}

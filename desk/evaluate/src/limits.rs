//! How near held objects come to the detector's limits, and how far lost ones go beyond them.
//!
//! Held: hours of the workload, and the runs of the sample in which the object stays. Lost: the other runs,
//! under a controller that never reports, so that the whole collapse is seen.

use std::fmt::Write;
use std::ops::ControlFlow;

use rayon::prelude::*;
use serde::Serialize;
use sim::setup::Setup;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;

use crate::case::{Case, Knowledge, Push};
use crate::identified_model::IdentifiedModel;
use crate::latency;
use crate::options::Options;
use crate::reach::{Reach, Sign, Situation};
use crate::record::{ObjectOutcome, Recording};
use crate::workload::{Block, Programme, TICK_S, Workload};

/// Noise of the gauges, µε rms. The limits are widened for noise, so they are measured without much of it.
const NOISE_UE: f64 = 20.0;
/// Length of one random stream, h.
const BLOCK_H: f64 = 0.5;
/// An object that has moved further against the palm has slipped, and is not one that stays, mm.
const STAYS_MM: f32 = 6.0;
/// Runs drawn at a time.
const BATCH: u64 = 64;

/// One of the things that the detector looks at.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Which.
    pub sign: Sign,
    /// The most that held objects reached.
    pub held: f32,
    /// The detector's limit.
    pub limit: f32,
    /// What half of the lost objects reached, of those that go this way; none if there were none.
    pub lost: Option<f32>,
    /// What 99 of 100 of them reached.
    pub most_lost: Option<f32>,
    /// How many those were.
    pub losses: usize,
}

/// What was reached in one situation.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// The situation.
    pub situation: Situation,
    /// One row per sign.
    pub rows: Vec<Row>,
}

/// Hours and losses that [`measure`] will report as done.
pub fn steps(options: &Options) -> u64 {
    (3.0 * 3600.0 * options.hours) as u64 + options.losses as u64
}

/// Measures every limit in every situation. `done` is told how many more of [`steps`] are done.
pub fn measure(
    base: &Setup,
    options: &Options,
    models: &[IdentifiedModel],
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Vec<Measured>> {
    let runs = runs(base, options, done)?;
    Situation::ALL
        .into_iter()
        .enumerate()
        .map(|(at, situation)| {
            let mut held = held(base, options, models, situation, done)?;
            // In every run of the sample the arm moves.
            let stays = runs.iter().filter(|run| run.kind.is_none());
            for run in stays.filter(|_| situation != Situation::Still) {
                held.join(&run.reach[at]);
            }
            Ok(Measured {
                situation,
                rows: rows(options, &held, &runs, at),
            })
        })
        .collect()
}

/// One run of the sample.
struct Run {
    /// How the object was lost, if it was.
    kind: Option<Kind>,
    /// In each of [`Situation::ALL`].
    reach: [Reach; 3],
}

/// How an object was lost.
#[derive(Debug, Clone, Copy)]
struct Kind {
    /// Pushed against a finger.
    sideways: bool,
}

/// Draws until the losses are found.
fn runs(base: &Setup, options: &Options, done: &(dyn Fn(u64) + Sync)) -> anyhow::Result<Vec<Run>> {
    let (mut runs, mut losses, mut next) = (Vec::new(), 0, 0);
    while losses < options.losses {
        let batch: Vec<Option<Run>> = (next..next + BATCH)
            .into_par_iter()
            .map(|index| run(base, options, index))
            .collect::<anyhow::Result<_>>()?;
        next += BATCH;
        for run in batch.into_iter().flatten() {
            if losses < options.losses {
                losses += usize::from(run.kind.is_some());
                done(run.kind.is_some().into());
                runs.push(run);
            }
        }
    }
    Ok(runs)
}

/// One run in every situation; none if the object was moved but not lost.
fn run(base: &Setup, options: &Options, index: u64) -> anyhow::Result<Option<Run>> {
    let (case, recording) = latency::prepare(base, options, Knowledge::Calibrated, index)?;
    let (kind, until) = match recording.outcome() {
        ObjectOutcome::Displaced => return Ok(None),
        ObjectOutcome::Held => {
            let mut carried = recording.carried();
            let last = carried.end - 1;
            if carried.any(|tick| recording.at(tick).moved_mm > STAYS_MM) {
                return Ok(None);
            }
            (None, last)
        }
        ObjectOutcome::Lost { .. } => {
            let kind = Kind {
                sideways: case.push.is_some_and(|push| is_sideways(&push)),
            };
            (Some(kind), recording.ticks.len())
        }
    };
    let mut silent = options.settings;
    if kind.is_some() {
        silent.detection.loss_evidence_percent_ms = 10_000.0;
    }
    let mut reach = [Reach::NONE; 3];
    for (reach, situation) in reach.iter_mut().zip(Situation::ALL) {
        *reach = look(base, &case, &recording, &silent, situation, until)?;
    }
    Ok(Some(Run { kind, reach }))
}

/// Whether a push goes across the palm's axis rather than along it.
fn is_sideways(push: &Push) -> bool {
    let [x, y, z] = push.force_n;
    x.hypot(y) > z.abs()
}

/// What a run reaches from the grip to a tick.
fn look(
    base: &Setup,
    case: &Case,
    recording: &Recording,
    settings: &Settings,
    situation: Situation,
    until: usize,
) -> anyhow::Result<Reach> {
    let controller = case.controller(base.table(), settings)?;
    let mut reach = Reach::NONE;
    let seen = |frame| situation.frame(frame);
    recording.replay_seen(
        case,
        NOISE_UE,
        controller,
        seen,
        |tick, _, outputs, controller| {
            // Something else has ended the hold.
            let ended = |event: &Event| matches!(event, Event::AirLoss | Event::Lost(_));
            if tick > until || outputs.events.iter().any(ended) {
                return ControlFlow::Break(());
            }
            if tick >= recording.lift {
                reach.take(controller.signs());
            }
            ControlFlow::Continue(())
        },
    );
    Ok(reach)
}

/// What held objects reach in hours of the workload.
fn held(
    base: &Setup,
    options: &Options,
    models: &[IdentifiedModel],
    situation: Situation,
    done: &(dyn Fn(u64) + Sync),
) -> anyhow::Result<Reach> {
    let number = (options.hours / BLOCK_H).ceil().max(1.0);
    let ticks = (options.hours / number * 3600.0 / TICK_S) as u64;
    let blocks: Vec<Reach> = (0..number as u64)
        .into_par_iter()
        .map(|index| {
            let block = Block {
                programme: Programme::Shift,
                noise_ue: NOISE_UE,
                index,
                ticks,
            };
            let workload = Workload::new(base, options, models, &block)?;
            let reach = workload.reach(situation, situation.activities());
            done((ticks as f64 * TICK_S) as u64);
            Ok(reach)
        })
        .collect::<anyhow::Result<_>>()?;
    let mut greatest = Reach::NONE;
    for reach in &blocks {
        greatest.join(reach);
    }
    Ok(greatest)
}

/// One row per sign, from the runs in the situation at this place of [`Situation::ALL`].
fn rows(options: &Options, held: &Reach, runs: &[Run], at: usize) -> Vec<Row> {
    let rows = Sign::ALL.into_iter().enumerate();
    rows.map(|(place, sign)| {
        let goes_this_way = |kind: &Kind| sign != Sign::OneSided || kind.sideways;
        let lost = runs
            .iter()
            .filter(|run| run.kind.as_ref().is_some_and(goes_this_way))
            .map(|run| run.reach[at].most[place]);
        let mut lost: Vec<f32> = lost.collect();
        lost.sort_by(f32::total_cmp);
        let reached_by = |share: f64| lost.get(((1.0 - share) * lost.len() as f64) as usize);
        Row {
            sign,
            held: held.most[place],
            limit: sign.limit(Situation::ALL[at], &options.settings),
            lost: reached_by(0.5).copied(),
            most_lost: reached_by(0.99).copied(),
            losses: lost.len(),
        }
    })
    .collect()
}

/// What held objects reached, the limit, and what lost ones reached of everything that the detector looks at.
pub fn text(measured: &[Measured]) -> String {
    let mut out = String::new();
    for Measured { situation, rows } in measured {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{}", situation.name());
        for row in rows {
            let number = |lost: Option<f32>| lost.map_or("-".into(), |lost| format!("{lost:.3}"));
            let _ = writeln!(
                out,
                "  {:21}  held {:7.3}   limit {:6.3}   lost {:>8}, 99 % {:>8}, of {}",
                row.sign.name(),
                row.held,
                row.limit,
                number(row.lost),
                number(row.most_lost),
                row.losses
            );
        }
    }
    out
}

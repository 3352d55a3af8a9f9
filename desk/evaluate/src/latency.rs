//! How soon a loss is reported: random losses on the twin, measured at each level of noise.

use finger::capability::Object;
use indicatif::ProgressBar;
use rayon::prelude::*;
use softgrip::TICK_US;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;
use softgrip::units::Instant;

use super::case::{Case, KNOWLEDGE, Knowledge};
use super::record::{Fate, Measure, Recording};
use super::roc::Race;
use super::{NOISE_UE, Options, store};
use crate::events;
use crate::setup::Setup;

/// Noise at which the physics is simulated in closed loop, µε.
const RECORDED_AT_UE: f64 = 20.0;
/// A loss that is not reported this long after its onset is missed, ms.
pub const MISSED_MS: f64 = 500.0;
/// A report while the object has moved less than this is not of the loss that may come later, mm.
pub const UNMOVED_MM: f32 = 1.0;
/// The object slides for good from the last moment when it had slid less than this, mm.
const SLIDE_MM: f32 = 0.5;
/// Cases drawn at a time.
const BATCH: u64 = 64;

/// What the controller made of one recording at one level of noise.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The run.
    pub case: Case,
    /// What became of the object.
    pub fate: Fate,
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// When it recognised the grip, s.
    pub holding_s: Option<f64>,
    /// What it reported.
    pub report: Report,
    /// The loss, if the object was lost.
    pub loss: Option<Loss>,
}

/// The controller's word on a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Report {
    /// Nothing wrong.
    Nothing,
    /// The object is lost.
    Lost {
        /// When, s.
        t_s: f64,
        /// How far the object had moved, mm.
        moved_mm: f32,
    },
    /// Something else that ended the hold.
    Other {
        /// When, s.
        t_s: f64,
        /// What.
        event: Event,
    },
}

/// One true loss. Times count from the start of the run, s.
#[derive(Debug, Clone, Copy)]
pub struct Loss {
    /// The collapse: the true residual sum left 90 % of its plateau for good.
    pub onset_s: f64,
    /// When the object began to slide.
    pub slide_s: f64,
    /// How far it had moved against the palm at the onset, mm.
    pub moved_onset_mm: f32,
    /// First warning of a slip before that, and how far the object had moved by then, mm.
    pub warning: Option<(f64, f32)>,
}

/// How a trial is to be counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// Held, and nothing said.
    Quiet,
    /// Lost and reported, so many ms after the onset.
    Reported(f64),
    /// Lost and not reported in time.
    Missed,
    /// Reported lost while it was held.
    FalseAlarm,
    /// The grip was not recognised before the lift.
    NotRecognised,
    /// Something else was reported instead.
    Misnamed,
    /// The object was moved out of place, but the fingers still press on it: neither is wrong.
    Displaced,
}

impl Trial {
    /// How it is counted.
    pub fn verdict(&self) -> Verdict {
        if self.holding_s.is_none() {
            return Verdict::NotRecognised;
        }
        match (&self.loss, &self.report) {
            (_, Report::Other { .. }) => Verdict::Misnamed,
            (_, Report::Lost { moved_mm, .. }) if *moved_mm < UNMOVED_MM => Verdict::FalseAlarm,
            (None, _) if self.fate == Fate::Displaced => Verdict::Displaced,
            (None, Report::Lost { .. }) => Verdict::FalseAlarm,
            (None, Report::Nothing) => Verdict::Quiet,
            (Some(_), Report::Nothing) => Verdict::Missed,
            (Some(loss), Report::Lost { t_s, .. }) => match 1e3 * (t_s - loss.onset_s) {
                ms if ms > MISSED_MS => Verdict::Missed,
                ms => Verdict::Reported(ms),
            },
        }
    }
}

/// Everything measured on the sample.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// Every trial of both classes of knowledge at every level of noise.
    pub trials: Vec<Trial>,
    /// The losses as the controller at other settings, and the rules of others, saw them.
    pub races: Vec<Race>,
}

/// Draws until the losses are found.
pub fn sample(base: &Setup, options: &Options, bar: &ProgressBar) -> anyhow::Result<Sample> {
    let mut all = Sample::default();
    for knowledge in KNOWLEDGE {
        let (mut losses, mut next) = (0, 0);
        while losses < options.losses {
            let batch: Vec<_> = (next..next + BATCH)
                .into_par_iter()
                .map(|index| {
                    let (case, recording) = prepare(base, options, knowledge, index)?;
                    let trials = judge_all(&case, &recording, options, base)?;
                    let race = Race::run(&case, &recording, &options.settings, base)?;
                    Ok((trials, race))
                })
                .collect::<anyhow::Result<_>>()?;
            next += BATCH;
            // In the order of their numbers, so that the sample does not depend on the threads.
            for (trials, race) in batch {
                if losses < options.losses {
                    losses += usize::from(race.is_some());
                    bar.inc(u64::from(race.is_some()));
                    all.trials.extend(trials);
                    all.races.extend(race);
                }
            }
        }
    }
    Ok(all)
}

/// One case at every level of noise.
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
fn prepare(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
) -> anyhow::Result<(Case, Recording)> {
    let case = Case::draw(base, base.table(), options.seed, knowledge, index);
    let simulate = || Recording::of(&case, base.table(), &options.settings, RECORDED_AT_UE);
    let recording = match &options.recordings {
        Some(dir) => store::recording(dir, &case, simulate)?,
        None => simulate()?,
    };
    Ok((case, recording))
}

/// A case tick by tick, as CSV: the truth, and what the controller sees at a level of noise.
pub fn trace(
    base: &Setup,
    options: &Options,
    knowledge: Knowledge,
    index: u64,
    noise_ue: f64,
) -> anyhow::Result<Vec<u8>> {
    let (case, recording) = prepare(base, options, knowledge, index)?;
    let mut controller = case.controller(base.table(), &options.settings)?;
    let mut measure = Measure::new(&case, noise_ue);
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
    for (n, truth) in recording.ticks.iter().enumerate() {
        let tick = n + 1;
        let frame = measure.frame(tick, truth);
        let command = recording.command(tick, case.setup.scenario.pressure_kpa);
        let now = Instant::from_micros(TICK_US * tick as u64);
        let outputs = controller.step(now, &frame, command);
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
        writer.write_record(&record)?;
    }
    Ok(writer.into_inner()?)
}

/// Runs the controller over a recording.
pub fn judge(
    case: &Case,
    recording: &Recording,
    noise_ue: f64,
    settings: &Settings,
    base: &Setup,
) -> anyhow::Result<Trial> {
    let mut controller = case.controller(base.table(), settings)?;
    let mut measure = Measure::new(case, noise_ue);
    let (mut holding, mut slip, mut ended) = (None, None, None);
    for (n, truth) in recording.ticks.iter().enumerate() {
        let tick = n + 1;
        let frame = measure.frame(tick, truth);
        let command = recording.command(tick, case.setup.scenario.pressure_kpa);
        let now = Instant::from_micros(TICK_US * tick as u64);
        let outputs = controller.step(now, &frame, command);
        for event in outputs.events.iter() {
            match event {
                Event::Holding { .. } => {
                    holding.get_or_insert(tick);
                }
                Event::Slip { .. } if tick >= recording.lift => {
                    slip.get_or_insert(tick);
                }
                Event::Lost { .. } | Event::AirLoss | Event::Fault { .. } | Event::Empty => {
                    ended.get_or_insert((tick, *event));
                }
                _ => {}
            }
        }
        if ended.is_some() {
            break;
        }
    }
    let report = match ended {
        None => Report::Nothing,
        Some((tick, Event::Lost { .. })) => Report::Lost {
            t_s: seconds(tick),
            moved_mm: recording.at(tick).moved_mm,
        },
        Some((tick, event)) => Report::Other {
            t_s: seconds(tick),
            event,
        },
    };
    let fate = recording.fate();
    let loss = match fate {
        Fate::Held | Fate::Displaced => None,
        Fate::Lost { onset } => Some(Loss {
            onset_s: seconds(onset),
            slide_s: seconds(slide(recording)),
            moved_onset_mm: recording.at(onset).moved_mm,
            warning: slip.map(|tick| (seconds(tick), recording.at(tick).moved_mm)),
        }),
    };
    Ok(Trial {
        case: case.clone(),
        fate,
        noise_ue,
        holding_s: holding.filter(|&tick| tick <= recording.lift).map(seconds),
        report,
        loss,
    })
}

/// The first tick at which the object has slid.
fn slide(recording: &Recording) -> usize {
    let mut carried = recording.carried();
    carried
        .find(|&tick| recording.at(tick).slid_mm > SLIDE_MM)
        .unwrap_or(recording.lift)
}

fn seconds(tick: usize) -> f64 {
    tick as f64 * TICK_US as f64 * 1e-6
}

/// The losses, a row each, as CSV.
pub fn losses_csv(trials: &[Trial]) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "knowledge",
        "index",
        "noise_ue",
        "object",
        "diameter_mm",
        "mass_kg",
        "pressure_kpa",
        "friction",
        "depth_mm",
        "accel_m_s2",
        "first_finger_deg",
        "push_x_n",
        "push_y_n",
        "push_z_n",
        "push_start_s",
        "push_rise_s",
        "slide_s",
        "onset_s",
        "moved_onset_mm",
        "warned_s",
        "moved_warned_mm",
        "reported_s",
        "moved_reported_mm",
        "latency_ms",
        "verdict",
    ])?;
    for trial in trials {
        let Some(loss) = trial.loss else { continue };
        let case = &trial.case;
        let (scenario, gripped) = (&case.setup.scenario, case.setup.gripped());
        let (Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. }) = gripped.object;
        let number = |x: f64, decimals: usize| format!("{x:.decimals$}");
        let maybe = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.3}"));
        let push = case.push;
        let (reported_s, moved_mm) = match trial.report {
            Report::Lost { t_s, moved_mm } => (Some(t_s), Some(f64::from(moved_mm))),
            Report::Nothing | Report::Other { .. } => (None, None),
        };
        let (latency_ms, verdict) = match trial.verdict() {
            Verdict::Reported(ms) => (Some(ms), "reported".to_string()),
            other => (None, format!("{other:?}").to_lowercase()),
        };
        writer.write_record([
            case.knowledge.name().to_string(),
            case.index.to_string(),
            trial.noise_ue.to_string(),
            scenario.object.to_string(),
            number(2e3 * radius_m, 2),
            number(scenario.mass_kg, 4),
            number(scenario.pressure_kpa, 2),
            number(scenario.friction, 3),
            number(1e3 * gripped.depth_m, 2),
            number(scenario.accel_m_s2, 2),
            number(case.setup.gripper.hand.first_finger_deg, 1),
            maybe(push.map(|push| push.force_n[0])),
            maybe(push.map(|push| push.force_n[1])),
            maybe(push.map(|push| push.force_n[2])),
            maybe(push.map(|push| push.start_s)),
            maybe(push.map(|push| push.rise_s)),
            number(loss.slide_s, 3),
            number(loss.onset_s, 3),
            number(loss.moved_onset_mm.into(), 2),
            maybe(loss.warning.map(|(t_s, _)| t_s)),
            maybe(loss.warning.map(|(_, mm)| f64::from(mm))),
            maybe(reported_s),
            maybe(moved_mm),
            maybe(latency_ms),
            verdict,
        ])?;
    }
    Ok(writer.into_inner()?)
}

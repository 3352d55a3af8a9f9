//! Runs the controller against the simulated gripper and judges it by the truth.

use std::time::{Duration, Instant as WallClock};

use finger::chain::Chain;
use finger::recipe::Recipe;
use finger::table::Table;
use serde_json::{Value, json};
use softgrip::settings::Settings;
use softgrip::table::{FINGER, FingerTable};
use softgrip::telemetry::{Event, Snapshot};
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Controller, FINGERS, Grip, TICK_US};

use crate::arm::Phase;
use crate::events::TimedEvent;
use crate::gripper::Gripper;
use crate::json::round;
use crate::plant::{Plant, Truth};
use crate::scenario::Scenario;
use crate::world::LINKS;

/// The object is gone once it has moved this far against the palm, m.
const GONE_M: f64 = 0.020;
/// The collapse begins when the residual sum leaves this share of its plateau for good.
const COLLAPSE: f64 = 0.9;

/// Ticks from one pose to the next.
pub const POSE_TICKS: u64 = 10;

/// What the physics did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The object arrived.
    Hold,
    /// It fell while being lifted.
    Pick,
    /// It fell while being carried or set down.
    Transfer,
}

impl Outcome {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Pick => "pick",
            Self::Transfer => "transfer",
        }
    }
}

/// One tick of a run.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// What really happened.
    pub truth: Truth,
    /// What the controller made of it.
    pub seen: Snapshot,
    /// Gauge readings as the converter delivered them, µε.
    pub strain_ue: [f32; FINGERS],
    /// Pressure that the robot asked for, kPa.
    pub asked_kpa: f64,
}

/// Where everything is at one moment, seen from the palm; for drawing.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// Time since the start, s.
    pub t_s: f64,
    /// Upper and lower end of every link, m.
    pub links_m: [[[[f64; 3]; 2]; LINKS]; FINGERS],
    /// Centre of the object, m.
    pub object_m: [f64; 3],
    /// Direction in which the cylinder stands.
    pub object_axis: [f64; 3],
}

impl Pose {
    /// Where everything in the plant is now.
    pub fn of(plant: &Plant, truth: &Truth) -> Self {
        Self {
            t_s: truth.t_s,
            links_m: plant.link_ends(),
            object_m: truth.object_m,
            object_axis: plant.object_axis(),
        }
    }
}

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    /// What was to be done.
    pub scenario: Scenario,
    /// Every tick.
    pub samples: Vec<Sample>,
    /// Every hundredth of a second.
    pub poses: Vec<Pose>,
    /// Everything that the controller reported.
    pub events: Vec<TimedEvent>,
    /// What the physics did.
    pub outcome: Outcome,
    /// When the object had moved 20 mm, s.
    pub slid_at_s: Option<f64>,
    /// When the true residual sum left 90 % of its plateau for good, s.
    pub collapse_at_s: Option<f64>,
    /// When the controller said *lost*, s.
    pub flagged_at_s: Option<f64>,
    /// Simulated time over wall time.
    pub realtime_factor: f64,
}

/// The controller's table for a finger: the built-in one if that is its finger, else a new one that lives
/// as long as the program.
pub fn table_of(recipe: &Recipe) -> anyhow::Result<&'static FingerTable> {
    if recipe.inputs_hash == FINGER.inputs_hash {
        return Ok(&FINGER);
    }
    let table = Table::of(recipe)?;
    Ok(Box::leak(Box::new(FingerTable {
        recipe: Box::leak(table.recipe.clone().into_boxed_str()),
        inputs_hash: table.inputs_hash,
        error_bound_percent: table.error_bound_percent,
        lift_error_percent: table.lift_error_percent,
        max_pressure_kpa: table.max_pressure_kpa,
        stiffness_nmm_per_deg: table.stiffness_nmm_per_deg,
        rows: table.rows.map(|row| softgrip::table::Row {
            free_strain_ue: row.free_strain_ue,
            tip_angle_deg: row.tip_angle_deg,
            tip_mm: row.tip_mm,
            torque_nmm: row.torque_nmm,
            lift_n: row.lift_n,
        }),
    })))
}

/// A controller with a recipe's table and the default settings.
pub fn controller(table: &'static FingerTable, settings: &Settings) -> anyhow::Result<Controller> {
    let active = settings
        .validate(&softgrip::frontend::FrontEnd::REFERENCE, table)
        .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
    Ok(Controller::new(table, active))
}

/// Runs one scenario. `progress` is told the share that is done.
pub fn run(
    scenario: &Scenario,
    gripper: &Gripper,
    chain: &Chain,
    mut controller: Controller,
    mut progress: impl FnMut(f64),
) -> Run {
    let start = WallClock::now();
    let mut plant = Plant::new(scenario, gripper, chain);
    let ticks = (plant.profile().duration_s() * 1e6) as u64 / TICK_US;
    let mut samples = Vec::with_capacity(ticks as usize);
    let mut poses = Vec::new();
    let mut events = Vec::new();
    let mut dac = DacCode(0);
    let mut gripping = false;
    for tick in 1..=ticks {
        let (frame, truth) = plant.step(dac);
        let wants_grip = truth.arm.phase.wants_grip();
        let command = match (gripping, wants_grip) {
            (false, true) => {
                Command::Grip(Grip::Pressure(Kilopascals(scenario.pressure_kpa as f32)))
            }
            (true, false) => Command::Release,
            _ => Command::Continue,
        };
        gripping = wants_grip;
        let outputs = controller.step(Instant::from_micros(TICK_US * tick), &frame, command);
        dac = outputs.dac;
        events.extend(outputs.events.iter().map(|&event| TimedEvent {
            t_s: truth.t_s,
            event,
        }));
        let front_end = softgrip::frontend::FrontEnd::REFERENCE;
        samples.push(Sample {
            truth,
            seen: outputs.snapshot,
            strain_ue: frame.gauges.map(|code| front_end.strain(code).0),
            asked_kpa: if gripping { scenario.pressure_kpa } else { 0.0 },
        });
        if tick % POSE_TICKS == 0 {
            poses.push(Pose::of(&plant, &truth));
        }
        if tick % 100 == 0 {
            progress(tick as f64 / ticks as f64);
        }
    }
    Run::new(scenario, samples, poses, events, start.elapsed())
}

/// Whether and when the object moved against the palm between lift and release.
fn judge(samples: &[Sample]) -> (Outcome, Option<f64>) {
    let carried = || {
        samples.iter().filter(|sample| {
            matches!(
                sample.truth.arm.phase,
                Phase::Lift | Phase::Carry | Phase::Place
            )
        })
    };
    let Some(gripped) = carried().next() else {
        return (Outcome::Hold, None);
    };
    let gone = carried().find(|sample| {
        let moved = (0..3)
            .map(|i| (sample.truth.object_m[i] - gripped.truth.object_m[i]).powi(2))
            .sum::<f64>();
        moved.sqrt() > GONE_M
    });
    match gone {
        None => (Outcome::Hold, None),
        Some(sample) if sample.truth.arm.phase == Phase::Lift => {
            (Outcome::Pick, Some(sample.truth.t_s))
        }
        Some(sample) => (Outcome::Transfer, Some(sample.truth.t_s)),
    }
}

/// When the true residual sum left 90 % of its plateau, its value at the start of the lift, for good.
fn collapse(samples: &[Sample]) -> Option<f64> {
    let sum = |sample: &Sample| sample.truth.residual_ue.iter().sum::<f64>();
    let lift = samples
        .iter()
        .position(|sample| sample.truth.arm.phase == Phase::Lift)?;
    let release = samples
        .iter()
        .position(|sample| sample.truth.arm.phase == Phase::Release)?;
    let plateau = sum(&samples[lift]);
    let held = samples[lift..release]
        .iter()
        .rposition(|sample| sum(sample) >= COLLAPSE * plateau)?;
    samples[lift..release]
        .get(held + 1)
        .map(|sample| sample.truth.t_s)
}

impl Run {
    /// Judges what happened by the truth in the samples. It took `wall` on the clock on the wall.
    pub fn new(
        scenario: &Scenario,
        samples: Vec<Sample>,
        poses: Vec<Pose>,
        events: Vec<TimedEvent>,
        wall: Duration,
    ) -> Self {
        let (outcome, slid_at_s) = judge(&samples);
        Self {
            scenario: *scenario,
            outcome,
            slid_at_s,
            collapse_at_s: slid_at_s.and_then(|_| collapse(&samples)),
            flagged_at_s: events
                .iter()
                .find(|timed| matches!(timed.event, Event::Lost { .. }))
                .map(|timed| timed.t_s),
            realtime_factor: (samples.len() as u64 * TICK_US) as f64 * 1e-6 / wall.as_secs_f64(),
            samples,
            poses,
            events,
        }
    }

    /// From the collapse to the flag, ms.
    pub fn latency_ms(&self) -> Option<f64> {
        Some(1e3 * (self.flagged_at_s? - self.collapse_at_s?))
    }

    /// How often the controller said *lost*.
    pub fn lost_reports(&self) -> usize {
        self.events
            .iter()
            .filter(|timed| matches!(timed.event, Event::Lost { .. }))
            .count()
    }

    /// What the controller got wrong, if anything.
    pub fn mistake(&self) -> Option<String> {
        match (self.outcome, self.lost_reports()) {
            (Outcome::Hold, 0) => None,
            (Outcome::Hold, n) => Some(format!(
                "the object was held, but lost was reported {n} times"
            )),
            (_, 1) => None,
            (_, n) => Some(format!(
                "the object fell once, but lost was reported {n} times"
            )),
        }
    }

    /// One object per run. Times count from the start of the run.
    pub fn json(&self) -> Value {
        let scenario = &self.scenario;
        json!({
            "object": scenario.object,
            "mass_kg": scenario.mass_kg,
            "accel_m_s2": scenario.accel_m_s2,
            "pressure_kpa": scenario.pressure_kpa,
            "friction": scenario.friction,
            "noise_ue": scenario.noise_ue,
            "seed": scenario.seed,
            "outcome": self.outcome.name(),
            "slid_at_s": self.slid_at_s.map(|s| round(s, 6)),
            "collapse_at_s": self.collapse_at_s.map(|s| round(s, 6)),
            "flagged_at_s": self.flagged_at_s.map(|s| round(s, 6)),
            "latency_ms": self.latency_ms().map(|ms| round(ms, 3)),
            "events": self.events.iter().map(TimedEvent::json).collect::<Vec<_>>(),
            "realtime_factor": round(self.realtime_factor, 1),
        })
    }
}

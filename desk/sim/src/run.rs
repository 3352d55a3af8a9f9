//! Runs the controller on the simulated gripper and compares its reports with the true state.

use std::time::{Duration, Instant as WallClock};

use finger::grasp::Grasp;
use finger::recipe::Recipe;
use softgrip::settings::Settings;
use softgrip::table::{FINGER, FingerTable};
use softgrip::telemetry::{Event, Snapshot};
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Controller, FINGERS, Grip, TICK_US};

use crate::arm::Phase;
use crate::events::TimedEvent;
use crate::fault::{self, FaultKind, Injected};
use crate::gripper::Gripper;
use crate::hand::Hand;
use crate::plant::{Plant, Truth};
use crate::scenario::Scenario;
use crate::world::LINKS;

/// The object is gone once it has moved this far against the palm, m.
const GONE_M: f64 = 0.020;
/// The collapse begins when the residual sum leaves this share of its plateau for good.
const COLLAPSE: f64 = 0.9;

/// An object that has moved less than this against the palm is held, m: held ones move by 1.4 mm at 10 m/s².
const HELD_M: f64 = 0.005;
/// A grip with less than this share of the pressure that was asked for has lost its air.
const WITH_AIR: f64 = 0.9;

/// Ticks from one pose to the next.
pub const POSE_TICKS: u64 = 10;

/// What happened to the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The object arrived at its destination.
    Hold,
    /// It fell while being lifted.
    Pick,
    /// It fell while being carried or set down.
    Transfer,
}

impl Outcome {
    /// Name in JSON, CSV and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Pick => "pick",
            Self::Transfer => "transfer",
        }
    }
}

/// True state and controller state at one control tick.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// True state of the plant.
    pub truth: Truth,
    /// The controller's snapshot.
    pub seen: Snapshot,
    /// Gauge readings as the converter delivered them, µε.
    pub strain_ue: [f32; FINGERS],
    /// Pressure that the robot asked for, kPa.
    pub asked_kpa: f64,
}

/// Positions of links and object at one instant in the palm's frame, for drawing.
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
    /// The present pose of the plant.
    pub fn of(plant: &Plant, truth: &Truth) -> Self {
        Self {
            t_s: truth.t_s,
            links_m: plant.link_ends(),
            object_m: truth.object_m,
            object_axis: plant.object_axis(),
        }
    }
}

/// The results of one simulated run.
#[derive(Debug, Clone)]
pub struct Run {
    /// The simulated scenario.
    pub scenario: Scenario,
    /// Injected faults.
    pub faults: Vec<Injected>,
    /// One sample per control tick.
    pub samples: Vec<Sample>,
    /// One pose per [`POSE_TICKS`] ticks.
    pub poses: Vec<Pose>,
    /// All events of the controller.
    pub events: Vec<TimedEvent>,
    /// What happened to the object.
    pub outcome: Outcome,
    /// Time at which the object had moved 20 mm relative to the palm, s; none if it never did.
    pub slid_at_s: Option<f64>,
    /// Onset of the loss: the true residual sum falls below 90 % of its plateau for good, s; none without a
    /// loss.
    pub collapse_at_s: Option<f64>,
    /// Time of the controller's report of *lost*, s; none without a report.
    pub flagged_at_s: Option<f64>,
    /// Simulated time divided by wall time.
    pub realtime_factor: f64,
}

/// The controller's table for a finger: the built-in one if that is its finger, else a new one that lives
/// as long as the program.
///
/// # Errors
/// If no table can be computed for the recipe.
pub fn table_of(recipe: &Recipe) -> anyhow::Result<&'static FingerTable> {
    if recipe.inputs_hash == FINGER.inputs_hash {
        return Ok(&FINGER);
    }
    Ok(Box::leak(Box::new(finger::table::of(recipe)?)))
}

/// A controller with a recipe's table and these settings.
///
/// # Errors
/// If the settings are not valid for the finger; the message names the setting.
pub fn controller(table: &'static FingerTable, settings: &Settings) -> anyhow::Result<Controller> {
    let active = settings
        .validate(table)
        .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
    Ok(Controller::new(table, active))
}

/// Runs one scenario. `progress` is told the share that is done.
pub fn run(
    scenario: &Scenario,
    gripper: &Gripper,
    hand: &Hand,
    grasp: &Grasp,
    mut controller: Controller,
    faults: &[Injected],
    mut progress: impl FnMut(f64),
) -> Run {
    let start = WallClock::now();
    let mut plant = Plant::new(scenario, gripper, hand, grasp).with_faults(faults);
    let ticks = (plant.profile().duration_s() * 1e6) as u64 / TICK_US;
    let mut samples = Vec::with_capacity(ticks as usize);
    let mut poses = Vec::new();
    let mut events = Vec::new();
    let mut dac = DacCode(0);
    let mut gripping = false;
    for tick in 1..=ticks {
        let (frame, truth) = plant.step(dac);
        let broken = |kind| fault::any(faults, kind, truth.t_s);
        let wants_grip = truth.arm.phase.wants_grip();
        let command = if broken(FaultKind::Stop) {
            Command::Stop
        } else if broken(FaultKind::HostSilent) {
            Command::Continue
        } else if gripping == wants_grip {
            Command::Alive
        } else {
            gripping = wants_grip;
            match gripping {
                true => Command::Grip(Grip::Pressure(Kilopascals(scenario.pressure_kpa as f32))),
                false => Command::Release,
            }
        };
        let outputs = controller.step(Instant::from_micros(TICK_US * tick), &frame, command);
        dac = outputs.dac;
        events.extend(outputs.events.iter().map(|&event| TimedEvent {
            t_s: truth.t_s,
            event,
        }));
        let strains = gripper.front_end().strains(&frame.gauges);
        samples.push(Sample {
            truth,
            seen: outputs.snapshot,
            strain_ue: strains.map(|strain| strain.0),
            asked_kpa: if gripping { scenario.pressure_kpa } else { 0.0 },
        });
        if tick % POSE_TICKS == 0 {
            poses.push(Pose::of(&plant, &truth));
        }
        if tick % 100 == 0 {
            progress(tick as f64 / ticks as f64);
        }
    }
    Run::new(scenario, faults, samples, poses, events, start.elapsed())
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
    let gone = carried().find(|sample| distance_m(gripped, sample) > GONE_M);
    match gone {
        None => (Outcome::Hold, None),
        Some(sample) if sample.truth.arm.phase == Phase::Lift => {
            (Outcome::Pick, Some(sample.truth.t_s))
        }
        Some(sample) => (Outcome::Transfer, Some(sample.truth.t_s)),
    }
}

/// Displacement of the object relative to the palm, m.
fn distance_m(from: &Sample, to: &Sample) -> f64 {
    let (from, to) = (from.truth.object_m, to.truth.object_m);
    let squares = (0..3).map(|i| (to[i] - from[i]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// When the true residual sum left 90 % of its plateau, its value at the start of the lift, for good.
fn collapse(samples: &[Sample]) -> Option<f64> {
    let start = |phase| {
        let mut samples = samples.iter();
        samples.position(|sample| sample.truth.arm.phase == phase)
    };
    let held = &samples[start(Phase::Lift)?..start(Phase::Release)?];
    let sums = held
        .iter()
        .map(|sample| sample.truth.residual_ue.iter().sum::<f64>());
    Some(held[collapse_of(sums)?].truth.t_s)
}

/// The place where a residual sum leaves 90 % of its first value for good.
pub fn collapse_of(
    sums: impl ExactSizeIterator<Item = f64> + DoubleEndedIterator + Clone,
) -> Option<usize> {
    let plateau = sums.clone().next()?;
    let ticks = sums.len();
    let held = sums.clone().rposition(|sum| sum >= COLLAPSE * plateau)?;
    Some(held + 1).filter(|&next| next < ticks)
}

impl Run {
    /// Judges what happened by the truth in the samples. It took `wall` on the clock on the wall.
    pub fn new(
        scenario: &Scenario,
        faults: &[Injected],
        samples: Vec<Sample>,
        poses: Vec<Pose>,
        events: Vec<TimedEvent>,
        wall: Duration,
    ) -> Self {
        let (outcome, slid_at_s) = judge(&samples);
        Self {
            scenario: *scenario,
            faults: faults.to_vec(),
            outcome,
            slid_at_s,
            collapse_at_s: slid_at_s.and_then(|_| collapse(&samples)),
            flagged_at_s: events
                .iter()
                .find(|timed| matches!(timed.event, Event::Lost(_)))
                .map(|timed| timed.t_s),
            realtime_factor: (samples.len() as u64 * TICK_US) as f64 * 1e-6 / wall.as_secs_f64(),
            samples,
            poses,
            events,
        }
    }

    /// Detection latency: from the onset to the report, ms; negative if reported before.
    pub fn latency_ms(&self) -> Option<f64> {
        Some(1e3 * (self.flagged_at_s? - self.collapse_at_s?))
    }

    /// Number of reports of *lost*.
    pub fn lost_reports(&self) -> usize {
        self.events
            .iter()
            .filter(|timed| matches!(timed.event, Event::Lost(_)))
            .count()
    }

    /// Whether fingers press on the object when the robot lets go of it, wherever it has moved to.
    fn kept(&self) -> bool {
        let release = self
            .samples
            .iter()
            .position(|s| s.truth.arm.phase == Phase::Release);
        release.is_some_and(|n| {
            let contact_n: f64 = self.samples[n].truth.contact_n.iter().sum();
            contact_n > 0.0
        })
    }

    /// The controller's mistake as text; none if it made none. An object that has moved but stays in the fingers counts
    /// neither way, as in `softgrip evaluate`.
    pub fn mistake(&self) -> Option<String> {
        let lost = self.lost_reports();
        match self.slid_at_s {
            None if lost == 0 => None,
            None => Some(format!(
                "the object was held, but lost was reported {lost} times"
            )),
            Some(_) if lost > 1 => Some(format!(
                "the object fell once, but lost was reported {lost} times"
            )),
            Some(slid_at_s) if !self.faults.is_empty() => self.mistake_with_faults(slid_at_s),
            Some(_) if lost == 1 || self.kept() => None,
            Some(_) => Some("the object fell once, but lost was reported 0 times".into()),
        }
    }

    /// The same where something broke and the object fell: it is not *lost* if its air was gone, and who was
    /// told of a fault before need not be told of the fall.
    fn mistake_with_faults(&self, slid_at_s: f64) -> Option<String> {
        let at = |t_s: f64| self.samples.iter().find(|s| s.truth.t_s >= t_s);
        let asked_kpa = self.scenario.pressure_kpa;
        let aired = at(slid_at_s).is_some_and(|s| s.truth.pressure_kpa >= WITH_AIR * asked_kpa);
        let heard = |before_s: f64| {
            self.events.iter().any(|timed| {
                let whole = matches!(
                    timed.event,
                    Event::AirLoss | Event::Fault { finger: None, .. }
                );
                whole && timed.t_s <= before_s
            })
        };
        let held = self
            .events
            .iter()
            .any(|e| matches!(e.event, Event::Holding { .. }));
        match self.flagged_at_s {
            Some(t_s) if !aired => Some(format!(
                "the air was gone, but lost was reported at {t_s:.3} s"
            )),
            Some(t_s) => {
                let lift = self
                    .samples
                    .iter()
                    .find(|s| s.truth.arm.phase == Phase::Lift)?;
                let moved = distance_m(lift, at(t_s)?);
                (moved < HELD_M).then(|| {
                    format!(
                        "lost was reported at {t_s:.3} s, when the object had moved by {:.1} mm",
                        1e3 * moved
                    )
                })
            }
            None if !aired && held && !heard(f64::INFINITY) => {
                Some("the air was gone, and nothing was reported".into())
            }
            None if aired && !heard(slid_at_s) && !self.kept() => {
                Some("the object fell once, but lost was reported 0 times".into())
            }
            None => None,
        }
    }
}

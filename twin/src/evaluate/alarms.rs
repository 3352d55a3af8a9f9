//! How often the controller cries wolf: hours of holding and moving in which nothing is lost.

use indicatif::ProgressBar;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use softgrip::table::FingerTable;
use softgrip::telemetry::Event;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Controller, FINGERS, Grip, TICK_US};

use super::baselines::{Baselines, RULES};
use super::case::generator;
use super::hand::{Gauge, Hand};
use super::response::Response;
pub use super::routine::Activity;
use super::routine::{Motion, motion};
use super::{Options, response, roc};
use crate::gripper::Gripper;
use crate::scenario::ObjectKind;
use crate::setup::Setup;
use crate::sim;

const TICK_S: f64 = 1e-6 * TICK_US as f64;
/// Number of the random stream.
const STREAM: u64 = 16;
/// Grips that are identified: each kind of object, at these pressures, …
const PRESSURES_KPA: [f64; 4] = [100.0, 120.0, 140.0, 160.0];
/// … as heavy as these shares of what the grip lifts at 10 m/s².
const LOADS: [f64; 2] = [0.25, 0.5];
/// The score of a rule that is not armed.
const NO_SCORE: [f32; RULES] = [f32::MIN; RULES];
/// Longest stretch of one random stream, h.
const BLOCK_H: f64 = 0.5;

/// What is done for a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Programme {
    /// Grip after grip, with everything in between.
    Shift,
    /// One grip for as long as it lasts.
    LongHold,
    /// Grips during which one gauge goes bad.
    BadGauge,
}

/// A stretch of time.
#[derive(Debug, Clone, Copy)]
struct Block {
    programme: Programme,
    noise_ue: f64,
    index: u64,
    ticks: u64,
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
    /// False warnings of a slip.
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
    /// The greatest score of every baseline in each hold, at the noise of the comparison.
    pub scores: Vec<[f32; RULES]>,
}

/// The grips of the generator.
pub fn responses(base: &Setup) -> anyhow::Result<Vec<Response>> {
    let mut setups = Vec::new();
    for object in [ObjectKind::Sphere, ObjectKind::Cylinder] {
        let mut setup = base.clone();
        setup.scenario.object = object;
        let closing = response::closing(&setup);
        for pressure_kpa in PRESSURES_KPA {
            for load in LOADS {
                let mut setup = setup.clone();
                setup.scenario.pressure_kpa = pressure_kpa;
                let kind = match object {
                    ObjectKind::Sphere => softgrip::table::ObjectKind::Sphere,
                    ObjectKind::Cylinder => softgrip::table::ObjectKind::Cylinder,
                };
                let pressure = Kilopascals(pressure_kpa as f32);
                let (lift, _) = base.table().lift(kind, pressure);
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

/// Counts false reports in so many hours at a level of noise.
pub fn tally(
    base: &Setup,
    options: &Options,
    responses: &[Response],
    noise_ue: f64,
    hours: f64,
    bar: &ProgressBar,
) -> anyhow::Result<Tally> {
    let counted: Vec<Tally> = blocks(hours, noise_ue)
        .par_iter()
        .map(|block| {
            let tally = Life::new(base, options, responses, block)?.live(block);
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
    fn none(noise_ue: f64) -> Self {
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

/// A gripper with its controller in the course of a block.
struct Life<'a> {
    rng: SmallRng,
    hand: Hand<SmallRng>,
    controller: Controller,
    responses: &'a [Response],
    gripper: Gripper,
    table: &'static FingerTable,
    tick: u64,
    end: u64,
    dac: DacCode,
    /// Amplitude, kPa, and phase per tick of the regulator's ripple.
    ripple: (f64, f64),
    bad: Option<Bad>,
    /// Only where they are compared with the controller.
    baselines: Option<Baselines>,
    greatest: [f32; RULES],
    tally: Tally,
    block: u64,
}

/// A gauge on its way out.
#[derive(Debug, Clone, Copy)]
struct Bad {
    finger: usize,
    /// When it began, s.
    since_s: f64,
    /// Time constant, s.
    time_s: f64,
    /// What it comes to: share of the gain lost, offset, and noise.
    gain_lost: f64,
    offset_ue: f64,
    noise_ue: f32,
}

/// How a stretch of time ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// As planned.
    Done,
    /// The controller let the hold go, or the block is over.
    Broken,
}

impl<'a> Life<'a> {
    fn new(
        base: &Setup,
        options: &Options,
        responses: &'a [Response],
        block: &Block,
    ) -> anyhow::Result<Self> {
        let noise = block.noise_ue as u64;
        let mut rng = SmallRng::from_rng(&mut generator(options.seed, STREAM + noise, block.index));
        let mut gripper = base.gripper.clone();
        let regulator = &mut gripper.regulator;
        regulator.lag_ms = rng.random_range(50.0..=90.0);
        regulator.gain = rng.random_range(0.99..=1.01);
        regulator.offset_kpa = rng.random_range(-1.0..=1.0);
        gripper.gauge.creep_percent = rng.random_range(0.0..=3.0);
        gripper.gauge.creep_time_s = rng.random_range(5.0..=60.0);
        let gauges = std::array::from_fn(|_| Gauge {
            gain: rng.random_range(0.99..=1.01),
            offset_ue: rng.random_range(-50.0..=50.0),
            noise_ue: block.noise_ue as f32,
        });
        let table = base.table();
        let noise = SmallRng::from_rng(&mut rng);
        Ok(Self {
            hand: Hand::new(&gripper, table, gauges, noise),
            controller: sim::controller(table, &options.settings)?,
            rng,
            responses,
            gripper,
            table,
            tick: 0,
            end: block.ticks,
            dac: DacCode(0),
            ripple: (0.0, 0.0),
            bad: None,
            baselines: (block.noise_ue == roc::NOISE_UE).then(Baselines::default),
            greatest: NO_SCORE,
            tally: Tally::none(block.noise_ue),
            block: block.index,
        })
    }

    fn live(mut self, block: &Block) -> Tally {
        while self.tick < self.end {
            match block.programme {
                Programme::Shift => self.job(),
                Programme::LongHold => self.long_hold(),
                Programme::BadGauge => self.bad_gauge(),
            }
        }
        self.tally
    }

    /// Grip, be busy, let go; now and then close on nothing.
    fn job(&mut self) {
        if self.rng.random_bool(0.1) {
            self.empty_close();
            return;
        }
        let held = self.grip();
        for _ in 0..self.rng.random_range(4..=20) {
            if held == End::Broken || self.activity() == End::Broken {
                break;
            }
        }
        self.release();
    }

    fn activity(&mut self) -> End {
        use Activity as A;
        const CHOICE: [Activity; 7] = [
            A::Rest,
            A::Move,
            A::HardStart,
            A::EmergencyStop,
            A::Vibration,
            A::Bump,
            A::PressureChange,
        ];
        let activity = CHOICE[self.rng.random_range(0..CHOICE.len())];
        let (motion, time_s) = motion(activity, &mut self.rng);
        let command = match activity {
            A::PressureChange => self.grip_command(),
            _ => Command::Continue,
        };
        let time_s = if activity == A::PressureChange {
            1.5
        } else {
            time_s
        };
        self.run(activity, time_s, motion, command)
    }

    fn grip_command(&mut self) -> Command {
        let pressure = self.rng.random_range(100.0..=160.0);
        Command::Grip(Grip::Pressure(Kilopascals(pressure)))
    }

    /// Takes something up.
    fn grip(&mut self) -> End {
        let response = &self.responses[self.rng.random_range(0..self.responses.len())];
        let pressure = Kilopascals(response.pressure_kpa as f32);
        self.hand.place(Some(response));
        let ripple_hz = self.rng.random_range(2.0..=40.0);
        self.ripple = (
            self.rng.random_range(0.0..=1.0),
            std::f64::consts::TAU * ripple_hz * TICK_S,
        );
        let command = Command::Grip(Grip::Pressure(pressure));
        self.run(Activity::Closing, 1.2, Motion::Rest, command)
    }

    fn release(&mut self) {
        self.run(Activity::Release, 0.9, Motion::Rest, Command::Release);
        self.hand.place(None);
        self.ripple = (0.0, 0.0);
        let greatest = std::mem::replace(&mut self.greatest, NO_SCORE);
        if greatest != NO_SCORE {
            self.tally.scores.push(greatest);
        }
    }

    fn empty_close(&mut self) {
        self.hand.place(None);
        let command = self.grip_command();
        self.run(Activity::EmptyClose, 1.5, Motion::Rest, command);
        self.release();
    }

    /// One grip to the end of the block, now and then moved.
    fn long_hold(&mut self) {
        // Creep of an hour: a tenth of the strain with time constants of minutes.
        self.gripper.gauge.creep_percent = self.rng.random_range(3.0..=10.0);
        self.gripper.gauge.creep_time_s = self.rng.random_range(300.0..=1800.0);
        self.renew();
        let drift: [f64; FINGERS] = std::array::from_fn(|_| self.rng.random_range(-0.5..=0.5));
        let start = self.tick;
        let mut end = self.grip();
        while end == End::Done {
            for (gauge, drift) in self.hand.gauges.iter_mut().zip(drift) {
                gauge.offset_ue += drift;
            }
            end = self.run(Activity::Creep, 1.0, Motion::Rest, Command::Continue);
            if end == End::Done && (self.tick - start).is_multiple_of(60_000) {
                end = self.activity();
            }
        }
        self.release();
    }

    /// A gauge goes bad in the course of a minute to ten while the gripper works.
    fn bad_gauge(&mut self) {
        self.renew();
        self.bad = Some(Bad {
            finger: self.rng.random_range(0..FINGERS),
            since_s: self.tick as f64 * TICK_S,
            time_s: self.rng.random_range(60.0..=600.0),
            gain_lost: self.rng.random_range(0.0..=0.3),
            offset_ue: self.rng.random_range(-2000.0..=2000.0),
            noise_ue: self.rng.random_range(0.0..=1000.0),
        });
        let until = self.tick + 900_000;
        while self.tick < until.min(self.end) {
            self.job();
        }
        self.bad = None;
        self.renew();
    }

    /// Other gauges, another day.
    fn renew(&mut self) {
        let noise_ue = self.tally.noise_ue as f32;
        let gauges = std::array::from_fn(|_| Gauge {
            gain: self.rng.random_range(0.99..=1.01),
            offset_ue: self.rng.random_range(-50.0..=50.0),
            noise_ue,
        });
        let noise = SmallRng::from_rng(&mut self.rng);
        self.hand = Hand::new(&self.gripper, self.table, gauges, noise);
        self.controller = Controller::new(self.table, *self.controller.active());
        self.dac = DacCode(0);
    }

    /// Lets time pass, with a command in its first tick.
    fn run(&mut self, activity: Activity, time_s: f64, motion: Motion, first: Command) -> End {
        let label = match (self.bad, activity) {
            (Some(_), Activity::Closing | Activity::Release | Activity::EmptyClose) => activity,
            (Some(_), _) => Activity::BadGauge,
            (None, _) => activity,
        };
        let place = label as usize;
        let ticks = ((time_s / TICK_S) as u64).min(self.end.saturating_sub(self.tick));
        self.tally.counts[place].times += 1;
        let mut command = first;
        let mut end = if ticks == 0 { End::Broken } else { End::Done };
        for n in 0..ticks {
            self.tick += 1;
            self.tally.counts[place].time_s += TICK_S;
            if self.bad.is_some() && n % 100 == 0 {
                self.worsen();
            }
            let (amplitude, phase) = self.ripple;
            let ripple_kpa = amplitude * (phase * self.tick as f64).sin();
            let acceleration = motion.at(n as f64 * TICK_S);
            let frame = self.hand.step(self.dac, acceleration, ripple_kpa);
            let now = Instant::from_micros(TICK_US * self.tick);
            let outputs = self.controller.step(now, &frame, command);
            self.dac = outputs.dac;
            if let Some(baselines) = &mut self.baselines {
                let seen = outputs.snapshot;
                let scores = baselines.step(&seen.residual, seen.state.is_holding());
                for (greatest, score) in self.greatest.iter_mut().zip(scores.unwrap_or(NO_SCORE)) {
                    *greatest = greatest.max(score);
                }
            }
            command = Command::Continue;
            for event in outputs.events.iter() {
                let count = &mut self.tally.counts[place];
                match event {
                    Event::Lost { .. } => count.lost += 1,
                    Event::Slip { .. } => count.slips += 1,
                    // A gauge that goes bad is to be reported.
                    Event::Fault { .. } if self.bad.is_some() => continue,
                    Event::Fault { .. } | Event::AirLoss => count.faults += 1,
                    _ => continue,
                }
                if matches!(event, Event::Slip { .. }) {
                    continue;
                }
                self.tally.alarms.push(Alarm {
                    noise_ue: self.tally.noise_ue,
                    block: self.block,
                    t_s: self.tick as f64 * TICK_S,
                    activity,
                    detail: format!("{motion:?} after {:.3} s", n as f64 * TICK_S),
                    event: *event,
                });
                command = Command::Acknowledge;
                end = End::Broken;
            }
            if end == End::Broken && command == Command::Continue {
                break;
            }
        }
        end
    }

    fn worsen(&mut self) {
        let Some(bad) = self.bad else { return };
        let share = 1.0 - (-(self.tick as f64 * TICK_S - bad.since_s) / bad.time_s).exp();
        let gauge = &mut self.hand.gauges[bad.finger];
        gauge.gain = 1.0 - share * bad.gain_lost;
        gauge.offset_ue = share * bad.offset_ue;
        gauge.noise_ue = self.tally.noise_ue as f32 + share as f32 * bad.noise_ue;
    }
}

//! A simulated run, recorded without sensor errors, so that it can be measured with any noise and judged by
//! any detector.
//!
//! Gauge noise does not influence the physics before a loss is reported: the regulator follows its own
//! monitor, and the reaction to a loss is to hold. Therefore the physics is simulated once, in closed loop,
//! and its strains and pressures are measured again for each level of noise.

use std::ops::ControlFlow;

use sim::arm::Phase;
use sim::run;
use softgrip::settings::Settings;
use softgrip::table::FingerTable;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Controller, FINGERS, Grip, Outputs, RawFrame, TICK_US};

use crate::case::{Case, generator};
use crate::sensor_model::SensorModel;

/// The object is gone once it has moved this far against the palm, mm.
pub const GONE_MM: f32 = 20.0;
/// The recording ends this long after the object is gone, s.
const AFTERMATH_S: f64 = 0.7;

/// The true state at one control tick.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Strain of each gauge without noise, drift and gain errors, µε.
    pub strain_ue: [f32; FINGERS],
    /// True pressure in the fingers, kPa.
    pub pressure_kpa: f32,
    /// True residual, summed over the fingers, µε.
    pub residual_ue: f32,
    /// Normal force on the object, summed over the fingers, N.
    pub contact_n: f32,
    /// Displacement of the object relative to the palm since the lift began, mm.
    pub moved_mm: f32,
    /// Distance that the object has slid along the fingers since the lift began, mm.
    pub slid_mm: f32,
}

/// The true course of one run, without sensor errors.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Every tick; the first one is tick 1.
    pub ticks: Vec<Tick>,
    /// The tick at which the robot asks for a grip.
    pub grip: usize,
    /// The tick at which the lift begins.
    pub lift: usize,
    /// The tick at which the robot asks for a release, if the run got there.
    pub release: Option<usize>,
}

/// What happened to the object in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObjectOutcome {
    /// The object moved by at most [`GONE_MM`] until it was released.
    Held,
    /// It moved by more than [`GONE_MM`], but the fingers still press on it.
    Displaced,
    /// It was lost: no finger touches it any more. The true residual sum left 90 % of its plateau for good at this
    /// tick. It need not fall far: fingers that meet one another keep most of it.
    Lost {
        /// Tick of the onset, as in [`Recording::at`].
        onset: usize,
    },
}

impl Recording {
    /// Simulates a case in closed loop, with gauge noise of `noise_ue` (µε rms).
    ///
    /// # Errors
    /// If the settings are not valid for the case's fingers.
    pub fn of(
        case: &Case,
        table: &'static FingerTable,
        settings: &Settings,
        noise_ue: f64,
    ) -> anyhow::Result<Self> {
        let setup = &case.setup;
        let mut plant = setup.plant();
        let mut controller = case.controller(table, settings)?;
        let mut measure = Measure::new(case, noise_ue);
        let profile = plant.profile().clone();
        let tick_of = |phase| (profile.start_s(phase) * 1e6 / TICK_US as f64).ceil() as usize;
        let (grip, lift) = (tick_of(Phase::Grip), tick_of(Phase::Lift));
        let (release, end) = (tick_of(Phase::Release), tick_of(Phase::Release) + 200);
        let mut recording = Self {
            ticks: Vec::with_capacity(end),
            grip,
            lift,
            release: None,
        };
        let mut dac = DacCode(0);
        let mut origin_m = [0.0; 3];
        let mut slid_mm = 0.0;
        let mut stop = end;
        for tick in 1.. {
            plant.disturb(case.disturbance(tick as f64 * 1e-6 * TICK_US as f64));
            let (_, truth) = plant.step(dac);
            if tick <= lift {
                origin_m = truth.object_m;
            } else {
                // m/s × 1 ms = mm.
                let speeds = plant.sliding_m_s();
                let touching = speeds.iter().flatten();
                let (sum, count) = touching.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
                slid_mm += if count > 0.0 { sum / count } else { 0.0 };
            }
            let moved_m = (0..3)
                .map(|i| (truth.object_m[i] - origin_m[i]).powi(2))
                .sum::<f64>()
                .sqrt();
            recording.ticks.push(Tick {
                strain_ue: truth.strain_ue.map(|ue| ue as f32),
                pressure_kpa: truth.pressure_kpa as f32,
                residual_ue: truth.residual_ue.iter().sum::<f64>() as f32,
                contact_n: truth.contact_n.iter().sum::<f64>() as f32,
                moved_mm: 1e3 * moved_m as f32,
                slid_mm: slid_mm as f32,
            });
            if tick == release {
                recording.release = Some(release);
            }
            let frame = measure.frame(tick, &recording.ticks[tick - 1]);
            let command = recording.command(tick, setup.scenario.pressure_kpa);
            let now = Instant::from_micros(TICK_US * tick as u64);
            dac = controller.step(now, &frame, command).dac;
            if tick < release && 1e3 * moved_m as f32 > GONE_MM {
                stop = stop.min(tick + (AFTERMATH_S * 1e6) as usize / TICK_US as usize);
            }
            if tick >= stop {
                break;
            }
        }
        Ok(recording)
    }

    /// Runs a controller over the recording, measured at a level of noise. `look` is called with each tick's
    /// number, its true state and the controller's outputs, until it breaks.
    pub fn replay(
        &self,
        case: &Case,
        noise_ue: f64,
        controller: Controller,
        mut look: impl FnMut(usize, &Tick, &Outputs) -> ControlFlow<()>,
    ) {
        let as_it_is = |frame| frame;
        self.replay_seen(
            case,
            noise_ue,
            controller,
            as_it_is,
            |tick, truth, outputs, _| look(tick, truth, outputs),
        );
    }

    /// The same; the controller gets what `seen` makes of each frame, and `look` sees it, too.
    pub fn replay_seen(
        &self,
        case: &Case,
        noise_ue: f64,
        mut controller: Controller,
        seen: impl Fn(RawFrame) -> RawFrame,
        mut look: impl FnMut(usize, &Tick, &Outputs, &Controller) -> ControlFlow<()>,
    ) {
        let mut measure = Measure::new(case, noise_ue);
        for (n, truth) in self.ticks.iter().enumerate() {
            let tick = n + 1;
            let frame = seen(measure.frame(tick, truth));
            let command = self.command(tick, case.setup.scenario.pressure_kpa);
            let now = Instant::from_micros(TICK_US * tick as u64);
            let outputs = controller.step(now, &frame, command);
            if look(tick, truth, &outputs, &controller).is_break() {
                break;
            }
        }
    }

    /// The robot's command at tick `tick`, from 1.
    pub fn command(&self, tick: usize, pressure_kpa: f64) -> Command {
        if tick == self.grip {
            Command::Grip(Grip::Pressure(Kilopascals(pressure_kpa as f32)))
        } else if Some(tick) == self.release {
            Command::Release
        } else {
            Command::Continue
        }
    }

    /// The ticks from the lift to the release or the end.
    pub fn carried(&self) -> std::ops::Range<usize> {
        self.lift..self.release.unwrap_or(self.ticks.len() + 1)
    }

    /// The state at tick `tick`, from 1.
    pub fn at(&self, tick: usize) -> &Tick {
        &self.ticks[tick - 1]
    }

    /// Classifies the recording by its true state.
    pub fn outcome(&self) -> ObjectOutcome {
        let carried = self.carried();
        let gone = carried.clone().any(|tick| self.at(tick).moved_mm > GONE_MM);
        if !gone {
            return ObjectOutcome::Held;
        }
        let held = &self.ticks[carried.start - 1..carried.end - 1];
        let sums = held.iter().map(|tick| f64::from(tick.residual_ue));
        // One that has slid and jams is still held.
        let free = held.last().is_some_and(|tick| tick.contact_n == 0.0);
        match run::collapse_of(sums) {
            Some(n) if free => ObjectOutcome::Lost {
                onset: carried.start + n,
            },
            _ => ObjectOutcome::Displaced,
        }
    }
}

/// A case's gauges and converter at one level of noise.
pub struct Measure<'a> {
    case: &'a Case,
    noise_ue: f32,
    sensors: SensorModel<rand_chacha::ChaCha8Rng>,
}

impl<'a> Measure<'a> {
    /// The noise of a case is the same sequence at every level, scaled.
    pub fn new(case: &'a Case, noise_ue: f64) -> Self {
        let rng = generator(case.seed, 0, 0);
        Self {
            case,
            noise_ue: noise_ue as f32,
            sensors: SensorModel::new(rng, &case.setup.gripper),
        }
    }

    /// The converter's codes for tick `tick` with the true state `truth`.
    pub fn frame(&mut self, tick: usize, truth: &Tick) -> RawFrame {
        let case = self.case;
        let t_s = tick as f64 * 1e-6 * TICK_US as f64;
        let strain = std::array::from_fn(|i| {
            let off = case.offset_ue[i] + case.drift_ue_per_s[i] * t_s;
            case.gauge_gain[i] as f32 * truth.strain_ue[i] + off as f32
        });
        self.sensors
            .frame(strain, [self.noise_ue; FINGERS], truth.pressure_kpa)
    }
}

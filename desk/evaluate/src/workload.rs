//! The workload: the controller on a surrogate gripper, hours of operation in which no object is lost.

use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use sim::gripper::Gripper;
use sim::hand::Likeness;
use sim::run;
use sim::setup::Setup;
use softgrip::table::FingerTable;
use softgrip::telemetry::Event;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Controller, FINGERS, Grip, TICK_US};

use crate::baselines::{Baselines, RULES};
use crate::case::generator;
use crate::cycle::{Activity, PalmMotion, motion};
use crate::identified_model::IdentifiedModel;
use crate::options::Options;
use crate::reach::{Reach, Situation};
use crate::surrogate::{GaugeErrors, Surrogate};
use crate::tally::{FalseAlarm, Tally};

/// Number of the random stream.
const STREAM: u64 = 16;
/// A warning of a slip is correct once the slide has changed the residual by this fraction of the plateau,
/// which is about 2 mm of a sphere's slide.
const SLID: f64 = 0.02;
/// The score of a rule that is not armed.
const NO_SCORE: [f32; RULES] = [f32::MIN; RULES];

/// Control tick, s, from [`softgrip::TICK_US`].
pub const TICK_S: f64 = 1e-6 * TICK_US as f64;

/// Kind of operation during a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Programme {
    /// Grips one after the other, with activities in between.
    Shift,
    /// One grip that is held to the end of the block.
    LongHold,
    /// Grips during which one gauge goes bad.
    BadGauge,
}

/// One random stream of simulated operation.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    pub programme: Programme,
    pub noise_ue: f64,
    pub index: u64,
    pub ticks: u64,
}

/// A gripper with its controller in the course of a block.
pub struct Workload<'a> {
    rng: SmallRng,
    surrogate: Surrogate<SmallRng>,
    controller: Controller,
    models: &'a [IdentifiedModel],
    gripper: Gripper,
    table: &'static FingerTable,
    /// Gain of each gauge; none where it is drawn, close to what the controller was calibrated to.
    gauge_gain: Option<[f64; FINGERS]>,
    tick: u64,
    end: u64,
    dac: DacCode,
    /// Amplitude, kPa, and phase per tick of the regulator's ripple.
    ripple: (f64, f64),
    bad: Option<Bad>,
    /// Only where they are compared with the controller.
    pub baselines: Option<Baselines>,
    greatest: [f32; RULES],
    /// Only where the limits are measured.
    reach: Option<(Situation, Reach)>,
    tally: Tally,
    block: u64,
}

/// A gauge that degrades.
#[derive(Debug, Clone, Copy)]
struct Bad {
    finger: usize,
    /// Start of the degradation, s since the start of the block.
    since_s: f64,
    /// Time constant of the degradation, s.
    time_s: f64,
    /// Final values: fraction of the gain that is lost, offset, and noise.
    gain_lost: f64,
    offset_ue: f64,
    noise_ue: f32,
}

/// How an activity ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// The planned time has passed.
    Done,
    /// The controller let the hold go, or the block is over.
    Broken,
}

impl<'a> Workload<'a> {
    /// A gripper at rest at the start of a block.
    ///
    /// # Errors
    /// If the settings are not valid.
    pub fn new(
        base: &Setup,
        options: &Options,
        models: &'a [IdentifiedModel],
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
        let gauges = std::array::from_fn(|_| GaugeErrors {
            gain: rng.random_range(0.99..=1.01),
            offset_ue: rng.random_range(-50.0..=50.0),
            noise_ue: block.noise_ue as f32,
        });
        let table = base.table();
        let noise = SmallRng::from_rng(&mut rng);
        Ok(Self {
            surrogate: Surrogate::new(&gripper, table, gauges, noise),
            controller: run::controller(table, &options.settings)?,
            rng,
            models,
            gripper,
            table,
            gauge_gain: None,
            tick: 0,
            end: block.ticks,
            dac: DacCode(0),
            ripple: (0.0, 0.0),
            bad: None,
            baselines: None,
            greatest: NO_SCORE,
            reach: None,
            tally: Tally::none(block.noise_ue),
            block: block.index,
        })
    }

    /// Takes fingers as they were cast, and their regulator's lag, ms.
    pub fn mount(&mut self, fingers: &Likeness, regulator_lag_ms: f64) {
        self.gripper.hand.finger_stiffness = fingers.stiffness;
        self.gripper.regulator.lag_ms = regulator_lag_ms;
        self.gauge_gain = Some(fingers.gain);
        self.renew();
    }

    /// Simulates the block and gives its counts.
    pub fn finish(mut self, block: &Block) -> Tally {
        while self.tick < self.end {
            match block.programme {
                Programme::Shift => self.job(),
                Programme::LongHold => self.long_hold(),
                Programme::BadGauge => self.bad_gauge(),
            }
        }
        self.tally
    }

    /// Goes through the block with nothing but these activities, and gives what held objects reached.
    pub fn reach(mut self, situation: Situation, activities: &[Activity]) -> Reach {
        self.reach = Some((situation, Reach::NONE));
        while self.tick < self.end {
            let mut held = self.grip();
            for _ in 0..self.rng.random_range(4..=20) {
                if held == End::Broken {
                    break;
                }
                let activity = activities[self.rng.random_range(0..activities.len())];
                let (motion, time_s) = motion(activity, &mut self.rng);
                let said = Command::Motion(situation.motion());
                held = self.run(activity, time_s, motion, said);
            }
            self.release();
        }
        self.reach.map_or(Reach::NONE, |(_, reach)| reach)
    }

    /// One grip with 4 to 20 activities and its release; in one of ten cases an empty close.
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

    /// Grips a random object of the identified models.
    fn grip(&mut self) -> End {
        let model = &self.models[self.rng.random_range(0..self.models.len())];
        let pressure = Kilopascals(model.pressure_kpa as f32);
        self.surrogate.place(Some(model));
        let ripple_hz = self.rng.random_range(2.0..=40.0);
        self.ripple = (
            self.rng.random_range(0.0..=1.0),
            std::f64::consts::TAU * ripple_hz * TICK_S,
        );
        let command = Command::Grip(Grip::Pressure(pressure));
        self.run(Activity::Closing, 1.2, PalmMotion::Rest, command)
    }

    fn release(&mut self) {
        self.run(Activity::Release, 0.9, PalmMotion::Rest, Command::Release);
        self.surrogate.place(None);
        self.ripple = (0.0, 0.0);
        let greatest = std::mem::replace(&mut self.greatest, NO_SCORE);
        if greatest != NO_SCORE {
            self.tally.scores.push(greatest);
        }
    }

    fn empty_close(&mut self) {
        self.surrogate.place(None);
        let command = self.grip_command();
        self.run(Activity::EmptyClose, 1.5, PalmMotion::Rest, command);
        self.release();
    }

    /// One grip to the end of the block, with a motion once a minute.
    fn long_hold(&mut self) {
        // Creep of an hour: a tenth of the strain with time constants of minutes.
        self.gripper.gauge.creep_percent = self.rng.random_range(3.0..=10.0);
        self.gripper.gauge.creep_time_s = self.rng.random_range(300.0..=1800.0);
        self.renew();
        let drift: [f64; FINGERS] = std::array::from_fn(|_| self.rng.random_range(-0.5..=0.5));
        let start = self.tick;
        let mut end = self.grip();
        while end == End::Done {
            for (gauge, drift) in self.surrogate.gauges.iter_mut().zip(drift) {
                gauge.offset_ue += drift;
            }
            end = self.run(Activity::Creep, 1.0, PalmMotion::Rest, Command::Continue);
            if end == End::Done && (self.tick - start).is_multiple_of(60_000) {
                end = self.activity();
            }
        }
        self.release();
    }

    /// Operation while one gauge degrades with a time constant of one to ten minutes.
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

    /// Draws new gauge errors.
    fn renew(&mut self) {
        let noise_ue = self.tally.noise_ue as f32;
        let known = self.gauge_gain;
        let gauges = std::array::from_fn(|i| GaugeErrors {
            gain: match known {
                Some(gain) => gain[i],
                None => self.rng.random_range(0.99..=1.01),
            },
            offset_ue: self.rng.random_range(-50.0..=50.0),
            noise_ue,
        });
        let noise = SmallRng::from_rng(&mut self.rng);
        self.surrogate = Surrogate::new(&self.gripper, self.table, gauges, noise);
        self.controller = Controller::new(self.table, *self.controller.active());
        self.dac = DacCode(0);
    }

    /// Simulates `time_s` of an activity, with `first` as the command of its first tick.
    fn run(&mut self, activity: Activity, time_s: f64, motion: PalmMotion, first: Command) -> End {
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
            let mut frame = self.surrogate.step(self.dac, acceleration, ripple_kpa);
            if let Some((situation, _)) = self.reach {
                frame = situation.frame(frame);
            }
            let now = Instant::from_micros(TICK_US * self.tick);
            let outputs = self.controller.step(now, &frame, command);
            self.dac = outputs.dac;
            if let Some((_, reach)) = &mut self.reach {
                reach.take(self.controller.signs());
            }
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
                    Event::Slip { .. } if self.surrogate.gave_way() > SLID => continue,
                    Event::Slip { .. } => count.slips += 1,
                    // A gauge that goes bad is to be reported.
                    Event::Fault { .. } if self.bad.is_some() => continue,
                    Event::Fault { .. } | Event::AirLoss => count.faults += 1,
                    _ => continue,
                }
                if matches!(event, Event::Slip { .. }) {
                    continue;
                }
                self.tally.alarms.push(FalseAlarm {
                    noise_ue: self.tally.noise_ue,
                    block: self.block,
                    t_s: self.tick as f64 * TICK_S,
                    activity,
                    detail: format!("{motion:?} after {:.3} s", n as f64 * TICK_S),
                    event: format!("{event:?}"),
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
        let gauge = &mut self.surrogate.gauges[bad.finger];
        let whole = self.gauge_gain.map_or(1.0, |gain| gain[bad.finger]);
        gauge.gain = whole * (1.0 - share * bad.gain_lost);
        gauge.offset_ue = share * bad.offset_ue;
        gauge.noise_ue = self.tally.noise_ue as f32 + share as f32 * bad.noise_ue;
    }
}

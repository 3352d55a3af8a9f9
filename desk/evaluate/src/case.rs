//! Random parameters of one pick-and-carry run: object, grip, arm, push, and the errors of fingers, gauges
//! and air.

use std::f64::consts::TAU;

use finger::capability::GRAVITY_M_S2;
use finger::object::Object;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use sim::arm::{Phase, Profile};
use sim::gripper::Gripper;
use sim::plant::Disturbance;
use sim::run;
use sim::scenario::{ObjectKind, Scenario};
use sim::setup::Setup;
use softgrip::settings::Settings;
use softgrip::table::{self, FingerTable};
use softgrip::units::Kilopascals;
use softgrip::{Controller, FINGERS};

/// Class of calibration: how well the controller knows its fingers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Knowledge {
    /// After a free-bend sweep: the gain of each finger is known to 1 %.
    Calibrated,
    /// Recipe alone: the gain of each finger is up to 10 % off.
    Uncalibrated,
}

/// Every class of calibration, in the order of the tables.
pub const KNOWLEDGE: [Knowledge; 2] = [Knowledge::Calibrated, Knowledge::Uncalibrated];

impl Knowledge {
    /// Name in tables, CSV and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibrated => "calibrated",
            Self::Uncalibrated => "uncalibrated",
        }
    }
}

/// What makes an object fall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Inertia, under the arm's motion.
    Dropped,
    /// An external force.
    Pushed,
}

/// Every origin, in the order of the tables.
pub const ORIGINS: [Origin; 2] = [Origin::Dropped, Origin::Pushed];

impl Origin {
    /// Name in tables, CSV and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dropped => "dropped",
            Self::Pushed => "pushed out",
        }
    }
}

/// An external force on the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Final value in the palm's frame, N.
    pub force_n: [f64; 3],
    /// Start of the force, s since the start of the run.
    pub start_s: f64,
    /// Rise time from zero to the final value, s; 0 for a step.
    pub rise_s: f64,
}

/// All random parameters of one run.
#[derive(Debug, Clone)]
pub struct Case {
    /// Index of the run in the sample, from 0.
    pub index: u64,
    /// Class of calibration: how well the controller knows its fingers.
    pub knowledge: Knowledge,
    /// Object, arm, fingers and air.
    pub setup: Setup,
    /// The external force, if there is one.
    pub push: Option<Push>,
    /// Gain of each gauge relative to its nominal one, dimensionless.
    pub gauge_gain: [f64; FINGERS],
    /// Free-bend gain of each finger as the controller assumes it, dimensionless.
    pub free_bend_gain: [f64; FINGERS],
    /// Offset that the tare left, µε.
    pub offset_ue: [f64; FINGERS],
    /// Drift of each gauge, µε/s.
    pub drift_ue_per_s: [f64; FINGERS],
    /// Amplitude of the regulator's ripple, kPa.
    pub ripple_kpa: f64,
    /// Frequency of the regulator's ripple, Hz.
    pub ripple_hz: f64,
    /// Seed of the noise of gauges and monitor.
    pub seed: u64,
}

/// Distance of the stream numbers of two purposes, so that no two share a random stream.
const STREAMS: u64 = 1 << 32;

/// A generator of its own for each run of each purpose.
pub fn generator(seed: u64, stream: u64, index: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream * STREAMS + index);
    rng
}

const CASES: u64 = 1;

/// After so many of its lags a regulator is within 1 % of its set-point.
const LAGS_TO_FILL: f64 = 5.0;

/// Uniform random parameters. Their order of drawing is part of a seed's meaning.
struct Draw(ChaCha8Rng);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..=high)
    }

    /// Draws object, grip and arm. Gives the approximate force that the fingers can hold, N: masses close to
    /// it slide slowly.
    fn grip(&mut self, setup: &mut Setup, table: &FingerTable) -> f64 {
        let object = match self.between(0.0, 1.0) < 0.5 {
            true => ObjectKind::Sphere,
            false => ObjectKind::Cylinder,
        };
        let pressure_kpa = self.between(100.0, 160.0);
        let accel_m_s2 = self.between(2.0, 15.0);
        let friction = self.between(0.6, 1.0);
        setup.scenario = Scenario {
            object,
            mass_kg: 0.1,
            accel_m_s2,
            pressure_kpa,
            friction,
            noise_ue: 0.0,
            seed: 0,
        };
        let gripped = setup.gripped_mut();
        gripped.depth_m += 1e-3 * self.between(-3.0, 3.0);
        let (Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. }) = &mut gripped.object;
        *radius_m *= self.between(0.92, 1.0);

        let kind = match object {
            ObjectKind::Sphere => table::ObjectKind::Sphere,
            ObjectKind::Cylinder => table::ObjectKind::Cylinder,
        };
        let lift = table::lift(table, kind, Kilopascals(pressure_kpa as f32));
        // `evaluation::check` has seen to it that it is known.
        lift.map_or(0.0, |(lift, _)| f64::from(lift.0)) * friction / 0.8
    }

    /// Fingers, gauges, air and the arm's moves.
    fn gripper(&mut self, gripper: &mut Gripper, finger_stiffness: [f64; FINGERS]) {
        let hand = &mut gripper.hand;
        hand.finger_stiffness = finger_stiffness;
        hand.first_finger_deg = self.between(0.0, 120.0);
        hand.sliding_friction = self.between(0.85, 1.0);
        let gauge = &mut gripper.gauge;
        gauge.creep_percent = self.between(0.0, 3.0);
        gauge.creep_time_s = self.between(5.0, 60.0);
        let regulator = &mut gripper.regulator;
        regulator.lag_ms = self.between(50.0, 90.0);
        regulator.gain = self.between(0.99, 1.01);
        regulator.offset_kpa = self.between(-1.0, 1.0);
        let arm = &mut gripper.arm;
        // The run begins where the fingers close: the way down costs time and shows nothing.
        arm.approach_mm = 1.0;
        arm.dwell_ms = 50.0;
        arm.jerk_ramp_ms = self.between(10.0, 60.0);
        arm.lift_mm = self.between(100.0, 200.0);
        arm.carry_mm = self.between(200.0, 600.0);
    }

    /// A push that makes the object fall, and a mass that the arm's motion alone would not lose.
    fn push(&mut self, setup: &mut Setup, holds_n: f64) -> Push {
        // At rest after the lift, or in the middle of things.
        let at_rest = self.between(0.0, 1.0) < 0.6;
        if at_rest {
            setup.gripper.arm.dwell_ms = 700.0;
        }
        let accel_m_s2 = setup.scenario.accel_m_s2.min(10.0);
        setup.scenario.accel_m_s2 = accel_m_s2;
        setup.scenario.mass_kg = self.between(0.25, 0.7) * holds_n / (GRAVITY_M_S2 + accel_m_s2);
        let spare_n = holds_n - setup.scenario.mass_kg * GRAVITY_M_S2;
        let force_n = self.between(0.8, 3.0) * spare_n;
        let direction = self.direction();
        let profile = Profile::new(&setup.gripper.arm_task(accel_m_s2));
        let (lift_s, carry_s) = (profile.start_s(Phase::Lift), profile.start_s(Phase::Carry));
        let start_s = if at_rest {
            carry_s - 0.65
        } else {
            self.between(lift_s + 0.05, profile.start_s(Phase::Place))
        };
        let rise_s = match self.between(0.0, 1.0) < 0.3 {
            true => 0.0,
            false => 1e-3 * self.between(5.0, 500.0),
        };
        Push {
            force_n: direction.map(|x| force_n * x),
            start_s,
            rise_s,
        }
    }

    /// Downwards, sideways or anywhere.
    fn direction(&mut self) -> [f64; 3] {
        let (kind, angle, z) = (
            self.between(0.0, 3.0) as u8,
            self.between(0.0, TAU),
            self.between(-1.0, 1.0),
        );
        match kind {
            0 => [0.0, 0.0, -1.0],
            1 => [angle.cos(), angle.sin(), 0.0],
            _ => {
                let r = (1.0 - z * z).sqrt();
                [r * angle.cos(), r * angle.sin(), z]
            }
        }
    }
}

impl Case {
    /// Draws run number `index` of the sample of `seed` and `knowledge`.
    pub fn draw(
        base: &Setup,
        table: &FingerTable,
        seed: u64,
        knowledge: Knowledge,
        index: u64,
    ) -> Self {
        let mut draw = Draw(generator(seed, CASES + knowledge as u64, index));
        let mut setup = base.clone();
        let holds_n = draw.grip(&mut setup, table);
        let stiffness: [f64; FINGERS] = std::array::from_fn(|_| draw.between(0.95, 1.05));
        let gauge_gain = std::array::from_fn(|_| draw.between(0.95, 1.05));
        let swept = setup.hand().free_bend_gain(&setup.chain);
        let free_bend_gain = std::array::from_fn(|i| match knowledge {
            Knowledge::Calibrated => {
                gauge_gain[i] * swept[i] / stiffness[i] * draw.between(0.99, 1.01)
            }
            Knowledge::Uncalibrated => 1.0,
        });
        draw.gripper(&mut setup.gripper, stiffness);
        let push = if draw.between(0.0, 1.0) < 0.5 {
            Some(draw.push(&mut setup, holds_n))
        } else {
            let scenario = &mut setup.scenario;
            scenario.mass_kg =
                draw.between(0.6, 1.6) * holds_n / (GRAVITY_M_S2 + scenario.accel_m_s2);
            None
        };
        Self {
            index,
            knowledge,
            setup,
            push,
            gauge_gain,
            free_bend_gain,
            offset_ue: std::array::from_fn(|_| draw.between(-50.0, 50.0)),
            drift_ue_per_s: std::array::from_fn(|_| draw.between(-30.0, 30.0)),
            ripple_kpa: draw.between(0.0, 1.0),
            ripple_hz: draw.between(2.0, 40.0),
            seed: draw.0.random(),
        }
    }

    /// As [`Self::draw`], with the fingers, gauges and regulator of `setup`, of which the settings say all that is known.
    pub fn mounted(setup: &Setup, seed: u64, index: u64) -> Self {
        let mut case = Self::draw(setup, setup.table(), seed, Knowledge::Calibrated, index);
        let regulator_lag_ms = setup.gripper.regulator.lag_ms;
        let gripper = &mut case.setup.gripper;
        gripper.hand.finger_stiffness = setup.gripper.hand.finger_stiffness;
        gripper.regulator.lag_ms = regulator_lag_ms;
        // The robot knows its gripper and waits for it; all that follows is later.
        let wait_ms = LAGS_TO_FILL * regulator_lag_ms;
        gripper.arm.grip_ms += wait_ms;
        if let Some(push) = &mut case.push {
            push.start_s += 1e-3 * wait_ms;
        }
        case.gauge_gain = setup.hand().gauge_gain;
        case.free_bend_gain = [1.0; FINGERS];
        case
    }

    /// What makes the object fall, if it falls.
    pub fn origin(&self) -> Origin {
        match self.push {
            Some(_) => Origin::Pushed,
            None => Origin::Dropped,
        }
    }

    /// External force and pressure ripple at time `t_s`, s.
    pub fn disturbance(&self, t_s: f64) -> Disturbance {
        let push_n = self.push.map_or([0.0; 3], |push| {
            let since_s = t_s - push.start_s;
            let share = if since_s < 0.0 {
                0.0
            } else if since_s < push.rise_s {
                since_s / push.rise_s
            } else {
                1.0
            };
            push.force_n.map(|force| share * force)
        });
        Disturbance {
            push_n,
            ripple_kpa: self.ripple_kpa * (TAU * self.ripple_hz * t_s).sin(),
        }
    }

    /// The controller of this run, with its settings and what it knows of the fingers.
    ///
    /// # Errors
    /// If the settings are not valid.
    pub fn controller(
        &self,
        table: &'static FingerTable,
        settings: &Settings,
    ) -> anyhow::Result<Controller> {
        let mut settings = *settings;
        let gains = settings.finger.free_bend_gain.iter_mut();
        for (gain, known) in gains.zip(self.free_bend_gain) {
            *gain = (f64::from(*gain) * known) as f32;
        }
        run::controller(table, &settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_waits_for_a_slower_regulator_is_pushed_in_the_same_place() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
        let recipe = finger::recipe::load(path.as_ref()).expect("the recipe");
        let mut setup = Setup::of(&recipe).expect("a setup");
        setup.gripper.regulator.lag_ms = 200.0;
        let since_lift_s = |case: &Case| {
            let accel_m_s2 = case.setup.scenario.accel_m_s2;
            let profile = Profile::new(&case.setup.gripper.arm_task(accel_m_s2));
            let lift_s = profile.start_s(Phase::Lift);
            (lift_s, case.push.map(|push| push.start_s - lift_s))
        };
        let mut pushed = 0;
        for index in 0..8 {
            let drawn = Case::draw(&setup, setup.table(), 1, Knowledge::Calibrated, index);
            let mounted = Case::mounted(&setup, 1, index);
            let (drawn, mounted) = (since_lift_s(&drawn), since_lift_s(&mounted));
            assert!((mounted.0 - drawn.0 - 1.0).abs() < 1e-9);
            if let (Some(drawn), Some(mounted)) = (drawn.1, mounted.1) {
                assert!((mounted - drawn).abs() < 1e-9);
                pushed += 1;
            }
        }
        assert!(pushed > 0);
    }
}

//! Model of how the residuals of a firmly held object respond to the arm's acceleration, identified on the
//! simulated gripper and run by the surrogate.
//!
//! The response is overdamped and almost linear, because the damping of the silicone exceeds what the
//! object's mass can excite. All fingers respond alike to acceleration along the fingers; to acceleration
//! across them each responds with the cosine of the angle to its direction. Two second-order difference
//! equations, fitted by least squares to a run under broadband acceleration, describe most of it. The rest is
//! a sideways slide that stays, where a stop or a bump exceeds friction ([`crate::slide`]).

use anyhow::Context;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use sim::setup::Setup;
use softgrip::FINGERS;

use crate::case::generator;
use crate::difference::{Difference, Filter};
use crate::rig::{GRID_KPA, Rig, STEP_S, closing, directions, spread};
use crate::slide::{SlideModel, Slider};

/// Rms of the acceleration for the identification, m/s². At 2 m/s² the contacts of a light cylinder creep,
/// and the fit takes that for a slow response.
const EXCITATION_M_S2: f64 = 0.5;
/// Duration of the identification run, s.
const EXCITED_S: f64 = 3.0;
/// The model of an object in the grip.
#[derive(Debug, Clone)]
pub struct IdentifiedModel {
    /// Pressure at which it was identified, kPa.
    pub pressure_kpa: f64,
    /// Mean residual of a finger against pressure in steps of 2 kPa, µε.
    pub residual_ue: Vec<f64>,
    /// Response of every finger's residual to acceleration along the fingers, upwards, µε per m/s².
    pub along: Difference,
    /// Response of a finger's residual to acceleration across the fingers, outwards of that finger, µε per
    /// m/s².
    pub across: Difference,
    /// Model of the sideways slide.
    pub slide: SlideModel,
}

impl IdentifiedModel {
    /// Identifies the response of the object that a setup holds at its pressure, and the closing curve.
    ///
    /// # Errors
    /// If the object does not respond to acceleration.
    pub fn of(setup: &Setup) -> anyhow::Result<Self> {
        Self::with(setup, closing(setup))
    }

    /// As [`Self::of`] with a known closing curve: mean residual of a finger in steps of 2 kPa, µε.
    ///
    /// # Errors
    /// If the object does not respond to acceleration.
    pub fn with(setup: &Setup, residual_ue: Vec<f64>) -> anyhow::Result<Self> {
        let pressure_kpa = setup.scenario.pressure_kpa;
        let mut rng = generator(0, 0, 0);
        let mut along = [Vec::new(), Vec::new()];
        let mut across = [Vec::new(), Vec::new()];
        let mut rig = Rig::holding(setup, pressure_kpa);
        let home_m = rig.position_m;
        let plateau = rig.residual_ue();
        let mut drive = [Noise::default(); 3];
        for _ in 0..(EXCITED_S / STEP_S) as usize {
            let acceleration =
                rig.confined(home_m, drive.each_mut().map(|noise| noise.step(&mut rng)));
            rig.step(acceleration);
            let now = rig.residual_ue();
            let change: [f64; FINGERS] = std::array::from_fn(|i| now[i] - plateau[i]);
            along[0].push(acceleration[2]);
            along[1].push(change.iter().sum::<f64>() / FINGERS as f64);
            // The first finger stands in the direction of x: the projection of the three on cos(φ).
            let outwards = directions();
            across[0].push(acceleration[0]);
            let projected: f64 = (0..FINGERS).map(|i| change[i] * outwards[i][0]).sum();
            across[1].push(projected / 1.5);
        }
        let fit = |[input, output]: &[Vec<f64>; 2]| {
            Difference::fit(input, output).context("the object does not answer to acceleration")
        };
        let (along, across) = (fit(&along)?, fit(&across)?);
        Ok(Self {
            pressure_kpa,
            residual_ue,
            along,
            across,
            slide: SlideModel::of(setup, along, across),
        })
    }

    /// Mean residual of a finger at a pressure, µε.
    pub fn residual_at(&self, pressure_kpa: f64) -> f64 {
        let place = (pressure_kpa / GRID_KPA).clamp(0.0, self.residual_ue.len() as f64 - 1.001);
        let n = place as usize;
        let share = place - n as f64;
        self.residual_ue[n] + share * (self.residual_ue[n + 1] - self.residual_ue[n])
    }
}

/// A held object that responds to the arm's motion.
#[derive(Debug, Clone)]
pub struct Held {
    along: Filter,
    across: [Filter; 2],
    slider: Slider,
}

impl Held {
    /// A held object at rest, with all residuals on their plateau.
    pub fn new(model: &IdentifiedModel) -> Self {
        Self {
            along: Filter::new(model.along),
            across: [model.across; 2].map(Filter::new),
            slider: Slider::new(model.slide),
        }
    }

    /// Change of every residual by the slide so far, µε.
    pub fn gave_way_ue(&self) -> f64 {
        self.slider.gave_way_ue()
    }

    /// Change of each finger's residual under this acceleration, µε.
    pub fn step(&mut self, acceleration_m_s2: [f64; 3]) -> [f64; FINGERS] {
        let [x, y, z] = acceleration_m_s2;
        let along = self.along.step(z);
        let across = [self.across[0].step(x), self.across[1].step(y)];
        let shifted = self.slider.step(acceleration_m_s2);
        let linear = spread(across);
        std::array::from_fn(|i| along + linear[i] + shifted[i])
    }
}

/// White noise through two first-order lags of 4 ms: flat up to 40 Hz.
#[derive(Debug, Clone, Copy, Default)]
struct Noise {
    stages: [f64; 2],
}

impl Noise {
    fn step(&mut self, rng: &mut impl Rng) -> f64 {
        let white: f64 = rng.sample(StandardNormal);
        const GAIN: f64 = 0.25;
        self.stages[0] += GAIN * (white - self.stages[0]);
        self.stages[1] += GAIN * (self.stages[0] - self.stages[1]);
        // What the two lags leave of an rms of one.
        const LEFT: f64 = 0.286;
        EXCITATION_M_S2 / LEFT * self.stages[1]
    }
}

//! The identified model of a firmly held object: how its residuals answer to the arm's acceleration,
//! identified on the simulated gripper, then run by the surrogate.
//!
//! There the answer is overdamped and almost linear: silicone damps more than the object's mass
//! can swing. Each finger's residual answers alike to acceleration along the fingers, and to
//! acceleration across them by its cosine with the finger's direction. Two difference equations of second
//! order, fitted by least squares to a run under broadband acceleration, are most of it. The rest is that
//! an object gives way sideways where a stop or a bump is harder than its friction, and stays there.

use anyhow::Context;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use sim::setup::Setup;
use softgrip::FINGERS;

use crate::bench::{Bench, GRID_KPA, STEP_S, closing, directions, spread};
use crate::case::generator;
use crate::difference::{Difference, Filter};
use crate::slide::{Slide, Slider};

/// Rms of the acceleration under which a response is identified, m/s²: at 2, contacts of a light cylinder
/// slip by hairs, and the fit takes them for a slow answer.
const EXCITATION_M_S2: f64 = 0.5;
/// Length of that run, s.
const EXCITED_S: f64 = 3.0;
/// The model of an object in the grip.
#[derive(Debug, Clone)]
pub struct IdentifiedModel {
    /// Pressure at which it was identified, kPa.
    pub pressure_kpa: f64,
    /// Mean residual of a finger against pressure in steps of 2 kPa, µε.
    pub residual_ue: Vec<f64>,
    /// Residual of every finger on acceleration along the fingers, upwards, µε per m/s².
    pub along: Difference,
    /// Residual of a finger on acceleration across, outwards of that finger, µε per m/s².
    pub across: Difference,
    /// How it gives way.
    pub slide: Slide,
}

impl IdentifiedModel {
    /// Identifies the response of what a setup holds at its pressure, and its closing.
    pub fn of(setup: &Setup) -> anyhow::Result<Self> {
        Self::with(setup, closing(setup))
    }

    /// The same where the closing is known: mean residual of a finger in steps of 2 kPa, µε.
    pub fn with(setup: &Setup, residual_ue: Vec<f64>) -> anyhow::Result<Self> {
        let pressure_kpa = setup.scenario.pressure_kpa;
        let mut rng = generator(0, 0, 0);
        let mut along = [Vec::new(), Vec::new()];
        let mut across = [Vec::new(), Vec::new()];
        let mut bench = Bench::holding(setup, pressure_kpa);
        let home_m = bench.position_m;
        let plateau = bench.residual_ue();
        let mut drive = [Noise::default(); 3];
        for _ in 0..(EXCITED_S / STEP_S) as usize {
            let acceleration =
                bench.confined(home_m, drive.each_mut().map(|noise| noise.step(&mut rng)));
            bench.step(acceleration);
            let now = bench.residual_ue();
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
            slide: Slide::of(setup, along, across),
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

/// An object that answers to the arm's motion.
#[derive(Debug, Clone)]
pub struct Held {
    along: Filter,
    across: [Filter; 2],
    slider: Slider,
}

impl Held {
    /// At rest.
    pub fn new(model: &IdentifiedModel) -> Self {
        Self {
            along: Filter::new(model.along),
            across: [model.across; 2].map(Filter::new),
            slider: Slider::new(model.slide),
        }
    }

    /// What has changed in every residual since it gave way, µε.
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

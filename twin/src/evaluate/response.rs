//! How a firmly held object answers to the arm's acceleration: identified on the twin, then run by the
//! fast generator.
//!
//! On the twin the answer is overdamped and almost linear: silicone damps more than the object's mass
//! can swing. Each finger's residual answers alike to acceleration along the fingers, and to
//! acceleration across them by its cosine with the finger's direction. Two difference equations of second
//! order, fitted by least squares to a run under broadband acceleration, are most of it. The rest is that
//! an object gives way sideways where a stop or a bump is harder than its friction, and stays there.

use std::f64::consts::TAU;

use anyhow::Context;
use finger::chain::Chain;
use nalgebra::{Matrix4, Vector4};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use softgrip::FINGERS;

use super::case::generator;
use crate::plant::{Lag, world_config};
use crate::setup::Setup;
use crate::world::World;

/// Step of the world, s.
const STEP_S: f64 = 0.001;
/// Rms of the acceleration under which a response is identified, m/s²: at 2, contacts of a light cylinder
/// slip by hairs, and the fit takes them for a slow answer.
const EXCITATION_M_S2: f64 = 0.5;
/// Length of that run, s.
const EXCITED_S: f64 = 3.0;
/// Lag before the fit, as slow as the answers, s.
const FIT_LAG_S: f64 = 0.02;
/// Pressures of a closing, kPa apart.
const GRID_KPA: f64 = 2.0;

/// A difference equation `y = a₁ y₁ + a₂ y₂ + b₀ u + b₁ u₁`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    a: [f64; 2],
    b: [f64; 2],
}

impl Difference {
    /// The one that fits output to input best, in the sense of least squares of the next value. Both go
    /// through the same lag first: slow motion counts, where a tick's own error would drown it.
    pub fn fit(input: &[f64], output: &[f64]) -> Option<Self> {
        let lag = |values: &[f64]| -> Vec<f64> {
            let mut lag = Lag::new(FIT_LAG_S);
            values.iter().map(|&value| lag.step(value)).collect()
        };
        let (input, output) = (lag(input), lag(output));
        let mut normal = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for n in 2..input.len().min(output.len()) {
            let row = Vector4::new(output[n - 1], output[n - 2], input[n], input[n - 1]);
            normal += row * row.transpose();
            right += row * output[n];
        }
        let [a1, a2, b0, b1] = normal.cholesky()?.solve(&right).into();
        Some(Self {
            a: [a1, a2],
            b: [b0, b1],
        })
    }
}

/// A difference equation in motion.
#[derive(Debug, Clone, Copy)]
pub struct Filter {
    difference: Difference,
    input: f64,
    output: [f64; 2],
}

impl Filter {
    /// At rest.
    pub fn new(difference: Difference) -> Self {
        Self {
            difference,
            input: 0.0,
            output: [0.0; 2],
        }
    }

    /// The next output.
    pub fn step(&mut self, input: f64) -> f64 {
        let Difference { a, b } = self.difference;
        let [y1, y2] = self.output;
        let output = a[0] * y1 + a[1] * y2 + b[0] * input + b[1] * self.input;
        self.input = input;
        self.output = [output, y1];
        output
    }
}

/// How an object gives way across the fingers: once what it pulls at them, its weight included, is more
/// than friction resists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slide {
    /// What friction resists, m/s²: of the weight, and of acceleration along and across together.
    pub threshold_m_s2: f64,
    /// What the fingers push back for each unit of the way, 1/s.
    pub restoring_per_s: f64,
    /// Share by which the way follows acceleration in a tick.
    pub gain: f64,
    /// Residual of a finger for each unit of the way towards it, µε per m/s.
    pub shift_ue: f64,
    /// Change of every residual with the length of the way, µε per m/s.
    pub rise_ue: f64,
}

/// An object that gives way, in motion. The way counts in m/s: acceleration beyond the threshold times its
/// duration.
#[derive(Debug, Clone, Copy)]
pub struct Slider {
    slide: Slide,
    lagged: [f64; 3],
    way: [f64; 2],
}

impl Slider {
    /// At rest in the middle.
    pub fn new(slide: Slide) -> Self {
        Self {
            slide,
            lagged: [0.0; 3],
            way: [0.0; 2],
        }
    }

    /// Change of the fingers' residuals under this acceleration, µε.
    pub fn step(&mut self, acceleration_m_s2: [f64; 3]) -> [f64; FINGERS] {
        self.advance(acceleration_m_s2);
        let Slide {
            shift_ue, rise_ue, ..
        } = self.slide;
        let [x, y] = self.way;
        let rise = rise_ue * (x * x + y * y).sqrt();
        spread([x, y]).map(|way| shift_ue * way + rise)
    }

    fn advance(&mut self, acceleration_m_s2: [f64; 3]) {
        let slide = &self.slide;
        for (lagged, now) in self.lagged.iter_mut().zip(acceleration_m_s2) {
            *lagged += slide.gain * (now - *lagged);
        }
        let x = self.lagged[0] - slide.restoring_per_s * self.way[0];
        let y = self.lagged[1] - slide.restoring_per_s * self.way[1];
        let z = self.lagged[2] + GRAVITY_M_S2;
        let square = x * x + y * y + z * z;
        if square > slide.threshold_m_s2 * slide.threshold_m_s2 {
            let step = STEP_S * (1.0 - slide.threshold_m_s2 / square.sqrt());
            self.way[0] += step * x;
            self.way[1] += step * y;
        }
    }
}

/// One tick of a run across the fingers.
struct Across {
    /// Acceleration, m/s².
    acceleration_m_s2: [f64; 3],
    /// What the linear answers leave of each finger's residual, µε.
    left_ue: [f64; FINGERS],
    /// What the tick counts for.
    weight: f64,
}

impl Slide {
    /// Thresholds, restorations and lags that are tried.
    const THRESHOLDS_M_S2: std::ops::Range<u32> = 11..36;
    const RESTORING_PER_S: [f64; 6] = [0.0, 2.0, 5.0, 10.0, 20.0, 40.0];
    const GAINS: [f64; 4] = [1.0, 0.2, 0.1, 0.05];

    /// The one whose course is most like that of a run, as large as in the run.
    fn fit(run: &[Across]) -> Self {
        let tried = Self::THRESHOLDS_M_S2.flat_map(|threshold| {
            Self::RESTORING_PER_S
                .into_iter()
                .flat_map(move |restoring_per_s| {
                    Self::GAINS.into_iter().map(move |gain| Self {
                        threshold_m_s2: f64::from(threshold),
                        restoring_per_s,
                        gain,
                        shift_ue: 0.0,
                        rise_ue: 0.0,
                    })
                })
        });
        tried
            .map(|slide| slide.scaled(run))
            .reduce(|best, next| if next.1 > best.1 { next } else { best })
            .map(|(slide, _)| slide)
            .expect("something is tried")
    }

    /// The same with shifts as large as in the run, where those of the best fit would be too small; and
    /// how much of the run goes its way.
    fn scaled(mut self, run: &[Across]) -> (Self, f64) {
        let mut slider = Slider::new(self);
        let mut shift = Likeness::default();
        let mut rise = Likeness::default();
        for tick in run {
            slider.advance(tick.acceleration_m_s2);
            let [x, y] = slider.way;
            let mean = tick.left_ue.iter().sum::<f64>() / FINGERS as f64;
            for (way, left) in spread([x, y]).into_iter().zip(tick.left_ue) {
                shift.add(tick.weight, way, left - mean);
            }
            rise.add(tick.weight, (x * x + y * y).sqrt(), mean);
        }
        self.shift_ue = shift.scale();
        self.rise_ue = rise.correlation().abs() * rise.scale();
        (self, shift.correlation().abs())
    }
}

/// How like two courses are.
#[derive(Debug, Clone, Copy, Default)]
struct Likeness {
    model: f64,
    both: f64,
    truth: f64,
}

impl Likeness {
    fn add(&mut self, weight: f64, model: f64, truth: f64) {
        self.model += weight * model * model;
        self.both += weight * model * truth;
        self.truth += weight * truth * truth;
    }

    /// What gives the model the truth's power.
    fn scale(&self) -> f64 {
        match self.model > 0.0 {
            true => self.both.signum() * (self.truth / self.model).sqrt(),
            false => 0.0,
        }
    }

    fn correlation(&self) -> f64 {
        match self.model > 0.0 {
            true => self.both / (self.model * self.truth).sqrt(),
            false => 0.0,
        }
    }
}

/// An object in the grip.
#[derive(Debug, Clone)]
pub struct Response {
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

impl Response {
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
            slide: Slide::fit(&knocks(setup, along, across)),
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

/// Half sines under which an object is made to give way: peak, m/s², length, s, direction across in units
/// of a sixth of a turn, and share along.
const KNOCKS: [(f64, f64, f64, f64); 10] = [
    (10.0, 0.30, 2.0, 0.0),
    (12.0, 0.15, 0.0, 0.4),
    (16.0, 0.10, 3.5, -0.4),
    (20.0, 0.08, 1.2, 0.0),
    (14.0, 0.20, 4.6, 0.2),
    (30.0, 0.015, 2.3, -0.2),
    (50.0, 0.010, 5.8, 0.4),
    (18.0, 0.12, 2.9, 0.5),
    (40.0, 0.015, 0.4, 0.0),
    (18.0, 0.12, 5.3, -0.6),
];
/// Time from one to the next, s.
const KNOCK_S: f64 = 0.4;
/// Standard gravity, m/s².
const GRAVITY_M_S2: f64 = 9.80665;

/// What the linear answers leave of the residuals under knocks.
fn knocks(setup: &Setup, along: Difference, across: Difference) -> Vec<Across> {
    let mut bench = Bench::holding(setup, setup.scenario.pressure_kpa);
    let plateau = bench.residual_ue();
    let mut filters = [along, across, across].map(Filter::new);
    let mut run: Vec<Across> = Vec::new();
    for (peak_m_s2, length_s, sixth, share) in KNOCKS {
        let angle = TAU * sixth / 6.0;
        let first = run.len();
        for n in 0..(KNOCK_S / STEP_S) as usize {
            let t_s = n as f64 * STEP_S;
            let size = match t_s < length_s {
                true => peak_m_s2 * (0.5 * TAU * t_s / length_s).sin(),
                false => 0.0,
            };
            let flat = size * f64::sqrt(1.0 - share * share);
            let acceleration_m_s2 = [flat * angle.cos(), flat * angle.sin(), share * size];
            bench.step(acceleration_m_s2);
            let now = bench.residual_ue();
            let [x, y, z] = acceleration_m_s2;
            let [along, first, second] = &mut filters;
            let along = along.step(z);
            let linear = spread([first.step(x), second.step(y)]);
            run.push(Across {
                acceleration_m_s2,
                left_ue: std::array::from_fn(|i| now[i] - plateau[i] - along - linear[i]),
                weight: 0.0,
            });
        }
        // Weak knocks count as much as hard ones, down to 2 % of the plateau.
        let knock = &mut run[first..];
        let squares = knock.iter().flat_map(|tick| tick.left_ue).map(|x| x * x);
        let floor = (0.02 * plateau[0]).powi(2);
        let weight = 1.0 / (squares.sum::<f64>() / (FINGERS * knock.len()) as f64 + floor);
        for tick in knock {
            tick.weight = weight;
        }
    }
    run
}

/// What an answer across in x and y is to each finger.
pub fn spread([x, y]: [f64; 2]) -> [f64; FINGERS] {
    directions().map(|[cos, sin]| cos * x + sin * y)
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
    pub fn new(response: &Response) -> Self {
        Self {
            along: Filter::new(response.along),
            across: [response.across; 2].map(Filter::new),
            slider: Slider::new(response.slide),
        }
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

/// Outward directions of the fingers across, x and y.
pub const fn directions() -> [[f64; 2]; FINGERS] {
    // √3 / 2.
    const SIN_60: f64 = 0.866_025_403_784_438_6;
    [[1.0, 0.0], [-0.5, SIN_60], [-0.5, -SIN_60]]
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

/// The fingers, an object and an arm that goes where it is told.
pub struct Bench {
    world: World,
    chain: Chain,
    pressure_kpa: f64,
    position_m: [f64; 3],
    velocity_m_s: [f64; 3],
}

impl Bench {
    /// Open fingers above the object on its fixture.
    fn open(setup: &Setup) -> Self {
        let mut setup = setup.clone();
        // The first finger in the direction of x.
        setup.gripper.hand.first_finger_deg = 0.0;
        let config = world_config(&setup.scenario, &setup.gripper, &setup.chain);
        Self {
            world: World::new(&config, [0.0; 3]),
            chain: setup.chain.clone(),
            pressure_kpa: 0.0,
            position_m: [0.0; 3],
            velocity_m_s: [0.0; 3],
        }
    }

    /// The object held at a pressure and lifted off, at rest.
    pub fn holding(setup: &Setup, pressure_kpa: f64) -> Self {
        let mut bench = Self::open(setup);
        let ticks = |s: f64| (s / STEP_S) as usize;
        for n in 0..ticks(1.0) {
            bench.pressure_kpa = pressure_kpa * (n as f64 / ticks(0.6) as f64).min(1.0);
            bench.step([0.0; 3]);
        }
        for acceleration in [2.0, -2.0] {
            for _ in 0..ticks(0.4) {
                bench.step([0.0, 0.0, acceleration]);
            }
        }
        for _ in 0..ticks(0.4) {
            bench.step([0.0; 3]);
        }
        bench
    }

    /// One step of 1 ms at this acceleration of the palm.
    pub fn step(&mut self, acceleration_m_s2: [f64; 3]) {
        for i in 0..3 {
            self.velocity_m_s[i] += STEP_S * acceleration_m_s2[i];
            self.position_m[i] += STEP_S * self.velocity_m_s[i];
        }
        let torques = self.chain.joint_torques_nm(self.pressure_kpa);
        self.world.step(&[torques; FINGERS], self.position_m);
    }

    /// The acceleration with a weak pull back home, so that noise does not lead the arm away.
    fn confined(&self, home_m: [f64; 3], acceleration_m_s2: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let away_m = self.position_m[i] - home_m[i];
            acceleration_m_s2[i] - 4.0 * self.velocity_m_s[i] - 4.0 * away_m
        })
    }

    /// Residual of each finger in steady air, µε.
    pub fn residual_ue(&self) -> [f64; FINGERS] {
        let free = self.chain.free_strain_ue(self.pressure_kpa);
        let angles = self.world.joint_angles();
        angles.map(|angles| free - self.chain.gauge_strain_ue(&angles))
    }
}

/// Mean residual of a finger while the object is gripped slowly on its fixture; its mass has no share in it.
pub fn closing(setup: &Setup) -> Vec<f64> {
    let mut bench = Bench::open(setup);
    let steps = (setup.chain.max_pressure_kpa() / GRID_KPA) as usize;
    (0..=steps)
        .map(|n| {
            bench.pressure_kpa = n as f64 * GRID_KPA;
            // Slow against the finger's 26 ms: 50 ms for each 2 kPa.
            for _ in 0..50 {
                bench.step([0.0; 3]);
            }
            let sum: f64 = bench.residual_ue().iter().sum();
            // Before the first touch the finger's own weight is no contact.
            (sum / FINGERS as f64).max(0.0)
        })
        .collect()
}

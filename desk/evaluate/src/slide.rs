//! Model of how a held object slides sideways under stops and bumps, fitted to a run with knocks on the
//! simulated gripper.

use std::f64::consts::TAU;

use finger::capability::GRAVITY_M_S2;
use sim::setup::Setup;
use softgrip::FINGERS;

use crate::difference::{Difference, Filter};
use crate::rig::{Rig, STEP_S, spread};

/// Sideways slide of a held object, once its load on the fingers, including its weight, exceeds friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlideModel {
    /// Friction threshold, m/s²: for the vector sum of weight, and acceleration along and across the fingers.
    pub threshold_m_s2: f64,
    /// Restoring rate of the fingers, 1/s.
    pub restoring_per_s: f64,
    /// Share by which the way follows acceleration in a tick.
    pub gain: f64,
    /// Change of a finger's residual per unit of slide towards it, µε per m/s.
    pub shift_ue: f64,
    /// Change of every residual per unit of path length, µε per m/s.
    pub rise_ue: f64,
}

/// State of the sideways slide. Distance counts in m/s: acceleration beyond the threshold, integrated over
/// time.
#[derive(Debug, Clone, Copy)]
pub struct Slider {
    slide: SlideModel,
    lagged: [f64; 3],
    way: [f64; 2],
}

impl Slider {
    /// An object at rest in the middle of the grip.
    pub fn new(slide: SlideModel) -> Self {
        Self {
            slide,
            lagged: [0.0; 3],
            way: [0.0; 2],
        }
    }

    /// Change of the fingers' residuals under this acceleration, µε.
    pub fn step(&mut self, acceleration_m_s2: [f64; 3]) -> [f64; FINGERS] {
        self.advance(acceleration_m_s2);
        let SlideModel {
            shift_ue, rise_ue, ..
        } = self.slide;
        let [x, y] = self.way;
        let rise = rise_ue * (x * x + y * y).sqrt();
        spread([x, y]).map(|way| shift_ue * way + rise)
    }

    /// Change of every residual by the path length of the slide, µε.
    pub fn gave_way_ue(&self) -> f64 {
        let [x, y] = self.way;
        self.slide.rise_ue * (x * x + y * y).sqrt()
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
    /// Acceleration of the palm, m/s².
    acceleration_m_s2: [f64; 3],
    /// Residual of each finger that the linear responses do not explain, µε.
    left_ue: [f64; FINGERS],
    /// Weight of the tick in the fit.
    weight: f64,
}

impl SlideModel {
    /// Thresholds, restorations and lags that are tried.
    const THRESHOLDS_M_S2: std::ops::Range<u32> = 11..36;
    const RESTORING_PER_S: [f64; 6] = [0.0, 2.0, 5.0, 10.0, 20.0, 40.0];
    const GAINS: [f64; 4] = [1.0, 0.2, 0.1, 0.05];

    /// Identifies the slide of the object that a setup holds, given its linear responses.
    pub fn of(setup: &Setup, along: Difference, across: Difference) -> Self {
        Self::fit(&knocks(setup, along, across))
    }

    /// The model with the highest correlation with a run, scaled to it.
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

    /// The model scaled so that its shifts are as large as in the run, and its correlation with the run.
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

/// Weighted correlation of two signals.
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

    /// Factor that gives the model the power of the reference.
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

/// Half-sine knocks for the identification: peak, m/s²; duration, s; direction across in sixths of a turn;
/// fraction along.
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
/// Time between two knocks, s.
const KNOCK_S: f64 = 0.4;

/// Residuals under knocks that the linear responses do not explain.
fn knocks(setup: &Setup, along: Difference, across: Difference) -> Vec<Across> {
    let mut rig = Rig::holding(setup, setup.scenario.pressure_kpa);
    let plateau = rig.residual_ue();
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
            rig.step(acceleration_m_s2);
            let now = rig.residual_ue();
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

//! The activities of which the workload consists, and the random motions of the palm during them.

use std::f64::consts::{SQRT_2, TAU};

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// What the gripper and the arm are doing. False alarms are counted by activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "`Activity::name` says what each is")]
pub enum Activity {
    Closing,
    Rest,
    Move,
    HardStart,
    EmergencyStop,
    Vibration,
    Bump,
    PressureChange,
    Release,
    EmptyClose,
    Creep,
    BadGauge,
}

impl Activity {
    /// Every activity, in the order of the tables.
    pub const ALL: [Self; 12] = [
        Self::Closing,
        Self::Rest,
        Self::Move,
        Self::HardStart,
        Self::EmergencyStop,
        Self::Vibration,
        Self::Bump,
        Self::PressureChange,
        Self::Release,
        Self::EmptyClose,
        Self::Creep,
        Self::BadGauge,
    ];

    /// Name in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Closing => "closing on an object",
            Self::Rest => "holding at rest",
            Self::Move => "moves at 2-10 m/s²",
            Self::HardStart => "starts at 10 m/s²",
            Self::EmergencyStop => "emergency stops, 10-20 m/s²",
            Self::Vibration => "vibration, 5-40 Hz, up to 2 m/s² rms",
            Self::Bump => "bumps, 20-60 m/s² for 5-20 ms",
            Self::PressureChange => "pressure changes while holding",
            Self::Release => "releases",
            Self::EmptyClose => "empty closes",
            Self::Creep => "an hour of creep and drift",
            Self::BadGauge => "one gauge going bad",
        }
    }

    /// Whether it counts as hard motion: moves, hard starts, emergency stops, vibration and bumps.
    pub fn is_hard_motion(self) -> bool {
        matches!(
            self,
            Self::Move | Self::HardStart | Self::EmergencyStop | Self::Vibration | Self::Bump
        )
    }
}

/// Acceleration of the palm over time.
#[derive(Debug, Clone, Copy)]
pub enum PalmMotion {
    /// No acceleration.
    Rest,
    /// Acceleration and deceleration along a line.
    Travel {
        /// Peak acceleration, m/s², in the palm's frame.
        vector: [f64; 3],
        /// Time to rise to it, s.
        ramp_s: f64,
        /// Duration of the acceleration, s, including both ramps.
        push_s: f64,
        /// Time at constant speed before the stop, s.
        cruise_s: f64,
    },
    /// One acceleration pulse, followed by ringing of the arm.
    Pulse {
        /// Peak acceleration, m/s², in the palm's frame.
        vector: [f64; 3],
        /// Duration of the pulse, s.
        length_s: f64,
        /// Frequency of the ringing, Hz.
        ring_hz: f64,
        /// First amplitude of the ringing, as a fraction of the peak.
        ring_share: f64,
    },
    /// Three sines, each along its own line: amplitude, m/s², frequency, Hz, phase.
    Vibration([([f64; 3], f64, f64); 3]),
}

/// Decay time constant of the ringing, s.
const RING_S: f64 = 0.15;

impl PalmMotion {
    /// The acceleration at `t_s` after the start (s), m/s².
    pub fn at(&self, t_s: f64) -> [f64; 3] {
        match *self {
            Self::Rest => [0.0; 3],
            Self::Travel {
                vector,
                ramp_s,
                push_s,
                cruise_s,
            } => {
                // A trapezium up, and the same down.
                let trapezium = |t: f64| (t.min(push_s - t) / ramp_s).clamp(0.0, 1.0);
                let share = trapezium(t_s) - trapezium(t_s - push_s - cruise_s);
                vector.map(|a| share * a)
            }
            Self::Pulse {
                vector,
                length_s,
                ring_hz,
                ring_share,
            } => {
                let share = if t_s < length_s {
                    (0.5 * TAU * t_s / length_s).sin()
                } else {
                    let since = t_s - length_s;
                    -ring_share * (-since / RING_S).exp() * (TAU * ring_hz * since).sin()
                };
                vector.map(|a| share * a)
            }
            Self::Vibration(sines) => {
                let mut sum = [0.0; 3];
                for (vector, hz, phase) in sines {
                    let share = (TAU * hz * t_s + phase).sin();
                    for (sum, a) in sum.iter_mut().zip(vector) {
                        *sum += share * a;
                    }
                }
                sum
            }
        }
    }
}

/// Draws a random motion for an activity, and the time to simulate, s.
pub fn motion(activity: Activity, rng: &mut impl Rng) -> (PalmMotion, f64) {
    let direction = direction(rng);
    let mut between = |low: f64, high: f64| rng.random_range(low..=high);
    let travel = |accel: f64, ramp_s: f64, push_s: f64, cruise_s: f64| PalmMotion::Travel {
        vector: direction.map(|x| accel * x),
        ramp_s,
        push_s: push_s.max(2.0 * ramp_s),
        cruise_s,
    };
    match activity {
        Activity::Move => {
            let (ramp_s, push_s) = (between(0.02, 0.06), between(0.15, 0.5));
            let motion = travel(between(2.0, 10.0), ramp_s, push_s, between(0.0, 0.5));
            (motion, 1.8)
        }
        Activity::HardStart => {
            let (ramp_s, push_s) = (between(0.005, 0.02), between(0.1, 0.3));
            (travel(10.0, ramp_s, push_s, between(0.0, 0.3)), 1.2)
        }
        Activity::EmergencyStop => {
            // The way up to speed is another activity's: only the stop and its ringing.
            let motion = PalmMotion::Pulse {
                vector: direction.map(|x| between(10.0, 20.0) * x),
                length_s: between(0.06, 0.2),
                ring_hz: between(6.0, 20.0),
                ring_share: between(0.1, 0.4),
            };
            (motion, 1.0)
        }
        Activity::Bump => {
            let motion = PalmMotion::Pulse {
                vector: direction.map(|x| between(20.0, 60.0) * x),
                length_s: between(0.005, 0.02),
                ring_hz: between(6.0, 20.0),
                ring_share: between(0.05, 0.2),
            };
            (motion, 0.8)
        }
        Activity::Vibration => {
            // Three sines of rms r/√3 each have an rms of r together.
            let amplitude = SQRT_2 * between(0.5, 2.0) / 3f64.sqrt();
            let sines = std::array::from_fn(|_| {
                let hz = between(5.0, 40.0);
                let phase = between(0.0, TAU);
                let z = between(-1.0, 1.0);
                let (r, angle) = ((1.0 - z * z).sqrt(), between(0.0, TAU));
                let line = [r * angle.cos(), r * angle.sin(), z];
                (line.map(|x| amplitude * x), hz, phase)
            });
            (PalmMotion::Vibration(sines), between(1.0, 5.0))
        }
        _ => (PalmMotion::Rest, between(0.5, 3.0)),
    }
}

/// A unit vector, uniform over the sphere.
fn direction(rng: &mut impl Rng) -> [f64; 3] {
    let z: f64 = rng.random_range(-1.0..=1.0);
    let angle = rng.random_range(0.0..TAU);
    let r = (1.0 - z * z).sqrt();
    [r * angle.cos(), r * angle.sin(), z]
}

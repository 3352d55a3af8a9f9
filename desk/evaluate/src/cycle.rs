//! What a gripper's cycles are made of between two losses: moves, stops, shocks, vibration, new pressures,
//! releases, empty closes, hours of creep and gauges that go bad.

use std::f64::consts::{SQRT_2, TAU};

use rand::{Rng, RngExt};
use serde::Serialize;

/// What happens at a time; the cause of a false alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "`Activity::name` says it in words")]
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
    /// All of them.
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

    /// In words.
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

    /// Whether the arm moves hard.
    pub fn is_hard_motion(self) -> bool {
        matches!(
            self,
            Self::Move | Self::HardStart | Self::EmergencyStop | Self::Vibration | Self::Bump
        )
    }
}

/// Acceleration of the palm over time.
#[derive(Debug, Clone, Copy)]
pub enum Motion {
    /// None.
    Rest,
    /// Speeding up and slowing down again along a line.
    Travel {
        /// Its greatest acceleration, m/s².
        vector: [f64; 3],
        /// Time to rise to it, s.
        ramp_s: f64,
        /// Time for which it lasts, s; rises included.
        push_s: f64,
        /// Time at constant speed before the stop, s.
        cruise_s: f64,
    },
    /// One pulse, then the arm rings.
    Pulse {
        /// Its peak, m/s².
        vector: [f64; 3],
        /// Its length, s.
        length_s: f64,
        /// Frequency of the ringing, Hz.
        ring_hz: f64,
        /// Its first amplitude as a share of the peak.
        ring_share: f64,
    },
    /// Three sines, each along its own line: amplitude, m/s², frequency, Hz, phase.
    Vibration([([f64; 3], f64, f64); 3]),
}

/// The arm's ringing dies with this time constant, s.
const RING_S: f64 = 0.15;

impl Motion {
    /// The acceleration so long after the start, m/s².
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

/// A motion of this kind drawn at random, and how long to watch it, s.
pub fn motion(activity: Activity, rng: &mut impl Rng) -> (Motion, f64) {
    let direction = direction(rng);
    let mut between = |low: f64, high: f64| rng.random_range(low..=high);
    let travel = |accel: f64, ramp_s: f64, push_s: f64, cruise_s: f64| Motion::Travel {
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
            let motion = Motion::Pulse {
                vector: direction.map(|x| between(10.0, 20.0) * x),
                length_s: between(0.06, 0.2),
                ring_hz: between(6.0, 20.0),
                ring_share: between(0.1, 0.4),
            };
            (motion, 1.0)
        }
        Activity::Bump => {
            let motion = Motion::Pulse {
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
            (Motion::Vibration(sines), between(1.0, 5.0))
        }
        _ => (Motion::Rest, between(0.5, 3.0)),
    }
}

/// A direction of the sphere, all alike.
fn direction(rng: &mut impl Rng) -> [f64; 3] {
    let z: f64 = rng.random_range(-1.0..=1.0);
    let angle = rng.random_range(0.0..TAU);
    let r = (1.0 - z * z).sqrt();
    [r * angle.cos(), r * angle.sin(), z]
}

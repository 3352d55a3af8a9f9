//! The controller's view of one tick.

use crate::detect::Loss;
use crate::grasp::State;
use crate::units::{Degrees, FINGERS, Instant, Kilopascals, Microstrain};

/// The controller's view of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Snapshot {
    /// When.
    pub now: Instant,
    /// Where the gripper is.
    pub state: State,
    /// The loss that is latched.
    pub lost: Option<Loss>,
    /// Measured pressure.
    pub pressure: Option<Kilopascals>,
    /// Slew-limited set-point.
    pub setpoint: Kilopascals,
    /// Contact residual of each finger.
    pub residual: [Option<Microstrain>; FINGERS],
    /// Fingers that touch.
    pub touching: [bool; FINGERS],
    /// Estimated bend.
    pub bend: Degrees,
    /// Summed residual over its plateau, smoothed, while holding.
    pub level: Option<f32>,
    /// Lift beyond the payload's load, as a share of it, where the grip was given a payload.
    pub margin: Option<f32>,
    /// Noise of each gauge, rms.
    pub noise: [Microstrain; FINGERS],
    /// How far the zero of each gauge has been tracked since the last tare.
    pub drift: [Microstrain; FINGERS],
    /// A tare is asked for.
    pub tare_due: bool,
}

//! Parameters of the simulated gripper, from `gripper.toml`.

use serde::de::Error;
use serde::{Deserialize, Deserializer};
use softgrip::FINGERS;
use softgrip::frontend::{self, FrontEnd};

use crate::arm::ArmTask;

/// Every parameter that is not in the finger's recipe.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct Gripper {
    pub hand: FingerParameters,
    pub world: EngineParameters,
    pub arm: ArmParameters,
    pub regulator: RegulatorParameters,
    pub gauge: GaugeParameters,
    /// Amplifiers, dividers and scales, which the controller's settings state.
    #[serde(skip)]
    pub front_end: frontend::Settings,
}

/// A value for each finger. Three times one, as gripper.toml has it, stands for any number of fingers.
fn one_each<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; FINGERS], D::Error> {
    let values = Vec::<f64>::deserialize(source)?;
    if values == [1.0; 3] {
        return Ok([1.0; FINGERS]);
    }
    <[f64; FINGERS]>::try_from(values.as_slice())
        .map_err(|_| D::Error::invalid_length(values.len(), &"one value for each finger"))
}

/// Position, silicone and friction of the fingers (`[hand]`).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct FingerParameters {
    pub first_finger_deg: f64,
    #[serde(deserialize_with = "one_each")]
    pub finger_stiffness: [f64; FINGERS],
    pub damping_ms: f64,
    pub inflation_lag_ms: f64,
    pub deflation_lag_ms: f64,
    pub hysteresis_percent: f64,
    pub creep_percent: f64,
    pub creep_time_s: f64,
    pub sliding_friction: f64,
    pub fingers_touch: bool,
}

/// Parameters of the rigid-body engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct EngineParameters {
    pub step_ms: f64,
}

/// Parameters of the arm's moves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct ArmParameters {
    pub approach_mm: f64,
    pub lift_mm: f64,
    pub carry_mm: f64,
    pub jerk_ramp_ms: f64,
    pub dwell_ms: f64,
    pub grip_ms: f64,
    pub release_ms: f64,
}

/// Parameters of pressure regulator, pressure monitor and supply.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct RegulatorParameters {
    pub lag_ms: f64,
    pub slew_kpa_per_s: f64,
    pub gain: f64,
    pub offset_kpa: f64,
    pub monitor_noise_kpa: f64,
    pub supply_v: f64,
}

/// Parameters of strain gauges and converter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "gripper.toml documents each field")]
pub struct GaugeParameters {
    pub creep_percent: f64,
    pub creep_time_s: f64,
    pub scans: u16,
}

impl Gripper {
    /// The gripper of `gripper.toml`.
    pub fn reference() -> Self {
        toml::from_str(include_str!("../gripper.toml")).expect("a test reads this file")
    }

    /// The electronics. What the controller corrects of each gauge is no part of them.
    pub fn front_end(&self) -> FrontEnd {
        FrontEnd::of(&self.front_end, [1.0; FINGERS])
    }

    /// The arm's cycle at an acceleration.
    pub fn arm_task(&self, acceleration_m_s2: f64) -> ArmTask {
        let arm = &self.arm;
        ArmTask {
            acceleration_m_s2,
            jerk_ramp_s: 1e-3 * arm.jerk_ramp_ms,
            approach_m: 1e-3 * arm.approach_mm,
            lift_m: 1e-3 * arm.lift_mm,
            carry_m: 1e-3 * arm.carry_mm,
            dwell_s: 1e-3 * arm.dwell_ms,
            grip_s: 1e-3 * arm.grip_ms,
            release_s: 1e-3 * arm.release_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_is_readable_and_is_the_arms_default() {
        assert_eq!(Gripper::reference().arm_task(5.0), ArmTask::default());
    }
}

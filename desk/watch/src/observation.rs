//! One look at the gripper.

use softgrip::units::FINGERS;

/// What is seen of the gripper at one moment. What a source does not tell, or what is not known, is none.
///
/// [`FIELDS`](crate::fields::FIELDS) is the table of these values: name, unit and meaning of each, and where they stand in
/// recordings, CSV files and registers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Observation {
    /// Time since the gripper's start, s.
    pub t_s: Option<f64>,
    /// Strain of each gauge less its tare, µε.
    pub strain_ue: [Option<f32>; FINGERS],
    /// Measured pressure, kPa.
    pub pressure_kpa: Option<f32>,
    /// Where the pressure is to be now, kPa.
    pub setpoint_kpa: Option<f32>,
    /// What the regulator is told, kPa.
    pub commanded_kpa: Option<f32>,
    /// Place of the state in [`STATES`](crate::fields::STATES).
    pub state: Option<u16>,
    /// Number of the latched fault, 0 for none (`docs/faults.md`).
    pub fault: Option<u16>,
    /// Something is held.
    pub holding: Option<bool>,
    /// A loss is latched.
    pub lost: Option<bool>,
    /// A tare is asked for.
    pub tare_due: Option<bool>,
    /// Estimated bend, °.
    pub bend_deg: Option<f32>,
    /// While something is held: summed contact residual over its plateau.
    pub level: Option<f32>,
    /// While a payload is held: lift beyond its load, as a share of it.
    pub margin: Option<f32>,
    /// Fingers that touch.
    pub touching: [Option<bool>; FINGERS],
    /// Contact residual of each finger, µε.
    pub residual_ue: [Option<f32>; FINGERS],
    /// Noise of each gauge, rms, µε.
    pub noise_ue: [Option<f32>; FINGERS],
    /// How far the zero of each gauge has been tracked since the last tare, µε.
    pub drift_ue: [Option<f32>; FINGERS],
    /// Number of what has failed of each gauge, 0 for nothing (`docs/faults.md`).
    pub gauge_fault: [Option<u16>; FINGERS],
    /// Place of the latched loss's cause in [`CAUSES`](crate::fields::CAUSES).
    pub loss_cause: Option<u16>,
    /// From the onset of the latched loss to its report, ms.
    pub loss_latency_ms: Option<f32>,
    /// How far the residual of each finger had fallen then, as a share of its plateau.
    pub loss_evidence: [Option<f32>; FINGERS],
}

//! Object, arm and grip of one run.

use anyhow::bail;
use serde::Serialize;

/// Shape of the grasped object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectKind {
    /// A solid sphere.
    Sphere,
    /// A solid upright cylinder.
    Cylinder,
}

impl ObjectKind {
    /// Every kind, in the order of tables.
    pub const ALL: [Self; 2] = [Self::Sphere, Self::Cylinder];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
        }
    }
}

impl std::fmt::Display for ObjectKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for ObjectKind {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(kind),
            None => bail!("must be {}", Self::ALL.map(Self::name).join(" or ")),
        }
    }
}

/// Object, arm and grip of one pick-and-place run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scenario {
    /// Shape of the object.
    pub object: ObjectKind,
    /// Mass of the object, kg.
    pub mass_kg: f64,
    /// Greatest acceleration of the arm, m/s².
    pub accel_m_s2: f64,
    /// Pressure that the robot asks for, kPa.
    pub pressure_kpa: f64,
    /// Friction coefficient between finger and object.
    pub friction: f64,
    /// Noise of a gauge reading, rms at the control tick, µε.
    pub noise_ue: f64,
    /// Seed of all noise.
    pub seed: u64,
}

impl Default for Scenario {
    /// The paper's sphere (section 4.2), with the noise of a decent amplifier.
    fn default() -> Self {
        Self {
            object: ObjectKind::Sphere,
            mass_kg: 0.150,
            accel_m_s2: 5.0,
            pressure_kpa: 140.0,
            friction: 0.8,
            noise_ue: 20.0,
            seed: 1,
        }
    }
}

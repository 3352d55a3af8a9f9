//! How the fingers of a gripper stand around its objects, and what they lift.

use crate::capability::{Grip, GripError};
use crate::chain::Chain;
use crate::object::Object;

/// An object on the gripper's axis and where it is gripped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gripped {
    /// Shape and size.
    pub object: Object,
    /// Distance of its centre below the palm, m.
    pub depth_m: f64,
}

/// How the fingers stand around an object: evenly spaced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// How many there are: two to four.
    pub fingers: usize,
    /// Distance of the fingers' clamps from the gripper's axis, m.
    pub palm_radius_m: f64,
    /// Distance of the finger's touching surface from the chain, m.
    pub link_radius_m: f64,
    /// Coefficient of Coulomb friction between finger and object.
    pub friction: f64,
    /// The sphere that the table is for.
    pub sphere: Gripped,
    /// The upright cylinder that the table is for.
    pub cylinder: Gripped,
}

impl Grasp {
    /// These fingers at a pressure, kPa, as statics takes them.
    pub fn grip(&self, finger: &Chain, pressure_kpa: f64) -> Grip {
        Grip {
            fingers: self.fingers,
            link_length_m: finger.link_length_m,
            joint_stiffness_nm_per_rad: finger.joint_stiffness_nm_per_rad,
            free_angle_rad: finger.joint_angles_rad(pressure_kpa),
            palm_radius_m: self.palm_radius_m,
            link_radius_m: self.link_radius_m,
            friction: self.friction,
        }
    }

    /// Pressure at which the tips of the free fingers meet on the gripper's axis, kPa: `n` round links touch
    /// one another with their centres `ρ/sin(π/n)` away from it. None if they do not.
    pub fn meeting_kpa(&self, finger: &Chain) -> Option<f64> {
        let apart_rad = std::f64::consts::PI / self.fingers as f64;
        let reach_m = self.palm_radius_m - self.link_radius_m / apart_rad.sin();
        let meets = |kpa: f64| finger.tip_position_m(kpa)[1] >= reach_m;
        let (mut low, mut high) = (0.0, finger.max_pressure_kpa());
        if !meets(high) {
            return None;
        }
        // To a millionth of the range.
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            match meets(middle) {
                true => high = middle,
                false => low = middle,
            }
        }
        Some(high)
    }

    /// Greatest force of all fingers against gravity on an object at a pressure, kPa, in N
    /// ([`Grip::strongest`]); none where fingers and object find no equilibrium.
    ///
    /// # Errors
    /// [`GripError`], if a dimension is wrong or the object does not fit between the open fingers.
    pub fn lift_n(
        &self,
        gripped: Gripped,
        finger: &Chain,
        pressure_kpa: f64,
    ) -> Result<Option<f64>, GripError> {
        let grip = self.grip(finger, pressure_kpa);
        match grip.strongest(gripped.object, gripped.depth_m) {
            Ok(hold) => Ok(Some(hold.lift_n)),
            Err(GripError::NoEquilibrium { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

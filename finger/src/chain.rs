//! The finger as rigid links joined by torsional springs (paper, section 4.1).

use crate::capability::{Grip, GripError, Object};
use crate::cubic::MonotoneCubic;

/// Links, and joints, of the equivalent chain.
pub const LINKS: usize = 6;

/// Where the strain gauge is bonded, along the undeformed finger from the clamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// Start of the bonded span, m.
    pub from_m: f64,
    /// End of the bonded span, m.
    pub to_m: f64,
    /// Distance of the grid from the neutral axis, m.
    pub distance_m: f64,
}

/// An object and where it is gripped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gripped {
    /// Shape and size.
    pub object: Object,
    /// Distance of its centre below the palm, m.
    pub depth_m: f64,
}

/// How three fingers stand around an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Distance of the fingers' clamps from the gripper's axis, m.
    pub palm_radius_m: f64,
    /// Distance of the touching surface from the chain, m.
    pub link_radius_m: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// The sphere that the table is for.
    pub sphere: Gripped,
    /// The upright cylinder that the table is for.
    pub cylinder: Gripped,
}

/// Six links in a row. Joint `i` stands at the near end of link `i`; joint 0 is the clamp.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Link lengths, m.
    pub link_length_m: [f64; LINKS],
    /// Link masses, kg.
    pub link_mass_kg: [f64; LINKS],
    /// Length inside the clamp that bends with the first joint, m; the gauge does not see it.
    pub root_free_length_m: f64,
    /// Torsional stiffness of each joint, N·m/rad (eq. 24).
    pub joint_stiffness_nm_per_rad: [f64; LINKS],
    /// Torque of each joint, N·m, against pressure in kPa.
    pub joint_torque_nm: [MonotoneCubic; LINKS],
    /// The strain gauge.
    pub gauge: Gauge,
}

impl Chain {
    /// The highest pressure that the model describes, kPa.
    pub fn max_pressure_kpa(&self) -> f64 {
        self.joint_torque_nm[0].end()
    }

    /// Joint torques at a pressure, N·m.
    pub fn joint_torques_nm(&self, pressure_kpa: f64) -> [f64; LINKS] {
        std::array::from_fn(|i| self.joint_torque_nm[i].at(pressure_kpa))
    }

    /// Joint angles of the free finger, rad: `φ = T/k` (eq. 24).
    pub fn joint_angles_rad(&self, pressure_kpa: f64) -> [f64; LINKS] {
        let torque = self.joint_torques_nm(pressure_kpa);
        std::array::from_fn(|i| torque[i] / self.joint_stiffness_nm_per_rad[i])
    }

    /// Angle of each link to the unbent finger, rad: `Φ_i = Σ φ_j, j ≤ i` (eq. 22, corrected).
    pub fn link_angles_rad(&self, pressure_kpa: f64) -> [f64; LINKS] {
        let mut sum = 0.0;
        self.joint_angles_rad(pressure_kpa).map(|angle| {
            sum += angle;
            sum
        })
    }

    /// Angle of the last link, rad.
    pub fn tip_angle_rad(&self, pressure_kpa: f64) -> f64 {
        self.joint_angles_rad(pressure_kpa).iter().sum()
    }

    /// Tip of the free finger, m: along the unbent finger, and towards the inside of the bend.
    pub fn tip_position_m(&self, pressure_kpa: f64) -> [f64; 2] {
        let angles = self.link_angles_rad(pressure_kpa);
        let mut tip = [0.0; 2];
        for (length, angle) in self.link_length_m.iter().zip(angles) {
            tip[0] += length * angle.cos();
            tip[1] += length * angle.sin();
        }
        tip
    }

    /// Gauge strain of the free finger, µε.
    pub fn free_strain_ue(&self, pressure_kpa: f64) -> f64 {
        self.gauge_strain_ue(&self.joint_angles_rad(pressure_kpa))
    }

    /// Gauge strain of any configuration, µε: `ε = y κ` with κ the mean curvature of the bonded span.
    pub fn gauge_strain_ue(&self, joint_angles_rad: &[f64; LINKS]) -> f64 {
        let share = self.gauge_share();
        let bend: f64 = (0..LINKS).map(|i| share[i] * joint_angles_rad[i]).sum();
        1e6 * self.gauge.distance_m * bend / (self.gauge.to_m - self.gauge.from_m)
    }

    /// The part of each joint's angle that the gauge sees: a joint stands for the curvature between
    /// the middles of its two links, the first one from the root, the last one up to the tip.
    pub fn gauge_share(&self) -> [f64; LINKS] {
        let mut middle = -self.root_free_length_m;
        let mut joint = 0.0;
        std::array::from_fn(|i| {
            let from = middle;
            let length = self.link_length_m[i];
            middle = joint + length / 2.0;
            joint += length;
            let to = if i == LINKS - 1 { joint } else { middle };
            let overlap = to.min(self.gauge.to_m) - from.max(self.gauge.from_m);
            overlap.max(0.0) / (to - from)
        })
    }
}

impl Grasp {
    /// Three fingers at a pressure.
    pub fn grip(&self, finger: &Chain, pressure_kpa: f64) -> Grip {
        Grip {
            link_length_m: finger.link_length_m,
            joint_stiffness_nm_per_rad: finger.joint_stiffness_nm_per_rad,
            free_angle_rad: finger.joint_angles_rad(pressure_kpa),
            palm_radius_m: self.palm_radius_m,
            link_radius_m: self.link_radius_m,
            friction: self.friction,
        }
    }

    /// Greatest force of three fingers against gravity on an object, N; none where fingers and object
    /// find no equilibrium.
    ///
    /// # Errors
    /// [`GripError`], if a dimension is wrong.
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

//! The finger as rigid links joined by torsional springs (paper, section 4.1).

pub use softgrip_table::LINKS;

use crate::cubic::MonotoneCubic;

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

/// Six links in a row. Joint `i` stands at the near end of link `i`; joint 0 is the clamp.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Length of each link, m.
    pub link_length_m: [f64; LINKS],
    /// Mass of each link, kg (table 1).
    pub link_mass_kg: [f64; LINKS],
    /// Length inside the clamp that bends with the first joint, m; the gauge does not see it.
    pub root_free_length_m: f64,
    /// Torsional stiffness `k_i` of each joint, N·m/rad (eq. 24, table 2).
    pub joint_stiffness_nm_per_rad: [f64; LINKS],
    /// Torque `T_i` that the pressure exerts at each joint, N·m, over pressure in kPa (table 3).
    pub joint_torque_nm: [MonotoneCubic; LINKS],
    /// Where the strain gauge is bonded.
    pub gauge: Gauge,
}

impl Chain {
    /// The highest pressure that the model describes, kPa.
    pub fn max_pressure_kpa(&self) -> f64 {
        self.joint_torque_nm[0].end()
    }

    /// Torque `T_i` that a pressure, kPa, exerts at each joint, N·m; beyond the model's highest pressure the
    /// torque there.
    pub fn joint_torques_nm(&self, pressure_kpa: f64) -> [f64; LINKS] {
        std::array::from_fn(|i| self.joint_torque_nm[i].at(pressure_kpa))
    }

    /// Angle `φ_i = T_i/k_i` of each joint of the free finger, rad (eq. 24).
    pub fn joint_angles_rad(&self, pressure_kpa: f64) -> [f64; LINKS] {
        let torque = self.joint_torques_nm(pressure_kpa);
        std::array::from_fn(|i| torque[i] / self.joint_stiffness_nm_per_rad[i])
    }

    /// Angle of each link of the free finger to the unbent one, rad: `Φ_i = Σ φ_j, j ≤ i` (eq. 22,
    /// corrected).
    pub fn link_angles_rad(&self, pressure_kpa: f64) -> [f64; LINKS] {
        let mut sum = 0.0;
        self.joint_angles_rad(pressure_kpa).map(|angle| {
            sum += angle;
            sum
        })
    }

    /// Angle of the free finger's last link to the unbent finger, rad.
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

    /// Gauge strain, µε, of a finger whose joints are at these angles, rad: `ε = y κ` with `y` the gauge's
    /// distance from the neutral axis and `κ` the mean curvature of the bonded span.
    pub fn gauge_strain_ue(&self, joint_angles_rad: &[f64; LINKS]) -> f64 {
        let share = self.gauge_share();
        let bend: f64 = (0..LINKS).map(|i| share[i] * joint_angles_rad[i]).sum();
        1e6 * self.gauge.distance_m * bend / (self.gauge.to_m - self.gauge.from_m)
    }

    /// The share, 0 to 1, of each joint's angle that the gauge sees: a joint stands for the curvature between
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

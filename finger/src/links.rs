//! The finger as equivalent links: tangents of the centreline at the links' mid-points (eqs. 17–23).
//!
//! The paper walks back from the tip to find the mid-points on the curve; along the arc they are simply
//! half a link beyond each joint. Its eq. 20 takes an arctangent that cannot pass 90°, and eqs. 22–23 sum
//! link angles where joint angles belong; here `Φ_i = θ(s_i)`, `φ_i = Φ_i − Φ_{i−1}`.

use crate::chain::LINKS;
use crate::curve::Curve;

/// Arc length of each link's mid-point, m from the clamp.
pub fn midpoints_m(link_length_m: &[f64; LINKS]) -> [f64; LINKS] {
    let mut joint = 0.0;
    link_length_m.map(|length| {
        joint += length;
        joint - length / 2.0
    })
}

/// Angle `Φ_i` of each link to the unbent finger, rad.
pub fn link_angles_rad(curve: &Curve, link_length_m: &[f64; LINKS]) -> [f64; LINKS] {
    midpoints_m(link_length_m).map(|s| curve.angle_at(s))
}

/// Angle `φ_i` of each joint, rad.
pub fn joint_angles_rad(link_angle_rad: &[f64; LINKS]) -> [f64; LINKS] {
    let mut before = 0.0;
    link_angle_rad.map(|angle| angle - std::mem::replace(&mut before, angle))
}

/// Both ends of every link, the clamp first, m: along the unbent finger and towards the inside of the bend.
pub fn joints_m(
    link_length_m: &[f64; LINKS],
    link_angle_rad: &[f64; LINKS],
) -> [[f64; 2]; LINKS + 1] {
    let mut joints = [[0.0; 2]; LINKS + 1];
    for i in 0..LINKS {
        let (sin, cos) = link_angle_rad[i].sin_cos();
        let [x, y] = joints[i];
        joints[i + 1] = [x + link_length_m[i] * cos, y + link_length_m[i] * sin];
    }
    joints
}

//! The finger as equivalent links: tangents of the centreline at the links' mid-points (eqs. 17–23).
//!
//! The paper walks back from the tip to find the mid-points on the curve; along the arc they are simply
//! half a link beyond each joint. Its eq. 20 takes an arctangent that cannot pass 90°, and eqs. 22–23 sum
//! link angles where joint angles belong; here `Φ_i = θ(s_i)`, `φ_i = Φ_i − Φ_{i−1}`.

use softgrip_table::LINKS;

use crate::curve::Curve;

/// Arc length of each link's mid-point, m from the clamp, from the links' lengths, m.
pub fn midpoints_m(link_length_m: &[f64; LINKS]) -> [f64; LINKS] {
    let mut joint = 0.0;
    link_length_m.map(|length| {
        joint += length;
        joint - length / 2.0
    })
}

/// Angle `Φ_i = θ(s_i)` of each link to the unbent finger, rad: that of the curve at the link's mid-point
/// (eqs. 17–21, corrected).
pub fn link_angles_rad(curve: &Curve, link_length_m: &[f64; LINKS]) -> [f64; LINKS] {
    midpoints_m(link_length_m).map(|s| curve.angle_at(s))
}

/// Angle `φ_i = Φ_i − Φ_{i−1}` of each joint, rad, from the links' angles (eqs. 22 and 23, corrected).
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve;
    use proptest::prelude::*;

    const LENGTHS_M: [f64; LINKS] = [0.018, 0.018, 0.018, 0.018, 0.018, 0.010];

    proptest! {
        #[test]
        fn the_chain_follows_the_curve(tip_angle in -2.0f64..2.0) {
            let length: f64 = LENGTHS_M.iter().sum();
            let curvature = tip_angle / length;
            let curve = Curve::from_curvature(curve::grid(&[length]), 0.0, |_| curvature);
            let link = link_angles_rad(&curve, &LENGTHS_M);
            for (angle, s) in link.iter().zip(midpoints_m(&LENGTHS_M)) {
                prop_assert!((angle - curvature * s).abs() < 1e-9);
            }
            let sum: f64 = joint_angles_rad(&link).iter().sum();
            prop_assert!((sum - link[LINKS - 1]).abs() < 1e-12);
            let [x, y] = joints_m(&LENGTHS_M, &link)[LINKS];
            let tip = curve.tip_m();
            prop_assert!((x - tip[0]).hypot(y - tip[1]) < 0.006 * length);
        }
    }
}

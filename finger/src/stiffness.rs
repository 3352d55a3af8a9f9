//! Torsional stiffness of the equivalent joints by virtual loading (eqs. 24–29).
//!
//! A force across the tip bends the finger into an elastica; the chain must take the same link angles
//! under the same force, so each joint's stiffness is its torque over its angle, `k_i = T_i / φ_i`. The
//! force's lever is `x_tip − x`, not `l` (eq. 25). The links' weights of eq. 28 (which counts one distal
//! mass where all of them hang) are left out on both sides: they would have to bend the elastica too, and
//! in a linear joint they cancel.

use softgrip_table::LINKS;

use crate::curve::{Curve, CurveError};
use crate::links;

/// The force of table 2, N.
pub const VIRTUAL_FORCE_N: f64 = 0.25;

/// Stiffness of each joint, N·m/rad, of a finger of bending stiffness `EI(s)`, N·m², under a virtual
/// force. `arc_m` is the grid from clamp to tip (see [`crate::curve::grid`]).
///
/// # Errors
/// [`CurveError`] if the bending stiffness is not positive or the force too large.
pub fn virtual_loading(
    arc_m: Vec<f64>,
    link_length_m: &[f64; LINKS],
    force_n: f64,
    stiffness_nm2: impl Fn(f64) -> f64,
) -> Result<[f64; LINKS], CurveError> {
    // Without a force there is neither torque nor angle to divide.
    if force_n.is_nan() || force_n <= 0.0 {
        return Err(CurveError::Force { force_n });
    }
    let curve = Curve::under_tip_force(arc_m, force_n, stiffness_nm2)?;
    let link_angle = links::link_angles_rad(&curve, link_length_m);
    let joint_angle = links::joint_angles_rad(&link_angle);
    let joints = links::joints_m(link_length_m, &link_angle);
    let tip = joints[LINKS][0];
    Ok(std::array::from_fn(|i| {
        force_n * (tip - joints[i][0]) / joint_angle[i]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve;

    const LENGTHS_M: [f64; LINKS] = [0.018, 0.018, 0.018, 0.018, 0.018, 0.010];

    #[test]
    fn a_small_force_gives_the_beam_s_stiffness_over_each_span() {
        let stiffness = 2e-3;
        let grid = curve::grid(&[0.1]);
        let joints = virtual_loading(grid.clone(), &LENGTHS_M, 1e-3, |_| stiffness).expect("small");
        // The first joint stands for half a link, the others for a whole one.
        assert!((joints[1] / (stiffness / 0.018) - 1.0).abs() < 0.01);
        assert!((joints[0] / (stiffness / 0.009) - 1.0).abs() < 0.06);
        // What the force is hardly matters: torque and angle shrink together.
        let strong = virtual_loading(grid.clone(), &LENGTHS_M, VIRTUAL_FORCE_N, |_| stiffness);
        for (small, strong) in joints.iter().zip(strong.expect("moderate")) {
            assert!((small / strong - 1.0).abs() < 0.02);
        }
        assert!(virtual_loading(grid.clone(), &LENGTHS_M, 0.25, |_| 0.0).is_err());
        assert!(virtual_loading(grid, &LENGTHS_M, 0.0, |_| stiffness).is_err());
    }
}

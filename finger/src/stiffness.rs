//! Torsional stiffness of the equivalent joints by virtual loading (eqs. 24–29).
//!
//! A force across the tip bends the finger into an elastica; the chain must take the same link angles
//! under the same force, so each joint's stiffness is its torque over its angle, `k_i = T_i / φ_i`. The
//! force's lever is `x_tip − x`, not `l` (eq. 25). The links' weights of eq. 28 (which counts one distal
//! mass where all of them hang) are left out on both sides: they would have to bend the elastica too, and
//! in a linear joint they cancel.

use crate::chain::LINKS;
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
    let curve = Curve::under_tip_force(arc_m, force_n, stiffness_nm2)?;
    let link_angle = links::link_angles_rad(&curve, link_length_m);
    let joint_angle = links::joint_angles_rad(&link_angle);
    let joints = links::joints_m(link_length_m, &link_angle);
    let tip = joints[LINKS][0];
    Ok(std::array::from_fn(|i| {
        force_n * (tip - joints[i][0]) / joint_angle[i]
    }))
}

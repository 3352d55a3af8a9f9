//! The finger's centreline as arc-length curvature.
//!
//! Replaces eqs. 5–16: with the arc length `s` as the variable, `θ'(s) = κ(s)` needs neither the unknown
//! shortening `Δ` nor trial and error, and nothing happens at 90°. The clamp is at `s = 0`, where the
//! slope vanishes (the paper prints `x = L − Δ`).

/// A bent centreline in its plane: `x` along the unbent finger, `y` towards the inside of the bend.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Arc lengths from the clamp, m.
    pub arc_m: Vec<f64>,
    /// Angle `θ` to the unbent finger at each of them, rad.
    pub angle_rad: Vec<f64>,
    /// Position at each of them, m.
    pub position_m: Vec<[f64; 2]>,
}

/// Why a tip force gives no shape.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The bending stiffness is not a positive number.
    #[error("bending stiffness {stiffness_nm2} N·m² at s = {arc_m} m: must be positive")]
    Stiffness {
        /// Where, m from the clamp.
        arc_m: f64,
        /// The bending stiffness, N·m².
        stiffness_nm2: f64,
    },
    /// The force is not a number, or so large that the shape cannot be followed.
    #[error("a tip force of {force_n} N gives no shape that can be followed")]
    Force {
        /// The force asked for, N.
        force_n: f64,
    },
}

/// Arc lengths from 0 through all of `breaks_m` (rising), no more than half a millimetre apart: shapes
/// are then exact to 1e-5 of the length.
pub fn grid(breaks_m: &[f64]) -> Vec<f64> {
    let mut arc = vec![0.0];
    let mut from = 0.0;
    for &to in breaks_m {
        let n = ((to - from) / 0.5e-3).ceil().max(0.0) as usize;
        arc.extend((1..=n).map(|i| from + (to - from) * i as f64 / n as f64));
        from = to;
    }
    arc
}

impl Curve {
    /// Integrates `θ'(s) = κ(s)` over the grid `arc_m`, m, from the angle at the clamp, rad. The curvature,
    /// rad/m, may jump at points of the grid: it is only asked for between them.
    pub fn from_curvature(
        arc_m: Vec<f64>,
        clamp_angle_rad: f64,
        curvature: impl Fn(f64) -> f64,
    ) -> Self {
        Self::integrate(arc_m, clamp_angle_rad, |s, _| curvature(s))
    }

    /// The elastica of a cantilever under a force across its unbent direction at the tip, `force_n` in N,
    /// with the bending stiffness `EI(s)`, N·m², of the material point `s` (not of the place `x`):
    /// `EI θ' = F (x_tip − x)`, eq. 25 corrected.
    ///
    /// # Errors
    /// [`CurveError`] if the stiffness is not positive or the force too large to follow.
    pub fn under_tip_force(
        arc_m: Vec<f64>,
        force_n: f64,
        stiffness_nm2: impl Fn(f64) -> f64,
    ) -> Result<Self, CurveError> {
        for pair in arc_m.windows(2) {
            let arc_m = (pair[0] + pair[1]) / 2.0;
            let stiffness_nm2 = stiffness_nm2(arc_m);
            if stiffness_nm2.is_nan() || stiffness_nm2 <= 0.0 {
                return Err(CurveError::Stiffness {
                    arc_m,
                    stiffness_nm2,
                });
            }
        }
        let with_tip_at = |x: f64| {
            Self::integrate(arc_m.clone(), 0.0, |s, position| {
                force_n * (x - position[0]) / stiffness_nm2(s)
            })
        };
        // The further the tip is assumed to reach, the more the finger bends and the less it reaches:
        // the difference has one zero, between the clamp and the unbent length.
        let (mut near, mut far) = (0.0, arc_m.last().copied().unwrap_or(0.0));
        let tolerance = 1e-9 * far;
        while far - near > tolerance {
            let middle = (near + far) / 2.0;
            if with_tip_at(middle).tip_m()[0] > middle {
                near = middle;
            } else {
                far = middle;
            }
        }
        let curve = with_tip_at(far);
        if (curve.tip_m()[0] - far).abs() < 1e3 * tolerance {
            Ok(curve)
        } else {
            Err(CurveError::Force { force_n })
        }
    }

    /// Midpoint rule for the angle, Simpson's for the position.
    fn integrate(
        arc_m: Vec<f64>,
        clamp_angle: f64,
        curvature: impl Fn(f64, [f64; 2]) -> f64,
    ) -> Self {
        let (mut angle, mut position) = (clamp_angle, [0.0; 2]);
        let mut angle_rad = vec![angle];
        let mut position_m = vec![position];
        for pair in arc_m.windows(2) {
            let h = pair[1] - pair[0];
            let ahead = |share: f64| {
                let (sin, cos) = angle.sin_cos();
                [position[0] + share * h * cos, position[1] + share * h * sin]
            };
            let quarter = curvature(pair[0] + h / 4.0, ahead(0.25));
            let middle = angle + quarter * h / 2.0;
            let end = angle + curvature(pair[0] + h / 2.0, ahead(0.5)) * h;
            position[0] += h / 6.0 * (angle.cos() + 4.0 * middle.cos() + end.cos());
            position[1] += h / 6.0 * (angle.sin() + 4.0 * middle.sin() + end.sin());
            angle = end;
            angle_rad.push(angle);
            position_m.push(position);
        }
        Self {
            arc_m,
            angle_rad,
            position_m,
        }
    }

    /// Angle `θ` at arc length `s`, m, in rad: linear between the points of the grid, constant outside the finger.
    pub fn angle_at(&self, s: f64) -> f64 {
        let last = self.arc_m.len() - 1;
        let i = self
            .arc_m
            .partition_point(|&arc| arc <= s)
            .clamp(1, last.max(1))
            - 1;
        if i >= last {
            return self.angle_rad[last];
        }
        let t = ((s - self.arc_m[i]) / (self.arc_m[i + 1] - self.arc_m[i])).clamp(0.0, 1.0);
        self.angle_rad[i] + t * (self.angle_rad[i + 1] - self.angle_rad[i])
    }

    /// Position of the tip, m: along the unbent finger and towards the inside of the bend.
    pub fn tip_m(&self) -> [f64; 2] {
        self.position_m[self.position_m.len() - 1]
    }

    /// Angle of the tip to the unbent finger, rad.
    pub fn tip_angle_rad(&self) -> f64 {
        self.angle_rad[self.angle_rad.len() - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn constant_curvature_is_a_circle(curvature in -60.0f64..60.0, length in 0.02f64..0.2) {
            let curve = Curve::from_curvature(grid(&[length]), 0.0, |_| curvature);
            let angle = curvature * length;
            prop_assert!((curve.tip_angle_rad() - angle).abs() < 1e-12);
            let [x, y] = curve.tip_m();
            let (sin, versed) = (angle.sin(), 1.0 - angle.cos());
            prop_assert!((x * curvature - sin).abs() < 1e-9);
            prop_assert!((y * curvature - versed).abs() < 1e-9);
        }
    }

    #[test]
    fn a_tip_force_bends_a_cantilever_as_the_elastica_says() {
        let (length, stiffness) = (0.1, 2e-3);
        let bend = |force| {
            Curve::under_tip_force(grid(&[length]), force, |_| stiffness).expect("moderate")
        };
        // A small force: F L³ / 3 EI.
        let small = 1e-4;
        let linear = small * length.powi(3) / (3.0 * stiffness);
        assert!((bend(small).tip_m()[1] / linear - 1.0).abs() < 1e-4);
        // F L² / EI = 1, 2 and 10: the exact deflections per length (Mattiasson, 1981).
        for (load, down, along) in [
            (1.0, 0.30172, 0.94357),
            (2.0, 0.49346, 0.83936),
            (10.0, 0.81061, 0.44500),
        ] {
            let [x, y] = bend(load * stiffness / length.powi(2)).tip_m();
            assert!((y / length - down).abs() < 1e-4, "{}", y / length);
            assert!((x / length - along).abs() < 1e-4, "{}", x / length);
        }
    }

    #[test]
    fn a_bad_stiffness_is_named() {
        let bent = Curve::under_tip_force(grid(&[0.1]), 0.25, |s| 1e-3 - 0.02 * s);
        assert!(
            matches!(bent, Err(CurveError::Stiffness { .. })),
            "{bent:?}"
        );
    }
}

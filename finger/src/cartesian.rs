//! The paper's own large-deflection beam over the coordinate `x` (eqs. 1–16), for comparison only.
//!
//! Its moment is proportional to pressure, its second moment a function of the place `x` where it should
//! be of the material point, and its slope `y' = G/√(1 − G²)` is singular at 90°, which Table 3 passes.
//! [`crate::curve`] and [`crate::yeoh`] have none of these limits. Two slips are corrected: the slope
//! vanishes at the clamp `x = 0` (eqs. 9–12 put it at the tip), and in eq. 4 the bore's radius stands
//! where a diameter would make the force four times too large.

use std::f64::consts::PI;

use crate::geometry::Geometry;

/// Parts into which the beam is cut along `x`.
const PARTS: usize = 1000;

/// A beam bent by a moment, as the paper describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct CartesianShape {
    /// How far the tip draws back along `x`, `Δ`, m.
    pub shortening_m: f64,
    /// Points of the beam from clamp to tip, m.
    pub position_m: Vec<[f64; 2]>,
    /// Angle of the tip, rad.
    pub tip_angle_rad: f64,
}

/// Why the formulation gives no shape.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CartesianError {
    /// Eqs. 12 and 15 are singular there; no `Δ` gives the beam its length.
    #[error(
        "the beam stands at 90° to the clamp {:.1} mm along it and the formulation over x ends there",
        1e3 * arc_m
    )]
    Vertical {
        /// Arc length that it reaches, m.
        arc_m: f64,
    },
    /// Length, stiffness or moment is out of range.
    #[error("{name} = {value}: must be finite and {expected}")]
    Input {
        /// Which one, as messages call it.
        name: &'static str,
        /// Its value: m, N·m or N·m².
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
}

/// The bending moment of eqs. 2–4, N·m: mean eccentricity times pressure times the mean bore's area, from
/// the bore's offsets and radii at both ends, m.
pub fn pressure_moment_nm(pressure_pa: f64, offset_m: [f64; 2], bore_radius_m: [f64; 2]) -> f64 {
    let mean = |ends: [f64; 2]| (ends[0] + ends[1]) / 2.0;
    mean(offset_m) * pressure_pa * PI * mean(bore_radius_m).powi(2)
}

/// The paper's shape of a finger at a pressure, kPa.
///
/// # Errors
/// [`CartesianError::Vertical`] from the pressure on at which the tip would reach 90°.
pub fn paper_shape(
    geometry: &Geometry,
    pressure_kpa: f64,
) -> Result<CartesianShape, CartesianError> {
    let ends = [0.0, geometry.bore_end_m].map(|s| geometry.section(s));
    let moment = pressure_moment_nm(
        1e3 * pressure_kpa,
        ends.map(|section| section.bore_offset_m),
        ends.map(|section| section.bore_radius_m),
    );
    shape(geometry.length_m(), moment, |x| {
        geometry.bending_stiffness_nm2(x)
    })
}

/// The shape of a cantilever of `length_m` and bending stiffness `EI(x)`, N·m², under a moment, N·m, found
/// by trial of `Δ` until eq. 15 returns the length.
///
/// # Errors
/// [`CartesianError`], if the beam would reach 90° or an input is out of range.
pub fn shape(
    length_m: f64,
    moment_nm: f64,
    stiffness_nm2: impl Fn(f64) -> f64,
) -> Result<CartesianShape, CartesianError> {
    let input = |name, value: f64, ok: bool, expected| {
        if value.is_finite() && ok {
            Ok(())
        } else {
            Err(CartesianError::Input {
                name,
                value,
                expected,
            })
        }
    };
    input("length", length_m, length_m > 0.0, "positive")?;
    input("moment", moment_nm, moment_nm >= 0.0, "not negative")?;
    for k in 0..PARTS {
        let stiffness = stiffness_nm2(length_m * (k as f64 + 0.5) / PARTS as f64);
        input("bending stiffness", stiffness, stiffness > 0.0, "positive")?;
    }
    let curvature = |x: f64| moment_nm / stiffness_nm2(x);
    // The arc length grows with the span, so bisection is trial and error that cannot miss.
    let (mut short, mut long) = (0.0, length_m);
    if arc(long, curvature).is_some_and(|arc| arc <= length_m) {
        short = long;
    }
    while long - short > f64::EPSILON * length_m {
        let span = (short + long) / 2.0;
        if span <= short || span >= long {
            break;
        }
        if arc(span, curvature).is_some_and(|arc| arc <= length_m) {
            short = span;
        } else {
            long = span;
        }
    }
    let arc_m = arc(short, curvature).unwrap_or(0.0);
    // Next to 90° the arc grows with the root of the span: the last bit of the span is 1e-7 of the arc.
    if (length_m - arc_m).abs() > 1e-6 * length_m {
        return Err(CartesianError::Vertical { arc_m });
    }
    let mut position_m = vec![[0.0; 2]];
    let mut y = 0.0;
    let mut sine = 0.0;
    for part in parts(short, curvature) {
        sine = part.sine[1];
        y += part.rise();
        position_m.push([part.x + part.width, y]);
    }
    Ok(CartesianShape {
        shortening_m: length_m - short,
        position_m,
        tip_angle_rad: sine.asin(),
    })
}

/// A part of the beam of even curvature `dG/dx`.
struct Part {
    x: f64,
    width: f64,
    curvature: f64,
    /// `G = sin θ` at both ends (eq. 9).
    sine: [f64; 2],
}

impl Part {
    /// Arc length, `∫ dx/√(1 − G²)` (eq. 15).
    fn arc(&self) -> f64 {
        let [from, to] = self.sine;
        if to > from {
            (to.asin() - from.asin()) / self.curvature
        } else {
            self.width / (1.0 - from * from).sqrt()
        }
    }

    /// Deflection, `∫ G/√(1 − G²) dx` (eq. 16).
    fn rise(&self) -> f64 {
        let cosine = self.sine.map(|sine| (1.0 - sine * sine).sqrt());
        (self.sine[0] + self.sine[1]) * self.width / (cosine[0] + cosine[1])
    }
}

fn parts(span: f64, curvature: impl Fn(f64) -> f64) -> impl Iterator<Item = Part> {
    let width = span / PARTS as f64;
    (0..PARTS).scan(0.0, move |sine, k| {
        let x = width * k as f64;
        let curvature = curvature(x + width / 2.0);
        let from = *sine;
        *sine += curvature * width;
        Some(Part {
            x,
            width,
            curvature,
            sine: [from, *sine],
        })
    })
}

/// Arc length over a span of `x`, or `None` if the beam reaches 90° on the way.
fn arc(span: f64, curvature: impl Fn(f64) -> f64) -> Option<f64> {
    parts(span, curvature)
        .map(|part| (part.sine[1] < 1.0).then(|| part.arc()))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{self, Curve};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn below_a_right_angle_it_agrees_with_the_arc_length(angle in 0.0f64..1.55) {
            let (length, stiffness) = (0.09, 2e-3);
            let bent = shape(length, angle / length * stiffness, |_| stiffness).expect("below 90°");
            let curve = Curve::from_curvature(curve::grid(&[length]), 0.0, |_| angle / length);
            prop_assert!((bent.tip_angle_rad - angle).abs() < 1e-4);
            let [x, y] = bent.position_m[PARTS];
            prop_assert!((x - curve.tip_m()[0]).abs() < 1e-5 * length);
            prop_assert!((y - curve.tip_m()[1]).abs() < 1e-5 * length);
            prop_assert!((bent.shortening_m - (length - x)).abs() < 1e-12);
        }

        #[test]
        fn from_a_right_angle_on_it_fails_and_says_where(angle in 1.58f64..6.0) {
            let (length, stiffness) = (0.09, 2e-3);
            let error = shape(length, angle / length * stiffness, |_| stiffness);
            let error = error.expect_err("beyond 90°");
            let CartesianError::Vertical { arc_m } = error else {
                panic!("{error}");
            };
            prop_assert!((arc_m * angle / length - PI / 2.0).abs() < 1e-4);
        }
    }

    #[test]
    fn bad_inputs_are_named() {
        let error = shape(0.1, 1e-3, |x| 1e-3 - 0.02 * x).expect_err("no stiffness");
        assert!(error.to_string().contains("bending stiffness"), "{error}");
        let error = shape(0.1, f64::NAN, |_| 1e-3).expect_err("no moment");
        assert!(error.to_string().contains("moment"), "{error}");
    }
}

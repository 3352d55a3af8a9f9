//! Deformations of a plane section: its plane stays plane, and lines along the finger stay normal to it.

use nalgebra::{SMatrix, SVector};

/// The deformation gradient of a section: `F₁₁ F₁₂ F₂₁ F₂₂ F₃₃`; the other components are zero.
pub(crate) type Gradient = SVector<f64, 5>;
/// Second derivatives against [`Gradient`].
pub(crate) type Tangent = SMatrix<f64, 5, 5>;

/// Principal stretches of a deformation of the section, the greatest first.
pub(crate) fn principal_stretches(f: &Gradient) -> [f64; 3] {
    let mean = f.fixed_rows::<4>(0).norm_squared() / 2.0;
    let area = f[0] * f[3] - f[1] * f[2];
    let apart = (mean * mean - area * area).max(0.0).sqrt();
    let mut stretches = [
        (mean + apart).sqrt(),
        // Of the two stretches, which make the area, so that nothing cancels.
        area / (mean + apart).sqrt(),
        f[4],
    ];
    stretches.sort_by(|a, b| b.total_cmp(a));
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_are_those_of_the_deformation() {
        let (sin, cos) = 0.7f64.sin_cos();
        // A rotation after stretches of 1.4 and 0.6 in the plane.
        let f = Gradient::new(1.4 * cos, -0.6 * sin, 1.4 * sin, 0.6 * cos, 1.2);
        for (found, known) in principal_stretches(&f).into_iter().zip([1.4, 1.2, 0.6]) {
            assert!((found - known).abs() < 1e-12);
        }
    }
}

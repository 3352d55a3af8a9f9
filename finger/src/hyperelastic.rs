//! Yeoh's rubber (1993) with a volumetric penalty, in the deformations of a plane section.

use nalgebra::{SMatrix, SVector};

/// The deformation gradient of a section: `F₁₁ F₁₂ F₂₁ F₂₂ F₃₃`; the other components are zero.
pub(crate) type Gradient = SVector<f64, 5>;
/// Second derivatives against [`Gradient`].
pub(crate) type Tangent = SMatrix<f64, 5, 5>;

/// An isotropic rubber, `W = C₁Ī + C₂Ī² + C₃Ī³ + K/2 (J − 1)²` with `Ī = J^(−2/3) tr FᵀF − 3`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubber {
    /// Yeoh's constants `C₁ C₂ C₃`, Pa.
    pub yeoh_pa: [f64; 3],
    /// Bulk modulus `K`, Pa; a penalty where the rubber counts as incompressible.
    pub bulk_modulus_pa: f64,
}

impl Rubber {
    /// Penalty for a rubber that is given as incompressible, Pa: a hundred times the shear modulus of
    /// a soft silicone. Five times more lowers the curvature by 3–8 %.
    pub const PENALTY_PA: f64 = 20e6;

    /// A rubber that is given as incompressible, by Yeoh's constants, Pa.
    pub fn incompressible(yeoh_pa: [f64; 3]) -> Self {
        Self {
            yeoh_pa,
            bulk_modulus_pa: Self::PENALTY_PA,
        }
    }

    /// A rubber of which only Young's modulus is known, Pa: neo-Hookean, `C₁ = E/6`.
    pub fn from_youngs_modulus(youngs_modulus_pa: f64) -> Self {
        Self::incompressible([youngs_modulus_pa / 6.0, 0.0, 0.0])
    }

    /// Young's modulus at small strain if incompressible, `E = 6C₁`, Pa.
    pub fn youngs_modulus_pa(&self) -> f64 {
        6.0 * self.yeoh_pa[0]
    }

    /// First and second derivatives of the energy density, or `None` where the material is turned
    /// inside out (`J ≤ 0`).
    pub(crate) fn derivatives(&self, f: &Gradient) -> Option<(Gradient, Tangent)> {
        let cofactor = Gradient::new(
            f[3] * f[4],
            -f[2] * f[4],
            -f[1] * f[4],
            f[0] * f[4],
            f[0] * f[3] - f[1] * f[2],
        );
        let jacobian = cofactor[4] * f[4];
        // Written so that a NaN is refused too.
        if !(jacobian > 0.0 && f[4] > 0.0) {
            return None;
        }
        let mut curl = Tangent::zeros();
        for (i, j, value) in [
            (0, 3, f[4]),
            (1, 2, -f[4]),
            (0, 4, f[3]),
            (3, 4, f[0]),
            (1, 4, -f[2]),
            (2, 4, -f[1]),
        ] {
            curl[(i, j)] = value;
            curl[(j, i)] = value;
        }
        let power = jacobian.powf(-2.0 / 3.0);
        let invariant = f.norm_squared();
        let strain = power * invariant - 3.0;
        let slope = -2.0 / 3.0 * power * invariant / jacobian;
        let first = cofactor * slope + f * (2.0 * power);
        let mixed = f * cofactor.transpose();
        let second = cofactor * cofactor.transpose() * (-5.0 / 3.0 * slope / jacobian)
            + (mixed + mixed.transpose()) * (-4.0 / 3.0 * power / jacobian)
            + curl * slope
            + Tangent::identity() * (2.0 * power);
        let [c1, c2, c3] = self.yeoh_pa;
        let d1 = c1 + strain * (2.0 * c2 + 3.0 * c3 * strain);
        let d2 = 2.0 * c2 + 6.0 * c3 * strain;
        let k = self.bulk_modulus_pa;
        let pressure = k * (jacobian - 1.0);
        Some((
            first * d1 + cofactor * pressure,
            second * d1
                + first * first.transpose() * d2
                + cofactor * cofactor.transpose() * k
                + curl * pressure,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn energy(rubber: &Rubber, f: &Gradient) -> f64 {
        let j = (f[0] * f[3] - f[1] * f[2]) * f[4];
        let i = j.powf(-2.0 / 3.0) * f.norm_squared() - 3.0;
        let [c1, c2, c3] = rubber.yeoh_pa;
        c1 * i + c2 * i * i + c3 * i * i * i + rubber.bulk_modulus_pa / 2.0 * (j - 1.0).powi(2)
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_differences(
            change in prop::array::uniform5(-0.2f64..0.2)
        ) {
            let rubber = Rubber { yeoh_pa: [0.1, 0.02, 0.01], bulk_modulus_pa: 2.0 };
            let f = Gradient::from(change) + Gradient::new(1.0, 0.0, 0.0, 1.0, 1.0);
            let (first, second) = rubber.derivatives(&f).expect("J > 0");
            let h = 1e-5;
            for i in 0..5 {
                let step = Gradient::from_fn(|k, _| if k == i { h } else { 0.0 });
                let (up, down) = (f + step, f - step);
                let slope = (energy(&rubber, &up) - energy(&rubber, &down)) / (2.0 * h);
                prop_assert!((slope - first[i]).abs() < 1e-7);
                let column = (rubber.derivatives(&up).expect("J > 0").0
                    - rubber.derivatives(&down).expect("J > 0").0) / (2.0 * h);
                prop_assert!((column - second.column(i)).amax() < 1e-6);
            }
        }
    }

    #[test]
    fn inverted_material_has_no_energy() {
        let rubber = Rubber::from_youngs_modulus(0.6e6);
        let folded = Gradient::new(-1.0, 0.0, 0.0, 1.0, 1.0);
        assert!(rubber.derivatives(&folded).is_none());
        assert!(rubber.derivatives(&(folded * f64::NAN)).is_none());
    }
}

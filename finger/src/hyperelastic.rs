//! Rubber by Yeoh (1993), Mooney and Rivlin, or Ogden (1972) with a volumetric penalty, in the deformations
//! of a plane section.

use crate::deformation::{Gradient, Tangent};
use crate::ogden::{Term, Terms};

/// The energy density of an isotropic rubber at constant volume, of the stretches `λ̄ = J^(−1/3) λ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Energy {
    /// Yeoh: `C₁Ī + C₂Ī² + C₃Ī³` with `Ī = J^(−2/3) tr FᵀF − 3`; the constants in Pa.
    Yeoh([f64; 3]),
    /// Ogden: `Σ 2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)`.
    Ogden(Terms),
}

/// An isotropic rubber: its [`Energy`] and `K/2 (J − 1)²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubber {
    /// Energy density at constant volume.
    pub energy: Energy,
    /// Bulk modulus `K`, Pa; a penalty where the rubber counts as incompressible.
    pub bulk_modulus_pa: f64,
}

impl Rubber {
    /// Penalty for a rubber that is given as incompressible, Pa: a hundred times the shear modulus of
    /// a soft silicone. Five times more lowers the curvature by 3–8 %.
    pub const PENALTY_PA: f64 = 20e6;

    /// A rubber that is given as incompressible, by Yeoh's constants, Pa.
    pub fn incompressible(yeoh_pa: [f64; 3]) -> Self {
        Self::of(Energy::Yeoh(yeoh_pa))
    }

    /// A rubber by Mooney's and Rivlin's constants `C₁₀ C₀₁`, Pa: `C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3)`, which is
    /// Ogden's energy with the exponents 2 and −2, for `Ī₂ = Σ λ̄⁻²`.
    pub fn mooney_rivlin([c10_pa, c01_pa]: [f64; 2]) -> Self {
        Self::ogden_abaqus(&[[2.0 * c10_pa, 2.0], [2.0 * c01_pa, -2.0]])
    }

    /// A rubber by pairs of `μ`, Pa, and `α` of `W = Σ 2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)`, as Abaqus writes
    /// Ogden's energy: the shear modulus is `Σ μ`. The first [`crate::ogden::TERMS`] count.
    pub fn ogden_abaqus(pairs: &[[f64; 2]]) -> Self {
        let term = |&[mu_pa, alpha]: &[f64; 2]| Term { mu_pa, alpha };
        Self::of(Energy::Ogden(Terms::new(pairs.iter().map(term))))
    }

    /// A rubber by pairs of `μ`, Pa, and `α` of `W = Σ μ/α (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)`, as Ogden and
    /// Holzapfel write it: the shear modulus is `½ Σ μ α`.
    pub fn ogden(pairs: &[[f64; 2]]) -> Self {
        let term = |&[mu, alpha]: &[f64; 2]| [mu * alpha / 2.0, alpha];
        let pairs: Vec<[f64; 2]> = pairs.iter().map(term).collect();
        Self::ogden_abaqus(&pairs)
    }

    fn of(energy: Energy) -> Self {
        Self {
            energy,
            bulk_modulus_pa: Self::PENALTY_PA,
        }
    }

    /// A rubber of which only Young's modulus is known, Pa: neo-Hookean, `C₁ = E/6`.
    pub fn from_youngs_modulus(youngs_modulus_pa: f64) -> Self {
        Self::incompressible([youngs_modulus_pa / 6.0, 0.0, 0.0])
    }

    /// Young's modulus at small strain if incompressible, Pa: three times the shear modulus, which is `2C₁`
    /// or `Σ μ`.
    pub fn youngs_modulus_pa(&self) -> f64 {
        match &self.energy {
            Energy::Yeoh([c1, ..]) => 6.0 * c1,
            Energy::Ogden(terms) => {
                3.0 * terms.as_slice().iter().map(|term| term.mu_pa).sum::<f64>()
            }
        }
    }

    /// The rubber whose energy at constant volume is `factor` times this one's at every strain; the bulk
    /// modulus stays.
    pub fn scaled(&self, factor: f64) -> Self {
        let energy = match &self.energy {
            Energy::Yeoh(constants) => Energy::Yeoh(constants.map(|c| factor * c)),
            Energy::Ogden(terms) => {
                Energy::Ogden(Terms::new(terms.as_slice().iter().map(|term| Term {
                    mu_pa: factor * term.mu_pa,
                    ..*term
                })))
            }
        };
        Self { energy, ..*self }
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
        let (first, second) = match &self.energy {
            Energy::Yeoh(constants) => yeoh(constants, f, &cofactor, &curl, jacobian),
            Energy::Ogden(terms) => terms.derivatives(f),
        };
        let k = self.bulk_modulus_pa;
        let pressure = k * (jacobian - 1.0);
        Some((
            first + cofactor * pressure,
            second + cofactor * cofactor.transpose() * k + curl * pressure,
        ))
    }
}

/// First and second derivatives of Yeoh's energy density, by those of `J`: its cofactor and curl.
#[inline]
fn yeoh(
    [c1, c2, c3]: &[f64; 3],
    f: &Gradient,
    cofactor: &Gradient,
    curl: &Tangent,
    jacobian: f64,
) -> (Gradient, Tangent) {
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
    let d1 = c1 + strain * (2.0 * c2 + 3.0 * c3 * strain);
    let d2 = 2.0 * c2 + 6.0 * c3 * strain;
    (first * d1, second * d1 + first * first.transpose() * d2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deformation::principal_stretches;
    use proptest::prelude::*;

    fn energy(rubber: &Rubber, f: &Gradient) -> f64 {
        let j = (f[0] * f[3] - f[1] * f[2]) * f[4];
        let at_constant_volume = match &rubber.energy {
            Energy::Yeoh([c1, c2, c3]) => {
                let i = j.powf(-2.0 / 3.0) * f.norm_squared() - 3.0;
                c1 * i + c2 * i * i + c3 * i * i * i
            }
            Energy::Ogden(terms) => {
                let stretches = principal_stretches(f).map(|l| l / j.cbrt());
                let term = |term: &Term| {
                    let sum: f64 = stretches.iter().map(|l| l.powf(term.alpha)).sum();
                    2.0 * term.mu_pa / (term.alpha * term.alpha) * (sum - 3.0)
                };
                terms.as_slice().iter().map(term).sum()
            }
        };
        at_constant_volume + rubber.bulk_modulus_pa / 2.0 * (j - 1.0).powi(2)
    }

    fn with_bulk(rubber: Rubber) -> Rubber {
        Rubber {
            bulk_modulus_pa: 2.0,
            ..rubber
        }
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_differences(
            change in prop::array::uniform5(-0.2f64..0.2),
            // Equal stretches in the plane, nearly equal ones, and any.
            apart in prop::sample::select(vec![0.0, 1e-9, 1e-4, 1.0]),
        ) {
            let round = Gradient::new(1.0 + change[0], change[1], -change[1], 1.0 + change[0], 1.0 + change[4]);
            let any = Gradient::from(change) + Gradient::new(1.0, 0.0, 0.0, 1.0, 1.0);
            let f = round + (any - round) * apart;
            for rubber in [
                Rubber::incompressible([0.1, 0.02, 0.01]),
                Rubber::incompressible([0.1, 0.02, -0.004]),
                Rubber::mooney_rivlin([0.1, 0.04]),
                Rubber::ogden_abaqus(&[[0.1, 1.3], [0.02, 5.0], [0.03, -2.0]]),
                Rubber::ogden_abaqus(&[[0.05, 0.4], [-0.01, 7.5]]),
            ].map(with_bulk) {
                let (first, second) = rubber.derivatives(&f).expect("J > 0");
                prop_assert!((second - second.transpose()).amax() < 1e-12);
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
        fn the_same_energy_by_another_name_is_the_same(
            change in prop::array::uniform5(-0.3f64..0.3),
            c10 in 0.01f64..0.5,
            c01 in -0.1f64..0.5,
        ) {
            let f = Gradient::from(change) + Gradient::new(1.0, 0.0, 0.0, 1.0, 1.0);
            for (one, other) in [
                (Rubber::mooney_rivlin([c10, 0.0]), Rubber::incompressible([c10, 0.0, 0.0])),
                (Rubber::ogden_abaqus(&[[2.0 * c10, 2.0]]), Rubber::incompressible([c10, 0.0, 0.0])),
                (Rubber::ogden(&[[2.0 * c10, 2.0]]), Rubber::incompressible([c10, 0.0, 0.0])),
                (
                    Rubber::ogden(&[[2.0 * c10, 2.0], [-2.0 * c01, -2.0]]),
                    Rubber::mooney_rivlin([c10, c01]),
                ),
            ].map(|(one, other)| (with_bulk(one), with_bulk(other))) {
                let modulus = one.youngs_modulus_pa() - other.youngs_modulus_pa();
                prop_assert!(modulus.abs() < 1e-12);
                let (first, second) = one.derivatives(&f).expect("J > 0");
                let (first_too, second_too) = other.derivatives(&f).expect("J > 0");
                prop_assert!((first - first_too).amax() < 1e-12);
                prop_assert!((second - second_too).amax() < 1e-11);
            }
        }
    }

    #[test]
    fn mooney_and_rivlin_count_the_second_invariant() {
        let f = Gradient::new(1.3, 0.2, -0.1, 0.9, 1.1);
        let (c10, c01) = (0.1, 0.04);
        let j = (f[0] * f[3] - f[1] * f[2]) * f[4];
        let plane = f.fixed_rows::<4>(0).norm_squared();
        // I₂ = ½ (I₁² − tr (FᵀF)²) of a block and a single value.
        let i2 = plane * f[4].powi(2) + (j / f[4]).powi(2);
        let invariants = c10 * (j.powf(-2.0 / 3.0) * f.norm_squared() - 3.0)
            + c01 * (j.powf(-4.0 / 3.0) * i2 - 3.0);
        let rubber = Rubber {
            bulk_modulus_pa: 0.0,
            ..Rubber::mooney_rivlin([c10, c01])
        };
        assert!((energy(&rubber, &f) - invariants).abs() < 1e-14);
    }

    #[test]
    fn youngs_modulus_is_the_slope_at_rest() {
        for rubber in [
            Rubber::incompressible([0.1, 0.02, -0.001]),
            Rubber::mooney_rivlin([0.1, 0.04]),
            Rubber::ogden_abaqus(&[[0.1, 1.3], [0.02, 5.0], [0.03, -2.0]]),
            Rubber::ogden(&[[0.63, 1.3], [0.0012, 5.0], [-0.01, -2.0]]),
        ] {
            let uniaxial = |l: f64| {
                energy(
                    &rubber,
                    &Gradient::new(l.powf(-0.5), 0.0, 0.0, l.powf(-0.5), l),
                )
            };
            let h = 1e-4;
            let slope = (uniaxial(1.0 + h) - 2.0 * uniaxial(1.0) + uniaxial(1.0 - h)) / (h * h);
            assert!(
                (slope / rubber.youngs_modulus_pa() - 1.0).abs() < 1e-5,
                "{rubber:?}"
            );
            let twice = rubber.scaled(2.0).youngs_modulus_pa();
            assert!((twice / rubber.youngs_modulus_pa() - 2.0).abs() < 1e-12);
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

//! Where a strain energy still describes a material: Drucker's stability.
//!
//! Any further strain must cost work, `dτ : dε > 0`, with the Kirchhoff stress `τ` and the logarithmic
//! strain `ε` at constant volume: then true stress rises with stretch in every direction. For an isotropic
//! energy this is Hill's inequality (Hill, Proc. R. Soc. A 314, 1970): `W` is convex in the principal
//! logarithmic strains, and the greater stress lies along the greater stretch. It is what finite-element
//! programs test fitted constants by, and what a polynomial with a negative coefficient loses beyond the
//! stretches that it was fitted to.

use nalgebra::{Matrix3, Vector3};

use crate::hyperelastic::Energy;

impl Energy {
    /// Whether every deformation is stable, as far as that shows at once: no negative coefficient.
    pub(crate) fn is_always_stable(&self) -> bool {
        match self {
            Self::Yeoh(constants) => constants.iter().all(|c| *c >= 0.0),
            Self::Ogden(terms) => terms.as_slice().iter().all(|term| term.mu_pa >= 0.0),
        }
    }

    /// Whether a deformation with these principal stretches, in any order and brought to constant volume, is
    /// stable by Hill's inequality.
    pub fn is_stable_at(&self, stretches: [f64; 3]) -> bool {
        let volume: f64 = stretches.iter().product();
        let stretches = Vector3::from(stretches) / volume.cbrt();
        let (stress, h) = self.logarithmic(&stretches);
        // The curvature of W in the plane of constant volume, spanned by (1, 0, −1) and (0, 1, −1).
        let first = h[(0, 0)] + h[(2, 2)] - 2.0 * h[(0, 2)];
        let second = h[(1, 1)] + h[(2, 2)] - 2.0 * h[(1, 2)];
        let mixed = h[(0, 1)] - h[(0, 2)] - h[(1, 2)] + h[(2, 2)];
        let convex = first > 0.0 && first * second > mixed * mixed;
        // Equal stretches have equal stresses but for rounding.
        let ordered = [(0, 1), (1, 2), (0, 2)].into_iter().all(|(i, j)| {
            let apart = stretches[i] - stretches[j];
            apart.abs() < 1e-6 || (stress[i] - stress[j]) * apart > 0.0
        });
        convex && ordered
    }

    /// Where stability ends on the straight path of logarithmic strain to these unstable stretches.
    pub(crate) fn last_stable(&self, stretches: [f64; 3]) -> [f64; 3] {
        let at = |share: f64| stretches.map(|stretch| stretch.powf(share));
        let (mut stable, mut unstable) = (0.0, 1.0);
        // To the sixth decimal.
        for _ in 0..20 {
            let middle = (stable + unstable) / 2.0;
            match self.is_stable_at(at(middle)) {
                true => stable = middle,
                false => unstable = middle,
            }
        }
        at(stable)
    }

    /// First and second derivatives of `W` against the principal logarithmic strains.
    fn logarithmic(&self, stretches: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        match self {
            Self::Yeoh([c1, c2, c3]) => {
                let squares = stretches.component_mul(stretches);
                let strain = squares.sum() - 3.0;
                let slope = c1 + strain * (2.0 * c2 + 3.0 * c3 * strain);
                let curvature = 2.0 * c2 + 6.0 * c3 * strain;
                (
                    squares * (2.0 * slope),
                    Matrix3::from_diagonal(&squares) * (4.0 * slope)
                        + squares * squares.transpose() * (4.0 * curvature),
                )
            }
            Self::Ogden(terms) => {
                let (mut stress, mut diagonal) = (Vector3::zeros(), Vector3::zeros());
                for term in terms.as_slice() {
                    let power = stretches.map(|stretch| stretch.powf(term.alpha));
                    stress += power * (2.0 * term.mu_pa / term.alpha);
                    diagonal += power * (2.0 * term.mu_pa);
                }
                (stress, Matrix3::from_diagonal(&diagonal))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::hyperelastic::Rubber;

    /// Uniaxial, planar and equibiaxial.
    fn modes(stretch: f64) -> [[f64; 3]; 3] {
        [
            [stretch, stretch.powf(-0.5), stretch.powf(-0.5)],
            [stretch, 1.0, 1.0 / stretch],
            [stretch, stretch, stretch.powi(-2)],
        ]
    }

    #[test]
    fn without_negative_coefficients_no_stretch_is_unstable() {
        for rubber in [
            Rubber::incompressible([0.1e6, 0.02e6, 200.0]),
            Rubber::from_youngs_modulus(0.6e6),
            Rubber::mooney_rivlin([0.1e6, 0.05e6]),
            Rubber::ogden_abaqus(&[[2e4, -3.8], [3e4, 0.7], [1e4, 4.2]]),
        ] {
            assert!(rubber.energy.is_always_stable());
            for stretch in [0.2, 0.5, 1.0, 1.5, 3.0, 8.0] {
                for mode in modes(stretch) {
                    assert!(rubber.energy.is_stable_at(mode), "{rubber:?} {mode:?}");
                }
            }
        }
    }

    #[test]
    fn uniaxial_stability_ends_where_true_stress_stops_rising() {
        for yeoh_pa in [
            [86_560.0, 13_800.0, -1_466.0],
            [55_100.0, 15_210.0, -2_194.0],
        ] {
            let energy = Rubber::incompressible(yeoh_pa).energy;
            let [c1, c2, c3] = yeoh_pa;
            let true_stress = |l: f64| {
                let i = l * l + 2.0 / l - 3.0;
                2.0 * (l * l - 1.0 / l) * (c1 + 2.0 * c2 * i + 3.0 * c3 * i * i)
            };
            let mut stretch = 1.0;
            while true_stress(stretch + 1e-4) > true_stress(stretch) {
                stretch += 1e-4;
            }
            let uniaxial = |stretch| modes(stretch)[0];
            assert!(energy.is_stable_at(uniaxial(1.0)));
            assert!(energy.is_stable_at(uniaxial(stretch - 0.02)), "{stretch}");
            assert!(!energy.is_stable_at(uniaxial(stretch + 1e-3)), "{stretch}");
        }
    }
}

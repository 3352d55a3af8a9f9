//! Ogden's isochoric energy `W = Σ 2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)` in the deformations of a plane section.
//!
//! One principal stretch is `z = F₃₃`; of the other two only `λ₁² + λ₂² = s` and `λ₁ λ₂ = D`, trace and
//! determinant of the plane part, are known without an eigenvalue problem, and in these two `λ₁^α + λ₂^α`
//! is smooth, also where the stretches are equal:
//!
//! ```text
//! λ₁^α + λ₂^α = P(s, D) = 2 m^β G(v),   m = s/2,  β = α/2,  v = 1 − D²/m²
//! G(v) = ½ [(1 + √v)^β + (1 − √v)^β] = Σ binomial(β, 2j) v^j
//! ```

use nalgebra::{Matrix3, Vector3};

use crate::deformation::{Gradient, Tangent};

/// Most terms of an energy: as many as Abaqus takes.
pub const TERMS: usize = 6;

/// One term, `2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Its part `μ` of the shear modulus, Pa.
    pub mu_pa: f64,
    /// Its exponent `α`; not zero.
    pub alpha: f64,
}

/// A sum of up to [`TERMS`] terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms {
    terms: [Term; TERMS],
    len: usize,
}

impl Terms {
    /// The sum of the first [`TERMS`] of these; what comes after them is dropped.
    pub fn new(terms: impl IntoIterator<Item = Term>) -> Self {
        let nothing = Term {
            mu_pa: 0.0,
            alpha: 2.0,
        };
        let mut list = Self {
            terms: [nothing; TERMS],
            len: 0,
        };
        for (place, term) in list.terms.iter_mut().zip(terms) {
            *place = term;
            list.len += 1;
        }
        list
    }

    /// The terms in the order in which they were given.
    pub fn as_slice(&self) -> &[Term] {
        &self.terms[..self.len]
    }

    /// First and second derivatives of the energy density, for `J > 0` and `F₃₃ > 0`.
    pub(crate) fn derivatives(&self, f: &Gradient) -> (Gradient, Tangent) {
        let s = f.fixed_rows::<4>(0).norm_squared();
        let d = f[0] * f[3] - f[1] * f[2];
        let z = f[4];
        let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
        for term in self.as_slice() {
            let (u1, u2) = term.in_invariants(s, d, z);
            first += u1;
            second += u2;
        }
        // Slopes of s, D and z against F, and the second derivatives of s and D.
        let slopes = [
            Gradient::new(2.0 * f[0], 2.0 * f[1], 2.0 * f[2], 2.0 * f[3], 0.0),
            Gradient::new(f[3], -f[2], -f[1], f[0], 0.0),
            Gradient::new(0.0, 0.0, 0.0, 0.0, 1.0),
        ];
        let mut gradient = Gradient::zeros();
        let mut tangent = Tangent::zeros();
        for i in 0..3 {
            gradient += slopes[i] * first[i];
            for j in 0..3 {
                tangent += slopes[i] * slopes[j].transpose() * second[(i, j)];
            }
        }
        for i in 0..4 {
            tangent[(i, i)] += 2.0 * first[0];
        }
        for (i, j, sign) in [(0, 3, 1.0), (1, 2, -1.0)] {
            tangent[(i, j)] += sign * first[1];
            tangent[(j, i)] += sign * first[1];
        }
        (gradient, tangent)
    }
}

impl Term {
    /// First and second derivatives against `(s, D, z)` of `2μ/α² J^(−α/3) (P(s, D) + z^α)`, `J = D z`.
    fn in_invariants(&self, s: f64, d: f64, z: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let (alpha, beta, k) = (self.alpha, self.alpha / 2.0, self.alpha / 3.0);
        let m = s / 2.0;
        // Not below zero by rounding: a plane part is never closer to a rotation than one.
        let v = (1.0 - (d / m).powi(2)).max(0.0);
        let [g, g1, g2] = even_part(beta, v);
        let (v_s, v_d) = ((1.0 - v) / m, -2.0 * d / (m * m));
        let (v_ss, v_sd, v_dd) = (
            -1.5 * (1.0 - v) / (m * m),
            2.0 * d / m.powi(3),
            -2.0 / (m * m),
        );
        let power = 2.0 * m.powf(beta);
        let p = power * g;
        let p_s = power * (beta / s * g + g1 * v_s);
        let p_d = power * g1 * v_d;
        let p_ss = power
            * (beta * (beta - 1.0) / (s * s) * g
                + 2.0 * beta / s * g1 * v_s
                + g2 * v_s * v_s
                + g1 * v_ss);
        let p_sd = power * (beta / s * g1 * v_d + g2 * v_s * v_d + g1 * v_sd);
        let p_dd = power * (g2 * v_d * v_d + g1 * v_dd);

        let axial = z.powf(alpha);
        let (axial_1, axial_2) = (alpha * axial / z, alpha * (alpha - 1.0) * axial / (z * z));
        let sum = p + axial;
        let u_sd = p_sd - k / d * p_s;
        let u_sz = -k / z * p_s;
        let u_dz = -k / z * p_d - k / d * axial_1 + k * k / (d * z) * sum;
        let second = Matrix3::new(
            p_ss,
            u_sd,
            u_sz,
            u_sd,
            p_dd - 2.0 * k / d * p_d + k * (k + 1.0) / (d * d) * sum,
            u_dz,
            u_sz,
            u_dz,
            axial_2 - 2.0 * k / z * axial_1 + k * (k + 1.0) / (z * z) * sum,
        );
        let first = Vector3::new(p_s, p_d - k / d * sum, axial_1 - k / z * sum);
        let factor = 2.0 * self.mu_pa / (alpha * alpha) * (d * z).powf(-k);
        (first * factor, second * factor)
    }
}

/// `G(v)` with its first two derivatives, `0 ≤ v < 1`.
fn even_part(beta: f64, v: f64) -> [f64; 3] {
    // Nearer to zero the closed form's differences lose more than three digits.
    if v < 0.01 {
        return even_series(beta, v);
    }
    let u = v.sqrt();
    let power = |exponent: f64| ((1.0 + u).powf(exponent), (1.0 - u).powf(exponent));
    let ((a, b), (a1, b1), (a2, b2)) = (power(beta), power(beta - 1.0), power(beta - 2.0));
    // Against u, then against v = u².
    let (by_u, by_uu) = (
        beta * (a1 - b1) / 2.0,
        beta * (beta - 1.0) * (a2 + b2) / 2.0,
    );
    [
        (a + b) / 2.0,
        by_u / (2.0 * u),
        (by_uu - by_u / u) / (4.0 * v),
    ]
}

/// The same as a power series, whose terms fall by `v` each.
fn even_series(beta: f64, v: f64) -> [f64; 3] {
    // Exponents up to 30, β up to 15, are exact to the last digit after sixteen terms.
    const LAST: i32 = 16;
    let mut coefficient = 1.0;
    let (mut power, mut power_1, mut power_2) = (1.0, 0.0, 0.0);
    let mut sums = [0.0; 3];
    for j in 0..=LAST {
        sums[0] += coefficient * power;
        sums[1] += coefficient * power_1;
        sums[2] += coefficient * power_2;
        let n = 2.0 * f64::from(j);
        coefficient *= (beta - n) * (beta - n - 1.0) / ((n + 1.0) * (n + 2.0));
        // v^(j+1) with its derivatives, (j+1) v^j and (j+1) j v^(j−1).
        let next = f64::from(j + 1);
        power_2 = next * power_1;
        power_1 = next * power;
        power *= v;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_closed_form_meet() {
        for beta in [-15.0, -2.7, -1.0, -0.3, 0.005, 0.5, 1.0, 1.7, 4.2, 15.0] {
            let v = 0.01;
            let (series, closed) = (even_series(beta, v), even_part(beta, v));
            for (series, closed) in series.into_iter().zip(closed) {
                let off = (series - closed).abs() / closed.abs().max(1e-6);
                assert!(off < 1e-9, "{beta}: {series} {closed}");
            }
        }
    }

    #[test]
    fn the_first_terms_are_kept() {
        let term = |n: usize| Term {
            mu_pa: n as f64,
            alpha: 2.0,
        };
        let terms = Terms::new((1..=8).map(term));
        assert_eq!(terms.as_slice().len(), TERMS);
        assert_eq!(Terms::new([term(3)]).as_slice(), [term(3)]);
    }
}

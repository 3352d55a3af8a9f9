//! The linear complementarity problem, in which contacts either touch or press.

use nalgebra::{DMatrix, DVector};

/// `z ≥ 0` with `M z + q ≥ 0` and `z · (M z + q) = 0`, by Lemke's complementary pivoting (friction makes
/// `M` unsymmetric); `None` if it ends on a ray.
pub(crate) fn complementary(m: &DMatrix<f64>, q: &DVector<f64>) -> Option<DVector<f64>> {
    let n = q.len();
    let mut z = DVector::zeros(n);
    if q.iter().all(|q| *q >= 0.0) {
        return Some(z);
    }
    // Columns: w, z, the artificial variable, right side; w − M z − artificial = q.
    let (artificial, right) = (2 * n, 2 * n + 1);
    let mut tableau = DMatrix::identity(n, 2 * n + 2);
    tableau.view_mut((0, n), (n, n)).copy_from(&-m);
    tableau.column_mut(artificial).fill(-1.0);
    tableau.column_mut(right).copy_from(q);
    let mut basis: Vec<usize> = (0..n).collect();
    let mut row = q.imin();
    let mut entering = artificial;
    for _ in 0..100 * n {
        let pivot = tableau[(row, entering)];
        tableau.row_mut(row).unscale_mut(pivot);
        let pivot_row = tableau.row(row).clone_owned();
        for other in (0..n).filter(|other| *other != row) {
            let factor = tableau[(other, entering)];
            let mut changed = tableau.row_mut(other);
            changed -= &pivot_row * factor;
        }
        let leaving = std::mem::replace(&mut basis[row], entering);
        if leaving == artificial {
            for (row, variable) in basis.into_iter().enumerate() {
                if (n..2 * n).contains(&variable) {
                    z[variable - n] = tableau[(row, right)].max(0.0);
                }
            }
            return Some(z);
        }
        entering = (leaving + n) % (2 * n);
        // The first variable to vanish leaves; of several, the artificial one, which ends the search.
        row = (0..n)
            .filter(|r| tableau[(*r, entering)] > 1e-12)
            .min_by(|a, b| {
                let ratio = |r: usize| tableau[(r, right)] / tableau[(r, entering)];
                let last = |r: usize| basis[r] != artificial;
                ratio(*a)
                    .total_cmp(&ratio(*b))
                    .then(last(*a).cmp(&last(*b)))
            })?;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn complementarity_is_what_it_says(entries in prop::collection::vec(-1.0f64..1.0, 25)) {
            let half = DMatrix::from_column_slice(5, 4, &entries[..20]);
            let m = &half * half.transpose() + DMatrix::identity(5, 5) * 0.1;
            let q = DVector::from_column_slice(&entries[20..]);
            let z = complementary(&m, &q).expect("definite");
            let w = &m * &z + &q;
            prop_assert!(z.min() >= 0.0 && w.min() > -1e-9 && z.dot(&w).abs() < 1e-9);
        }
    }

    #[test]
    fn what_cannot_be_complementary_has_no_answer() {
        let m = DMatrix::from_element(1, 1, -1.0);
        assert!(complementary(&m, &DVector::from_element(1, -1.0)).is_none());
    }
}

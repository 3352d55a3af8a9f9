//! Newton's equations of a section: symmetric, block tridiagonal, with a border of two.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// The equations `[K B; Bᵀ C] δ = −g`, one diagonal block of `K` for each column of the mesh.
pub(crate) struct Bordered {
    /// Unknowns in a block; the last block may have fewer.
    block: usize,
    diagonal: Vec<DMatrix<f64>>,
    /// What joins a block's columns to the rows of the next.
    below: Vec<DMatrix<f64>>,
    /// `g` and `B`, all three block by block.
    right: Vec<DMatrix<f64>>,
    /// Rest of `g`.
    pub corner_gradient: Vector2<f64>,
    /// `C`.
    pub corner: Matrix2<f64>,
}

/// A solution of [`Bordered`].
pub(crate) struct Step {
    /// `δ` without the border.
    pub inner: DVector<f64>,
    /// `δ` of the border.
    pub border: Vector2<f64>,
    /// Stiffness of the border when the rest follows, `C − Bᵀ K⁻¹ B`.
    pub condensed: Matrix2<f64>,
}

impl Bordered {
    /// Equations of `size` unknowns in blocks of `block`.
    pub fn new(size: usize, block: usize) -> Self {
        let rows = |start: usize| block.min(size - start);
        let starts = || (0..size).step_by(block);
        Self {
            block,
            diagonal: starts().map(|s| DMatrix::zeros(rows(s), rows(s))).collect(),
            below: starts()
                .skip(1)
                .map(|s| DMatrix::zeros(rows(s), block))
                .collect(),
            right: starts().map(|s| DMatrix::zeros(rows(s), 3)).collect(),
            corner_gradient: Vector2::zeros(),
            corner: Matrix2::zeros(),
        }
    }

    /// Adds to `K` at a row and a column; the half above the diagonal blocks is implied.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let (j, i) = (row / self.block, column / self.block);
        let (r, c) = (row % self.block, column % self.block);
        if i == j {
            self.diagonal[i][(r, c)] += value;
        } else if i < j {
            self.below[i][(r, c)] += value;
        }
    }

    /// Adds to `g` and to the two columns of `B`.
    pub fn add_right(&mut self, row: usize, values: [f64; 3]) {
        let block = &mut self.right[row / self.block];
        for (column, value) in values.into_iter().enumerate() {
            block[(row % self.block, column)] += value;
        }
    }

    /// Solves by block Cholesky elimination; `None` unless the whole matrix is positive definite.
    pub fn solve(mut self) -> Option<Step> {
        // Y = L⁻¹ [g B] makes both the border's Schur complement and its right side inner products.
        let mut schur = nalgebra::Matrix3::zeros();
        let last = self.diagonal.len() - 1;
        let mut factors = Vec::with_capacity(last + 1);
        for i in 0..=last {
            let factor = std::mem::take(&mut self.diagonal[i]).cholesky()?.unpack();
            factor.solve_lower_triangular_mut(&mut self.right[i]);
            schur += self.right[i].tr_mul(&self.right[i]);
            if i < last {
                let mut across = self.below[i].transpose();
                factor.solve_lower_triangular_mut(&mut across);
                self.diagonal[i + 1].gemm_tr(-1.0, &across, &across, 1.0);
                let (done, rest) = self.right.split_at_mut(i + 1);
                rest[0].gemm_tr(-1.0, &across, &done[i], 1.0);
                self.below[i] = across;
            }
            factors.push(factor);
        }
        let condensed = self.corner - schur.fixed_view::<2, 2>(1, 1);
        let reaction = self.corner_gradient - schur.fixed_view::<2, 1>(1, 0);
        let border = -condensed.cholesky()?.solve(&reaction);
        let mut inner = DVector::zeros(last * self.block + factors[last].nrows());
        for i in (0..=last).rev() {
            let right = &self.right[i];
            let mut part = -(right.column(0) + right.columns(1, 2) * border);
            if i < last {
                let next = inner.rows((i + 1) * self.block, self.below[i].ncols());
                part -= &self.below[i] * next;
            }
            factors[i].tr_solve_lower_triangular_mut(&mut part);
            inner.rows_mut(i * self.block, part.len()).copy_from(&part);
        }
        Some(Step {
            inner,
            border,
            condensed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fills the bordered form of `matrix` (the border last) with the gradient `g`.
    fn bordered(matrix: &DMatrix<f64>, g: &DVector<f64>, block: usize) -> Bordered {
        let n = matrix.nrows() - 2;
        let mut equations = Bordered::new(n, block);
        for r in 0..n {
            for c in 0..n {
                equations.add(r, c, matrix[(r, c)]);
            }
            equations.add_right(r, [g[r], matrix[(r, n)], matrix[(r, n + 1)]]);
        }
        equations.corner = matrix.fixed_view::<2, 2>(n, n).into();
        equations.corner_gradient = g.fixed_rows::<2>(n).into();
        equations
    }

    #[test]
    fn solves_what_a_dense_solver_solves_and_refuses_what_is_not_definite() {
        let (n, block) = (11, 4);
        let mut matrix = DMatrix::from_fn(n + 2, n + 2, |r, c| {
            let (low, high) = (r.min(c), r.max(c));
            let apart = high < n && high / block - low / block > 1;
            let wave = ((low * 7 + high * 3) as f64).sin();
            if apart { 0.0 } else { wave }
        });
        matrix += DMatrix::identity(n + 2, n + 2) * 8.0;
        let g = DVector::from_fn(n + 2, |i, _| (i as f64).cos());
        let step = bordered(&matrix, &g, block).solve().expect("definite");
        let dense = -matrix.clone().lu().solve(&g).expect("regular");
        assert!((step.inner - dense.rows(0, n)).amax() < 1e-12);
        assert!((step.border - dense.fixed_rows::<2>(n)).amax() < 1e-12);
        let inverse = matrix.clone().try_inverse().expect("regular");
        let condensed = inverse
            .fixed_view::<2, 2>(n, n)
            .try_inverse()
            .expect("regular");
        assert!((step.condensed - condensed).amax() < 1e-9);

        matrix[(n, n)] -= 20.0;
        assert!(bordered(&matrix, &g, block).solve().is_none());
        matrix[(3, 3)] -= 20.0;
        assert!(bordered(&matrix, &g, block).solve().is_none());
    }
}

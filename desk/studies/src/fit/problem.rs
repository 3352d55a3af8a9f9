//! The least-squares problem: measurements minus the model of a changed recipe.

use anyhow::ensure;
use finger::geometry::Description;
use nalgebra::{DMatrix, DVector};
use toml_edit::DocumentMut;

use super::data::{Noise, Point};
use super::parameter::Parameter;

/// Difference quotients are taken over this many steps: smooth enough that forward differences are good
/// for a percent of the slope, and far above the rounding of a recipe's numbers.
const DIFFERENCE: f64 = 0.1;
/// A fit has converged when no parameter moves by more than this, in steps.
const CONVERGED: f64 = 1e-3;
/// The model is not trusted over more than this in one iteration, in steps.
const TRUST: f64 = 2.0;
/// Further from the recipe than this, in steps, it is another finger: half a millimetre in a radius.
const ANOTHER: f64 = 5.0;
const ITERATIONS: usize = 40;

/// Measurements and the recipe to start from.
pub struct Problem<'a> {
    pub points: &'a [Point],
    pub noise: Noise,
    pub recipe: &'a DocumentMut,
}

impl Problem<'_> {
    /// The recipe with every parameter changed by its steps.
    pub fn changed(&self, parameters: &[Parameter], steps: &[f64]) -> DocumentMut {
        let mut recipe = self.recipe.clone();
        for (parameter, &steps) in parameters.iter().zip(steps) {
            parameter.apply(&mut recipe, steps);
        }
        recipe
    }

    /// Measured less modelled, in standard deviations of the noise. Solved at the measured pressures only.
    ///
    /// # Errors
    /// If the changed recipe describes no possible finger, or the model has no solution.
    pub fn residuals(
        &self,
        parameters: &[Parameter],
        steps: &[f64],
    ) -> anyhow::Result<DVector<f64>> {
        let text = self.changed(parameters, steps).to_string();
        let geometry = toml::from_str::<Description>(&text)?.check()?;
        let mut pressures: Vec<f64> = self.points.iter().map(|p| p.pressure_kpa).collect();
        // Without pressure nothing bends, which the chain knows by itself.
        pressures.retain(|kpa| *kpa > 0.0);
        pressures.sort_by(f64::total_cmp);
        pressures.dedup();
        let chain = geometry.chain_through(&pressures)?;
        let residual = |point: &Point| {
            let model = point.quantity.of(&chain, point.pressure_kpa);
            (point.value - model) / self.noise.of(point.quantity)
        };
        let residuals = self.points.iter().map(residual);
        Ok(DVector::from_iterator(self.points.len(), residuals))
    }

    /// Change of the modelled values per step of each parameter, in standard deviations of the noise;
    /// `here` are the residuals without the change.
    ///
    /// # Errors
    /// If the model has no solution on either side of a parameter.
    pub fn jacobian(
        &self,
        parameters: &[Parameter],
        steps: &[f64],
        here: &DVector<f64>,
    ) -> anyhow::Result<DMatrix<f64>> {
        let mut columns = Vec::with_capacity(parameters.len());
        for i in 0..parameters.len() {
            let slope = |by: f64| {
                let mut there = steps.to_vec();
                there[i] += by;
                let there = self.residuals(parameters, &there)?;
                Ok::<_, anyhow::Error>((here - there) / by)
            };
            // At an end of its range a number can be changed in one direction only.
            columns.push(slope(DIFFERENCE).or_else(|_| slope(-DIFFERENCE))?);
        }
        Ok(DMatrix::from_columns(&columns))
    }

    /// The steps that bring the model closest to the measurements: Levenberg–Marquardt.
    ///
    /// # Errors
    /// If the best fit changes a parameter so much that the recipe is of another finger.
    pub fn solve(&self, parameters: &[Parameter]) -> anyhow::Result<Vec<f64>> {
        let mut steps = vec![0.0; parameters.len()];
        let mut residuals = self.residuals(parameters, &steps)?;
        let mut damping = 1e-3;
        let mut normal = None;
        for _ in 0..ITERATIONS {
            let (hessian, gradient) = match normal.take() {
                Some(kept) => kept,
                None => {
                    let jacobian = self.jacobian(parameters, &steps, &residuals)?;
                    (
                        jacobian.transpose() * &jacobian,
                        jacobian.transpose() * &residuals,
                    )
                }
            };
            let damped = &hessian + DMatrix::from_diagonal(&(hessian.diagonal() * damping));
            // Chosen for being distinct, the columns are independent.
            let Some(mut change) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                break;
            };
            change *= (TRUST / change.amax()).min(1.0);
            let there: Vec<f64> = steps.iter().zip(&change).map(|(a, b)| a + b).collect();
            // Where the changed finger cannot be built or balloons, the way there was too long.
            match self.residuals(parameters, &there) {
                Ok(better) if better.norm() <= residuals.norm() => {
                    (steps, residuals) = (there, better);
                    damping = (0.1 * damping).max(1e-9);
                }
                Ok(_) | Err(_) => {
                    damping = 10.0 * damping.max(1e-3);
                    normal = Some((hessian, gradient));
                }
            }
            if change.amax() < CONVERGED {
                break;
            }
        }
        for (parameter, steps) in parameters.iter().zip(&steps) {
            ensure!(
                steps.abs() < ANOTHER,
                "{} would have to change by {:+.1} {} or more: the measurements are not of this recipe's \
                 finger; measure its dimensions and start from a recipe that has them",
                parameter.name(),
                parameter.shift(*steps),
                parameter.step().1
            );
        }
        Ok(steps)
    }
}

//! Selection of the parameters that the measurements can identify.

use nalgebra::DMatrix;

use super::parameter::Parameter;

/// A parameter is fitted if one step of it, less all that the parameters fitted before can imitate,
/// stands out of the noise by this factor: it will then be known to a third of what it was before.
pub const DISTINCT: f64 = 3.0;
/// More are never fitted: a curve of the free finger has a height and a slope, and a gauge a scale.
const MOST: usize = 3;

/// Whether a parameter is fitted, and the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// The parameter is fitted.
    Fitted,
    /// The user has excluded it as known.
    Known,
    /// Its effect on the measured values is within their noise.
    Weak,
    /// Its effect resembles that of the fitted ones.
    Alike,
    /// The measurements could tell it, but it would be one too many for their number, or at all.
    Spare,
}

/// A parameter before the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The parameter.
    pub parameter: Parameter,
    /// Mean change of the modelled values per step, %.
    pub change_percent: f64,
    /// Length of the change of all points per step, in standard deviations of the noise.
    pub effect: f64,
    /// The part of it that the parameters fitted before cannot imitate.
    pub distinct: f64,
    /// Whether it is fitted, and why not.
    pub selection: Selection,
}

/// Result of the identifiability analysis.
#[derive(Debug, Clone)]
pub struct Identified {
    /// One for each parameter that the recipe has.
    pub candidates: Vec<Candidate>,
    /// Cosines of the angles between the candidates' effects.
    pub correlation: DMatrix<f64>,
    /// Singular values of all effects together, falling.
    pub singular_values: Vec<f64>,
}

impl Identified {
    /// The parameters to fit.
    pub fn fitted(&self) -> Vec<Parameter> {
        let fitted = |c: &&Candidate| c.selection == Selection::Fitted;
        let candidates = self.candidates.iter().filter(fitted);
        candidates.map(|c| c.parameter).collect()
    }
}

/// Chooses greedily (a QR decomposition with column pivoting, stopped at the noise): the parameter with
/// the largest distinct effect first, then the one with the largest effect across that one.
pub fn identify(
    parameters: &[Parameter],
    known: &[Parameter],
    jacobian: &DMatrix<f64>,
    change_percent: &[f64],
) -> Identified {
    let effect: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let cosine = |i: usize, j: usize| {
        let lengths = effect[i] * effect[j];
        let product = jacobian.column(i).dot(&jacobian.column(j));
        if lengths > 0.0 {
            product / lengths
        } else {
            0.0
        }
    };
    let n = parameters.len();
    let mut rest = jacobian.clone();
    let mut candidates: Vec<Candidate> = (0..n)
        .map(|i| Candidate {
            parameter: parameters[i],
            change_percent: change_percent[i],
            effect: effect[i],
            distinct: effect[i],
            selection: match known.contains(&parameters[i]) {
                true => Selection::Known,
                false if effect[i] < DISTINCT => Selection::Weak,
                false => Selection::Alike,
            },
        })
        .collect();
    // One point more than parameters, so that the residuals say something.
    let most = MOST.min(jacobian.nrows() - 1).max(1);
    for turn in 0.. {
        let open = |c: &Candidate| c.selection == Selection::Alike && c.distinct >= DISTINCT;
        let best = (0..n)
            .filter(|&i| open(&candidates[i]))
            .max_by(|&i, &j| candidates[i].distinct.total_cmp(&candidates[j].distinct));
        let Some(best) = best else { break };
        if turn == most {
            let spare = candidates.iter_mut().filter(|c| open(c));
            spare.for_each(|c| c.selection = Selection::Spare);
            break;
        }
        candidates[best].selection = Selection::Fitted;
        let direction = rest.column(best).normalize();
        for (mut column, candidate) in rest.column_iter_mut().zip(&mut candidates) {
            let share = direction.dot(&column);
            column.axpy(-share, &direction, 1.0);
            if candidate.selection != Selection::Fitted {
                candidate.distinct = column.norm();
            }
        }
    }
    Identified {
        candidates,
        correlation: DMatrix::from_fn(n, n, cosine),
        singular_values: jacobian.singular_values().iter().copied().collect(),
    }
}

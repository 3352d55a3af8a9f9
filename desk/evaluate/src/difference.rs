//! Second-order linear difference equations: least-squares fit and simulation.

use nalgebra::{Matrix4, Vector4};
use sim::air::Lag;

/// Lag before the fit, as slow as the answers, s.
const FIT_LAG_S: f64 = 0.02;

/// A difference equation `y = a₁ y₁ + a₂ y₂ + b₀ u + b₁ u₁`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    a: [f64; 2],
    b: [f64; 2],
}

impl Difference {
    /// The one that fits output to input best, in the sense of least squares of the next value. Both go
    /// through the same lag first: slow motion counts, where a tick's own error would drown it.
    pub fn fit(input: &[f64], output: &[f64]) -> Option<Self> {
        let lag = |values: &[f64]| -> Vec<f64> {
            let mut lag = Lag::new(FIT_LAG_S);
            values.iter().map(|&value| lag.step(value)).collect()
        };
        let (input, output) = (lag(input), lag(output));
        let mut normal = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for n in 2..input.len().min(output.len()) {
            let row = Vector4::new(output[n - 1], output[n - 2], input[n], input[n - 1]);
            normal += row * row.transpose();
            right += row * output[n];
        }
        let [a1, a2, b0, b1] = normal.cholesky()?.solve(&right).into();
        Some(Self {
            a: [a1, a2],
            b: [b0, b1],
        })
    }
}

/// A difference equation in motion.
#[derive(Debug, Clone, Copy)]
pub struct Filter {
    difference: Difference,
    input: f64,
    output: [f64; 2],
}

impl Filter {
    /// A filter with all past values zero.
    pub fn new(difference: Difference) -> Self {
        Self {
            difference,
            input: 0.0,
            output: [0.0; 2],
        }
    }

    /// Advances by one tick and gives the output.
    pub fn step(&mut self, input: f64) -> f64 {
        let Difference { a, b } = self.difference;
        let [y1, y2] = self.output;
        let output = a[0] * y1 + a[1] * y2 + b[0] * input + b[1] * self.input;
        self.input = input;
        self.output = [output, y1];
        output
    }
}

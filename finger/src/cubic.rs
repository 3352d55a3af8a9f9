//! Monotone cubic interpolation (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980).

/// A C¹ interpolant through non-decreasing points that never overshoots them.
#[derive(Debug, Clone, PartialEq)]
pub struct MonotoneCubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl MonotoneCubic {
    /// Interpolates `points` `(x, y)`, in strictly rising `x` and non-falling `y`, and starts with slope zero:
    /// a finger's torque does, whose curvature grows with the square of a small pressure (see [`crate::yeoh`]).
    ///
    /// # Panics
    /// With fewer than two points; the callers have validated them.
    pub fn starting_flat(points: &[(f64, f64)]) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let n = x.len();
        let secant: Vec<f64> = (0..n - 1)
            .map(|i| (y[i + 1] - y[i]) / (x[i + 1] - x[i]))
            .collect();
        let mut slope = vec![0.0; n];
        for i in 1..n - 1 {
            let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
            // The weighted harmonic mean keeps monotonicity without a second pass.
            if secant[i - 1] > 0.0 && secant[i] > 0.0 {
                let (wl, wr) = (left + 2.0 * right, 2.0 * left + right);
                slope[i] = (wl + wr) / (wl / secant[i - 1] + wr / secant[i]);
            }
        }
        // The far end keeps the last secant: no curvature is invented beyond the data.
        slope[n - 1] = secant[n - 2];
        Self { x, y, slope }
    }

    /// The value at `x`, held constant outside the points.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        let x = x.clamp(self.x[0], self.x[last]);
        let i = self.x.partition_point(|&knot| knot <= x).clamp(1, last) - 1;
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let (t2, t3) = (t * t, t * t * t);
        self.y[i] * (2.0 * t3 - 3.0 * t2 + 1.0)
            + self.slope[i] * h * (t3 - 2.0 * t2 + t)
            + self.y[i + 1] * (3.0 * t2 - 2.0 * t3)
            + self.slope[i + 1] * h * (t3 - t2)
    }

    /// The largest `x` of the points, beyond which the value is constant.
    pub fn end(&self) -> f64 {
        self.x[self.x.len() - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn passes_through_its_points_and_never_falls(
            steps in prop::collection::vec((0.1f64..50.0, 0.0f64..20.0), 1..8)
        ) {
            let mut points = vec![(0.0, 0.0)];
            for (dx, dy) in steps {
                let (x, y) = points[points.len() - 1];
                points.push((x + dx, y + dy));
            }
            let cubic = MonotoneCubic::starting_flat(&points);
            for &(x, y) in &points {
                prop_assert!((cubic.at(x) - y).abs() < 1e-9);
            }
            let mut before = 0.0;
            for k in 0..=2000 {
                let value = cubic.at(cubic.end() * f64::from(k) / 2000.0);
                prop_assert!(value >= before - 1e-9);
                before = value;
            }
        }
    }
}

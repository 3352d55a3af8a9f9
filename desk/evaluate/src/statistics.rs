//! Quantiles of samples and bounds of counts.

use std::collections::BTreeMap;

use report::json::round;

/// Numbers to a tenth, each with how often it occurred: as small for a million values as for a thousand.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Histogram {
    tenths: BTreeMap<i64, usize>,
    count: usize,
}

impl Histogram {
    /// Adds a value, which must be finite.
    pub fn add(&mut self, value: f64) {
        self.add_tenths((10.0 * round(value, 1)).round() as i64, 1);
    }

    fn add_tenths(&mut self, tenths: i64, times: usize) {
        *self.tenths.entry(tenths).or_default() += times;
        self.count += times;
    }

    /// Adds all values of another one.
    pub fn join(&mut self, other: &Self) {
        for (&tenths, &times) in &other.tenths {
            self.add_tenths(tenths, times);
        }
    }

    /// How many values there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The values from the smallest on, each with the number of those up to it.
    pub fn cumulative(&self) -> impl Iterator<Item = (f64, usize)> {
        self.tenths.iter().scan(0, |below, (&tenths, &times)| {
            *below += times;
            Some((tenths as f64 / 10.0, *below))
        })
    }

    /// The `share`-quantile, none of no values: the smallest value that at least that share does not exceed.
    /// No interpolation: a published latency is one that was measured.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        self.quantile_of(share, self.count)
    }

    /// The same of so many values, of which those that are not here are greater; none if it is one of them.
    pub fn quantile_of(&self, share: f64, count: usize) -> Option<f64> {
        let rank = (share * count as f64).ceil().max(1.0) as usize;
        let mut values = self.cumulative();
        values
            .find(|(_, upto)| *upto >= rank)
            .map(|(value, _)| value)
    }
}

/// Upper 95 % bound of the mean of a Poisson count: the mean at which so few or fewer events have a
/// chance of 5 %. None at all gives 3.0.
pub fn poisson_upper_95(count: u64) -> f64 {
    // At most `count` events.
    let chance = |mean: f64| {
        let mut term = (-mean).exp();
        let mut sum = term;
        for n in 1..=count {
            term *= mean / n as f64;
            sum += term;
        }
        sum
    };
    // Beyond every bound: far above the mean plus two deviations.
    let (mut low, mut high) = (0.0, 10.0 + 3.0 * count as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if chance(middle) > 0.05 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: impl IntoIterator<Item = f64>) -> Histogram {
        let mut histogram = Histogram::default();
        values.into_iter().for_each(|value| histogram.add(value));
        histogram
    }

    #[test]
    fn a_quantile_is_one_of_the_values() {
        let values = of((1..=100).rev().map(f64::from));
        assert_eq!(values.quantile(0.5), Some(50.0));
        assert_eq!(values.quantile(0.99), Some(99.0));
        assert_eq!(values.quantile(1.0), Some(100.0));
        assert_eq!(values.quantile(0.0), Some(1.0));
        assert_eq!(of([7.04]).quantile(0.99), Some(7.0));
        assert_eq!(of([-0.26, -0.04]).quantile(0.5), Some(-0.3));
        assert_eq!(of([-0.26, -0.04]).quantile(1.0), Some(0.0));
        assert_eq!(of([]).quantile(0.5), None);
    }

    #[test]
    fn values_that_are_missing_are_the_greatest() {
        let values = of([3.0, 1.0, 2.0]);
        assert_eq!(values.quantile_of(0.5, 6), Some(3.0));
        assert_eq!(values.quantile_of(0.51, 6), None);
    }

    #[test]
    fn poisson_bounds_are_those_of_the_tables() {
        for (count, expected) in [
            (0, 2.996),
            (1, 4.744),
            (2, 6.296),
            (5, 10.513),
            (10, 16.962),
        ] {
            let bound = poisson_upper_95(count);
            assert!((bound - expected).abs() < 1e-3, "{count}: {bound}");
        }
        // Large counts do not overflow; the normal approximation is near.
        let bound = poisson_upper_95(400);
        assert!((bound - (400.0 + 1.645 * 20.0)).abs() < 3.0, "{bound}");
    }
}

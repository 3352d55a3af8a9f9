//! Quantiles of samples and bounds of counts.

/// The `share`-quantile of sorted values, none of no values: the smallest value that at least that share
/// does not exceed. No interpolation: a published latency is one that was measured.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
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

    #[test]
    fn a_quantile_is_one_of_the_values() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(quantile(&values, 0.5), Some(50.0));
        assert_eq!(quantile(&values, 0.99), Some(99.0));
        assert_eq!(quantile(&values, 1.0), Some(100.0));
        assert_eq!(quantile(&values, 0.0), Some(1.0));
        assert_eq!(quantile(&[7.0], 0.99), Some(7.0));
        assert_eq!(quantile(&[], 0.5), None);
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

//! Slow loss: all fingers but the emptiest have fallen further below their plateau than an arm makes them.

use super::shares::Shares;

/// Their fall.
pub(super) fn fall(shares: &Shares) -> f32 {
    1.0 - shares.others
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_but_the_emptiest_have_lost_counts() {
        let mut shares = Shares::every(0.7);
        // A gauge that fades is not looked at.
        shares.emptiest = 0.0;
        assert!((fall(&shares) - 0.3).abs() < 1e-6);
    }
}

//! Slow loss: all fingers but the emptiest have fallen further below their plateau than an arm makes them.

use super::limits::Limits;
use super::shares::Shares;

/// Their fall, less what counts for nothing, however slow.
pub(super) fn fall(shares: &Shares, limits: &Limits) -> f32 {
    1.0 - shares.others - limits.slow_allowance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::limits::{MOVING, TWO_FINGERS};

    #[test]
    fn what_all_but_the_emptiest_have_lost_counts_beyond_what_an_arm_takes() {
        let mut shares = Shares::every(0.7);
        // A gauge that fades is not looked at.
        shares.emptiest = 0.0;
        for limits in [&MOVING, &TWO_FINGERS] {
            let fall = fall(&shares, limits);
            assert!((fall + limits.slow_allowance - 0.3).abs() < 1e-6, "{fall}");
        }
    }
}

//! Slow loss: all fingers but the emptiest have less than an arm leaves them, both of their plateau and of what they
//! carried lately. What takes several seconds is an object that works its way deeper into the grip, or creep; what
//! goes back to the plateau, one that has turned.

use super::shares::Shares;
use crate::math::larger;

/// Their fall. `shares` are of the plateau, `lately` of what each finger has carried lately.
pub(super) fn fall(shares: &Shares, lately: &Shares) -> f32 {
    1.0 - larger(shares.others, lately.others)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_but_the_emptiest_have_lost_counts() {
        let mut shares = Shares::every(0.7);
        // A gauge that fades is not looked at.
        shares.emptiest = 0.0;
        assert!((fall(&shares, &shares) - 0.3).abs() < 1e-6);
    }

    #[test]
    fn neither_a_way_back_to_the_plateau_nor_one_of_many_seconds_counts() {
        let [empty, full] = [Shares::every(0.6), Shares::every(0.98)];
        for (shares, lately, counts) in [
            (&empty, &empty, true),
            (&full, &empty, false),
            (&empty, &full, false),
        ] {
            assert_eq!(fall(shares, lately) > 0.3, counts);
        }
    }
}

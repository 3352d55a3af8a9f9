//! Slow loss: all fingers but the emptiest have fallen further below their plateau than an arm makes them.

use super::limits::Limits;
use super::shares::Shares;

/// How far they have fallen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slow {
    /// Share of the plateau.
    pub fallen: f32,
}

impl Slow {
    /// At the plateau.
    pub const START: Self = Self { fallen: 0.0 };

    /// The fall, less what counts for nothing, however slow.
    pub fn step(&mut self, shares: &Shares, limits: &Limits) -> f32 {
        self.fallen = 1.0 - shares.others;
        self.fallen - limits.fallen.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::limits::{MOVING, TWO_FINGERS};

    #[test]
    fn what_all_but_the_emptiest_have_lost_counts_beyond_what_an_arm_takes() {
        let mut slow = Slow::START;
        let mut shares = Shares::every(0.7);
        // A gauge that fades is not looked at.
        shares.emptiest = 0.0;
        for limits in [&MOVING, &TWO_FINGERS] {
            let fall = slow.step(&shares, limits);
            assert!((slow.fallen - 0.3).abs() < 1e-6);
            assert!((fall + limits.fallen.limit - 0.3).abs() < 1e-6, "{fall}");
        }
    }
}

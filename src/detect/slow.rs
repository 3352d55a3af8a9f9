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

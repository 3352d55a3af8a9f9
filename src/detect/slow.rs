//! Slow loss: all fingers but the emptiest have fallen further below their plateau than an arm makes them.

use super::limits::Limits;
use super::shares::Shares;

/// Their fall, less what counts for nothing, however slow.
pub(super) fn fall(shares: &Shares, limits: &Limits) -> f32 {
    1.0 - shares.others - limits.slow_allowance
}

//! Slow loss: the sum, less its emptiest finger, has fallen further below the plateau than an arm makes it.

use super::limits::Limits;
use super::shares::Shares;

/// Fall of all fingers but the emptiest below their plateau, less what counts for nothing, however slow.
pub(super) fn fall(shares: &Shares, limits: &Limits) -> f32 {
    1.0 - shares.others - limits.slow_allowance
}

//! What the supervisor sees.

use crate::air::Air;
use crate::condition::Reading;
use crate::detect::Verdict;
use crate::estimate::Contact;
use crate::zero::ZeroReport;

/// What the supervisor sees in one tick.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The readings.
    pub reading: &'a Reading,
    /// The pressure, and what it should be.
    pub air: &'a Air,
    /// What the fingers feel.
    pub contact: &'a Contact,
    /// What has become of the zero.
    pub zero: &'a ZeroReport,
    /// The detector's verdict.
    pub verdict: Verdict,
}

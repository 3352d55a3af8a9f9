//! One-sided loss: an object that leaves sideways empties one finger while it presses on the others.
//!
//! A gauge that fades looks like an emptying finger, but the other fingers do not feel it.

use super::level::Smoothing;
use super::limits::{EMPTYING, Limits, SIDEWAYS};
use super::plateau::CALM;
use super::shares::Shares;
use crate::math::{root, smaller};

/// The least of three noisy numbers lies 0.85 standard deviations below them (order statistics of the normal
/// distribution), and looking ahead doubles that.
const FINGER_SIGMAS: f32 = 2.0;
/// An object that turns in the grip lets the other fingers pass through their plateau on the way.
const FELT_TICKS: u16 = 50;

/// The emptiest finger, and whether the others feel it.
#[derive(Debug, Clone, Copy)]
pub(super) struct OneSided {
    /// Share that the emptiest finger has left of what it had lately, smoothed.
    emptiest: f32,
    /// How much longer the other fingers are taken to feel what the emptiest does.
    felt_ticks: u16,
    /// Fall of the emptiest finger while the object leaves sideways, share; else zero.
    pub emptied: f32,
}

impl OneSided {
    /// Every finger carries.
    pub const START: Self = Self {
        emptiest: 1.0,
        felt_ticks: 0,
        emptied: 0.0,
    };

    /// Fall of the emptiest finger, less what counts for nothing; none unless the object leaves sideways.
    /// `shares` are of the plateau, `lately` of what each finger has carried lately.
    pub fn step(
        &mut self,
        shares: &Shares,
        lately: &Shares,
        smoothing: &Smoothing,
        limits: &Limits,
    ) -> Option<f32> {
        self.emptiest += smoothing.gain * (lately.emptiest - self.emptiest);
        // Where the emptiest finger will be one averaging time from now: a push against the grip makes it
        // empty too, but comes to rest.
        let ahead = 2.0 * lately.emptiest - self.emptiest;
        let falls = 1.0 - ahead;
        let mut fall = smaller(falls - limits.emptied.limit, EMPTYING - lately.emptiest);
        if fall > 0.0 {
            fall -= FINGER_SIGMAS * root(lately.emptiest_variance);
        }
        self.felt_ticks = match (lately.others - 1.0).abs() > CALM {
            true => FELT_TICKS,
            false => self.felt_ticks.saturating_sub(1),
        };
        // A knock from the side presses on the others almost as much as it takes away.
        let leaves = self.is_felt() && shares.sum < 1.0 - SIDEWAYS;
        self.emptied = if leaves { falls } else { 0.0 };
        leaves.then_some(fall)
    }

    /// Whether the other fingers feel what the emptiest does. What they do not feel is a gauge that fades.
    pub fn is_felt(&self) -> bool {
        self.felt_ticks > 0
    }
}

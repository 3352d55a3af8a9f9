//! What a user may choose, by the stage that uses it; checked once and turned into what the control tick needs.
//!
//! [`softgrip_settings`] has the table of all settings, and their values by number.

mod active;
mod factory;
mod leaves;
mod tree;

pub use crate::estimate::{Calibration, GaugeSense};
pub use crate::grasp::{OnFault, OnLoss};
pub use active::Active;
pub use factory::FACTORY;
pub use softgrip_settings::{Decoded, ENCODED_BYTES, SettingsError, Values};
pub use tree::Settings;

use crate::units::FINGERS;

/// The numbers of the settings that a tare changes.
pub const TARE: [u16; FINGERS] = softgrip_settings::per_finger(510);

#[cfg(test)]
mod tests;

//! What a user may choose, by the stage that uses it; checked once and turned into what the control tick needs.
//!
//! [`softgrip_settings`] has the table of all settings, and their values by number.

mod active;
mod factory;
mod leaves;
mod tree;

pub use crate::estimate::GaugeSense;
pub use crate::grasp::{OnFault, OnLoss};
pub use active::Active;
pub use factory::FACTORY;
pub use softgrip_settings::{ENCODED_BYTES, SettingsError, Values};
pub use tree::Settings;

#[cfg(test)]
mod tests;

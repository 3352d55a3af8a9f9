//! What a user may choose, by the stage that uses it; checked once and turned into what the control tick needs.

mod active;
mod error;
mod leaves;
mod record;
mod tree;

pub use crate::estimate::GaugeSense;
pub use crate::grasp::{OnFault, OnLoss};
pub use active::Active;
pub use error::SettingsError;
pub use record::{Decoded, ENCODED_BYTES};
pub use tree::Settings;

#[cfg(test)]
mod tests;

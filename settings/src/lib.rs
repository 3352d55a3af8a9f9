//! The settings of the controller by number: what each is, its values, and how they are stored.
//!
//! One row of [`FIELDS`] is all there is to say about a setting. The controller takes ranges and defaults from it,
//! the command `softgrip` and the build script the TOML file, and the manual its page. `softgrip::settings` has the
//! settings as typed fields.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(any(test, feature = "file"))]
extern crate std;

mod error;
mod field;
mod fields;
#[cfg(feature = "file")]
pub mod file;
#[cfg(feature = "file")]
pub mod page;
mod record;
mod values;

pub use error::SettingsError;
pub use field::{Field, Kind, Limit};
pub use fields::{COUNT, FIELDS, per_finger};
pub use record::{Decoded, ENCODED_BYTES};
pub use values::{LIMITS, Values, place};

/// Version of the settings file.
pub const VERSION: u16 = 1;

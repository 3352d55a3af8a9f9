//! What results were made with, so that only what belongs together is compared or joined.

use finger::recipe::Recipe;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use softgrip::settings::Settings;

/// The program that makes results.
#[derive(Debug, Clone, Copy)]
pub struct Build {
    /// Its version.
    pub version: &'static str,
    /// The commit that it was built from. A plus sign and a hash of the changes follow where the sources differed
    /// from it.
    pub commit: &'static str,
}

/// Program, finger and settings behind a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    version: String,
    commit: String,
    recipe: String,
    recipe_hash: String,
    settings_hash: String,
}

impl Provenance {
    /// Of results that this program makes of a finger at the controller's settings.
    pub fn new(build: Build, recipe: &Recipe, settings: &Settings) -> Self {
        Self {
            version: build.version.into(),
            commit: build.commit.into(),
            recipe: recipe.name.clone(),
            recipe_hash: format!("{:016x}", recipe.inputs_hash),
            settings_hash: hash(&format!("{settings:?}")),
        }
    }
}

/// First eight bytes of the SHA-256, as of a recipe.
fn hash(text: &str) -> String {
    let digest = Sha256::digest(text);
    digest[..8]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

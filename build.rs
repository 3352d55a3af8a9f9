//! Finger recipe → table; settings file → what the image starts with.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use softgrip_table::{FingerTable, LinkTable};

/// The recipe of the finger that the firmware is for, relative to this package.
const DEFAULT_RECIPE: &str = "recipes/rtv225.toml";

fn main() -> ExitCode {
    println!("cargo::rerun-if-env-changed=SOFTGRIP_RECIPE");
    let recipe = std::env::var("SOFTGRIP_RECIPE").unwrap_or_else(|_| DEFAULT_RECIPE.into());
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join(recipe);
    println!("cargo::rerun-if-changed={}", recipe.display());
    match make_tables(&recipe).and_then(make_settings) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            for line in error.to_string().lines() {
                println!("cargo::error={line}");
            }
            ExitCode::FAILURE
        }
    }
}

/// Writes the tables of the finger that the image is for, and of the default one for the library's tests. Gives the
/// first.
fn make_tables(recipe: &Path) -> Result<FingerTable, Box<dyn std::error::Error>> {
    let out = out_dir()?;
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join(DEFAULT_RECIPE);
    println!("cargo::rerun-if-changed={}", default.display());
    let wanted = tables(recipe)?;
    // As a Rust expression, which the `Debug` form of plain data is.
    let write = |name: &str, text: String| std::fs::write(out.join(name), text);
    write("finger_table.rs", format!("{:?}", wanted.0))?;
    write("finger_links.rs", format!("{:?}", wanted.1))?;
    let default = match recipe == default {
        true => wanted,
        false => tables(&default)?,
    };
    write("default_table.rs", format!("{:?}", default.0))?;
    write("default_links.rs", format!("{:?}", default.1))?;
    Ok(wanted.0)
}

/// Writes what the settings file of this build states, by number: nothing, if there is none.
fn make_settings(finger: FingerTable) -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-env-changed=SOFTGRIP_SETTINGS");
    let stated = match std::env::var("SOFTGRIP_SETTINGS") {
        Ok(path) => {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
            println!("cargo::rerun-if-changed={}", path.display());
            softgrip_settings::file::read(&path, finger.max_pressure_kpa)?
        }
        Err(_) => Vec::new(),
    };
    let text = format!("{stated:?}");
    std::fs::write(out_dir()?.join("factory_settings.rs"), text)?;
    Ok(())
}

fn out_dir() -> Result<PathBuf, std::env::VarError> {
    std::env::var("OUT_DIR").map(PathBuf::from)
}

/// The tables of a recipe.
fn tables(path: &Path) -> Result<(FingerTable, LinkTable), Box<dyn std::error::Error>> {
    let recipe = finger::recipe::load(path)?;
    let table =
        finger::table::of(&recipe).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok((table, finger::table::links(&recipe.chain)))
}

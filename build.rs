//! Finger recipe → table; settings file → what the image starts with.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use softgrip_table::FingerTable;

/// The recipe of the finger that the firmware is for, relative to this package.
const DEFAULT_RECIPE: &str = "recipes/rtv225.toml";

fn main() -> ExitCode {
    println!("cargo::rerun-if-env-changed=SOFTGRIP_RECIPE");
    let recipe = std::env::var("SOFTGRIP_RECIPE").unwrap_or_else(|_| DEFAULT_RECIPE.into());
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join(recipe);
    println!("cargo::rerun-if-changed={}", recipe.display());
    link_firmware();
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
    let wanted = table(recipe)?;
    // As a Rust expression, which the `Debug` form of plain data is.
    std::fs::write(out.join("finger_table.rs"), format!("{wanted:?}"))?;
    let default = match recipe == default {
        true => wanted,
        false => table(&default)?,
    };
    std::fs::write(out.join("default_table.rs"), format!("{default:?}"))?;
    Ok(wanted)
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

/// The table of a recipe.
fn table(path: &Path) -> Result<FingerTable, Box<dyn std::error::Error>> {
    let recipe = finger::recipe::load(path)?;
    finger::table::of(&recipe).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// The commit that the image is built from, with a plus sign where files differ from it; what is no checkout
/// has none.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return "no commit".into();
    };
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    match git(&["status", "--porcelain", "--untracked-files=no"]) {
        Some(changes) if changes.is_empty() => commit,
        _ => format!("{commit}+"),
    }
}

/// Link arguments of the firmware; the host's binaries need none.
fn link_firmware() {
    println!("cargo::rerun-if-changed=memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        println!("cargo::rustc-env=SOFTGRIP_COMMIT={}", commit());
        // The linker looks for memory.x here.
        println!("cargo::rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
    }
}

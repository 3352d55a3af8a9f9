//! A fingerprint of what decides a simulated loss besides the case itself, for the names of kept recordings:
//! the sources of simulator, finger model and controller, and the versions of all that they are built on.

use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Files and folders, relative to this package.
const SOURCES: [&str; 9] = [
    "src/case.rs",
    "src/record.rs",
    "src/sensor_model.rs",
    "../sim/src",
    "../sim/gripper.toml",
    "../../finger/src",
    "../../settings/src",
    "../../src",
    // The rigid-body engine, and whatever it computes with.
    "../../Cargo.lock",
];

/// What begins like this in the controller's sources has no share in the physics: the detector watches the
/// gauges, and until it reports a loss it moves nothing. Recordings are kept for work on it.
const DETECTOR: &str = "../../src/detect";

fn main() -> io::Result<()> {
    let mut hasher = Sha256::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        add(Path::new(source), &mut hasher)?;
    }
    let digest = hasher.finalize();
    let fingerprint = digest.iter().map(|byte| format!("{byte:02x}"));
    println!(
        "cargo::rustc-env=PHYSICS_SHA256={}",
        fingerprint.collect::<String>()
    );
    Ok(())
}

/// Adds a file with its name, or a folder's files in the order of their names.
fn add(path: &Path, hasher: &mut Sha256) -> io::Result<()> {
    if path.to_string_lossy().starts_with(DETECTOR) {
        return Ok(());
    }
    if path.is_dir() {
        let entries = std::fs::read_dir(path)?.map(|entry| Ok(entry?.path()));
        let mut entries = entries.collect::<io::Result<Vec<PathBuf>>>()?;
        entries.sort();
        return entries.iter().try_for_each(|entry| add(entry, hasher));
    }
    let content = std::fs::read(path)?;
    hasher.update(path.to_string_lossy().as_bytes());
    hasher.update((content.len() as u64).to_le_bytes());
    hasher.update(content);
    Ok(())
}

//! The commit that the command is built from, for the results that it writes.

use std::path::Path;
use std::process::Command;

use sha2::{Digest, Sha256};

/// Whatever the command is built from, relative to this package.
const SOURCES: [&str; 13] = [
    "build.rs",
    "src",
    "../evaluate/src",
    "../report/src",
    "../sim/src",
    "../sim/gripper.toml",
    "../studies/src",
    "../../finger/src",
    "../../settings/src",
    "../../src",
    "../../table/src",
    "../../recipes",
    "../../Cargo.lock",
];

fn main() {
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    if let Some(log) =
        git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| Path::new(log).exists())
    {
        println!("cargo::rerun-if-changed={log}");
    }
    println!("cargo::rustc-env=SOFTGRIP_COMMIT={}", commit());
}

/// With a plus sign and a hash of the changes where the sources differ from the commit; what is no checkout has none.
fn commit() -> String {
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return "no commit".into();
    };
    let mut diff = vec!["diff", "HEAD", "--"];
    diff.extend(SOURCES);
    match git(&diff) {
        Some(changes) if changes.is_empty() => commit,
        changes => {
            let hash = Sha256::digest(changes.unwrap_or_default());
            let hash = hash[..4].iter().map(|byte| format!("{byte:02x}"));
            format!("{commit}+{}", hash.collect::<String>())
        }
    }
}

/// What git says; none if there is no git, or it does not know.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    output.status.success().then_some(text)
}

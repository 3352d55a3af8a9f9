//! What the image says of itself, and how it is linked.

use std::process::Command;

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

/// Link arguments of the image; a host that looks at it needs none.
fn main() {
    println!("cargo::rerun-if-changed=../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        println!("cargo::rustc-env=SOFTGRIP_COMMIT={}", commit());
        // The linker looks for memory.x here.
        println!("cargo::rustc-link-search={}/..", env!("CARGO_MANIFEST_DIR"));
        for argument in ["--nmagic", "--build-id=fast", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
    }
}

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

/// The memories of each board, by its feature.
const MEMORIES: [(&str, &str); 2] = [
    (
        "CARGO_FEATURE_BOARD_NUCLEO_F429ZI",
        "../boards/nucleo_f429zi.x",
    ),
    (
        "CARGO_FEATURE_BOARD_NUCLEO_G474RE",
        "../boards/nucleo_g474re.x",
    ),
];

/// Puts the chosen board's memories where the linker finds what memory.x includes.
fn memories() {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    for (feature, file) in MEMORIES {
        println!("cargo::rerun-if-changed={file}");
        if std::env::var_os(feature).is_some() {
            std::fs::copy(file, format!("{out}/board.x")).expect("it is there");
        }
    }
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rustc-link-search={out}");
}

/// Link arguments of the image; a host that looks at it needs none.
fn main() {
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        println!("cargo::rustc-env=SOFTGRIP_COMMIT={}", commit());
        memories();
        for argument in ["--nmagic", "--build-id=fast", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
    }
}

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

/// The memory map of each board, by its feature.
const MEMORY_MAPS: [(&str, &str); 2] = [
    ("CARGO_FEATURE_BOARD_NUCLEO_F429ZI", "memory.x"),
    (
        "CARGO_FEATURE_BOARD_NUCLEO_G474RE",
        "boards/nucleo_g474re.x",
    ),
];

/// Puts the chosen board's memory map, and what all images have behind it, where the linker looks for memory.x.
fn memory_map() {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    let read = |file: &str| {
        let path = format!("{}/{file}", env!("CARGO_MANIFEST_DIR"));
        println!("cargo::rerun-if-changed={path}");
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
    };
    let build_id = read("build_id.x");
    for (feature, file) in MEMORY_MAPS {
        let map = read(&format!("../{file}"));
        if std::env::var_os(feature).is_some() {
            std::fs::write(format!("{out}/memory.x"), map + &build_id).expect("it can be written");
        }
    }
    println!("cargo::rustc-link-search={out}");
}

/// Link arguments of the image; a host that looks at it needs none.
fn main() {
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        println!("cargo::rustc-env=SOFTGRIP_COMMIT={}", commit());
        memory_map();
        for argument in ["--nmagic", "--build-id=fast", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
    }
}

//! Output files that are either complete or absent.

use std::fs;
use std::path::Path;

use anyhow::Context;

/// Writes `content` to `dir/name` by way of a file beside it, so that a full disk or a kill leaves no
/// half of it under its name.
///
/// # Errors
/// If the file cannot be written; the message names its path.
pub fn write(dir: &Path, name: &str, content: &[u8]) -> anyhow::Result<()> {
    let part = dir.join(format!(".{name}.part"));
    let path = dir.join(name);
    fs::write(&part, content)
        .and_then(|()| fs::rename(&part, &path))
        .inspect_err(|_| {
            // What went wrong matters more than whether the leftover could be removed.
            let _ = fs::remove_file(&part);
        })
        .with_context(|| format!("{}: cannot write", path.display()))
}

/// Creates `dir` and checks that files can be written there, before any work is done for them.
///
/// # Errors
/// If the directory cannot be created or written to; the message names its path.
pub fn prepare(dir: &Path) -> anyhow::Result<()> {
    let probe = dir.join(".softgrip.part");
    fs::create_dir_all(dir)
        .and_then(|()| fs::write(&probe, b""))
        .and_then(|()| fs::remove_file(&probe))
        .with_context(|| format!("{}: not a directory that can be written to", dir.display()))
}

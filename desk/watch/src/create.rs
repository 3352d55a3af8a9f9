//! Files that are made, and take the place of none without being told to; what a file is, by its name.

use std::fs::{File, OpenOptions};
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, anyhow};

/// Makes a file, and takes the place of one that is there only where that is allowed.
///
/// # Errors
/// If there is one, or it cannot be made.
pub fn create(path: &Path, may_replace: bool) -> anyhow::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true);
    match may_replace {
        true => options.create(true).truncate(true),
        false => options.create_new(true),
    };
    match options.open(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(taken(path)),
        made => made.with_context(|| format!("{}: cannot be written", path.display())),
    }
}

/// Why a file is not made where there is one.
pub fn taken(path: &Path) -> anyhow::Error {
    anyhow!(
        "{}: is there already: choose another name, or replace it with --force",
        path.display()
    )
}

/// The end of a file's name, as `csv`, in lower case: some loggers write `.CSV`. Empty if there is none.
pub fn ending(path: &Path) -> String {
    let end = path.extension().and_then(|end| end.to_str());
    end.unwrap_or_default().to_lowercase()
}

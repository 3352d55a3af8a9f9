//! Recordings as they are read.

use std::path::Path;

use crate::csv_file;
use crate::mcap_file;
use crate::recorder::Format;
use crate::told::Told;

/// Reads a recording; `take` gets what is told, in its order. What is missing is told as a note at its end.
///
/// # Errors
/// If the file cannot be read, or has what no recording of a gripper has; or if `take` fails.
pub fn read(path: &Path, take: &mut impl FnMut(Told) -> anyhow::Result<()>) -> anyhow::Result<()> {
    match Format::of(path)? {
        Format::Csv => csv_file::read(path, take),
        Format::Mcap => {
            let read = mcap_file::read(path, take)?;
            match read.missing {
                Some(missing) => take(Told::Note(format!("{}: {missing}", path.display()))),
                None => Ok(()),
            }
        }
    }
}

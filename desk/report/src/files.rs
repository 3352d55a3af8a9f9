//! Output files that are either complete or absent.

use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use tempfile::{Builder, NamedTempFile};

/// A file that gets its name when it is complete.
pub struct Pending {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl Pending {
    /// Begins `dir/name`, as a file beside it under a random name: other processes, also on other machines, may
    /// write the same.
    ///
    /// # Errors
    /// If the file cannot be created; the message names its path.
    pub fn create(dir: &Path, name: &str) -> anyhow::Result<Self> {
        let path = dir.join(name);
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // As for any other new file; the default is one that only its owner may read.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(dir);
        let file = file.with_context(|| format!("{}: cannot write", path.display()))?;
        Ok(Self {
            file: BufWriter::new(file),
            path,
        })
    }

    /// As [`Self::create`], from a path. What is there already must be a file: a device would be replaced by one.
    ///
    /// # Errors
    /// As [`Self::create`], or if there is something else than a file; the message names the path.
    pub fn at(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        ensure!(
            path.is_file() || !path.exists(),
            "{shown}: cannot write, because it is not a file"
        );
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.with_context(|| format!("{shown}: not the name of a file"))?;
        let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty());
        Self::create(dir.unwrap_or(Path::new(".")), name)
    }

    /// Gives the file its name, in place of one that had it.
    ///
    /// # Errors
    /// If the file cannot be written; the message names its path.
    pub fn finish(self) -> anyhow::Result<()> {
        let Self { file, path } = self;
        let named = file.into_inner().map_err(|error| error.into_error());
        named
            .and_then(|file| Ok(file.persist(&path)?))
            .with_context(|| format!("{}: cannot write", path.display()))?;
        Ok(())
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes `content` to `dir/name` by way of a file beside it, so that a full disk or a kill leaves no
/// half of it under its name.
///
/// # Errors
/// If the file cannot be written; the message names its path.
pub fn write(dir: &Path, name: &str, content: &[u8]) -> anyhow::Result<()> {
    let mut pending = Pending::create(dir, name)?;
    let written = pending.write_all(content);
    written.with_context(|| format!("{}: cannot write", dir.join(name).display()))?;
    pending.finish()
}

/// Creates `dir` and checks that files can be written there, before any work is done for them.
///
/// # Errors
/// If the directory cannot be created or written to; the message names its path.
pub fn prepare(dir: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(dir)
        .and_then(|()| tempfile::tempfile_in(dir))
        .with_context(|| format!("{}: not a directory that can be written to", dir.display()))?;
    Ok(())
}

//! Files that grow line by line while a study runs, and that a killed study leaves behind.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};

/// What a kill loses at most: results are written about this often.
pub const WRITTEN_EVERY: Duration = Duration::from_secs(10);

/// A file that this process adds lines to.
pub struct Journal {
    /// What a user should know: half a line was dropped, or the file could not be locked.
    pub notes: Vec<String>,
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens or creates the file, and calls `line` with the number, from 1, of each line that is there and its text.
    /// Half a line at the end, as a kill leaves it, is dropped.
    ///
    /// # Errors
    /// If another process writes the file, it cannot be read or written, or `line` refuses a line.
    pub fn open(
        path: &Path,
        mut line: impl FnMut(u64, &str) -> anyhow::Result<()>,
    ) -> anyhow::Result<Self> {
        let context = || path.display().to_string();
        let mut options = OpenOptions::new();
        let file = options.create(true).append(true).read(true).open(path);
        let file = file.with_context(context)?;
        let mut notes = Vec::new();
        notes.extend(locked(path, file.try_lock())?);
        let mut lines = Lines::of(path);
        let mut number = 0;
        while let Some(text) = lines.next_line()? {
            number += 1;
            line(number, &text)?;
        }
        let length = file.metadata().with_context(context)?.len();
        if lines.complete < length {
            notes.push(format!(
                "{}: dropped half a line that a killed process left",
                path.display()
            ));
            file.set_len(lines.complete).with_context(context)?;
        }
        Ok(Self {
            notes,
            path: path.to_path_buf(),
            file,
        })
    }

    /// Appends whole lines, each with its end, and waits until they are on the disk.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn append(&mut self, text: &str) -> anyhow::Result<()> {
        self.file
            .write_all(text.as_bytes())
            .and_then(|()| self.file.sync_data())
            .with_context(|| format!("{}: cannot write", self.path.display()))
    }
}

/// A warning where there are no locks, as on some network file systems.
fn locked(path: &Path, lock: Result<(), TryLockError>) -> anyhow::Result<Option<String>> {
    let path = path.display();
    match lock {
        Ok(()) => Ok(None),
        Err(TryLockError::WouldBlock) => bail!("{path}: another process is writing it"),
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
            Ok(Some(format!(
                "{path}: its file system knows no locks ({error}); two processes that write it at once would spoil it"
            )))
        }
        Err(TryLockError::Error(error)) => Err(error).with_context(|| path.to_string()),
    }
}

/// The lines of a file, which is open only while more of it is read, so that thousands can be read side by side.
pub struct Lines {
    /// Bytes of the complete lines that have been read.
    pub complete: u64,
    path: PathBuf,
    read: u64,
    buffer: VecDeque<u8>,
    /// So much of the buffer is known to hold no end of a line.
    searched: usize,
}

/// Bytes that are read at a time.
const CHUNK: u64 = 1 << 16;

impl Lines {
    /// From the start of a file.
    pub fn of(path: &Path) -> Self {
        Self {
            complete: 0,
            path: path.to_path_buf(),
            read: 0,
            buffer: VecDeque::new(),
            searched: 0,
        }
    }

    /// The next complete line without its end; none after the last one.
    ///
    /// # Errors
    /// If the file cannot be read, or is not text.
    pub fn next_line(&mut self) -> anyhow::Result<Option<String>> {
        loop {
            let mut unsearched = self.buffer.iter().skip(self.searched);
            match unsearched.position(|byte| *byte == b'\n') {
                Some(more) => {
                    let length = self.searched + more;
                    let line: Vec<u8> = self.buffer.drain(..=length).take(length).collect();
                    self.complete += length as u64 + 1;
                    self.searched = 0;
                    let line = String::from_utf8(line);
                    return Ok(Some(line.with_context(|| self.path.display().to_string())?));
                }
                None => {
                    self.searched = self.buffer.len();
                    let more = self.more();
                    if more.with_context(|| self.path.display().to_string())? == 0 {
                        return Ok(None);
                    }
                }
            }
        }
    }

    fn more(&mut self) -> io::Result<usize> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.read))?;
        let mut bytes = Vec::new();
        let read = file.take(CHUNK).read_to_end(&mut bytes)?;
        self.read += read as u64;
        self.buffer.extend(bytes);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &Path) -> (Vec<String>, Journal) {
        let mut lines = Vec::new();
        let journal = Journal::open(path, |number, line| {
            lines.push(line.to_string());
            assert_eq!(number, lines.len() as u64);
            Ok(())
        });
        (lines, journal.expect("a journal"))
    }

    #[test]
    fn a_journal_goes_on_after_its_last_whole_line() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("journal");
        let long = "x".repeat(3 * CHUNK as usize);
        let (none, mut journal) = lines(&path);
        assert!(none.is_empty() && journal.notes.is_empty());
        journal
            .append(&format!("a\n\n{long}\nhal"))
            .expect("written");
        drop(journal);
        let (found, mut journal) = lines(&path);
        assert_eq!(found, ["a", "", &long]);
        assert!(
            journal.notes[0].contains("half a line"),
            "{:?}",
            journal.notes
        );
        journal.append("b\n").expect("written");
        drop(journal);
        assert_eq!(lines(&path).0, ["a", "", &long, "b"]);
    }

    #[test]
    fn a_journal_has_one_writer() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("journal");
        let _first = lines(&path);
        let second = Journal::open(&path, |_, _| Ok(()));
        let error = second.err().expect("refused").to_string();
        assert!(error.contains("another process is writing it"), "{error}");
    }

    #[test]
    fn a_file_system_without_locks_is_a_warning_and_no_error() {
        let path = Path::new("journal");
        let error = |kind: io::ErrorKind| TryLockError::Error(kind.into());
        let note = locked(path, Err(error(io::ErrorKind::Unsupported))).expect("no error");
        assert!(note.is_some_and(|note| note.contains("knows no locks")));
        assert!(locked(path, Err(error(io::ErrorKind::PermissionDenied))).is_err());
    }
}

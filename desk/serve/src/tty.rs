//! A pseudo-terminal, which a client opens as if it were a serial line.

use std::ffi::OsStr;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use rustix::event::{PollFd, PollFlags};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use crate::io::{Came, wait_for};

/// Bytes of a client that has gone are flushed so often, with a pause between, for the kernel passes them on late.
const FLUSHES: u32 = 3;
const FLUSH_PAUSE: Duration = Duration::from_millis(5);

/// The gripper's side of a pseudo-terminal.
pub struct Tty {
    master: OwnedFd,
    /// The client's side.
    device: PathBuf,
    /// A stable name for it.
    link: Option<PathBuf>,
    /// Nobody has the client's side open.
    is_alone: bool,
    flushes: u32,
    flushed: Instant,
}

impl Tty {
    /// Makes a pseudo-terminal, and a link to it.
    ///
    /// # Errors
    /// If there is something else at the link's path, or it cannot be made.
    pub fn open(link: Option<&Path>) -> anyhow::Result<Self> {
        let (master, device) = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)
            .and_then(|master| {
                grantpt(&master)?;
                unlockpt(&master)?;
                rustix::io::ioctl_fionbio(&master, true)?;
                let name = ptsname(&master, Vec::new())?;
                Ok((master, PathBuf::from(OsStr::from_bytes(name.as_bytes()))))
            })
            .context("cannot make a pseudo-terminal")?;
        if let Some(link) = link {
            make_link(link, &device)?;
        }
        let tty = Self {
            master,
            device,
            link: link.map(Path::to_path_buf),
            is_alone: true,
            flushes: FLUSHES,
            flushed: Instant::now(),
        };
        // Once opened and closed, it hangs up, which it does not when it is new.
        tty.flush();
        Ok(tty)
    }

    /// What a client opens.
    pub fn name(&self) -> String {
        let name = self.link.as_ref().unwrap_or(&self.device);
        name.display().to_string()
    }

    /// Waits until something has come, but no longer than this.
    pub fn wait(&self, at_most: Duration) {
        if self.is_alone {
            // It hangs up all the time, and there is nothing to wait for.
            std::thread::sleep(at_most);
        } else {
            wait_for(&mut [PollFd::new(&self.master, PollFlags::IN)], at_most);
        }
    }

    /// Reads what has come, without waiting.
    pub fn read(&mut self, bytes: &mut [u8]) -> Came {
        if self.hangs_up() {
            let has_left = !std::mem::replace(&mut self.is_alone, true);
            if has_left {
                self.flushes = FLUSHES;
            }
            self.forget(bytes);
            return match has_left {
                true => Came::Left,
                false => Came::Nothing,
            };
        }
        if std::mem::take(&mut self.is_alone) {
            return Came::Client("a client has opened it".into());
        }
        // The client may have gone since: that is seen the next time.
        match rustix::io::read(&self.master, bytes) {
            Ok(0) | Err(_) => Came::Nothing,
            Ok(count) => Came::Bytes(count),
        }
    }

    /// Writes an answer as far as there is room: a client that does not read does not stop the gripper.
    pub fn write(&mut self, bytes: &[u8]) {
        // A part of an answer is as good as none, for its checksum is missing.
        let _ = rustix::io::write(&self.master, bytes);
    }

    /// Whether nobody has the client's side open.
    fn hangs_up(&self) -> bool {
        let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
        wait_for(&mut fds, Duration::ZERO);
        fds[0].revents().contains(PollFlags::HUP)
    }

    /// Drops what a client that has gone has left: requests that nobody waits for, and answers that the next one would
    /// take for its own.
    fn forget(&mut self, bytes: &mut [u8]) {
        while matches!(rustix::io::read(&self.master, &mut *bytes), Ok(1..)) {}
        if self.flushes > 0 && self.flushed.elapsed() >= FLUSH_PAUSE {
            self.flush();
            self.flushes -= 1;
            self.flushed = Instant::now();
        }
    }

    /// Drops unread answers. Those that have passed the line lie with the client's side, which must be opened to be
    /// flushed; it is also made raw again, whatever the last client has made of it.
    fn flush(&self) {
        // What fails here leaves a few bytes to the next client, whose checksums tell.
        let _ = tcflush(&self.master, QueueSelector::OFlush);
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        if let Ok(device) = rustix::fs::open(&self.device, flags, Mode::empty()) {
            let _ = tcflush(&device, QueueSelector::IFlush);
            if let Ok(mut termios) = tcgetattr(&device) {
                termios.make_raw();
                let _ = tcsetattr(&device, OptionalActions::Now, &termios);
            }
        }
    }
}

impl Drop for Tty {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|target| target == self.device)
        {
            // There is nobody left to be told.
            let _ = std::fs::remove_file(link);
        }
    }
}

/// Makes a link to the device. One that leads nowhere is left from before and replaced.
fn make_link(link: &Path, device: &Path) -> anyhow::Result<()> {
    let name = link.display();
    if let Ok(found) = link.symlink_metadata() {
        if !found.is_symlink() {
            bail!("{name}: there is something that is no link: choose another path");
        }
        if link.exists() {
            bail!(
                "{name}: is taken: it leads to {}; end who serves there, or choose another path",
                std::fs::read_link(link).unwrap_or_default().display()
            );
        }
        std::fs::remove_file(link).with_context(|| format!("{name}: cannot replace the link"))?;
    }
    std::os::unix::fs::symlink(device, link).with_context(|| {
        format!("{name}: cannot make the link: choose a path in a folder that you may write to")
    })
}

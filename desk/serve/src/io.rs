//! What the kinds of port have in common.

use std::time::Duration;

use rustix::event::{PollFd, Timespec, poll};
use rustix::io::Errno;

/// What has come from a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Came {
    /// Nothing.
    Nothing,
    /// So many bytes.
    Bytes(usize),
    /// A client that was not there before; what is to be said of it.
    Client(String),
    /// The client has gone, and nobody waits for what it has asked.
    Left,
}

/// Waits for one of these, but no longer than this.
pub fn wait_for(fds: &mut [PollFd<'_>], at_most: Duration) {
    let timeout = Timespec {
        tv_sec: at_most.as_secs() as i64,
        tv_nsec: at_most.subsec_nanos().into(),
    };
    if let Err(error) = poll(fds, Some(&timeout))
        && error != Errno::INTR
    {
        // It cannot be waited for, but time must pass.
        std::thread::sleep(at_most);
    }
}

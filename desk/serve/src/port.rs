//! Where clients come in.

use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use crate::io::Came;
use crate::pipe::Pipe;
use crate::tcp::Tcp;
use crate::tty::Tty;

/// A port with one client at a time.
pub enum Port {
    /// A pseudo-terminal.
    Tty(Tty),
    /// TCP.
    Tcp(Tcp),
    /// Somebody in this process.
    Pipe(Pipe),
}

impl Port {
    /// Makes a pseudo-terminal; `link` is a stable name for it.
    ///
    /// # Errors
    /// If the link cannot be made.
    pub fn tty(link: Option<&Path>) -> anyhow::Result<Self> {
        Tty::open(link).map(Self::Tty)
    }

    /// Listens at a TCP port.
    ///
    /// # Errors
    /// If it is taken or may not be used.
    pub fn tcp(address: SocketAddr) -> anyhow::Result<Self> {
        Tcp::open(address).map(Self::Tcp)
    }

    /// What a client is to be told to connect to.
    pub fn name(&self) -> String {
        match self {
            Self::Tty(tty) => tty.name(),
            Self::Tcp(tcp) => tcp.address().to_string(),
            Self::Pipe(_) => "this process".into(),
        }
    }

    /// Waits until something has come, but no longer than this.
    pub fn wait(&mut self, at_most: Duration) {
        match self {
            Self::Tty(tty) => tty.wait(at_most),
            Self::Tcp(tcp) => tcp.wait(at_most),
            Self::Pipe(pipe) => pipe.wait(at_most),
        }
    }

    /// Reads what has come, without waiting.
    pub fn read(&mut self, bytes: &mut [u8]) -> Came {
        match self {
            Self::Tty(tty) => tty.read(bytes),
            Self::Tcp(tcp) => tcp.read(bytes),
            Self::Pipe(pipe) => match pipe.read(bytes) {
                0 => Came::Nothing,
                count => Came::Bytes(count),
            },
        }
    }

    /// Writes an answer, without waiting.
    pub fn write(&mut self, bytes: &[u8]) {
        match self {
            Self::Tty(tty) => tty.write(bytes),
            Self::Tcp(tcp) => tcp.write(bytes),
            Self::Pipe(pipe) => pipe.write(bytes),
        }
    }
}

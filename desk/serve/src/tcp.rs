//! RTU frames over TCP.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use anyhow::Context;
use rustix::event::{PollFd, PollFlags};

use crate::io::{Came, wait_for};

/// A TCP port with one client at a time; a new one takes the place of the old.
pub struct Tcp {
    listener: TcpListener,
    address: SocketAddr,
    client: Option<TcpStream>,
}

impl Tcp {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// If the port is taken, or may not be used.
    pub fn open(address: SocketAddr) -> anyhow::Result<Self> {
        let listener = TcpListener::bind(address).with_context(|| {
            format!(
                "{address}: cannot listen there: choose another port, or 0 for any that is free"
            )
        })?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            address: listener.local_addr()?,
            listener,
            client: None,
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Waits until something has come, but no longer than this.
    pub fn wait(&self, at_most: Duration) {
        let listener = PollFd::new(&self.listener, PollFlags::IN);
        match &self.client {
            Some(client) => {
                let client = PollFd::new(client, PollFlags::IN);
                wait_for(&mut [listener, client], at_most);
            }
            None => wait_for(&mut [listener], at_most),
        }
    }

    /// Reads what has come, without waiting.
    pub fn read(&mut self, bytes: &mut [u8]) -> Came {
        if let Ok((client, from)) = self.listener.accept() {
            // A socket that refuses these is as good as gone, which is seen when it is read.
            let _ = client.set_nonblocking(true);
            let _ = client.set_nodelay(true);
            let text = match self.client.replace(client) {
                None => format!("client {from}"),
                Some(_) => format!("client {from} takes the place of the last one"),
            };
            return Came::Client(text);
        }
        let Some(client) = &mut self.client else {
            return Came::Nothing;
        };
        match client.read(bytes) {
            Ok(count) if count > 0 => Came::Bytes(count),
            Err(error) if is_passing(error.kind()) => Came::Nothing,
            Ok(_) | Err(_) => {
                self.client = None;
                Came::Left
            }
        }
    }

    /// Writes an answer. A client that does not read so much that there is no room for one is left: half an answer
    /// would make nonsense of all that follow.
    pub fn write(&mut self, bytes: &[u8]) {
        if let Some(client) = &mut self.client
            && client.write(bytes).ok() != Some(bytes.len())
        {
            self.client = None;
        }
    }
}

fn is_passing(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

//! A line within this process, for whoever has the virtual gripper at the other end.

use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

/// One end of it: what the other writes this one reads.
pub struct Pipe {
    sender: Sender<Vec<u8>>,
    receiver: Receiver<Vec<u8>>,
    bytes: VecDeque<u8>,
}

/// Both ends.
pub fn pipe() -> (Pipe, Pipe) {
    let (there, from_there) = mpsc::channel();
    let (back, from_back) = mpsc::channel();
    let end = |sender, receiver| Pipe {
        sender,
        receiver,
        bytes: VecDeque::new(),
    };
    (end(there, from_back), end(back, from_there))
}

impl Pipe {
    /// Waits until something has come, but no longer than this.
    pub fn wait(&mut self, at_most: Duration) {
        if !self.bytes.is_empty() {
            return;
        }
        match self.receiver.recv_timeout(at_most) {
            Ok(bytes) => self.bytes.extend(bytes),
            Err(RecvTimeoutError::Timeout) => {}
            // Nothing will come, but time must pass.
            Err(RecvTimeoutError::Disconnected) => thread::sleep(at_most),
        }
    }

    /// Reads what has come, without waiting, and gives how many bytes.
    pub fn read(&mut self, room: &mut [u8]) -> usize {
        while let Ok(bytes) = self.receiver.try_recv() {
            self.bytes.extend(bytes);
        }
        let count = room.len().min(self.bytes.len());
        for (place, byte) in room.iter_mut().zip(self.bytes.drain(..count)) {
            *place = byte;
        }
        count
    }

    /// Writes. What nobody reads any more is gone.
    pub fn write(&mut self, bytes: &[u8]) {
        let _ = self.sender.send(bytes.to_vec());
    }
}

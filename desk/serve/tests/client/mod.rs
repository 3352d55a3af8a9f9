//! A running virtual gripper, and a client that speaks in raw frames.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serve::play::Play;
use serve::port::Port;
use serve::run::{self, Line, Options, Summary};
use serve::script;
use serve::twin::Twin;
use sim::setup::Setup;

/// Patience with a machine that has much else to do.
pub const LONG: Duration = Duration::from_secs(60);

/// Nothing comes for so long where nothing is to come.
pub const SILENCE: Duration = Duration::from_millis(300);

fn setup() -> Setup {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    Setup::of(&recipe).expect("a setup")
}

/// A virtual gripper in a thread of its own.
pub struct Gripper {
    /// What a client is to connect to.
    pub name: String,
    stop: Arc<AtomicBool>,
    lines: Receiver<Line>,
    said: Vec<String>,
    thread: JoinHandle<Summary>,
}

impl Gripper {
    /// Runs behind a port, with a script, or none where that is empty.
    pub fn start(port: Port, script: &str) -> Self {
        let setup = setup();
        let twin = Twin::new(&setup, true).expect("a twin");
        let play = (!script.is_empty()).then(|| {
            let script = script::parse(script).expect("a script");
            twin.check(&script).expect("registers that there are");
            Play::new(script, &setup.gripper)
        });
        let options = Options {
            speed: 1.0,
            play,
            orders: None,
        };
        let stop = Arc::new(AtomicBool::new(false));
        let (sender, lines) = channel();
        Self {
            name: port.name(),
            stop: Arc::clone(&stop),
            lines,
            said: Vec::new(),
            thread: thread::spawn(move || {
                let mut log = |line| sender.send(line).expect("somebody listens");
                run::run(port, twin, options, &stop, &mut log, &mut |_| {})
            }),
        }
    }

    /// Waits until something is said.
    pub fn wait_for(&mut self, text: &str) {
        self.wait_for_so_many(1, text);
    }

    /// Waits until something has been said so many times.
    pub fn wait_for_so_many(&mut self, times: usize, text: &str) {
        let is_there = |line: &&String| line.contains(text);
        while self.said.iter().filter(is_there).count() < times {
            let line = self.lines.recv_timeout(LONG);
            self.said.push(line.expect(text).text);
        }
    }

    /// Ends it; what it has said, and how it went.
    pub fn end(mut self) -> (Vec<String>, Summary) {
        self.stop.store(true, Relaxed);
        let summary = self.thread.join().expect("no panic");
        self.said.extend(self.lines.iter().map(|line| line.text));
        (self.said, summary)
    }
}

/// The way to the gripper.
pub enum Way {
    Tty(File),
    Tcp(TcpStream),
}

/// Opens a pseudo-terminal.
pub fn tty(path: impl AsRef<Path>) -> Way {
    let mut options = OpenOptions::new();
    // Non-blocking, for there are no timeouts of a file.
    let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
    options.custom_flags(flags.bits().cast_signed());
    Way::Tty(options.read(true).write(true).open(path).expect("a tty"))
}

/// Connects to a TCP port.
pub fn tcp(address: &str) -> Way {
    let stream = TcpStream::connect(address).expect("a listener");
    stream.set_nonblocking(true).expect("an option");
    stream.set_nodelay(true).expect("an option");
    Way::Tcp(stream)
}

impl Way {
    /// Sends bytes as they are, once there is room for them.
    pub fn send(&mut self, bytes: &[u8]) {
        let end = Instant::now() + LONG;
        let mut rest = bytes;
        while !rest.is_empty() {
            rest = &rest[self.write_some(rest)..];
            assert!(Instant::now() < end, "no room");
        }
    }

    /// Writes what there is room for.
    fn write_some(&mut self, bytes: &[u8]) -> usize {
        let sent = match self {
            Self::Tty(file) => file.write(bytes),
            Self::Tcp(stream) => stream.write(bytes),
        };
        match sent {
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                thread::sleep(Duration::from_micros(200));
                0
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// Sends bytes again and again for so long, as fast as they are taken; how many.
    pub fn flood(&mut self, bytes: &[u8], time: Duration) -> usize {
        let end = Instant::now() + time;
        let mut taken = 0;
        while Instant::now() < end {
            taken += self.write_some(bytes);
        }
        taken
    }

    /// So many bytes, or what has come within a time.
    pub fn receive(&mut self, count: usize, within: Duration) -> Vec<u8> {
        let end = Instant::now() + within;
        let mut received = Vec::new();
        let mut bytes = [0; 256];
        loop {
            let is_over = Instant::now() >= end;
            let room = &mut bytes[..(count - received.len()).min(256)];
            let read = match self {
                Self::Tty(file) => file.read(room),
                Self::Tcp(stream) => stream.read(room),
            };
            match read {
                Ok(count) => received.extend(&bytes[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    thread::sleep(Duration::from_micros(200));
                }
                Err(error) => panic!("{error}"),
            }
            if is_over || received.len() == count {
                return received;
            }
        }
    }

    /// The answer to a request, which must be as long as this. Where the machine has kept the gripper from running for
    /// too long there is none: then it is asked again, as clients do.
    pub fn ask(&mut self, frame: &[u8], length: usize) -> Vec<u8> {
        let mut answer = Vec::new();
        for _ in 0..60 {
            self.send(frame);
            answer = self.receive(length, Duration::from_secs(1));
            if !answer.is_empty() {
                break;
            }
        }
        assert_eq!(answer.len(), length, "{frame:02x?}: {answer:02x?}");
        assert_eq!(framed(&answer[1..length - 2]), answer);
        answer
    }

    /// Writes the action request.
    pub fn write(&mut self, words: [u16; 3]) {
        self.ask(&write(words), 8);
    }

    /// Reads one register.
    pub fn read(&mut self, address: u16) -> u16 {
        let answer = self.ask(&read(address, 1), 7);
        u16::from_be_bytes([answer[3], answer[4]])
    }

    /// Nothing comes.
    pub fn is_silent(&mut self) -> bool {
        self.receive(1, SILENCE).is_empty()
    }
}

/// A frame of the gripper with this id, and its checksum.
pub fn framed(pdu: &[u8]) -> Vec<u8> {
    let mut frame = vec![9];
    frame.extend(pdu);
    let sum = bus::modbus::crc(&frame);
    frame.extend(sum.to_le_bytes());
    frame
}

/// A request that reads registers.
pub fn read(address: u16, count: u8) -> Vec<u8> {
    let [upper, lower] = address.to_be_bytes();
    framed(&[3, upper, lower, 0, count])
}

/// A request that writes the action request.
pub fn write(words: [u16; 3]) -> Vec<u8> {
    let mut pdu = vec![16, 0x03, 0xE8, 0, 3, 6];
    pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    framed(&pdu)
}

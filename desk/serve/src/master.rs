//! The other end of the line: a master that reads and writes a gripper's registers, a real one's or the virtual one's.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, anyhow, bail, ensure};
use bus::modbus::{MOST_READ, crc};
use rustix::fs::OFlags;
use rustix::termios::{
    OptionalActions, QueueSelector, SpecialCodeIndex, tcflush, tcgetattr, tcsetattr,
};

use crate::pipe::Pipe;

/// An answer takes no longer.
const PATIENCE: Duration = Duration::from_secs(1);
/// The same in tenths of a second, for a terminal.
const PATIENCE_TENTHS: u8 = 10;
/// A request is sent so often before the gripper is given up.
const TRIES: u32 = 3;

enum Line {
    Tty(File),
    Tcp(TcpStream),
    Pipe(Pipe),
}

/// The gripper has answered, and does not do what it was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused {
    /// The first register.
    pub address: u16,
    /// The exception (MODBUS Application Protocol 1.1b3, 7).
    pub exception: u8,
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { address, exception } = self;
        let what = match exception {
            2 => "it has no such register, or none that can be written",
            3 => "the value is out of its range, or does not go with the others",
            6 => "it is busy, as with a sweep",
            _ => "it does not say why",
        };
        write!(
            f,
            "the gripper refuses register {address:#06x} with exception {exception:02}: {what}"
        )
    }
}

impl std::error::Error for Refused {}

/// A master, and the slave that it calls.
pub struct Master {
    line: Line,
    name: String,
    id: u8,
}

impl Master {
    /// Opens a serial port, or a pseudo-terminal.
    ///
    /// # Errors
    /// If it is not there, is none, is in use, or does not go at this rate.
    pub fn open(path: &Path, baud: u32, id: u8) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let mut options = OpenOptions::new();
        options.custom_flags(OFlags::NOCTTY.bits().cast_signed());
        let file = options.read(true).write(true).open(path);
        let file = file.with_context(|| format!("{name}: cannot open"))?;
        // Two masters on a line take each other's answers.
        ensure!(
            !matches!(file.try_lock(), Err(TryLockError::WouldBlock)),
            "{name}: another program speaks on it: end that first"
        );
        let mut attributes =
            tcgetattr(&file).with_context(|| format!("{name}: not a serial port"))?;
        attributes.make_raw();
        attributes.special_codes[SpecialCodeIndex::VMIN] = 0;
        attributes.special_codes[SpecialCodeIndex::VTIME] = PATIENCE_TENTHS;
        attributes
            .set_speed(baud)
            .and_then(|()| tcsetattr(&file, OptionalActions::Now, &attributes))
            .with_context(|| format!("{name}: does not go at {baud} baud"))?;
        Ok(Self {
            line: Line::Tty(file),
            name,
            id,
        })
    }

    /// Connects to RTU frames over TCP.
    ///
    /// # Errors
    /// If nobody listens there.
    pub fn connect(address: &str, id: u8) -> anyhow::Result<Self> {
        let stream = TcpStream::connect(address)
            .with_context(|| format!("{address}: nobody serves there"))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        Ok(Self {
            line: Line::Tcp(stream),
            name: address.into(),
            id,
        })
    }

    /// Has the virtual gripper in this process at the other end.
    pub fn at(pipe: Pipe, id: u8) -> Self {
        Self {
            line: Line::Pipe(pipe),
            name: "the virtual gripper".into(),
            id,
        }
    }

    /// Reads registers, as many as there are.
    ///
    /// # Errors
    /// If the gripper does not answer, or has no such registers.
    pub fn read(&mut self, from: u16, count: u16) -> anyhow::Result<Vec<u16>> {
        let mut registers = Vec::new();
        while registers.len() < usize::from(count) {
            let at = from + registers.len() as u16;
            let some = (count - registers.len() as u16).min(MOST_READ);
            let [a, b, c, d] = words([at, some]);
            let answer = self.ask(&[3, a, b, c, d], 5 + 2 * usize::from(some))?;
            let (pairs, _) = answer[3..answer.len() - 2].as_chunks::<2>();
            registers.extend(pairs.iter().map(|pair| u16::from_be_bytes(*pair)));
        }
        Ok(registers)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the gripper does not answer, or does not take the value.
    pub fn write(&mut self, address: u16, value: u16) -> anyhow::Result<()> {
        let [a, b, c, d] = words([address, value]);
        self.ask(&[6, a, b, c, d], 8)?;
        Ok(())
    }

    /// Writes registers that follow one another, all of them or none.
    ///
    /// # Errors
    /// As [`Master::write`].
    pub fn write_all(&mut self, address: u16, values: &[u16]) -> anyhow::Result<()> {
        let [a, b, c, d] = words([address, values.len() as u16]);
        let mut request = vec![16, a, b, c, d, 2 * values.len() as u8];
        request.extend(values.iter().flat_map(|value| value.to_be_bytes()));
        self.ask(&request, 8)?;
        Ok(())
    }

    /// The answer to a request, of this length.
    fn ask(&mut self, request: &[u8], length: usize) -> anyhow::Result<Vec<u8>> {
        let mut frame = vec![self.id];
        frame.extend(request);
        frame.extend(crc(&frame).to_le_bytes());
        for _ in 0..TRIES {
            let answer = self.exchange(&frame, length);
            let answer = answer.with_context(|| format!("{}: the line is gone", self.name))?;
            if answer.first() != Some(&self.id) || crc(&answer) != 0 {
                continue;
            }
            if is_refusal(&answer, request) {
                let refused = Refused {
                    address: u16::from_be_bytes([request[1], request[2]]),
                    exception: answer[2],
                };
                return Err(anyhow!(refused).context(self.name.clone()));
            }
            if answer.len() == length && is_answer(&answer, request) {
                return Ok(answer);
            }
        }
        bail!(
            "{}: no answer from id {}; check power, wiring, id and baud rate",
            self.name,
            self.id
        );
    }

    /// Sends a frame, and receives so many bytes, an exception, or what has come when nothing more does.
    fn exchange(&mut self, frame: &[u8], length: usize) -> anyhow::Result<Vec<u8>> {
        match &mut self.line {
            // An answer that came too late is none to this.
            Line::Tty(file) => {
                tcflush(&*file, QueueSelector::IFlush)?;
                file.write_all(frame)?;
            }
            Line::Tcp(stream) => {
                forget(stream)?;
                stream.write_all(frame)?;
            }
            Line::Pipe(pipe) => {
                while pipe.read(&mut [0; 256]) > 0 {}
                pipe.write(frame);
            }
        }
        let mut answer = Vec::new();
        let mut bytes = [0; 256];
        loop {
            let is_exception = answer.get(1).is_some_and(|code| code & 0x80 != 0);
            let wanted = if is_exception { 5 } else { length };
            if answer.len() >= wanted {
                return Ok(answer);
            }
            let room = &mut bytes[..wanted - answer.len()];
            let read = match &mut self.line {
                Line::Tty(file) => file.read(room),
                Line::Tcp(stream) => stream.read(room),
                Line::Pipe(pipe) => {
                    pipe.wait(PATIENCE);
                    Ok(pipe.read(room))
                }
            };
            match read {
                // A terminal's patience ends so; a connection that has ended says so, too.
                Ok(0) => {
                    ensure!(!matches!(self.line, Line::Tcp(_)), "it was closed");
                    return Ok(answer);
                }
                Ok(count) => answer.extend(&bytes[..count]),
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    return Ok(answer);
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Whether an answer with a right checksum says that the request is refused.
fn is_refusal(answer: &[u8], request: &[u8]) -> bool {
    answer.len() == 5 && answer[1] == request[0] | 0x80
}

/// Whether an answer with a right checksum is to this request: of a read it has so many bytes, of a write where it was
/// and what. Another's answer is none.
fn is_answer(answer: &[u8], request: &[u8]) -> bool {
    answer[1] == request[0]
        && match request[0] {
            3 => usize::from(answer[2]) + 5 == answer.len(),
            _ => answer[2..6] == request[1..5],
        }
}

/// Drops what has come so far.
fn forget(stream: &mut TcpStream) -> std::io::Result<()> {
    stream.set_nonblocking(true)?;
    let dropped = loop {
        match stream.read(&mut [0; 256]) {
            // That it was closed is seen when it is read.
            Ok(0) => break Ok(()),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    stream.set_nonblocking(false)?;
    dropped
}

fn words([first, second]: [u16; 2]) -> [u8; 4] {
    let ([a, b], [c, d]) = (first.to_be_bytes(), second.to_be_bytes());
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::thread;

    use super::*;

    /// A frame of slave 9 with its checksum.
    fn frame(bytes: &[u8]) -> Vec<u8> {
        let mut frame = [&[9], bytes].concat();
        frame.extend(crc(&frame).to_le_bytes());
        frame
    }

    /// A master of somebody who answers each request, all of 8 bytes, with the next of these.
    fn answered_with(answers: Vec<Vec<u8>>) -> (Master, thread::JoinHandle<()>) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("a port").to_string();
        let slave = thread::spawn(move || {
            let (mut client, _) = listener.accept().expect("a client");
            for answer in answers {
                client.read_exact(&mut [0; 8]).expect("a request");
                client.write_all(&answer).expect("it listens");
            }
        });
        (Master::connect(&address, 9).expect("it is there"), slave)
    }

    #[test]
    fn an_answer_to_another_request_is_none() {
        let right = frame(&[3, 4, 0, 1, 0, 2]);
        // Of one register in place of two; of a write; a refusal of one.
        let others = [
            frame(&[3, 2, 0, 7]),
            frame(&[6, 0x11, 0x04, 0, 1, 0]),
            frame(&[0x86, 3]),
        ];
        for other in others {
            let (mut master, slave) = answered_with(vec![other, right.clone()]);
            assert_eq!(master.read(0x1000, 2).expect("an answer"), [1, 2]);
            slave.join().expect("it ends");
        }
        let echo = |value| frame(&[6, 0x11, 0x04, 0, value]);
        let (mut master, slave) = answered_with(vec![echo(4), echo(1)]);
        master.write(0x1104, 1).expect("an answer");
        slave.join().expect("it ends");
    }

    #[test]
    fn what_came_after_an_answer_is_none_to_the_next_request() {
        let answer = |value| frame(&[3, 2, 0, value]);
        let twice = [answer(1), answer(66)].concat();
        let (mut master, slave) = answered_with(vec![twice, answer(2)]);
        assert_eq!(master.read(0x1000, 1).expect("an answer"), [1]);
        assert_eq!(master.read(0x1001, 1).expect("an answer"), [2]);
        slave.join().expect("it ends");
    }

    #[test]
    fn a_line_on_which_another_program_speaks_is_not_taken() {
        let mut port = crate::port::Port::tty(None).expect("a pseudo-terminal");
        let name = port.name();
        let first = Master::open(name.as_ref(), 115_200, 9).expect("it is free");
        let second = Master::open(name.as_ref(), 115_200, 9).err();
        let error = format!("{:#}", second.expect("it is taken"));
        assert!(error.contains("another program speaks on it"), "{error}");
        drop(first);
        assert!(Master::open(name.as_ref(), 115_200, 9).is_ok());
        port.wait(Duration::ZERO);
    }
}

//! The bytes as they come.

use std::fmt;

use softgrip::telemetry::{BUILD_BYTES, BUILD_MARK, Record, RecordError};

use crate::image::{Build, Image};

/// How much a line matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Of interest to whoever looks for a defect.
    Trace,
    /// The same, in fewer words.
    Debug,
    /// How it goes.
    Info,
    /// Something is not as it should be.
    Warn,
    /// Something has failed.
    Error,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Trace => "trace",
            Self::Debug => "debug",
            Self::Info => "info",
            Self::Warn => "warn",
            Self::Error => "error",
        })
    }
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// How much it matters; none if it was printed without.
    pub level: Option<Level>,
    /// When it was sent, µs since the firmware's start.
    pub at_us: Option<u64>,
    /// What it says.
    pub text: String,
}

/// Something that the firmware has sent.
#[derive(Debug, Clone, PartialEq)]
pub enum Decoded {
    /// One tick.
    Record(Box<Record>),
    /// A line of the log: an event, or how the program fares.
    Line(Line),
}

/// Why nothing of a stream can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StreamError {
    /// The image that runs is another one than that of the ELF file.
    #[error(
        "the ELF file is not that of the running image: build {file} in the file, build {running} is running"
    )]
    OtherBuild {
        /// The file's.
        file: Build,
        /// What runs.
        running: Build,
    },
    /// The firmware's records have a layout that is not read here.
    #[error(transparent)]
    OtherLayout(RecordError),
}

/// Makes messages of bytes, however they come in pieces.
#[derive(Debug)]
pub struct Decoder<'i> {
    image: &'i Image,
    /// A message whose end has not come yet.
    begun: Vec<u8>,
    malformed: u64,
}

/// A message that is longer than this has lost its end: the firmware's ring is no longer.
const LONGEST: usize = 2048;
/// A message's index, and the time when it was sent.
const INDEX: usize = 2;
const TIME: usize = 8;

impl<'i> Decoder<'i> {
    /// Begins to read what this image sends.
    pub fn new(image: &'i Image) -> Self {
        Self {
            image,
            begun: Vec::new(),
            malformed: 0,
        }
    }

    /// Forgets the message that has begun, as when the firmware starts again.
    pub fn restart(&mut self) {
        self.begun.clear();
    }

    /// Messages so far that could not be read: they came in part, or were changed on their way. The first may be one
    /// where a stream is met in its midst.
    pub fn malformed(&self) -> u64 {
        self.malformed
    }

    /// Takes what has come, and gives what is complete.
    ///
    /// # Errors
    ///
    /// As soon as it shows that nothing of this stream can be read, see [`StreamError`].
    pub fn take(&mut self, bytes: &[u8]) -> Result<Vec<Decoded>, StreamError> {
        let mut decoded = Vec::new();
        for &byte in bytes {
            match byte {
                0 if self.begun.is_empty() => {}
                0 => {
                    let message = unpacked(&self.begun);
                    self.begun.clear();
                    match message {
                        Some(message) => decoded.extend(self.read(&message)?),
                        None => self.malformed += 1,
                    }
                }
                _ if self.begun.len() == LONGEST => {
                    self.begun.clear();
                    self.malformed += 1;
                }
                _ => self.begun.push(byte),
            }
        }
        Ok(decoded)
    }

    fn read(&mut self, message: &[u8]) -> Result<Option<Decoded>, StreamError> {
        if let Some(running) = build(message)
            && running != self.image.build
        {
            return Err(StreamError::OtherBuild {
                file: self.image.build,
                running,
            });
        }
        let decoded = match message.split_first_chunk() {
            Some((index, rest)) if u16::from_le_bytes(*index) == self.image.record => {
                record(&rest[self.time().min(rest.len())..])?
            }
            _ => self.line(message),
        };
        if decoded.is_none() {
            self.malformed += 1;
        }
        Ok(decoded)
    }

    /// Bytes of the time in each message.
    fn time(&self) -> usize {
        match self.image.table.has_timestamp() {
            true => TIME,
            false => 0,
        }
    }

    fn line(&self, message: &[u8]) -> Option<Decoded> {
        let (frame, _) = self.image.table.decode(message).ok()?;
        let time = message.get(INDEX..INDEX + self.time())?;
        Some(Decoded::Line(Line {
            level: frame.level().map(|level| match level.as_str() {
                "trace" => Level::Trace,
                "debug" => Level::Debug,
                "info" => Level::Info,
                "warn" => Level::Warn,
                _ => Level::Error,
            }),
            at_us: time.try_into().ok().map(u64::from_le_bytes),
            text: frame.display_message().to_string(),
        }))
    }
}

/// What follows index and time of a record's message: its length, and the record. Zeros at the end fill up a group.
fn record(message: &[u8]) -> Result<Option<Decoded>, StreamError> {
    let bytes = message.split_first_chunk().and_then(|(length, bytes)| {
        let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
        bytes.get(..length)
    });
    match bytes.map(Record::decode) {
        Some(Ok(record)) => Ok(Some(Decoded::Record(Box::new(record)))),
        Some(Err(error @ RecordError::Layout(_))) => Err(StreamError::OtherLayout(error)),
        Some(Err(RecordError::Malformed)) | None => Ok(None),
    }
}

/// The build that a message tells, whatever its index means.
fn build(message: &[u8]) -> Option<Build> {
    let mark = BUILD_MARK.as_bytes();
    let at = message
        .windows(mark.len())
        .position(|bytes| bytes == mark)?;
    let build = message
        .get(at + mark.len()..)?
        .first_chunk::<BUILD_BYTES>()?;
    Some(Build(*build))
}

/// A message without its last zero, as it was before rzCOBS; none if bytes are missing.
fn unpacked(packed: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = packed.iter().rev().copied();
    let mut message = Vec::new();
    while let Some(description) = bytes.next() {
        let run = match description {
            // Each of seven is zero or stands there.
            0..=0x7f => {
                for i in (0..7).rev() {
                    message.push(match description >> i & 1 {
                        0 => bytes.next()?,
                        _ => 0,
                    });
                }
                0
            }
            // A run, and the zero that ended it.
            0x80..=0xfe => {
                message.push(0);
                usize::from(description & 0x7f) + 7
            }
            // The longest run goes on without one.
            0xff => 134,
        };
        for _ in 0..run {
            message.push(bytes.next()?);
        }
    }
    message.reverse();
    Some(message)
}

//! Recordings as MCAP files (mcap.dev), which Foxglove, Lichtblick and PlotJuggler open as they are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use mcap::records::MessageHeader;
use mcap::sans_io::LinearReaderOptions;
use mcap::{Channel, Compression, McapError, WriteOptions};

use crate::create::create;
use crate::encoder::{Encoder, Message};
use crate::messages::{self, TOPICS, Topic};
use crate::schema::{PACKAGE, descriptors};
use crate::told::Told;

/// So much is lost at most where a recording is cut off: a chunk is written as often.
const CHUNK: Duration = Duration::from_secs(1);

/// An MCAP file that is being written.
pub struct McapFile {
    writer: mcap::Writer<BufWriter<File>>,
    /// Channel of each topic, and how many messages it has, in the order of [`TOPICS`].
    channels: [(u16, u32); TOPICS.len()],
    encoder: Encoder,
    chunk_began: Instant,
}

impl McapFile {
    /// Begins a recording.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn new(file: File) -> anyhow::Result<Self> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .library(concat!("softgrip ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(BufWriter::new(file))?;
        let descriptors = descriptors();
        let mut channels = [(0, 0); TOPICS.len()];
        for (Topic { name, of }, channel) in TOPICS.iter().zip(&mut channels) {
            let of = format!("{PACKAGE}.{of}");
            let schema = writer.add_schema(&of, "protobuf", &descriptors)?;
            channel.0 = writer.add_channel(schema, name, "protobuf", &BTreeMap::new())?;
        }
        Ok(Self {
            writer,
            channels,
            encoder: Encoder::new(),
            chunk_began: Instant::now(),
        })
    }

    /// Writes what is told.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, told: &Told) -> anyhow::Result<()> {
        for message in self.encoder.take(told) {
            self.write(&message)?;
        }
        if self.chunk_began.elapsed() >= CHUNK {
            self.chunk_began = Instant::now();
            self.write_gathered()?;
            self.writer.flush()?;
        }
        Ok(())
    }

    fn write_gathered(&mut self) -> anyhow::Result<()> {
        match self.encoder.gathered() {
            Some(message) => self.write(&message),
            None => Ok(()),
        }
    }

    fn write(&mut self, message: &Message) -> anyhow::Result<()> {
        let log_time = message.log_time;
        let mut channels = TOPICS.iter().zip(&mut self.channels);
        let found = channels.find(|(known, _)| **known == message.topic);
        let (_, (channel_id, count)) = found.context("a topic that is not written")?;
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *count,
            log_time,
            publish_time: log_time,
        };
        *count = count.wrapping_add(1);
        self.writer
            .write_to_known_channel(&header, message.data.bytes())?;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.write_gathered()?;
        self.writer.finish()?;
        Ok(())
    }
}

/// What has been read of a file, and what of it could not be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Read {
    /// Messages that are whole.
    pub messages: u64,
    /// What is missing, in words; none where the file is whole.
    pub missing: Option<String>,
}

/// Reads a recording; `take` gets what is told, in its order. What is whole of a file that was cut off is read.
///
/// # Errors
/// If the file cannot be read, is none, or has nothing of a gripper, or a message that is none; or if `take` fails.
pub fn read(
    path: &Path,
    take: &mut impl FnMut(Told) -> anyhow::Result<()>,
) -> anyhow::Result<Read> {
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    read_told(&bytes, take).with_context(|| format!("{}", path.display()))
}

fn read_told(
    bytes: &[u8],
    take: &mut impl FnMut(Told) -> anyhow::Result<()>,
) -> anyhow::Result<Read> {
    let mut others = BTreeSet::new();
    let mut is_a_grippers = false;
    let read = read_messages(bytes, &mut |message| {
        let topic = &message.channel.topic;
        if !is_ours(&message.channel) {
            others.insert(topic.clone());
            return Ok(());
        }
        is_a_grippers = true;
        let told = messages::read(topic, &message.data)
            .with_context(|| format!("topic {topic}, message {}", message.sequence))?;
        told.into_iter().try_for_each(&mut *take)
    })?;
    match (&read.missing, is_a_grippers) {
        (_, true) => Ok(read),
        (Some(missing), false) if others.is_empty() => {
            bail!("nothing of a gripper is whole in it: {missing}")
        }
        _ if others.is_empty() => bail!("it is empty: nothing was recorded"),
        _ => bail!(
            "nothing in it is of a gripper as `softgrip record` writes it (Protocol Buffers, {PACKAGE}.{}, …); it has {}",
            messages::SNAPSHOT.of,
            others.into_iter().collect::<Vec<_>>().join(", ")
        ),
    }
}

/// Whether the messages of a channel are those of a gripper. Other programs have topics of the same names.
fn is_ours(channel: &Channel<'_>) -> bool {
    let known = TOPICS.iter().find(|known| known.name == channel.topic);
    let schema = channel.schema.as_ref();
    channel.message_encoding == "protobuf"
        && known
            .zip(schema)
            .is_some_and(|(known, schema)| schema.name == format!("{PACKAGE}.{}", known.of))
}

/// Reads messages as far as they are whole.
fn read_messages(
    bytes: &[u8],
    take: &mut impl FnMut(&mcap::Message<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Read> {
    ensure!(
        bytes.starts_with(mcap::MAGIC),
        "not an MCAP file: it does not begin as one"
    );
    // A chunk is whole, or nothing of it is taken.
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true);
    let stream = mcap::io::MessageReader::new_with_options(bytes, options);
    // A file that is whole ends with a footer.
    let has_end = mcap::read::footer(bytes).is_ok();
    let mut messages = 0;
    for message in stream {
        match message {
            Ok(message) => {
                messages += 1;
                take(&message)?;
            }
            Err(McapError::UnsupportedCompression(what)) => bail!(
                "its chunks are compressed by {what}, and must be by lz4 or not at all: `mcap compress --compression lz4` makes \
                 them so"
            ),
            Err(error) => {
                let what = match has_end {
                    true => "it is damaged",
                    false => CUT,
                };
                return Ok(Read {
                    messages,
                    missing: Some(format!(
                        "{what}, and after {messages} messages nothing more is whole ({error})"
                    )),
                });
            }
        }
    }
    Ok(Read {
        messages,
        missing: (!has_end).then(|| CUT.into()),
    })
}

const CUT: &str = "its end is missing: whoever recorded it did not finish it";

/// Writes what is whole of a file that was cut off into a new one.
///
/// # Errors
/// If there is nothing whole in it, there is a new file already that may not be replaced, or it cannot be written; then
/// there is none.
pub fn recover(path: &Path, out: &Path, may_replace: bool) -> anyhow::Result<Read> {
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    let found = read_messages(&bytes, &mut |_| Ok(()));
    let found = found.with_context(|| format!("{}", path.display()))?;
    ensure!(
        found.messages > 0,
        "{}: nothing in it is whole",
        path.display()
    );
    let file = create(out, may_replace)?;
    copy(&bytes, file)
        .inspect_err(|_| drop(std::fs::remove_file(out)))
        .with_context(|| format!("{}: cannot be written", out.display()))
}

/// Writes the messages that are whole.
fn copy(bytes: &[u8], file: File) -> anyhow::Result<Read> {
    let options = WriteOptions::new().compression(Some(Compression::Lz4));
    let mut writer = options.create(BufWriter::new(file))?;
    let read = read_messages(bytes, &mut |message| Ok(writer.write(message)?))?;
    writer.finish()?;
    Ok(read)
}

//! The image's ELF file: what its messages mean, and which build it is.

use std::fmt;

use defmt_decoder::{Encoding, Table};
use object::{Object, ObjectSection, ObjectSymbol};
use softgrip::telemetry::BUILD_BYTES;

/// Names a build: a hash over all of it, by the linker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Build(pub [u8; BUILD_BYTES]);

impl fmt::Display for Build {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Why a file does not tell what the messages mean.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// It is something else.
    #[error("no ELF file: {0}")]
    NoElf(String),
    /// An image of another program, or of a defmt that is not read here.
    #[error("the ELF file's messages cannot be read: {0}")]
    NoMessages(String),
    /// An image of another program, or of softgrip before it sent records.
    #[error(
        "the image sends no records: it is none of softgrip, an old one, or built with DEFMT_LOG quieter than info"
    )]
    NoRecords,
    /// It was stripped, or linked in another way.
    #[error("the ELF file has no build id: take the file that `cargo fw-build` leaves")]
    NoBuild,
}

/// What the messages of one image mean.
#[derive(Debug)]
pub struct Image {
    /// By defmt's index.
    pub(crate) table: Table,
    /// The index of the message that holds a record.
    pub(crate) record: u16,
    /// Which build it is.
    pub build: Build,
    /// Address of the control block of its RTT channel; none where it has no channel.
    pub channel: Option<u64>,
}

/// The control block, as debuggers look for it.
const CHANNEL: &str = "_SEGGER_RTT";
/// The message that holds a record, as defmt's section names it.
const RECORD: &str = r#""data":"record {=[u8]}""#;

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    ///
    /// If it is none of an image that sends records, see [`ImageError`].
    pub fn read(elf: &[u8]) -> Result<Self, ImageError> {
        let file =
            object::File::parse(elf).map_err(|error| ImageError::NoElf(error.to_string()))?;
        let no_messages = |why: &str| ImageError::NoMessages(why.into());
        let table = Table::parse(elf)
            .map_err(|error| no_messages(&error.to_string()))?
            .ok_or_else(|| no_messages("it has none"))?;
        if table.encoding() != Encoding::Rzcobs {
            return Err(no_messages("they are not encoded as rzCOBS"));
        }
        let section = file
            .section_by_name(".defmt")
            .map(|section| section.index());
        let record = file.symbols().find(|symbol| {
            symbol.section_index() == section
                && symbol.name().is_ok_and(|name| name.contains(RECORD))
        });
        let record = record.and_then(|symbol| u16::try_from(symbol.address()).ok());
        let channel = file.symbols().find(|symbol| symbol.name() == Ok(CHANNEL));
        let build = file.build_id().ok().flatten();
        let build = build.and_then(|build| build.try_into().ok());
        Ok(Self {
            table,
            record: record.ok_or(ImageError::NoRecords)?,
            build: Build(build.ok_or(ImageError::NoBuild)?),
            channel: channel.map(|symbol| symbol.address()),
        })
    }
}

//! Recordings as they are written, or served.

use std::net::SocketAddr;
use std::path::Path;

use anyhow::{Context, bail};

use crate::create::{create, ending};
use crate::csv_file::CsvFile;
#[cfg(feature = "live")]
use crate::live::Live;
use crate::mcap_file::McapFile;
use crate::told::Told;

/// What a recording is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// MCAP: all that is told.
    Mcap,
    /// CSV: observations and the names of events.
    Csv,
}

impl Format {
    /// By the end of a file's name.
    ///
    /// # Errors
    /// If it is neither.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        match ending(path).as_str() {
            "mcap" => Ok(Self::Mcap),
            "csv" => Ok(Self::Csv),
            _ => bail!("{}: must end with .mcap or .csv", path.display()),
        }
    }
}

/// A recording that is being written.
pub enum Recorder {
    /// As MCAP.
    Mcap(Box<McapFile>),
    /// As CSV.
    Csv(Box<CsvFile>),
    /// As no file, for whoever watches.
    #[cfg(feature = "live")]
    Live(Box<Live>),
}

impl Recorder {
    /// Begins a recording, as the end of the file's name says.
    ///
    /// # Errors
    /// If it says neither format, there is a file, or it cannot be made.
    pub fn new(path: &Path, may_replace: bool) -> anyhow::Result<Self> {
        let format = Format::of(path)?;
        let file = create(path, may_replace)?;
        let begun = match format {
            Format::Mcap => McapFile::new(file).map(|file| Self::Mcap(Box::new(file))),
            Format::Csv => CsvFile::new(file).map(|file| Self::Csv(Box::new(file))),
        };
        begun.with_context(|| format!("{}: cannot be written", path.display()))
    }

    /// Serves what would be recorded at an address, and says at which, for port 0 is any that is free.
    ///
    /// # Errors
    /// If the port is taken or may not be used, or this program is built without the feature `live`.
    pub fn live(address: SocketAddr) -> anyhow::Result<(Self, SocketAddr)> {
        #[cfg(feature = "live")]
        {
            let live = Live::open(address)?;
            let address = live.address;
            Ok((Self::Live(Box::new(live)), address))
        }
        #[cfg(not(feature = "live"))]
        bail!(
            "{address}: this program serves nothing live: build it with `cargo build --release -p softgrip-cli --features live`"
        )
    }

    /// Writes what is told.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, told: &Told) -> anyhow::Result<()> {
        match self {
            Self::Mcap(file) => file.add(told),
            Self::Csv(file) => file.add(told),
            #[cfg(feature = "live")]
            Self::Live(live) => {
                live.add(told);
                Ok(())
            }
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(self) -> anyhow::Result<()> {
        match self {
            Self::Mcap(file) => file.finish(),
            Self::Csv(file) => file.finish(),
            #[cfg(feature = "live")]
            Self::Live(_) => Ok(()),
        }
    }
}

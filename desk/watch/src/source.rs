//! Where a gripper is watched, as text.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail};
use serve::master::Master;

use crate::connection::Connection;
use crate::debugger::{self, Reading};
use crate::gripper;
use crate::line;
use crate::playback;
#[cfg(feature = "probe")]
use crate::probe;
use crate::recorder::Format;

pub use crate::gripper::Virtual;

/// Where a gripper is watched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// The simulated gripper, in this process.
    Virtual,
    /// A serial port.
    Tty(PathBuf),
    /// RTU frames over TCP, at this address and port.
    Tcp(String),
    /// What the firmware sends to a debugger, at standard input.
    DefmtStdin,
    /// The same, at this TCP address and port.
    DefmtTcp(String),
    /// The same, from a chip behind a debug probe that is connected.
    Probe {
        /// The chip's name, as probe-rs has it.
        chip: String,
        /// The probe's serial number; none where only one is connected.
        serial: Option<String>,
    },
    /// A recording.
    File(PathBuf),
}

/// What a source may be.
pub const SOURCES: &str = "virtual, tty:/dev/ttyUSB0, tcp:HOST:PORT, defmt:-, defmt:HOST:PORT, probe, probe:CHIP, probe:CHIP@SERIAL, or the path of a recording that ends with .mcap or .csv";

/// The chip of the NUCLEO-F429ZI.
const CHIP: &str = "STM32F429ZITx";

impl FromStr for Source {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        Ok(match (kind, rest) {
            ("virtual", "") => Self::Virtual,
            ("tty", path) if !path.is_empty() => Self::Tty(path.into()),
            ("tcp", address) if is_address(address) => Self::Tcp(address.into()),
            ("defmt", "-") => Self::DefmtStdin,
            ("defmt", address) if is_address(address) => Self::DefmtTcp(address.into()),
            ("probe", rest) => {
                let (chip, serial) = rest.split_once('@').unwrap_or((rest, ""));
                Self::Probe {
                    chip: if chip.is_empty() { CHIP } else { chip }.into(),
                    serial: (!serial.is_empty()).then(|| serial.into()),
                }
            }
            _ if Format::of(Path::new(text)).is_ok() => Self::File(text.into()),
            _ => bail!("must be one of {SOURCES}"),
        })
    }
}

/// Whether it is a host with a port.
fn is_address(text: &str) -> bool {
    let parts = text.rsplit_once(':');
    parts.is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok())
}

/// How a source is to be watched.
#[derive(Debug, Clone)]
pub struct Options {
    /// How often an observation is to come, Hz.
    pub rate_hz: f64,
    /// Every control tick is wanted in full, where the source has them.
    pub with_ticks: bool,
    /// A recording is told as fast as it came; else as it is taken.
    pub in_real_time: bool,
    /// Baud rate of a serial port.
    pub baud: u32,
    /// The gripper's id on the bus.
    pub id: u8,
    /// The ELF file of the image that runs, for what it sends to a debugger.
    pub elf: Option<PathBuf>,
    /// The virtual gripper.
    pub gripper: Virtual,
}

/// Opens a source.
///
/// # Errors
/// If it is not there, does not answer, or is none of a gripper.
pub fn open(source: &Source, options: &Options) -> anyhow::Result<Connection> {
    match source {
        Source::Virtual => gripper::open(&options.gripper, options.rate_hz, options.with_ticks),
        Source::Tty(path) => {
            let master = Master::open(path, options.baud, options.id)?;
            line::open(master, format!("tty:{}", path.display()), options.rate_hz)
        }
        Source::Tcp(address) => {
            let master = Master::connect(address, options.id)?;
            line::open(master, format!("tcp:{address}"), options.rate_hz)
        }
        Source::DefmtStdin => Ok(debugger::of_stdin(reading(options)?)),
        Source::DefmtTcp(address) => debugger::of_tcp(address, reading(options)?),
        #[cfg(feature = "probe")]
        Source::Probe { chip, serial } => probe::open(chip, serial.as_deref(), reading(options)?),
        #[cfg(not(feature = "probe"))]
        Source::Probe { .. } => bail!(
            "this program reads no debug probe: build it with `cargo build --release -p softgrip-cli --features probe`, or \
             have the probe's own program pass RTT on, as OpenOCD's `rtt server start 9090 0`, and name defmt:localhost:9090 \
             with --elf"
        ),
        Source::File(path) => playback::open(path, options.in_real_time),
    }
}

/// How a debugger's stream is to be read.
fn reading(options: &Options) -> anyhow::Result<Reading> {
    let elf = options.elf.as_deref().context(
        "a debugger's stream needs --elf FILE, the ELF file of the image that runs: `cargo fw-build` leaves it",
    )?;
    Ok(Reading {
        image: debugger::image(elf)?,
        values: options.gripper.setup.settings().values(),
        rate_hz: options.rate_hz,
        with_ticks: options.with_ticks,
    })
}

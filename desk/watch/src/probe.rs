//! A debug probe: what the firmware sends over RTT, without another program in between. Nothing but the chip's memory is
//! attached to: a session of a debugger would halt the core to clear its breakpoints, and a halted core controls nothing.

use std::io::{self, Read};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use decode::Channel;
use probe_rs::Permissions;
use probe_rs::architecture::arm::dp::DpAddress;
use probe_rs::architecture::arm::memory::ArmMemoryInterface;
use probe_rs::architecture::arm::sequences::ArmDebugSequence;
use probe_rs::architecture::arm::{ArmDebugInterface, ArmError, FullyQualifiedApAddress};
use probe_rs::config::{DebugSequence, Registry};
use probe_rs::probe::list::Lister;

use crate::connection::Connection;
use crate::debugger::{self, Reading};

/// The bus of the one core that the boards' chips have.
const BUS: FullyQualifiedApAddress = FullyQualifiedApAddress::v1_with_default_dp(0);
/// The ring is looked at so often: with every tick it is full after 20 ms (2 KiB; `softgrip-hil run --rtt`: 103 bytes each ms).
const PAUSE: Duration = Duration::from_millis(2);

/// Reads from a chip; the firmware runs on. `serial`: of the probe, where more than one is connected.
///
/// # Errors
/// If there is no such probe, more than one, no such chip, or another image on it than that of the ELF file.
pub fn open(chip: &str, serial: Option<&str>, reading: Reading) -> anyhow::Result<Connection> {
    let block = reading.image.channel;
    let block = block.context("the ELF file has no RTT channel (_SEGGER_RTT)")?;
    let sequence = sequence(chip)?;
    let probes = Lister::new().list_all();
    let names: Vec<_> = probes.iter().map(ToString::to_string).collect();
    let serials = probes.iter().map(|probe| probe.serial_number.as_deref());
    let found = pick(chip, &serials.collect::<Vec<_>>(), serial, &names)?;
    let name = format!("{chip} behind {}", names[found]);
    let attached = || -> anyhow::Result<_> {
        let mut probe = probes[found].open()?;
        probe.attach_to_unspecified()?;
        let interface = probe.try_into_arm_debug_interface(sequence.clone());
        let mut interface = interface.map_err(|(_, error)| error)?;
        interface.select_debug_port(DpAddress::Default)?;
        // A core that sleeps between two ticks can be reached as well.
        sequence.debug_device_unlock(&mut *interface, &BUS, &Permissions::default())?;
        Ok(interface)
    };
    let mut attached = Attached {
        interface: attached().with_context(|| name.clone())?,
        channel: Channel::new(block),
        rest: Vec::new(),
    };
    attached.look().with_context(|| name.clone())?;
    Ok(debugger::open(Box::new(attached), name, reading))
}

/// How a chip of this name is attached to.
fn sequence(chip: &str) -> anyhow::Result<Arc<dyn ArmDebugSequence>> {
    let target = Registry::from_builtin_families().get_target_by_name(chip);
    let target = target.with_context(|| {
        format!("{chip}: must be a chip's name, as STM32F429ZITx (NUCLEO-F429ZI) or STM32G474RETx (NUCLEO-G474RE)")
    })?;
    match target.debug_sequence {
        DebugSequence::Arm(sequence) => Ok(sequence),
        _ => bail!("{chip}: is no ARM chip"),
    }
}

/// The place of the probe with this serial number, or of the only one.
fn pick(
    chip: &str,
    serials: &[Option<&str>],
    serial: Option<&str>,
    names: &[String],
) -> anyhow::Result<usize> {
    ensure!(
        !serials.is_empty(),
        "no debug probe is connected, or this user may not use it (https://probe.rs/docs/getting-started/probe-setup)"
    );
    let all = names.join("; ");
    match serial {
        Some(serial) => {
            let found = serials.iter().position(|known| *known == Some(serial));
            found.with_context(|| format!("no debug probe has the serial number {serial}: {all}"))
        }
        None => {
            let first = serials[0].unwrap_or("SERIAL");
            ensure!(
                serials.len() == 1,
                "{} debug probes are connected: name one, as probe:{chip}@{first}: {all}",
                serials.len()
            );
            Ok(0)
        }
    }
}

/// A chip that is attached.
struct Attached {
    interface: Box<dyn ArmDebugInterface>,
    channel: Channel,
    /// Taken, and not passed on yet.
    rest: Vec<u8>,
}

impl Attached {
    /// Takes what is in the ring.
    fn look(&mut self) -> anyhow::Result<()> {
        let memory = self.interface.memory_interface(&BUS)?;
        self.rest.extend(self.channel.take(&mut Memory(memory))?);
        Ok(())
    }
}

impl Read for Attached {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.rest.is_empty() {
            thread::sleep(PAUSE);
            self.look().map_err(io::Error::other)?;
        }
        let count = self.rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.rest[..count]);
        self.rest.drain(..count);
        Ok(count)
    }
}

/// The chip's memory.
struct Memory<'a>(Box<dyn ArmMemoryInterface + 'a>);

impl decode::Memory for Memory<'_> {
    type Error = ArmError;

    fn read(&mut self, address: u64, words: &mut [u32]) -> Result<(), ArmError> {
        self.0.read_32(address, words)
    }

    fn write(&mut self, address: u64, word: u32) -> Result<(), ArmError> {
        self.0.write_word_32(address, word)?;
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_boards_chips_are_known_and_others_are_refused() {
        for chip in ["STM32F429ZITx", "STM32G474RETx"] {
            assert!(sequence(chip).is_ok(), "{chip}");
        }
        for (chip, expected) in [
            (
                "STM32F9",
                "STM32F9: must be a chip's name, as STM32F429ZITx",
            ),
            ("GD32VF103CBT6", "is no ARM chip"),
        ] {
            let error = sequence(chip).map(drop).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn one_probe_is_taken_and_of_more_the_one_that_is_named() {
        let names = ["a".to_string(), "b".to_string()];
        let serials = [Some("066A"), Some("0671")];
        let pick = |count: usize, serial| pick("STM32", &serials[..count], serial, &names[..count]);
        assert_eq!(pick(1, None).expect("the only one"), 0);
        assert_eq!(pick(2, Some("0671")).expect("the second"), 1);
        for (count, serial, expected) in [
            (0, None, "no debug probe is connected"),
            (
                1,
                Some("0671"),
                "no debug probe has the serial number 0671: a",
            ),
            (
                2,
                None,
                "2 debug probes are connected: name one, as probe:STM32@066A: a; b",
            ),
        ] {
            let error = pick(count, serial).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}

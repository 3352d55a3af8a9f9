//! The flash of settings and black box: three sectors of 16 KiB in a bank that the program does not run from, so that they
//! can be erased meanwhile. What writes words and erases sectors is the chip's.

use embassy_stm32::Peri;
use embassy_stm32::peripherals::FLASH;
use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash as AsyncReadNorFlash};

use super::chip::flash;
use super::programming::{self, ENDED, Unlocked};

const SECTOR: usize = 16 << 10;
const SECTORS: usize = 3;
const SIZE: usize = SECTORS * SECTOR;
const WORD: usize = 4;

/// The sectors; there is one flash, so there is one of these.
pub struct SettingsFlash(Peri<'static, FLASH>);

impl SettingsFlash {
    pub fn new(peripheral: Peri<'static, FLASH>) -> Self {
        programming::enable();
        Self(peripheral)
    }
}

/// What is asked of the flash, and what it refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// Beyond its end, or not whole words or sectors.
    Place,
    /// The status register says that it went wrong.
    Failed,
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place => NorFlashErrorKind::OutOfBounds,
            Self::Failed => NorFlashErrorKind::Other,
        }
    }
}

impl ErrorType for SettingsFlash {
    type Error = Error;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let at = offset as usize;
        if at + bytes.len() > SIZE {
            return Err(Error::Place);
        }
        for (at, byte) in (at..SIZE).zip(bytes) {
            // SAFETY: in the sectors, which are readable and hold no variable.
            *byte = unsafe { (flash::address(at) as *const u8).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

/// The same.
impl AsyncReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        ReadNorFlash::read(self, offset, bytes)
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let at = offset as usize;
        let (words, rest) = bytes.as_chunks::<WORD>();
        if at + bytes.len() > SIZE || !at.is_multiple_of(WORD) || !rest.is_empty() {
            return Err(Error::Place);
        }
        let _unlocked = Unlocked::new();
        for (i, word) in (0..SIZE / WORD).zip(words) {
            flash::begin_word(at.wrapping_add(WORD * i), u32::from_le_bytes(*word));
            ENDED.wait().await;
            result()?;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let sector = from as usize / SECTOR;
        if from as usize != sector * SECTOR
            || to as usize != from as usize + SECTOR
            || sector >= SECTORS
        {
            return Err(Error::Place);
        }
        let _unlocked = Unlocked::new();
        for part in 0..flash::PARTS_PER_SECTOR {
            flash::begin_erase(sector, part);
            ENDED.wait().await;
            result()?;
        }
        Ok(())
    }
}

fn result() -> Result<(), Error> {
    match flash::has_failed() {
        true => Err(Error::Failed),
        false => Ok(()),
    }
}

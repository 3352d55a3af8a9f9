//! The flash of settings and black box in an STM32F42x or F43x (RM0090, chapter 3): the first three sectors of bank 2, of
//! 16 KiB each. They can be erased while code runs from bank 1.
//!
//! embassy's driver does the same and much more, which takes 3 kB of the image's 64.

use core::sync::atomic::{Ordering, fence};

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::flash::regs::Sr;
use embassy_stm32::pac::flash::vals::Psize;
use embassy_stm32::peripherals::FLASH;
use embassy_stm32::{Peri, interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash as AsyncReadNorFlash};

const BASE: usize = 0x0810_0000;
const SECTOR: usize = 16 << 10;
const SECTORS: usize = 3;
const SIZE: usize = SECTORS * SECTOR;
const WORD: usize = 4;
/// What the first sector of bank 2 is called in the control register.
const FIRST: u8 = 0b1_0000;
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// An operation has ended, well or not.
static ENDED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

// SAFETY: the name gives it the place of the flash's handler in the vector table.
#[interrupt]
unsafe fn FLASH() {
    // Ends the request; what went wrong stays in the status register.
    pac::FLASH.cr().modify(|w| {
        w.set_eopie(false);
        w.set_errie(false);
    });
    pac::FLASH.sr().write(|w| w.set_eop(true));
    ENDED.signal(());
}

/// The sectors; there is one flash, so there is one of these.
pub struct SettingsFlash(Peri<'static, FLASH>);

impl SettingsFlash {
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        // Below the control task, which it would come into at every word.
        interrupt::FLASH.set_priority(Priority::P7);
        // SAFETY: its handler has nothing to share but a signal.
        unsafe { interrupt::FLASH.enable() };
        Self(flash)
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

/// While it lives the control register takes commands, and the data cache is off, which would be corrupted by reading
/// one bank while the other is written (errata ES0206, 2.2.12).
struct Unlocked;

impl Unlocked {
    fn new() -> Self {
        pac::FLASH.acr().modify(|w| w.set_dcen(false));
        // Where they do not belong the keys would lock the register until the next reset.
        if pac::FLASH.cr().read().lock() {
            for key in KEYS {
                pac::FLASH.keyr().write_value(key);
            }
        }
        // Each flag is cleared by writing it.
        let flags = pac::FLASH.sr().read();
        pac::FLASH.sr().write_value(flags);
        Self
    }
}

impl Drop for Unlocked {
    fn drop(&mut self) {
        pac::FLASH.cr().write(|w| w.set_lock(true));
        pac::FLASH.acr().modify(|w| w.set_dcrst(true));
        pac::FLASH.acr().modify(|w| w.set_dcrst(false));
        pac::FLASH.acr().modify(|w| w.set_dcen(true));
    }
}

fn result(status: Sr) -> Result<(), Error> {
    let failed = status.pgserr() || status.pgperr() || status.pgaerr() || status.wrperr();
    match failed {
        true => Err(Error::Failed),
        false => Ok(()),
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
        let flash = BASE as *const u8;
        for (at, byte) in (at..).zip(bytes) {
            // SAFETY: in the sectors, which are readable and hold no variable.
            *byte = unsafe { flash.add(at).read_volatile() };
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

    /// 16 µs for each word, at most 100 (DS9405, flash memory programming), in which others work.
    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let at = offset as usize;
        let (words, rest) = bytes.as_chunks::<WORD>();
        if at + bytes.len() > SIZE || !at.is_multiple_of(WORD) || !rest.is_empty() {
            return Err(Error::Place);
        }
        let _unlocked = Unlocked::new();
        let flash = (BASE + at) as *mut u32;
        for (i, word) in words.iter().enumerate() {
            ENDED.reset();
            pac::FLASH.cr().write(|w| {
                w.set_pg(true);
                w.set_psize(Psize::PSIZE32);
                w.set_eopie(true);
                w.set_errie(true);
            });
            // SAFETY: a word of the sectors, which hold no variable.
            unsafe { flash.add(i).write_volatile(u32::from_le_bytes(*word)) };
            fence(Ordering::SeqCst);
            ENDED.wait().await;
            result(pac::FLASH.sr().read())?;
        }
        Ok(())
    }

    /// A quarter of a second, at most half of one (DS9405), in which others work.
    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let first = from as usize / SECTOR;
        if from as usize != first * SECTOR
            || to as usize != from as usize + SECTOR
            || first >= SECTORS
        {
            return Err(Error::Place);
        }
        let _unlocked = Unlocked::new();
        ENDED.reset();
        pac::FLASH.cr().write(|w| {
            w.set_ser(true);
            w.set_snb(FIRST + first as u8);
            w.set_psize(Psize::PSIZE32);
            w.set_eopie(true);
            w.set_errie(true);
        });
        pac::FLASH.cr().modify(|w| w.set_strt(true));
        ENDED.wait().await;
        result(pac::FLASH.sr().read())
    }
}

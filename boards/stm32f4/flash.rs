//! Writing the second flash bank of an STM32F42x or F43x (RM0090, chapter 3). Its first sectors have 16 KiB each.
//!
//! embassy's driver does the same and much more, which takes 3 kB of the image's 64.

use core::sync::atomic::{Ordering, fence};

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::flash::vals::Psize;
use embassy_stm32::{interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

const BASE: usize = 0x0810_0000;
/// What the first sector of bank 2 is called in the control register.
const FIRST: u8 = 0b1_0000;
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// A sector is erased at once: a quarter of a second, at most half of one (DS9405, flash memory programming).
pub const PARTS_PER_SECTOR: usize = 1;

/// An operation has ended, well or not.
pub static ENDED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

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

/// Operations can be waited for.
pub fn enable() {
    // Below the control task, which it would come into at every word.
    interrupt::FLASH.set_priority(Priority::P7);
    // SAFETY: its handler has nothing to share but a signal.
    unsafe { interrupt::FLASH.enable() };
}

/// While it lives the control register takes commands, and the data cache is off, which would be corrupted by reading
/// one bank while the other is written (errata ES0206, 2.2.12).
pub struct Unlocked;

impl Unlocked {
    pub fn new() -> Self {
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

/// Whether the operation that has ended went wrong.
pub fn has_failed() -> bool {
    let status = pac::FLASH.sr().read();
    status.pgserr() || status.pgperr() || status.pgaerr() || status.wrperr()
}

/// Where a byte of the sectors stands.
// Thousands of them are read at the start.
#[inline(always)]
pub fn address(at: usize) -> usize {
    BASE.wrapping_add(at)
}

/// Begins to write a word: 16 µs, at most 100 (DS9405).
pub fn begin_word(at: usize, value: u32) {
    ENDED.reset();
    pac::FLASH.cr().write(|w| {
        w.set_pg(true);
        w.set_psize(Psize::PSIZE32);
        w.set_eopie(true);
        w.set_errie(true);
    });
    // SAFETY: a word of the sectors, which hold no variable.
    unsafe { (address(at) as *mut u32).write_volatile(value) };
    fence(Ordering::SeqCst);
}

/// Begins to erase a sector.
pub fn begin_erase(sector: usize, _part: usize) {
    ENDED.reset();
    pac::FLASH.cr().write(|w| {
        w.set_ser(true);
        w.set_snb(FIRST + sector as u8);
        w.set_psize(Psize::PSIZE32);
        w.set_eopie(true);
        w.set_errie(true);
    });
    pac::FLASH.cr().modify(|w| w.set_strt(true));
}

//! Writing the second flash bank of an STM32G4 (RM0440, chapter 3). Its pages have 2 KiB each.
//!
//! It programs double words, each once. A *word* of the sectors is the lower half of one, whose upper half stays zero. So a
//! sector of 16 KiB takes sixteen pages.

use core::sync::atomic::{Ordering, fence};

use cortex_m_rt::exception;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::{interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::failsafe;

const BASE: usize = 0x0804_0000;
const WORD: usize = 4;
const DOUBLE_WORD: usize = 8;
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// Pages that are erased one after the other: 22 ms each, at most 24.5 (DS12288, flash memory characteristics).
pub const PARTS_PER_SECTOR: usize = (16 << 10) / WORD * DOUBLE_WORD / (2 << 10);

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

// A double word that a power cut has left half written is more than its error correction can mend: reading it raises this
// exception (RM0440, 3.3.8). What was read is refused by its checksum. Bank 1 has the program, and no excuse.
// SAFETY: the name gives it the place of the exception's handler in the vector table.
#[exception]
unsafe fn NonMaskableInt() {
    const NUMBER: i16 = -14;
    let error = pac::FLASH.eccr().read();
    if error.eccd() && error.bk_ecc() {
        pac::FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        failsafe::unknown_interrupt(NUMBER);
    }
}

/// Operations can be waited for.
pub fn enable() {
    // Below the control task, which it would come into at every word.
    interrupt::FLASH.set_priority(Priority::P7);
    // SAFETY: its handler has nothing to share but a signal.
    unsafe { interrupt::FLASH.enable() };
}

/// While it lives the control register takes commands, and the data cache is off, which would keep what was there before.
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
    status.progerr()
        || status.wrperr()
        || status.pgaerr()
        || status.sizerr()
        || status.pgserr()
        || status.operr()
}

/// Where a byte of the sectors stands.
// Thousands of them are read at the start.
#[inline(always)]
pub fn address(at: usize) -> usize {
    BASE.wrapping_add(at / WORD * DOUBLE_WORD)
        .wrapping_add(at % WORD)
}

/// Begins to write a word: 82 µs, at most 125 (DS12288). One that is written already can be written to zeros.
pub fn begin_word(at: usize, value: u32) {
    ENDED.reset();
    pac::FLASH.cr().write(|w| {
        w.set_pg(true);
        w.set_eopie(true);
        w.set_errie(true);
    });
    let halves = address(at) as *mut u32;
    // SAFETY: a double word of bank 2, which holds no variable.
    unsafe {
        halves.write_volatile(value);
        halves.add(1).write_volatile(0);
    }
    fence(Ordering::SeqCst);
}

/// Begins to erase a page of a sector.
pub fn begin_erase(sector: usize, page: usize) {
    ENDED.reset();
    pac::FLASH.cr().write(|w| {
        w.set_per(true);
        w.set_bker(true);
        w.set_pnb((sector * PARTS_PER_SECTOR + page) as u8);
        w.set_eopie(true);
        w.set_errie(true);
    });
    pac::FLASH.cr().modify(|w| w.set_strt(true));
}

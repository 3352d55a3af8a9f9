//! Writing the second flash bank of an STM32G4 (RM0440, chapter 3). Its pages have 2 KiB each.
//!
//! It programs double words, each once. A *word* of the sectors is the lower half of one, whose upper half stays zero. So a
//! sector of 16 KiB takes sixteen pages.

use core::sync::atomic::{Ordering, fence};

use cortex_m_rt::exception;
use embassy_stm32::pac;

use crate::board::programming::ENDED;
use crate::failsafe;

const BASE: usize = 0x0804_0000;
const WORD: usize = 4;
const DOUBLE_WORD: usize = 8;

/// Pages that are erased one after the other: 22 ms each, at most 24.5 (DS12288, flash memory characteristics).
pub const PARTS_PER_SECTOR: usize = (16 << 10) / WORD * DOUBLE_WORD / (2 << 10);

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

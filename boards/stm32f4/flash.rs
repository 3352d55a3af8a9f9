//! Writing the second flash bank of an STM32F42x or F43x (RM0090, chapter 3). Its first sectors have 16 KiB each.
//!
//! embassy's driver does the same and much more, which takes 3 kB of the image's 64.

use core::sync::atomic::{Ordering, fence};

use embassy_stm32::pac;
use embassy_stm32::pac::flash::vals::Psize;

use crate::board::programming::ENDED;

const BASE: usize = 0x0810_0000;
/// What the first sector of bank 2 is called in the control register.
const FIRST: u8 = 0b1_0000;

/// A sector is erased at once: a quarter of a second, at most half of one (DS9405, flash memory programming).
pub const PARTS_PER_SECTOR: usize = 1;

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

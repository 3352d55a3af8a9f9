//! Programming of the flash, as far as it is the same in all families: its end, and who may begin it.

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::{interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

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
/// one bank while the other is written (STM32F4: errata ES0206, 2.2.12), or keep what was there before.
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

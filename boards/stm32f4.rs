//! STM32F42x and F43x: safe output, start, option bytes (RM0090).

mod converter;
pub mod flash;
mod serial;

pub use converter::Converter;
pub use serial::{Serial, on_interrupt as on_serial};

use embassy_stm32::pac;

use super::regulator;
use super::wait::wait_for;

/// A crystal's clock is there before the chip runs, or comes seconds late, or not at all.
const HSE_WITHIN_US: u32 = 20_000;

/// Silicon before revision 3 (A, Y and 1 by their numbers 0x1000, 0x1003 and 0x1007: RM0090, DBGMCU_IDCODE) reads bank 2
/// wrong unless PA12 is an output at 0 V (errata ES0206, 2.2.14).
fn misreads_bank_2() -> bool {
    const REVISION_3: u16 = 0x2001;
    pac::DBGMCU.idcode().read().rev_id() < REVISION_3
}

/// Caches and prefetch, of which embassy's driver has written the wait states alone, and bank 2. `external`: the clock is,
/// and one that fails later is an exception without a handler, and the next start does without it.
pub fn finish_start(external: bool) {
    pac::RCC.cr().modify(|w| w.set_csson(external));
    pac::FLASH.acr().modify(|w| {
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
    if misreads_bank_2() {
        hold_pa12_low();
    }
}

fn hold_pa12_low() {
    let pin = 12;
    pac::GPIOA.bsrr().write(|w| w.set_br(pin, true));
    pac::GPIOA
        .pupdr()
        .modify(|w| w.set_pupdr(pin, pac::gpio::vals::Pupdr::PULL_DOWN));
    pac::GPIOA
        .moder()
        .modify(|w| w.set_moder(pin, pac::gpio::vals::Moder::OUTPUT));
}

/// Says so where the chip is not as this program wants it, as `boards/README.md` shows: where it would run on below 2.7 V,
/// and where PA12 must be left alone.
pub fn check_option_bytes() {
    // Level 3 is zero (RM0090, FLASH_OPTCR).
    if pac::FLASH.optcr().read().bor_lev() != 0 {
        defmt::warn!("brown-out level 3 is not set: see boards/README.md");
    }
    if misreads_bank_2() {
        defmt::warn!("silicon before revision 3: PA12 is held low, see boards/README.md");
    }
}

/// Whether the clock at OSC_IN is there, and stays switched on.
pub fn external_clock() -> bool {
    pac::RCC.cr().modify(|w| w.set_hsebyp(true));
    pac::RCC.cr().modify(|w| w.set_hseon(true));
    let there = wait_for(HSE_WITHIN_US, || pac::RCC.cr().read().hserdy());
    if !there {
        pac::RCC.cr().modify(|w| w.set_hseon(false));
    }
    there
}

/// Puts the regulator's command to zero by register, whatever state the chip and its drivers are in:
/// at start-up, from a panic, from a fault.
pub fn safe_output() {
    pac::RCC.ahb1enr().modify(|w| w.set_gpioaen(true));
    pac::RCC.apb1enr().modify(|w| w.set_dacen(true));
    // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
    pac::RCC.apb1enr().read();
    pac::GPIOA
        .moder()
        .modify(|w| w.set_moder(4, pac::gpio::vals::Moder::ANALOG));
    regulator::write(regulator::SAFE);
    pac::DAC1.cr().modify(|w| {
        // Buffered, so that the pull-down at the pin takes nothing from it. The buffer does not go below 0.2 V (DS9405,
        // DAC characteristics); the command's amplifier subtracts 0.3 V.
        w.set_boff(0, false);
        w.set_ten(0, false);
        w.set_en(0, true);
    });
}

/// Why the chip has started.
#[derive(Clone, Copy, defmt::Format)]
pub enum ResetReason {
    PowerOn,
    BrownOut,
    Pin,
    Software,
    Watchdog,
    Other,
}

/// Reads the reset flags and clears them for the next time.
pub fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset shows at the pin as well, and power-on as brown-out (RM0090, section 6.3.21).
    if flags.wdgrstf() || flags.wwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.porrstf() {
        ResetReason::PowerOn
    } else if flags.borrstf() {
        ResetReason::BrownOut
    } else if flags.padrstf() {
        ResetReason::Pin
    } else {
        ResetReason::Other
    }
}

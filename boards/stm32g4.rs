//! STM32G4 with two flash banks: safe output, start, option bytes (RM0440).

mod converter;
pub mod flash;
mod serial;

pub use converter::Converter;
pub use serial::{Serial, on_interrupt as on_serial};

use embassy_stm32::pac;
use embassy_stm32::pac::dac::vals::Mode;

use super::regulator;
use super::wait::wait_for;

/// A crystal needs 2 ms (DS12288, HSE characteristics), or does not come at all.
const HSE_WITHIN_US: u32 = 20_000;

/// Caches and prefetch, of which embassy's driver has written the wait states alone. `external`: the clock is, and one that
/// fails later is an exception that ends the program, and the next start does without it.
pub fn finish_start(external: bool) {
    pac::RCC.cr().modify(|w| w.set_csson(external));
    pac::FLASH.acr().modify(|w| {
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
}

/// Says so where the chip is not as this program wants it, as `boards/README.md` shows: where it would run on below 2.8 V,
/// and where its flash is one bank, so that nothing runs while settings are stored.
pub fn check_option_bytes() {
    /// 2.8 V, falling (DS12288, embedded reset and power control).
    const LEVEL_4: u8 = 4;
    let options = pac::FLASH.optr().read();
    if options.bor_lev() != LEVEL_4 {
        defmt::warn!("brown-out level 4 is not set: see boards/README.md");
    }
    if !options.dbank() {
        defmt::error!("the flash is one bank: set DBANK, see boards/README.md");
    }
}

/// Whether the crystal's clock is there, and stays switched on.
pub fn external_clock() -> bool {
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
    pac::RCC.ahb2enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_dac1en(true);
    });
    // A clock is there two cycles after it was enabled (RM0440, 7.2.17); a read takes longer.
    pac::RCC.ahb2enr().read();
    pac::GPIOA
        .moder()
        .modify(|w| w.set_moder(4, pac::gpio::vals::Moder::ANALOG));
    regulator::write(regulator::SAFE);
    if pac::DAC1.cr().read().en(0) {
        pac::DAC1.cr().modify(|w| w.set_ten(0, false));
        return;
    }
    // To be written while it is off.
    pac::DAC1.mcr().modify(|w| {
        // Buffered, so that the pull-down at the pin takes nothing from it. The buffer does not go below 0.2 V (DS12288, DAC
        // characteristics); the command's amplifier subtracts 0.3 V.
        w.set_mode(0, Mode::NORMAL_EXT_BUFEN);
        // For clocks above 160 MHz, and right for slower ones.
        w.set_hfsel(2);
    });
    pac::DAC1.cr().modify(|w| w.set_en(0, true));
}

/// Why the chip has started.
#[derive(Clone, Copy, defmt::Format)]
pub enum ResetReason {
    /// Or brown-out, which it does not tell apart (RM0440, RCC_CSR).
    PowerOn,
    Pin,
    Software,
    Watchdog,
    Other,
}

/// Reads the reset flags and clears them for the next time.
pub fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset shows at the pin as well.
    if flags.iwdgrstf() || flags.wwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.borrstf() {
        ResetReason::PowerOn
    } else if flags.pinrstf() {
        ResetReason::Pin
    } else {
        ResetReason::Other
    }
}

//! The independent watchdog, which is the same in all families.

use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

/// It counts at a quarter of its own clock, 8 kHz: 100 ms. That clock is good for 17 to 47 kHz in an STM32F4 (DS9405, LSI
/// characteristics), so these are 68 to 188 ms; for 29.5 to 34 kHz in an STM32G4 (DS12288, LSI characteristics), 94 to
/// 109 ms. It is fed every 20 ms.
const COUNTS: u16 = 800;

/// Starts the watchdog, which nothing stops. Its first time is half a second (348 to 964 ms): what is set here
/// counts from the first feeding on.
pub fn start_watchdog() {
    let watchdog = pac::IWDG;
    watchdog.kr().write(|w| w.set_key(Key::START));
    watchdog.kr().write(|w| w.set_key(Key::ENABLE));
    watchdog.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    watchdog.rlr().write(|w| w.set_rl(COUNTS - 1));
}

/// Gives the watchdog its whole time again.
pub fn feed_watchdog() {
    pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
}

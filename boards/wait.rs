//! Waiting by the core's cycles, before there is a clock to ask.

use cortex_m::peripheral::DWT;
use embassy_stm32::pac;
use embassy_stm32::rcc::Sysclk;

/// The core's clock at start-up, and what it may be later on any chip here.
const HSI_MHZ: u32 = 16;
const HIGHEST_MHZ: u32 = 180;

/// Waits at least so long, whatever the clock.
pub fn wait_us(us: u32) {
    wait_for(us, || false);
}

/// Waits until something is so, for about this long at most. Says whether it is.
pub fn wait_for(us: u32, so: impl Fn() -> bool) -> bool {
    let mhz = match pac::RCC.cfgr().read().sws() {
        Sysclk::HSI => HSI_MHZ,
        _ => HIGHEST_MHZ,
    };
    // SAFETY: nobody else uses the counter or what switches it on.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let began = DWT::cycle_count();
    while DWT::cycle_count().wrapping_sub(began) < us.saturating_mul(mhz) {
        if so() {
            return true;
        }
        // Microseconds: no need to keep the bus busy.
        cortex_m::asm::delay(50);
    }
    so()
}

//! Waiting by the core's cycles, before there is a clock to ask.

use cortex_m::peripheral::DWT;

/// Waits until something is so, for this long at most, at a clock of so many MHz or less. Says whether it is.
pub fn wait_for(us: u32, mhz: u32, so: impl Fn() -> bool) -> bool {
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

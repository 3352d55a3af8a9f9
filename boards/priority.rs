//! Above the thread: the interrupt that the control task runs in.

use embassy_executor::SendSpawner;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};

use crate::links::HIGH_PRIORITY;

/// The executor of the control task, above the thread's and the drivers' interrupts and below the clock's. No board uses
/// UART5, and its interrupt is.
pub fn high_priority() -> SendSpawner {
    interrupt::UART5.set_priority(Priority::P6);
    HIGH_PRIORITY.start(interrupt::UART5)
}

// SAFETY: the name gives it the place of UART5's handler in the vector table.
#[interrupt]
unsafe fn UART5() {
    // SAFETY: called from this handler alone, which `start` enables once the executor is there.
    unsafe { HIGH_PRIORITY.on_interrupt() }
}

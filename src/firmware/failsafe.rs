//! When the program itself is wrong: first the safe output, then a word to the host, then a reset.
//!
//! A reset lets go of the converter's pin, so holding the pressure is impossible here: it is vented.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::board;

/// A host polls RTT every few milliseconds. 20 ms at 180 MHz; the watchdog allows for more.
const HOST_READS_CYCLES: u32 = 3_600_000;

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    /// A panic while saying the first one's message. Read and written by this handler alone.
    static SPEAKING: AtomicBool = AtomicBool::new(false);

    board::safe_output();
    cortex_m::interrupt::disable();
    if !SPEAKING.swap(true, Relaxed) {
        defmt::error!("{}", defmt::Display2Format(info));
    }
    reset()
}

// SAFETY: the name gives it the place of the hard fault's handler in the vector table, and it never
// returns to the code that failed.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    board::safe_output();
    // SAFETY: reads a status register of the core, which has no side effect.
    let cause = unsafe { (*SCB::PTR).cfsr.read() };
    defmt::error!(
        "hard fault at {=u32:#010x}, called from {=u32:#010x}, cause {=u32:#010x}",
        frame.pc(),
        frame.lr(),
        cause,
    );
    reset()
}

// SAFETY: takes the place of every handler that nobody has written, and never returns.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    board::safe_output();
    defmt::error!("interrupt {=i16} has no handler", number);
    reset()
}

fn reset() -> ! {
    cortex_m::asm::delay(HOST_READS_CYCLES);
    SCB::sys_reset()
}

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

// After a stack overflow there is no stack to work on, so this takes it from the top again: nothing
// returns to what was there. A frame that could not be written is not read either.
// SAFETY: the name gives it the place of the hard fault's handler in the vector table; it goes on in a
// function that never returns to the code that failed.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    core::arch::naked_asm!(
        "mov r0, sp",
        "movw r1, #:lower16:_stack_end",
        "movt r1, #:upper16:_stack_end",
        "cmp r0, r1",
        "bhs 2f",
        "movs r0, #0",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "mov sp, r1",
        "2: b {hard_fault}",
        hard_fault = sym hard_fault,
    )
}

unsafe extern "C" fn hard_fault(frame: *const ExceptionFrame) -> ! {
    board::safe_output();
    // SAFETY: reads a status register of the core, which has no side effect.
    let cause = unsafe { (*SCB::PTR).cfsr.read() };
    // SAFETY: null, or what the core has just put on its stack.
    match unsafe { frame.as_ref() } {
        Some(frame) => defmt::error!(
            "hard fault at {=u32:#010x}, called from {=u32:#010x}, cause {=u32:#010x}",
            frame.pc(),
            frame.lr(),
            cause,
        ),
        None => defmt::error!("hard fault: stack overflow, cause {=u32:#010x}", cause),
    }
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

//! When the program itself is wrong: first nothing else may run, then the safe output, then the record and
//! a word to the host, then a reset.
//!
//! A reset lets go of the converter's pin, so holding the pressure is impossible here: it is vented.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use softgrip::failure::{CALLS, Cause, Failure};

use crate::{board, record};

/// A host polls RTT every few milliseconds. The watchdog, fed before, allows for 68.
const HOST_READS_US: u32 = 20_000;

/// Interrupts off first: a control tick behind the safe output would command a pressure again.
// Never inlined, so that a test can have a tick fall in between.
#[inline(never)]
fn stop() {
    cortex_m::interrupt::disable();
    board::safe_output();
}

// Inlined, it shows the compiler that nobody reads messages and source locations, and they and all of core's formatting
// go: 9 kB of flash, half of it the paths of the machine that it was built on. The calls lead to the place.
#[expect(
    unused_attributes,
    reason = "it is exported by its name alone, and inlined when everything is linked"
)]
#[inline(always)]
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    panicked()
}

#[inline(never)]
fn panicked() -> ! {
    /// A panic while telling the first one. Read and written here alone.
    static SPEAKING: AtomicBool = AtomicBool::new(false);

    stop();
    if SPEAKING.swap(true, Relaxed) {
        reset()
    }
    fail(Cause::Panic { calls: calls() })
}

/// Where the calls that led here would return to. The target's ABI keeps frames linked by R7: at it lies the caller's,
/// and above that the return address.
#[inline(always)]
fn calls() -> [u32; CALLS] {
    unsafe extern "C" {
        static _stack_start: u32;
    }
    let top = &raw const _stack_start as u32;
    let mut frame: u32;
    // SAFETY: copies a register.
    unsafe {
        core::arch::asm!("mov {}, r7", out(reg) frame, options(nomem, nostack, preserves_flags))
    };
    let mut calls = [0; CALLS];
    for call in &mut calls {
        if !frame.is_multiple_of(4) || frame >= top.saturating_sub(8) {
            break;
        }
        let words = frame as *const u32;
        // SAFETY: two aligned words of the stack: the first frame is this function's, and each lies above the one before.
        let (next, returns) = unsafe { (words.read(), words.add(1).read()) };
        *call = returns;
        if next <= frame {
            break;
        }
        frame = next;
    }
    calls
}

// After a stack overflow there is no stack to work on, and a stack pointer that has gone astray may point to
// nothing at all: then this takes the stack from the top again, as nothing returns to what was there. A
// frame of eight words that could not be written is not read either.
// SAFETY: the name gives it the place of the hard fault's handler in the vector table; it goes on in a
// function that never returns to the code that failed.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    core::arch::naked_asm!(
        "cpsid i",
        "mov r0, sp",
        "mov r1, sp",
        "movw r2, #:lower16:_stack_end",
        "movt r2, #:upper16:_stack_end",
        "movw r3, #:lower16:_stack_start",
        "movt r3, #:upper16:_stack_start",
        "cmp r0, r2",
        "blo 2f",
        "sub r2, r3, #32",
        "cmp r0, r2",
        "bls 3f",
        "2: movs r0, #0",
        "mov sp, r3",
        "3: b {hard_fault}",
        hard_fault = sym hard_fault,
    )
}

unsafe extern "C" fn hard_fault(frame: *const ExceptionFrame, sp: u32) -> ! {
    stop();
    // SAFETY: reads a status register of the core, which has no side effect.
    let cfsr = unsafe { (*SCB::PTR).cfsr.read() };
    // SAFETY: null, or what the core has just put on its stack.
    match unsafe { frame.as_ref() } {
        Some(frame) => fail(Cause::HardFault {
            pc: frame.pc(),
            lr: frame.lr(),
            cfsr,
        }),
        None => fail(Cause::StackFault { sp, cfsr }),
    }
}

// SAFETY: takes the place of every handler that nobody has written, and never returns.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    unknown_interrupt(number)
}

/// An interrupt that nobody has asked for.
pub fn unknown_interrupt(number: i16) -> ! {
    stop();
    fail(Cause::Interrupt {
        number: number.into(),
    })
}

fn fail(cause: Cause) -> ! {
    record::keep(cause);
    say(cause);
    reset()
}

fn reset() -> ! {
    board::feed_watchdog();
    board::wait_us(HOST_READS_US);
    SCB::sys_reset()
}

/// Why the program stopped.
fn say(cause: Cause) {
    match cause {
        Cause::Panic { calls } => defmt::error!("panicked, called from {:#010x}", calls),
        Cause::HardFault { pc, lr, cfsr } => defmt::error!(
            "hard fault at {=u32:#010x}, called from {=u32:#010x}, cause {=u32:#010x}",
            pc,
            lr,
            cfsr,
        ),
        Cause::StackFault { sp, cfsr } => defmt::error!(
            "hard fault: stack pointer {=u32:#010x} outside the stack, cause {=u32:#010x}",
            sp,
            cfsr,
        ),
        Cause::Interrupt { number } => {
            defmt::error!("interrupt {=i32} has no handler", number)
        }
        Cause::Watchdog { task } => {
            defmt::error!("watchdog: the {} task did not check in", task)
        }
    }
}

/// Tells a failure after the restart.
pub fn tell(failure: &Failure) {
    defmt::error!(
        "the program failed in tick {=u32}, while {}:",
        failure.tick,
        failure.activity,
    );
    say(failure.cause);
}

/// Stays in the safe state and says why once per second, to whoever comes to listen. An acknowledgement
/// restarts the chip; so do reset and power.
pub fn stay(why: &dyn Fn()) -> ! {
    /// Between two looks at the acknowledgement.
    const LOOK_US: u32 = 5_000;
    const LOOKS_PER_SECOND: u32 = 1_000_000 / LOOK_US;

    stop();
    board::show_fault();
    // On at the start, it must go off first. Two looks alike are no bounce.
    let (mut pressed, mut armed) = (0, false);
    for look in (0..LOOKS_PER_SECOND).cycle() {
        board::feed_watchdog();
        if look == 0 {
            why();
        }
        pressed = match board::acknowledged() {
            true => pressed + 1,
            false => {
                armed = true;
                0
            }
        };
        if armed && pressed >= 2 {
            break;
        }
        board::wait_us(LOOK_US);
    }
    record::forget();
    SCB::sys_reset()
}

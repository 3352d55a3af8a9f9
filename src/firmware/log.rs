//! The log: defmt's messages in a ring that a debugger empties (SEGGER UM08001, real-time transfer).
//!
//! defmt-rtt hands every byte to its ring by itself; here a message is packed in one loop (`softgrip::telemetry::frame`).
//! Nobody ever waits, whatever a host asks for: what does not fit is dropped.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use softgrip::telemetry::frame::{Frame, SIZE};

/// What the host does not read is dropped, says the channel. A host may write another wish here, which nobody heeds.
const SKIPS: u32 = 0;

#[repr(C)]
struct Channel {
    name: *const u8,
    buffer: *mut u8,
    size: u32,
    /// Where the host stops reading. Written here.
    written: AtomicU32,
    /// Where it goes on reading. Written by the host.
    read: AtomicU32,
    flags: AtomicU32,
}

/// What a debugger looks for in RAM, by its name or by its first bytes.
#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    channels_up: u32,
    channels_down: u32,
    channel: Channel,
}

// SAFETY: the pointers are constants that nobody here follows, and the rest is atomic.
unsafe impl Sync for ControlBlock {}

/// In RAM, so that all of the block can be read without flash.
#[unsafe(link_section = ".data.rtt_name")]
static NAME: [u8; 6] = *b"defmt\0";

// SAFETY: debuggers look for it by this name; no other crate here has one.
#[unsafe(no_mangle)]
static _SEGGER_RTT: ControlBlock = ControlBlock {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    channels_up: 1,
    channels_down: 0,
    channel: Channel {
        name: NAME.as_ptr(),
        buffer: RING.0.get().cast(),
        size: SIZE as u32,
        // Behind the zero of `start`.
        written: AtomicU32::new(1),
        read: AtomicU32::new(0),
        flags: AtomicU32::new(SKIPS),
    },
};

/// What only one message at a time uses.
struct Single<T>(UnsafeCell<T>);

// SAFETY: messages come from the tasks of thread mode, which do not interrupt each other, and from the failure of the
// program, which interrupts one and never returns to it. The control task, above them, sends none.
unsafe impl<T> Sync for Single<T> {}

// Not cleared at the start: nobody reads what nobody has written.
#[unsafe(link_section = ".uninit.rtt")]
static RING: Single<[u8; SIZE]> = Single(UnsafeCell::new([0; SIZE]));

static FRAME: Single<Frame> = Single(UnsafeCell::new(Frame::NONE));

/// To be called before the first message. The run before may have left half a message with the host, which a zero ends.
pub fn start() {
    // SAFETY: no message is being written.
    let (_, [first, ..]) = unsafe { parts() };
    *first = 0;
}

#[defmt::global_logger]
struct Log;

/// The message that is being written, and the ring.
///
/// # Safety
///
/// Only before the first message, or between [`defmt::Logger::acquire`] and `release`, and once at a time.
unsafe fn parts() -> (&'static mut Frame, &'static mut [u8; SIZE]) {
    // SAFETY: one message at a time uses them, see `Single`. The host reads only what `written` has passed, which
    // no message writes before the host has passed it.
    unsafe { (&mut *FRAME.0.get(), &mut *RING.0.get()) }
}

// SAFETY: the frame is begun, written and ended in this order, by one message at a time.
unsafe impl defmt::Logger for Log {
    fn acquire() {
        let channel = &_SEGGER_RTT.channel;
        let written = channel.written.load(Ordering::Relaxed) as usize;
        let read = channel.read.load(Ordering::Acquire) as usize;
        // SAFETY: a message begins, so none is being written, or none that is ever ended.
        let (frame, _) = unsafe { parts() };
        *frame = Frame::begin(written, read);
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: within a message.
        let (frame, ring) = unsafe { parts() };
        frame.write(ring, bytes);
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: the end of a message.
        let (frame, ring) = unsafe { parts() };
        if let Some(end) = frame.end(ring) {
            let written = &_SEGGER_RTT.channel.written;
            written.store(end as u32, Ordering::Release);
        }
    }
}

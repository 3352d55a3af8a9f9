//! What both ends of a half-duplex line have in memory: bytes that have come, bytes to be sent.

use core::sync::atomic::{AtomicU8, Ordering, fence};

use bus::modbus::LONGEST;
use embassy_stm32::pac::gpio::Gpio;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Where the transceiver is: ports and pins.
pub struct Pins {
    /// What it has received.
    pub receive: (Gpio, usize),
    /// What it is to send.
    pub send: (Gpio, usize),
    /// High: it sends.
    pub driver: (Gpio, usize),
}

/// Bytes between two looks at the line: 22 ms at 230 400 Bd.
pub const RING: usize = 512;

/// What the transfers read and write.
pub static RECEIVED: [AtomicU8; RING] = [const { AtomicU8::new(0) }; RING];
pub static SENDING: [AtomicU8; LONGEST] = [const { AtomicU8::new(0) }; LONGEST];

/// The line has fallen silent after something.
pub static SILENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// The last stop bit is out.
pub static SENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The byte at this place of the ring, which goes on to the next, where so many are left of the transfer. What lies in the
/// ring for longer than it takes to fill is overwritten.
pub fn received(at: &mut usize, left: u16) -> Option<u8> {
    if *at == RING.wrapping_sub(left.into()) % RING {
        return None;
    }
    let byte = RECEIVED.get(*at)?.load(Ordering::Relaxed);
    *at = at.wrapping_add(1) % RING;
    Some(byte)
}

/// Takes the first 256 bytes that are to be sent, before the transfer begins; says how many.
pub fn fill(bytes: &[u8]) -> u16 {
    for (place, byte) in SENDING.iter().zip(bytes) {
        place.store(*byte, Ordering::Relaxed);
    }
    fence(Ordering::SeqCst);
    SENT.reset();
    bytes.len().min(LONGEST) as u16
}

//! Half-duplex RS-485 on USART6 of an STM32F4, by DMA (RM0090, chapters 10 and 30). The driver enable is an output of
//! the program: this family has none of its own.
//!
//! embassy's driver does the same and much more, which takes 4 kB of the image's 64.

use core::sync::atomic::{AtomicU8, Ordering::Relaxed, fence};

use bus::modbus::LONGEST;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::dma::vals::Dir;
use embassy_stm32::peripherals::{DMA2_CH1, DMA2_CH6, PD14, PG9, PG14, USART6};
use embassy_stm32::{Peri, interrupt, pac, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Bytes between two looks at the line: 22 ms at 230 400 Bd.
const RING: usize = 512;
/// Streams of DMA2 and their channel for this port (RM0090, table 44).
const RECEIVE: usize = 1;
const SEND: usize = 6;
const CHANNEL: u8 = 5;
/// The port's function at its pins (DS9405, table 12).
const FUNCTION: u8 = 8;
/// Of ports G, G and D.
const RECEIVE_PIN: usize = 9;
const SEND_PIN: usize = 14;
const DRIVER_PIN: usize = 14;

/// What the transfers read and write.
static RECEIVED: [AtomicU8; RING] = [const { AtomicU8::new(0) }; RING];
static SENDING: [AtomicU8; LONGEST] = [const { AtomicU8::new(0) }; LONGEST];

/// The line has fallen silent after something.
static SILENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// The last stop bit is out.
static SENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();

// SAFETY: the name gives it the place of the port's handler in the vector table.
#[interrupt]
unsafe fn USART6() {
    let port = pac::USART6;
    let (status, control) = (port.sr().read(), port.cr1().read());
    if status.idle() {
        // Read after the status, the data register clears the flag; what it holds has been fetched.
        port.dr().read();
        SILENT.signal(());
    }
    if control.tcie() && status.tc() {
        drive(false);
        port.cr1().modify(|w| w.set_tcie(false));
        SENT.signal(());
    }
}

/// Drives the line, deaf meanwhile: most transceivers give back what they send. Or listens.
fn drive(on: bool) {
    pac::USART6.cr1().modify(|w| w.set_re(!on));
    pac::GPIOD.bsrr().write(|w| match on {
        true => w.set_bs(DRIVER_PIN, true),
        false => w.set_br(DRIVER_PIN, true),
    });
}

/// Port, pins (D0, D1 and D10) and transfers.
pub type SerialParts = (
    Peri<'static, USART6>,
    Peri<'static, PG9>,
    Peri<'static, PG14>,
    Peri<'static, PD14>,
    Peri<'static, DMA2_CH1>,
    Peri<'static, DMA2_CH6>,
);

/// The port. There is one set of its parts, so there is one of these.
pub struct Serial {
    _parts: SerialParts,
    /// The next byte in the ring.
    at: usize,
}

impl Serial {
    /// Listens at this rate, 8 bits, no parity, one stop bit.
    pub fn new(parts: SerialParts, baud: u32) -> Self {
        pac::RCC.ahb1enr().modify(|w| {
            w.set_dma2en(true);
            w.set_gpioden(true);
            w.set_gpiogen(true);
        });
        pac::RCC.apb2enr().modify(|w| w.set_usart6en(true));
        // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
        pac::RCC.apb2enr().read();
        pins();
        let port = pac::USART6;
        let clock = rcc::frequency::<USART6>().0;
        port.brr().write(|w| w.0 = (clock + baud / 2) / baud);
        port.cr3().write(|w| {
            w.set_dmar(true);
            w.set_dmat(true);
        });
        let stream = pac::DMA2.st(RECEIVE);
        stream.par().write_value(port.dr().as_ptr() as u32);
        stream.m0ar().write_value(RECEIVED.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(RING as u16));
        stream.cr().write(|w| {
            w.set_chsel(CHANNEL);
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        port.cr1().write(|w| {
            w.set_ue(true);
            w.set_re(true);
            w.set_te(true);
            w.set_idleie(true);
        });
        // Below the control task: the line is let go of a tick later at most.
        interrupt::USART6.set_priority(Priority::P7);
        // SAFETY: its handler has nothing to share but two signals.
        unsafe { interrupt::USART6.enable() };
        Self {
            _parts: parts,
            at: 0,
        }
    }

    /// The next byte that has come. What lies in the ring for longer than it takes to fill is overwritten.
    pub fn received(&mut self) -> Option<u8> {
        let left = usize::from(pac::DMA2.st(RECEIVE).ndtr().read().ndt());
        if self.at == RING.wrapping_sub(left) % RING {
            return None;
        }
        let byte = RECEIVED.get(self.at)?.load(Relaxed);
        self.at = self.at.wrapping_add(1) % RING;
        Some(byte)
    }

    /// Done when the line has fallen silent after something, for the time of one character.
    pub fn silence(&self) -> impl Future<Output = ()> {
        SILENT.wait()
    }

    /// Sends the first 256 bytes; done when they are out.
    pub fn send(&mut self, bytes: &[u8]) -> impl Future<Output = ()> + use<> {
        for (place, byte) in SENDING.iter().zip(bytes) {
            place.store(*byte, Relaxed);
        }
        // The transfer must not begin before its bytes are there.
        fence(core::sync::atomic::Ordering::SeqCst);
        SENT.reset();
        drive(true);
        let port = pac::USART6;
        // Cleared by writing zero; the other flags are not cleared so.
        port.sr().modify(|w| w.set_tc(false));
        pac::DMA2.ifcr(SEND / 4).write(|w| w.0 = u32::MAX);
        let stream = pac::DMA2.st(SEND);
        stream.par().write_value(port.dr().as_ptr() as u32);
        stream.m0ar().write_value(SENDING.as_ptr() as u32);
        let count = bytes.len().min(LONGEST);
        stream.ndtr().write(|w| w.set_ndt(count as u16));
        stream.cr().write(|w| {
            w.set_chsel(CHANNEL);
            w.set_dir(Dir::MEMORY_TO_PERIPHERAL);
            w.set_minc(true);
            w.set_en(true);
        });
        port.cr1().modify(|w| w.set_tcie(true));
        SENT.wait()
    }
}

/// The port's pins, and the driver's, off.
fn pins() {
    use pac::gpio::vals::{Moder, Pupdr};
    drive(false);
    pac::GPIOD
        .moder()
        .modify(|w| w.set_moder(DRIVER_PIN, Moder::OUTPUT));
    for pin in [RECEIVE_PIN, SEND_PIN] {
        pac::GPIOG
            .afr(pin / 8)
            .modify(|w| w.set_afr(pin % 8, FUNCTION));
        pac::GPIOG
            .moder()
            .modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    // The receiver's output floats while the driver is on.
    pac::GPIOG
        .pupdr()
        .modify(|w| w.set_pupdr(RECEIVE_PIN, Pupdr::PULL_UP));
}

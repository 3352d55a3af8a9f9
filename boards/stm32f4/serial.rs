//! Half-duplex RS-485 on USART6 of an STM32F4, by DMA (RM0090, chapters 10 and 30). The driver enable is an output of
//! the program: this family has none of its own.
//!
//! embassy's driver does the same and much more, which takes 4 kB of the image's 64.

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::dma::vals::Dir;
use embassy_stm32::peripherals::{DMA2_CH1, DMA2_CH6, USART6};
use embassy_stm32::{Peri, interrupt, pac, rcc};

use crate::board::half_duplex::{self, Pins, RECEIVED, RING, SENDING, SENT, SILENT};

/// Streams of DMA2 and their channel for this port (RM0090, table 44).
const RECEIVE: usize = 1;
const SEND: usize = 6;
const CHANNEL: u8 = 5;
/// The port's function at its pins (DS9405, table 12).
const FUNCTION: u8 = 8;

/// What the port's interrupt does.
pub fn on_interrupt(pins: &Pins) {
    let port = pac::USART6;
    let (status, control) = (port.sr().read(), port.cr1().read());
    if status.idle() {
        // Read after the status, the data register clears the flag; what it holds has been fetched.
        port.dr().read();
        SILENT.signal(());
    }
    if control.tcie() && status.tc() {
        drive(pins, false);
        port.cr1().modify(|w| w.set_tcie(false));
        SENT.signal(());
    }
}

/// Drives the line, deaf meanwhile: most transceivers give back what they send. Or listens.
fn drive(pins: &Pins, on: bool) {
    pac::USART6.cr1().modify(|w| w.set_re(!on));
    let (port, pin) = pins.driver;
    port.bsrr().write(|w| match on {
        true => w.set_bs(pin, true),
        false => w.set_br(pin, true),
    });
}

/// The port and its transfers.
type Parts = (
    Peri<'static, USART6>,
    Peri<'static, DMA2_CH1>,
    Peri<'static, DMA2_CH6>,
);

/// The port. There is one set of its parts, so there is one of these.
pub struct Serial {
    _parts: Parts,
    pins: &'static Pins,
    /// The next byte in the ring.
    at: usize,
}

impl Serial {
    /// Of its parts. The clocks of its pins' ports are on.
    pub fn new(parts: Parts, pins: &'static Pins) -> Self {
        Self {
            _parts: parts,
            pins,
            at: 0,
        }
    }

    /// Listens from now on, at this rate, 8 bits, no parity, one stop bit.
    pub fn start(&mut self, baud: u32) {
        pac::RCC.ahb1enr().modify(|w| w.set_dma2en(true));
        pac::RCC.apb2enr().modify(|w| w.set_usart6en(true));
        // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
        pac::RCC.apb2enr().read();
        set_up(self.pins);
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
    }

    /// The next byte that has come.
    pub fn received(&mut self) -> Option<u8> {
        let left = pac::DMA2.st(RECEIVE).ndtr().read().ndt();
        half_duplex::received(&mut self.at, left)
    }

    /// Done when the line has fallen silent after something, for the time of one character.
    pub fn silence(&self) -> impl Future<Output = ()> {
        SILENT.wait()
    }

    /// Sends the first 256 bytes; done when they are out.
    pub fn send(&mut self, bytes: &[u8]) -> impl Future<Output = ()> + use<> {
        let count = half_duplex::fill(bytes);
        drive(self.pins, true);
        let port = pac::USART6;
        // Cleared by writing zero; the other flags are not cleared so.
        port.sr().modify(|w| w.set_tc(false));
        pac::DMA2.ifcr(SEND / 4).write(|w| w.0 = u32::MAX);
        let stream = pac::DMA2.st(SEND);
        stream.par().write_value(port.dr().as_ptr() as u32);
        stream.m0ar().write_value(SENDING.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(count));
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
fn set_up(pins: &Pins) {
    use pac::gpio::vals::{Moder, Pupdr};
    drive(pins, false);
    let (port, pin) = pins.driver;
    port.moder().modify(|w| w.set_moder(pin, Moder::OUTPUT));
    for (port, pin) in [pins.receive, pins.send] {
        port.afr(pin / 8).modify(|w| w.set_afr(pin % 8, FUNCTION));
        port.moder().modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    // The receiver's output floats while the driver is on.
    let (port, pin) = pins.receive;
    port.pupdr().modify(|w| w.set_pupdr(pin, Pupdr::PULL_UP));
}

//! Half-duplex RS-485 on USART1 of an STM32G4, by DMA (RM0440, chapters 12, 13 and 37). The port drives the transceiver's
//! enable by itself.

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::bdma::vals::Dir;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::peripherals::{DMA1_CH2, DMA1_CH3, USART1};
use embassy_stm32::{Peri, interrupt, pac, rcc};

use crate::board::half_duplex::{self, Pins, RECEIVED, RING, SENDING, SENT, SILENT};

/// Channels of DMA1, from 0, and of the multiplexer before it, and its requests of this port (RM0440, table 91).
const RECEIVE: (usize, u8) = (1, 24);
const SEND: (usize, u8) = (2, 25);
/// The port's function at its pins (DS12288, table 13).
const FUNCTION: u8 = 7;
/// The transceiver is enabled for so many sixteenths of a bit before the first start bit and after the last stop bit.
const ENABLED_16THS: u8 = 16;

/// What the port's interrupt does.
pub fn on_interrupt() {
    let port = pac::USART1;
    let (status, control) = (port.isr().read(), port.cr1().read());
    if status.idle() {
        port.icr().write(|w| w.set_idle(true));
        SILENT.signal(());
    }
    if control.tcie() && status.tc() {
        port.cr1().modify(|w| {
            w.set_tcie(false);
            w.set_re(true);
        });
        SENT.signal(());
    }
}

/// The port and its transfers.
type Parts = (
    Peri<'static, USART1>,
    Peri<'static, DMA1_CH2>,
    Peri<'static, DMA1_CH3>,
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
        pac::RCC.ahb1enr().modify(|w| {
            w.set_dma1en(true);
            w.set_dmamux1en(true);
        });
        pac::RCC.apb2enr().modify(|w| w.set_usart1en(true));
        pac::RCC.apb2enr().read();
        set_up(self.pins);
        let port = pac::USART1;
        let clock = rcc::frequency::<USART1>().0;
        port.brr()
            .write(|w| w.set_brr(((clock + baud / 2) / baud) as u16));
        port.cr3().write(|w| {
            w.set_dmar(true);
            w.set_dmat(true);
            w.set_dem(true);
            // What an overrun would stop goes on; the checksum finds what is missing.
            w.set_ovrdis(true);
        });
        let (channel, request) = RECEIVE;
        pac::DMAMUX1
            .ccr(channel)
            .write(|w| w.set_dmareq_id(request));
        let transfer = pac::DMA1.ch(channel);
        transfer.par().write_value(port.rdr().as_ptr() as u32);
        transfer.mar().write_value(RECEIVED.as_ptr() as u32);
        transfer.ndtr().write(|w| w.set_ndt(RING as u16));
        transfer.cr().write(|w| {
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        port.cr1().write(|w| {
            w.set_deat(ENABLED_16THS);
            w.set_dedt(ENABLED_16THS);
        });
        port.cr1().modify(|w| {
            w.set_ue(true);
            w.set_re(true);
            w.set_te(true);
            w.set_idleie(true);
        });
        // Below the control task.
        interrupt::USART1.set_priority(Priority::P7);
        // SAFETY: its handler has nothing to share but two signals.
        unsafe { interrupt::USART1.enable() };
    }

    /// The next byte that has come.
    pub fn received(&mut self) -> Option<u8> {
        let left = pac::DMA1.ch(RECEIVE.0).ndtr().read().ndt();
        half_duplex::received(&mut self.at, left)
    }

    /// Done when the line has fallen silent after something, for the time of one character.
    pub fn silence(&self) -> impl Future<Output = ()> {
        SILENT.wait()
    }

    /// Sends the first 256 bytes; done when they are out. Deaf meanwhile: most transceivers give back what they send.
    pub fn send(&mut self, bytes: &[u8]) -> impl Future<Output = ()> + use<> {
        let count = half_duplex::fill(bytes);
        let port = pac::USART1;
        port.cr1().modify(|w| w.set_re(false));
        port.icr().write(|w| w.set_tc(true));
        let (channel, request) = SEND;
        pac::DMAMUX1
            .ccr(channel)
            .write(|w| w.set_dmareq_id(request));
        let transfer = pac::DMA1.ch(channel);
        transfer.cr().write(|_| {});
        transfer.par().write_value(port.tdr().as_ptr() as u32);
        transfer.mar().write_value(SENDING.as_ptr() as u32);
        transfer.ndtr().write(|w| w.set_ndt(count));
        transfer.cr().write(|w| {
            w.set_dir(Dir::FROM_MEMORY);
            w.set_minc(true);
            w.set_en(true);
        });
        port.cr1().modify(|w| w.set_tcie(true));
        SENT.wait()
    }
}

/// The port's pins.
fn set_up(pins: &Pins) {
    for (port, pin) in [pins.receive, pins.send, pins.driver] {
        port.afr(pin / 8).modify(|w| w.set_afr(pin % 8, FUNCTION));
        port.moder().modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    // The receiver's output floats while the driver is on.
    let (port, pin) = pins.receive;
    port.pupdr().modify(|w| w.set_pupdr(pin, Pupdr::PULL_UP));
}

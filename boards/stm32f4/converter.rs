//! ADC1 of an STM32F4, which scans its channels all the time by DMA (RM0090, chapters 10 and 13).
//!
//! embassy's driver does the same and much more, which takes 3 kB of the image's 64 and a tenth of a tick.

use embassy_stm32::pac::adc::vals::Dds;
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::pac::dma::vals::Size;
use embassy_stm32::peripherals::{ADC1, DMA2_CH0};
use embassy_stm32::{Peri, pac};
use softgrip::scan::CHANNELS;
use softgrip::{RawFrame, frontend};

use crate::board::analogue::{Analogue, RECEIVED, RING, Scans};

/// The stream of DMA2; its channel for this converter is the first (RM0090, table 44).
const STREAM: usize = 0;
/// Cycles in which the converter gets ready, 3 µs at the fastest clock (DS9405, ADC characteristics).
const READY_CYCLES: u32 = 3 * 180;

/// Reads of its register within which a stream is off: one takes several cycles.
const OFF_WITHIN_READS: u32 = 1_000;

/// The converter and its transfer.
type Parts = (Peri<'static, ADC1>, Peri<'static, DMA2_CH0>);

/// The converter. There is one set of its parts, so there is one of these.
pub struct Converter {
    _parts: Parts,
    scans: Scans,
}

impl Converter {
    /// Scans these channels from now on: gauges, monitor, supply, internal reference.
    pub fn new(parts: Parts, sequence: &[Analogue; CHANNELS]) -> Self {
        pac::RCC.ahb1enr().modify(|w| w.set_dma2en(true));
        pac::RCC.apb2enr().modify(|w| w.set_adc1en(true));
        // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
        pac::RCC.apb2enr().read();
        pac::ADC123_COMMON.ccr().modify(|w| {
            // 22.5 MHz of at most 36.
            w.set_adcpre(Adcpre::DIV4);
            w.set_tsvrefe(true);
        });
        let converter = pac::ADC1;
        converter.cr1().write(|w| w.set_scan(true));
        converter.sqr1().write(|w| w.set_l(CHANNELS as u8 - 1));
        for (place, analogue) in sequence.iter().enumerate() {
            analogue.set_up();
            let (channel, time) = (analogue.channel, analogue.time);
            match place.checked_sub(6) {
                Some(place) => converter.sqr2().modify(|w| w.set_sq(place, channel as u8)),
                None => converter.sqr3().modify(|w| w.set_sq(place, channel as u8)),
            }
            match channel.checked_sub(10) {
                Some(channel) => converter.smpr1().modify(|w| w.set_smp(channel, time)),
                None => converter.smpr2().modify(|w| w.set_smp(channel, time)),
            }
        }
        let mut this = Self {
            _parts: parts,
            scans: Scans::new(frontend::reference_code(factory_reference())),
        };
        this.start();
        this
    }

    /// Starts at the first channel.
    fn start(&mut self) {
        let (converter, stream) = (pac::ADC1, pac::DMA2.st(STREAM));
        converter.cr2().write(|_| {});
        stream.cr().write(|_| {});
        // A transfer ends before its stream is off, in some cycles.
        for _ in 0..OFF_WITHIN_READS {
            if !stream.cr().read().en() {
                break;
            }
        }
        pac::DMA2.ifcr(0).write(|w| w.0 = u32::MAX);
        converter.sr().write(|_| {});
        stream.par().write_value(converter.dr().as_ptr() as u32);
        stream.m0ar().write_value(RECEIVED.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(RING as u16));
        stream.cr().write(|w| {
            w.set_msize(Size::BITS16);
            w.set_psize(Size::BITS16);
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        self.scans.restart();
        converter.cr2().write(|w| {
            w.set_adon(true);
            w.set_cont(true);
            w.set_dma(true);
            w.set_dds(Dds::CONTINUOUS);
        });
        cortex_m::asm::delay(READY_CYCLES);
        converter.cr2().modify(|w| w.set_swstart(true));
    }

    /// The mean of the whole scans since the last call. After an overrun, which stops the transfer in the middle of one,
    /// it starts again.
    // Never inlined, so that what it can reach can be read off the image: no panic.
    #[inline(never)]
    pub fn frame(&mut self) -> RawFrame {
        let left = pac::DMA2.st(STREAM).ndtr().read().ndt();
        let overrun = pac::ADC1.sr().read().ovr();
        let frame = self.scans.average(left, overrun);
        if overrun {
            self.start();
        }
        frame
    }
}

/// What the internal reference read at the factory, at 3.3 V and 30 °C (DS9405, embedded reference voltage).
fn factory_reference() -> u16 {
    const VREFIN_CAL: *const u16 = 0x1fff_7a2a as *const u16;
    // SAFETY: a readable halfword of the chip's system memory, aligned, and never written.
    unsafe { VREFIN_CAL.read_volatile() }
}

//! ADC1 of an STM32F4, which scans its channels all the time by DMA (RM0090, chapters 10 and 13).
//!
//! embassy's driver does the same and much more, which takes 3 kB of the image's 64 and a tenth of a tick.

use core::sync::atomic::AtomicU16;

use embassy_stm32::pac::adc::vals::{Dds, SampleTime};
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::pac::dma::vals::Size;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::peripherals::{ADC1, DMA2_CH0, PA3, PB1, PC0, PC2, PC3};
use embassy_stm32::{Peri, pac};
use softgrip::RawFrame;
use softgrip::scan::{self, CHANNELS};

/// The scan's order: gauges, monitor, supply, internal reference. At 22.5 MHz, with 12 cycles of conversion, 21.9 and
/// 4.3 µs each. The internal reference asks for 10 µs of sampling; the supply moves slowly, and a capacitor holds it.
const SEQUENCE: [(usize, SampleTime); CHANNELS] = [
    (3, SampleTime::CYCLES480),
    (10, SampleTime::CYCLES480),
    (13, SampleTime::CYCLES480),
    (12, SampleTime::CYCLES480),
    (9, SampleTime::CYCLES84),
    (17, SampleTime::CYCLES480),
];
/// Their pins; the last has none.
const PINS: [(Gpio, usize); CHANNELS - 1] = [
    (pac::GPIOA, 3),
    (pac::GPIOC, 0),
    (pac::GPIOC, 3),
    (pac::GPIOC, 2),
    (pac::GPIOB, 1),
];

/// Scans in the transfer's ring: 3.6 ms, so a tick may be late by two.
const SCANS: usize = 32;
const RING: usize = SCANS * CHANNELS;
/// Scans looked at in one tick: one takes 114 µs, so there are seven or eight.
const MOST: usize = 16;
/// The stream of DMA2; its channel for this converter is the first (RM0090, table 44).
const STREAM: usize = 0;
/// Cycles in which the converter gets ready, 3 µs at the fastest clock (DS9405, ADC characteristics).
const READY_CYCLES: u32 = 3 * 180;

/// Reads of its register within which a stream is off: one takes several cycles.
const OFF_WITHIN_READS: u32 = 1_000;

/// What the transfer writes.
static RECEIVED: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];

/// Converter, pins (A0, A1, A2, A7, A6) and transfer.
pub type ConverterParts = (
    Peri<'static, ADC1>,
    Peri<'static, PA3>,
    Peri<'static, PC0>,
    Peri<'static, PC3>,
    Peri<'static, PC2>,
    Peri<'static, PB1>,
    Peri<'static, DMA2_CH0>,
);

/// The converter. There is one set of its parts, so there is one of these.
pub struct Converter {
    _parts: ConverterParts,
    /// What the internal reference reads at 3.3 V.
    calibrated: u16,
    /// The first scan in the ring that nobody has looked at.
    at: usize,
}

impl Converter {
    /// Scans from now on. `calibrated`: what the internal reference reads at 3.3 V.
    pub fn new(parts: ConverterParts, calibrated: u16) -> Self {
        pac::RCC.ahb1enr().modify(|w| {
            w.set_dma2en(true);
            w.set_gpioaen(true);
            w.set_gpioben(true);
            w.set_gpiocen(true);
        });
        pac::RCC.apb2enr().modify(|w| w.set_adc1en(true));
        // A clock is there two cycles after it was enabled (errata ES0206); a read takes longer.
        pac::RCC.apb2enr().read();
        for (port, pin) in PINS {
            port.moder().modify(|w| w.set_moder(pin, Moder::ANALOG));
        }
        pac::ADC123_COMMON.ccr().modify(|w| {
            // 22.5 MHz of at most 36.
            w.set_adcpre(Adcpre::DIV4);
            w.set_tsvrefe(true);
        });
        let converter = pac::ADC1;
        converter.cr1().write(|w| w.set_scan(true));
        converter.sqr1().write(|w| w.set_l(CHANNELS as u8 - 1));
        for (place, (channel, time)) in SEQUENCE.into_iter().enumerate() {
            converter.sqr3().modify(|w| w.set_sq(place, channel as u8));
            match channel.checked_sub(10) {
                Some(channel) => converter.smpr1().modify(|w| w.set_smp(channel, time)),
                None => converter.smpr2().modify(|w| w.set_smp(channel, time)),
            }
        }
        let mut this = Self {
            _parts: parts,
            calibrated,
            at: 0,
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
        self.at = 0;
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
        let left = usize::from(pac::DMA2.st(STREAM).ndtr().read().ndt());
        let end = RING.saturating_sub(left) / CHANNELS % SCANS;
        let new = SCANS.wrapping_add(end).wrapping_sub(self.at) % SCANS;
        let count = new.min(MOST);
        let from = SCANS.wrapping_add(end).wrapping_sub(count) % SCANS;
        self.at = end;
        let overrun = pac::ADC1.sr().read().ovr();
        let frame = scan::average(&RECEIVED, from, count, self.calibrated, overrun);
        if overrun {
            self.start();
        }
        frame
    }
}

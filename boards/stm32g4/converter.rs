//! ADC1 of an STM32G4, which scans its channels all the time by DMA and averages each by itself (RM0440, chapters 12, 13
//! and 21).

use embassy_stm32::pac::adc::regs::Isr;
use embassy_stm32::pac::adc::vals::{Adcaldif, Adstp, Dmacfg, Dmaen};
use embassy_stm32::pac::adccommon::vals::Ckmode;
use embassy_stm32::pac::bdma::vals::Size;
use embassy_stm32::peripherals::{ADC1, DMA1_CH1};
use embassy_stm32::{Peri, pac};
use softgrip::scan::CHANNELS;
use softgrip::{RawFrame, frontend};

use crate::board::analogue::{Analogue, RECEIVED, RING, Scans};
use crate::board::wait::wait_us;

/// Each value of a scan is the mean of eight conversions: the sum of 2 to this power, shifted by as much.
const OVERSAMPLING: u8 = 3;

/// The channel of DMA1, from 0, and of the multiplexer before it; its request of this converter (RM0440, table 91).
const TRANSFER: usize = 0;
const REQUEST: u8 = 5;
/// The regulator's start, µs (DS12288, ADC characteristics).
const REGULATOR_US: u32 = 20;
/// Reads of its register within which the converter is ready, off or calibrated: some hundred of its cycles.
const WITHIN_READS: u32 = 10_000;

/// The converter and its transfer.
type Parts = (Peri<'static, ADC1>, Peri<'static, DMA1_CH1>);

/// The converter. There is one set of its parts, so there is one of these.
pub struct Converter {
    _parts: Parts,
    scans: Scans,
}

/// Waits until something is so, within a bounded number of reads.
fn wait(so: impl Fn() -> bool) {
    for _ in 0..WITHIN_READS {
        if so() {
            break;
        }
    }
}

impl Converter {
    /// Scans these channels from now on: gauges, monitor, supply, internal reference.
    pub fn new(parts: Parts, sequence: &[Analogue; CHANNELS]) -> Self {
        pac::RCC.ahb1enr().modify(|w| {
            w.set_dma1en(true);
            w.set_dmamux1en(true);
        });
        pac::RCC.ahb2enr().modify(|w| w.set_adc12en(true));
        pac::RCC.ahb2enr().read();
        pac::ADC12_COMMON.ccr().modify(|w| {
            // 42.5 MHz of at most 60.
            w.set_ckmode(Ckmode::SYNC_DIV4);
            w.set_vrefen(true);
        });
        let converter = pac::ADC1;
        converter.cr().modify(|w| w.set_deeppwd(false));
        converter.cr().modify(|w| w.set_advregen(true));
        wait_us(REGULATOR_US);
        converter.cr().modify(|w| {
            w.set_adcaldif(Adcaldif::SINGLE_ENDED);
            w.set_adcal(true);
        });
        wait(|| !converter.cr().read().adcal());
        // It may be switched on four of its cycles after that.
        wait_us(1);
        converter.cr().modify(|w| w.set_aden(true));
        wait(|| converter.isr().read().adrdy());
        set_up(sequence);
        pac::DMAMUX1
            .ccr(TRANSFER)
            .write(|w| w.set_dmareq_id(REQUEST));
        let mut this = Self {
            _parts: parts,
            scans: Scans::new(frontend::reference_code(factory_reference())),
        };
        this.start();
        this
    }

    /// Starts at the first channel.
    fn start(&mut self) {
        let (converter, transfer) = (pac::ADC1, pac::DMA1.ch(TRANSFER));
        if converter.cr().read().adstart() {
            converter.cr().modify(|w| w.set_adstp(Adstp::STOP));
            wait(|| !converter.cr().read().adstart());
        }
        transfer.cr().write(|_| {});
        // Each flag is cleared by writing it.
        converter.isr().write_value(Isr(u32::MAX));
        transfer.par().write_value(converter.dr().as_ptr() as u32);
        transfer.mar().write_value(RECEIVED.as_ptr() as u32);
        transfer.ndtr().write(|w| w.set_ndt(RING as u16));
        transfer.cr().write(|w| {
            w.set_msize(Size::BITS16);
            w.set_psize(Size::BITS16);
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        self.scans.restart();
        converter.cr().modify(|w| w.set_adstart(true));
    }

    /// The mean of the whole scans since the last call. After an overrun, which stops the transfer in the middle of one,
    /// it starts again.
    // Never inlined, so that what it can reach can be read off the image: no panic.
    #[inline(never)]
    pub fn frame(&mut self) -> RawFrame {
        let left = pac::DMA1.ch(TRANSFER).ndtr().read().ndt();
        let overrun = pac::ADC1.isr().read().ovr();
        let frame = self.scans.average(left, overrun);
        if overrun {
            self.start();
        }
        frame
    }
}

/// Sequence, sampling times and averaging, while no conversion runs.
fn set_up(sequence: &[Analogue; CHANNELS]) {
    let converter = pac::ADC1;
    converter.cfgr().modify(|w| {
        w.set_cont(true);
        w.set_dmaen(Dmaen::ENABLE);
        w.set_dmacfg(Dmacfg::CIRCULAR);
    });
    converter.cfgr2().modify(|w| {
        w.set_rovse(true);
        w.set_ovsr(OVERSAMPLING - 1);
        w.set_ovss(OVERSAMPLING);
    });
    converter.sqr1().modify(|w| w.set_l(CHANNELS as u8 - 1));
    for (place, analogue) in sequence.iter().enumerate() {
        analogue.set_up();
        let (channel, time) = (analogue.channel, analogue.time);
        match place.checked_sub(4) {
            Some(place) => converter.sqr2().modify(|w| w.set_sq(place, channel as u8)),
            None => converter.sqr1().modify(|w| w.set_sq(place, channel as u8)),
        }
        match channel.checked_sub(10) {
            Some(channel) => converter.smpr2().modify(|w| w.set_smp(channel, time)),
            None => converter.smpr().modify(|w| w.set_smp(channel, time)),
        }
    }
}

/// What the internal reference would have read at the factory, at 3.3 V and 30 °C: it was read at 3.0 V (DS12288, embedded
/// voltage reference).
fn factory_reference() -> u16 {
    let at_3_0_v = u32::from(pac::VREFINTCAL.data().read());
    ((10 * at_3_0_v + 5) / 11) as u16
}

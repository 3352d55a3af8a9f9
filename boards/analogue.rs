//! What a converter scans, and the ring that its transfer fills with it.

use core::sync::atomic::AtomicU16;

use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Moder;
use softgrip::scan::{self, CHANNELS};
use softgrip::{FINGERS, RawFrame};

/// One channel of the scan.
#[derive(Clone, Copy)]
pub struct Analogue {
    pin: Option<(Gpio, usize)>,
    /// Its number at the converter.
    pub channel: usize,
    pub time: SampleTime,
}

impl Analogue {
    /// At a pin, whose port has a clock.
    pub const fn new(port: Gpio, pin: usize, channel: usize, time: SampleTime) -> Self {
        Self {
            pin: Some((port, pin)),
            channel,
            time,
        }
    }

    /// Inside the chip.
    pub const fn inside(channel: usize, time: SampleTime) -> Self {
        Self {
            pin: None,
            channel,
            time,
        }
    }

    /// Lets its pin go from everything digital.
    pub fn set_up(&self) {
        if let Some((port, pin)) = self.pin {
            port.moder().modify(|w| w.set_moder(pin, Moder::ANALOG));
        }
    }
}

/// Gauges that a board has pins for; the first are used.
pub const GAUGES: usize = 4;

/// The scan: a gauge per finger, and the others.
pub const fn sequence(
    gauges: [Analogue; GAUGES],
    others: [Analogue; CHANNELS - FINGERS],
) -> [Analogue; CHANNELS] {
    let mut all = [gauges[0]; CHANNELS];
    let mut place = 0;
    while place < CHANNELS {
        all[place] = match place < FINGERS {
            true => gauges[place],
            false => others[place - FINGERS],
        };
        place += 1;
    }
    all
}

/// Scans in the ring: 3.4 ms at the least, so a tick may be late by two.
const SCANS: usize = 32;
/// Samples in it.
pub const RING: usize = SCANS * CHANNELS;
/// Scans looked at in one tick: one takes more than 100 µs, so there are ten at most.
const MOST: usize = 16;

/// What the transfer writes.
pub static RECEIVED: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];

/// How far the ring has been looked at.
pub struct Scans {
    /// What the internal reference reads at 3.3 V.
    calibrated: u16,
    /// The first scan that nobody has looked at.
    at: usize,
}

impl Scans {
    /// From its beginning.
    pub fn new(calibrated: u16) -> Self {
        Self { calibrated, at: 0 }
    }

    /// The transfer begins again at the beginning.
    pub fn restart(&mut self) {
        self.at = 0;
    }

    /// The mean of the whole scans since the last call, where so many samples are left of the transfer.
    pub fn average(&mut self, left: u16, overrun: bool) -> RawFrame {
        let end = RING.saturating_sub(left.into()) / CHANNELS % SCANS;
        let new = SCANS.wrapping_add(end).wrapping_sub(self.at) % SCANS;
        let count = new.min(MOST);
        let from = SCANS.wrapping_add(end).wrapping_sub(count) % SCANS;
        self.at = end;
        scan::average(&RECEIVED, from, count, self.calibrated, overrun)
    }
}

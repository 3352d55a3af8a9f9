//! Converter codes → strain, pressure and supply, each either trustworthy or named as what it is.

mod channel;
mod liveliness;
mod monitor;
mod noise;

use channel::Channel;
use monitor::MonitorWire;
use noise::Gains;

use crate::fault::GaugeFault;
use crate::frontend::{FrontEnd, rail_factor, rail_is_good};
use crate::units::{AdcCode, FINGERS, Kilopascals, Microstrain, Millivolts, Volts};

pub use channel::Gauge;
pub use monitor::Monitor;

/// What the converter delivered for one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawFrame {
    /// One gauge per finger.
    pub gauges: [AdcCode; FINGERS],
    /// The regulator's pressure monitor.
    pub monitor: AdcCode,
    /// The supply voltage.
    pub supply: AdcCode,
    /// The 3.3 V rail that these codes are shares of, as the chip's internal reference tells it.
    pub rail: Millivolts,
    /// Scans behind these means; zero says that nothing new arrived.
    pub scans: u16,
    /// The converter lost data, so channels may be mixed up.
    pub overrun: bool,
    /// The gauges' codes stand for a tick in which none was measured, as between two rows of a slow trace:
    /// nothing is concluded from how they change. A converter never says so.
    pub carried: bool,
}

/// What the models make of one tick before it is measured.
#[derive(Debug, Clone, Copy, Default)]
pub struct Expected {
    /// Zero of each gauge, µε: what is to be subtracted from its strain.
    pub zero_ue: [f32; FINGERS],
    /// Strain of a free finger; unknown before the first pressure.
    pub free_strain: Option<Microstrain>,
    /// What the commands so far should have given; unknown before the first pressure.
    pub pressure: Option<Kilopascals>,
}

/// Everything measured in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// One gauge per finger.
    pub gauges: [Gauge; FINGERS],
    /// Variance of each gauge's noise, µε².
    pub noise_variance: [f32; FINGERS],
    /// The pressure.
    pub monitor: Monitor,
    /// The supply, if measured in this tick.
    pub supply: Option<Volts>,
    /// The converters' reference was measured in this tick, and is not good enough to measure by.
    pub rail_is_off: bool,
    /// Ticks since the last usable frame.
    pub stale_ticks: u32,
    /// The converter lost data in this tick.
    pub overrun: bool,
}

impl Reading {
    /// The strain of each gauge, µε, where all of them can be trusted.
    pub fn strains(&self) -> Option<[f32; FINGERS]> {
        let mut strains = [0.0; FINGERS];
        for (place, gauge) in strains.iter_mut().zip(&self.gauges) {
            *place = gauge.strain()?.0;
        }
        Some(strains)
    }
}

/// The state behind the readings: fault timers, noise.
#[derive(Debug, Clone, Copy)]
pub struct Conditioner {
    channels: [Channel; FINGERS],
    monitor: MonitorWire,
    gains: Gains,
    stale_ticks: u32,
    /// Ticks that one measurement stands for: one, or more in a slow trace.
    spacing: f32,
}

impl Conditioner {
    /// No faults.
    pub fn new() -> Self {
        Self {
            channels: [Channel::NEW; FINGERS],
            monitor: MonitorWire::NEW,
            gains: Gains::every_tick(),
            stale_ticks: 0,
            spacing: 1.0,
        }
    }

    /// Turns one frame into readings. `acknowledged`: somebody has seen which gauges had failed before the
    /// last tick; each failure ends with its cause, now or later, and no clock starts again.
    pub fn step(
        &mut self,
        frame: &RawFrame,
        front_end: &FrontEnd,
        expected: &Expected,
        acknowledged: bool,
    ) -> Reading {
        if acknowledged {
            self.channels.iter_mut().for_each(Channel::acknowledge);
        }
        let has_data = frame.scans > 0 && !frame.overrun;
        self.stale_ticks = match has_data {
            true => 0,
            false => self.stale_ticks.saturating_add(1),
        };
        let gauges = match has_data {
            true => self.gauges(frame, front_end, expected),
            false => core::array::from_fn(|i| self.channels[i].missing()),
        };
        let rail = rail_factor(frame.rail);
        Reading {
            gauges,
            noise_variance: core::array::from_fn(|i| self.channels[i].noise_variance()),
            monitor: match has_data {
                true => self
                    .monitor
                    .step(frame.monitor, rail, front_end, expected.pressure),
                false => Monitor::Missing,
            },
            supply: has_data.then(|| Volts(rail * front_end.supply(frame.supply).0)),
            rail_is_off: has_data && !rail_is_good(frame.rail),
            stale_ticks: self.stale_ticks,
            overrun: frame.overrun,
        }
    }

    /// What has failed of each gauge.
    pub fn failures(&self) -> [Option<GaugeFault>; FINGERS] {
        self.channels.map(|channel| match channel.missing() {
            Gauge::Failed(fault) => Some(fault),
            Gauge::Valid(_) | Gauge::Missing => None,
        })
    }

    fn gauges(
        &mut self,
        frame: &RawFrame,
        front_end: &FrontEnd,
        expected: &Expected,
    ) -> [Gauge; FINGERS] {
        let mut gauges = [Gauge::Missing; FINGERS];
        let amplifier = &front_end.amplifier;
        let channels = self.channels.iter_mut();
        let channels = channels.zip(front_end.gauge_ue_per_code);
        let codes = frame.gauges.iter().zip(expected.zero_ue);
        let channels = gauges.iter_mut().zip(channels.zip(codes));
        if frame.carried {
            self.spacing += 1.0;
            for (gauge, ((channel, ue), (&code, zero_ue))) in channels {
                *gauge = channel.carry(amplifier.strain(code, ue), zero_ue);
            }
            return gauges;
        }
        let slow;
        let gains = if self.spacing > 1.0 {
            slow = self.gains.over(self.spacing);
            self.spacing = 1.0;
            &slow
        } else {
            &self.gains
        };
        for (gauge, ((channel, ue), (&code, zero_ue))) in channels {
            *gauge = channel.step(
                code,
                amplifier.strain(code, ue),
                amplifier,
                zero_ue,
                expected.free_strain,
                gains,
            );
        }
        gauges
    }
}

impl Default for Conditioner {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;

//! A fast sensor model: from strain and pressure to converter codes.
//!
//! The noise of a tick's mean is drawn once per tick, not once per scan; the mean of ten quantised scans
//! differs from that by less than one code.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use sim::gripper::Gripper;
use softgrip::frontend::FrontEnd;
use softgrip::units::{AdcCode, Kilopascals, Microstrain, Volts};
use softgrip::{FINGERS, RawFrame};

/// Converter scans that are averaged in one tick.
const SCANS: u16 = 10;

/// Gauges, monitor and converter of one gripper.
#[derive(Debug, Clone)]
pub struct SensorModel<R> {
    rng: R,
    front_end: FrontEnd,
    supply: AdcCode,
    monitor_noise_kpa: f32,
}

impl<R: Rng> SensorModel<R> {
    /// The electronics of this gripper.
    pub fn new(rng: R, gripper: &Gripper) -> Self {
        let front_end = gripper.front_end();
        Self {
            rng,
            supply: AdcCode(front_end.supply_code(Volts(24.0)) as u16),
            monitor_noise_kpa: gripper.regulator.monitor_noise_kpa as f32,
            front_end,
        }
    }

    /// What codes mean.
    pub fn front_end(&self) -> &FrontEnd {
        &self.front_end
    }

    /// The converter's codes for one tick; `noise_ue` is the rms noise of a gauge reading, µε.
    pub fn frame(
        &mut self,
        strain_ue: [f32; FINGERS],
        noise_ue: [f32; FINGERS],
        pressure_kpa: f32,
    ) -> RawFrame {
        let front_end = self.front_end;
        let mut normal = || -> f32 { self.rng.sample(StandardNormal) };
        let gauges = std::array::from_fn(|i| {
            let strain = strain_ue[i] + noise_ue[i] * normal();
            AdcCode((front_end.gauge_code(i, Microstrain(strain)) + 0.5) as u16)
        });
        let pressure = pressure_kpa + self.monitor_noise_kpa * normal();
        let monitor = front_end.monitor_code(Kilopascals(pressure));
        RawFrame {
            gauges,
            monitor: AdcCode((monitor + 0.5) as u16),
            supply: self.supply,
            rail: softgrip::frontend::RAIL,
            scans: SCANS,
            overrun: false,
            carried: false,
        }
    }
}

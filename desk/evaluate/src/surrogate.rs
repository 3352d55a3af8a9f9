//! The fast gripper: air, free bend, plateau and the identified response instead of rigid bodies.

use rand::Rng;
use softgrip::frontend::FrontEnd;
use softgrip::table::FingerTable;
use softgrip::units::{DacCode, Kilopascals};
use softgrip::{FINGERS, RawFrame};

use super::meter::Meter;
use super::response::{Held, Response};
use crate::gripper::Gripper;
use crate::plant::{Lag, Swing};

const TICK_S: f64 = 0.001;

/// A finger presses on the object when its residual is beyond this, µε.
const TOUCH_UE: f64 = 500.0;

/// What is wrong with one gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// Gain over what the controller was calibrated to.
    pub gain: f64,
    /// Offset, µε.
    pub offset_ue: f64,
    /// Noise, µε rms.
    pub noise_ue: f32,
}

/// Three fingers, the air and the measuring chain.
pub struct Hand<R> {
    meter: Meter<R>,
    table: &'static FingerTable,
    gripper: Gripper,
    valve_kpa: f64,
    pressure: Lag,
    inflation: Lag,
    bending: Swing,
    creep: [Lag; FINGERS],
    /// What is between the fingers.
    held: Option<(Response, Held)>,
    /// The gauges.
    pub gauges: [Gauge; FINGERS],
}

impl<R: Rng> Hand<R> {
    /// Open, empty.
    pub fn new(
        gripper: &Gripper,
        table: &'static FingerTable,
        gauges: [Gauge; FINGERS],
        rng: R,
    ) -> Self {
        Self {
            meter: Meter::new(rng, gripper.regulator.monitor_noise_kpa),
            table,
            valve_kpa: 0.0,
            pressure: Lag::new(1e-3 * gripper.regulator.lag_ms),
            inflation: Lag::new(1e-3 * gripper.hand.inflation_lag_ms),
            bending: Swing::default(),
            creep: [Lag::new(gripper.gauge.creep_time_s); FINGERS],
            held: None,
            gauges,
            gripper: gripper.clone(),
        }
    }

    /// Puts an object between the open fingers, or takes it away.
    pub fn place(&mut self, object: Option<&Response>) {
        self.held = object.map(|response| (response.clone(), Held::new(response)));
    }

    /// How far the object has given way sideways, as the share of the plateau that this has changed.
    pub fn gave_way(&self) -> f64 {
        self.held.as_ref().map_or(0.0, |(response, held)| {
            held.gave_way_ue() / response.residual_at(response.pressure_kpa)
        })
    }

    /// One tick under this acceleration of the palm.
    pub fn step(&mut self, dac: DacCode, acceleration_m_s2: [f64; 3], ripple_kpa: f64) -> RawFrame {
        let regulator = &self.gripper.regulator;
        let commanded = f64::from(FrontEnd::REFERENCE.commanded(dac).0);
        let wanted = if commanded > 1.0 {
            (regulator.gain * commanded + regulator.offset_kpa).max(0.0)
        } else {
            0.0
        };
        let slew = regulator.slew_kpa_per_s * TICK_S;
        self.valve_kpa += (wanted - self.valve_kpa).clamp(-slew, slew);
        let pressure_kpa = (self.pressure.step(self.valve_kpa) + ripple_kpa).max(0.0);
        let inflated_kpa = self.inflation.step(pressure_kpa);
        let free_at = |kpa: f64| f64::from(self.table.free_strain(Kilopascals(kpa as f32)).0.0);
        let mut free = free_at(self.bending.step(inflated_kpa));

        let mut residual = [0.0; FINGERS];
        if let Some((response, held)) = &mut self.held {
            let plateau = response.residual_at(inflated_kpa);
            // A free finger swings; one that presses on something does not.
            let pressing = plateau / (plateau + TOUCH_UE);
            free += pressing * (free_at(inflated_kpa) - free);
            let share = plateau / response.residual_at(response.pressure_kpa);
            let change = held.step(acceleration_m_s2);
            residual = change.map(|change| plateau + share * change);
        }
        let creep = 0.01 * self.gripper.gauge.creep_percent;
        let gauges = self.gauges;
        let strain = std::array::from_fn(|i| {
            let strain = free - residual[i];
            let shown = strain + creep * self.creep[i].step(strain);
            (gauges[i].gain * shown + gauges[i].offset_ue) as f32
        });
        self.meter.frame(
            strain,
            gauges.map(|gauge| gauge.noise_ue),
            pressure_kpa as f32,
        )
    }
}

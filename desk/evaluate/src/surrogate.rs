//! A fast surrogate of the simulated gripper: air, free bend, plateau and the identified model replace the
//! rigid bodies.

use rand::Rng;
use sim::air::{Lag, Swing, Valve};
use sim::gripper::Gripper;
use sim::silicone::{Creep, Silicone};
use softgrip::table::{self, FingerTable};
use softgrip::units::{DacCode, Kilopascals};
use softgrip::{FINGERS, RawFrame};

use crate::identified_model::{Held, IdentifiedModel};
use crate::sensor_model::SensorModel;

/// A finger presses on the object when its residual is beyond this, µε.
const TOUCH_UE: f64 = 500.0;

/// Errors of one gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeErrors {
    /// Gain over what the controller was calibrated to.
    pub gain: f64,
    /// Offset of the zero, µε.
    pub offset_ue: f64,
    /// Noise at the control tick, µε rms.
    pub noise_ue: f32,
}

/// Three fingers, the air and the measuring chain.
pub struct Surrogate<R> {
    sensors: SensorModel<R>,
    table: &'static FingerTable,
    gripper: Gripper,
    valve: Valve,
    pressure: Lag,
    silicone: Silicone,
    bending: Swing,
    creep: Creep<FINGERS>,
    gauge_creep: Creep<FINGERS>,
    /// The held object, if there is one.
    held: Option<(IdentifiedModel, Held)>,
    /// Errors of each gauge.
    pub gauges: [GaugeErrors; FINGERS],
}

impl<R: Rng> Surrogate<R> {
    /// Open fingers without an object, at zero pressure.
    pub fn new(
        gripper: &Gripper,
        table: &'static FingerTable,
        gauges: [GaugeErrors; FINGERS],
        rng: R,
    ) -> Self {
        Self {
            sensors: SensorModel::new(rng, gripper),
            table,
            valve: Valve::default(),
            pressure: Lag::new(1e-3 * gripper.regulator.lag_ms),
            silicone: Silicone::new(&gripper.hand, table.max_pressure_kpa.into()),
            bending: Swing::default(),
            creep: Creep::new(gripper.hand.creep_percent, gripper.hand.creep_time_s),
            gauge_creep: Creep::new(gripper.gauge.creep_percent, gripper.gauge.creep_time_s),
            held: None,
            gauges,
            gripper: gripper.clone(),
        }
    }

    /// Puts an object between the open fingers, or takes it away.
    pub fn place(&mut self, object: Option<&IdentifiedModel>) {
        self.held = object.map(|model| (model.clone(), Held::new(model)));
    }

    /// Size of the sideways slide, as the change of the residual relative to its plateau.
    pub fn gave_way(&self) -> f64 {
        self.held.as_ref().map_or(0.0, |(model, held)| {
            held.gave_way_ue() / model.residual_at(model.pressure_kpa)
        })
    }

    /// Advances by one control tick with the regulator's command `dac`, the acceleration of the palm,
    /// m/s², and the regulator's ripple, kPa.
    pub fn step(&mut self, dac: DacCode, acceleration_m_s2: [f64; 3], ripple_kpa: f64) -> RawFrame {
        let regulator = &self.gripper.regulator;
        let valve_kpa = self.valve.step(
            regulator,
            Valve::wanted_kpa(self.sensors.front_end(), regulator, dac),
        );
        let pressure_kpa = (self.pressure.step(valve_kpa) + ripple_kpa).max(0.0);
        let inflated_kpa = self.silicone.step(pressure_kpa);
        let swung_kpa = self.bending.step(inflated_kpa);
        // A stiffer finger is bent as the recipe's is at a lower pressure.
        let stiffness = self.gripper.hand.finger_stiffness;
        let free_at = |kpa: f64| {
            let strain = |s: f64| table::free_strain(self.table, Kilopascals((kpa / s) as f32));
            stiffness.map(|s| f64::from(strain(s).0.0))
        };
        let still = free_at(inflated_kpa);
        let mut free = free_at(swung_kpa);

        // What presses on an object cannot bend any further.
        let mut crept = self.creep.step(still);
        let mut residual = [0.0; FINGERS];
        if let Some((model, held)) = &mut self.held {
            let change = held.step(acceleration_m_s2);
            let identified = model.residual_at(model.pressure_kpa);
            for i in 0..FINGERS {
                let plateau = model.residual_at(inflated_kpa / stiffness[i]);
                // A free finger swings; one that presses on something does not.
                let pressing = plateau / (plateau + TOUCH_UE);
                free[i] += pressing * (still[i] - free[i]);
                crept[i] *= 1.0 - pressing;
                residual[i] = plateau + plateau / identified * change[i];
            }
        }
        let gauges = self.gauges;
        let bent = std::array::from_fn(|i| free[i] + crept[i] - residual[i]);
        let gauge_crept = self.gauge_creep.step(bent);
        let strain = std::array::from_fn(|i| {
            let shown = bent[i] + gauge_crept[i];
            (gauges[i].gain * shown + gauges[i].offset_ue) as f32
        });
        self.sensors.frame(
            strain,
            gauges.map(|gauge| gauge.noise_ue),
            pressure_kpa as f32,
        )
    }
}

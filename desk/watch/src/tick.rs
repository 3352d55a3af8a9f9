//! What the controller got in a tick, and what is seen of it.

use softgrip::Command;
use softgrip::RawFrame;
use softgrip::failure::Activity;
use softgrip::fault::{Fault, GaugeFault};
use softgrip::frontend::FrontEnd;
use softgrip::settings::{Settings, Values};
use softgrip::telemetry::Snapshot;
use softgrip::units::{DacCode, FINGERS, Instant};

use crate::observation::Observation;

/// What the controller got in one tick, and what it told the regulator. All the rest it does again from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Counts from 1 on since the gripper's start; what is missing was dropped on its way.
    pub number: u32,
    /// When.
    pub now: Instant,
    /// What the converters delivered.
    pub frame: RawFrame,
    /// What the controller was told to do.
    pub command: Command,
    /// For the regulator's command converter.
    pub dac: DacCode,
}

/// What converter codes mean, by the gripper's settings.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    front_end: FrontEnd,
    tare_ue: [f32; FINGERS],
}

impl Scale {
    /// By these settings.
    pub fn of(values: &Values) -> Self {
        let settings = Settings::of(values);
        Self {
            front_end: FrontEnd::of(&settings.front_end, settings.gauge.gain),
            tare_ue: settings.gauge.tare_ue,
        }
    }

    /// What is seen of a tick, of which the controller has made this. `gauges`: what has failed of each; none where
    /// that is not told.
    pub fn observe(
        &self,
        tick: &Tick,
        snapshot: &Snapshot,
        gauges: Option<[Option<GaugeFault>; FINGERS]>,
    ) -> Observation {
        let Tick { frame, dac, .. } = tick;
        let strains = self.front_end.strains(&frame.gauges);
        let loss = snapshot.lost;
        let ue = |finger: usize| strains[finger].0 - self.tare_ue[finger];
        Observation {
            t_s: Some(1e-6 * snapshot.now.micros() as f64),
            strain_ue: std::array::from_fn(|finger| Some(ue(finger))),
            pressure_kpa: snapshot.pressure.map(|kpa| kpa.0),
            setpoint_kpa: Some(snapshot.setpoint.0),
            commanded_kpa: Some(self.front_end.commanded(*dac).0),
            state: Some(Activity::from(&snapshot.state) as u16),
            fault: Some(number(snapshot.state.fault())),
            holding: Some(snapshot.state.is_holding()),
            lost: Some(loss.is_some()),
            tare_due: Some(snapshot.tare_due),
            bend_deg: Some(snapshot.bend.0),
            level: snapshot.level,
            margin: snapshot.margin,
            touching: snapshot.touching.map(Some),
            residual_ue: snapshot.residual.map(|ue| ue.map(|ue| ue.0)),
            noise_ue: snapshot.noise.map(|ue| Some(ue.0)),
            drift_ue: snapshot.drift.map(|ue| Some(ue.0)),
            gauge_fault: match gauges {
                Some(gauges) => gauges.map(|fault| Some(number(fault.map(Fault::from)))),
                None => [None; FINGERS],
            },
            loss_cause: Some(loss.map_or(0, |loss| bus::robot::of_cause(loss.cause))),
            loss_latency_ms: loss.map(|loss| 1e-3 * loss.latency_us() as f32),
            loss_evidence: loss.map_or([None; FINGERS], |loss| loss.evidence),
        }
    }
}

/// The number of a fault; zero for none.
fn number(fault: Option<Fault>) -> u16 {
    fault.map_or(0, |fault| fault.code().into())
}

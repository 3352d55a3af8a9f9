//! One control tick, from converter codes to converter codes.

use crate::command::{Command, Motion};
use crate::condition::{Conditioner, Gauge, Monitor, RawFrame, Reading};
use crate::detect::Detector;
use crate::estimate::{Contact, Estimator};
use crate::fault::Fault;
use crate::grasp::{Request, Situation, State, Supervisor};
use crate::interlock::interlock;
use crate::math::root;
use crate::regulate::Regulator;
use crate::settings::Active;
use crate::table::FingerTable;
use crate::telemetry::{Events, Indicators, Snapshot};
use crate::units::{DacCode, Instant, Microstrain};

/// What one tick puts out.
#[derive(Debug, Clone, PartialEq)]
pub struct Outputs {
    /// For the regulator's command converter.
    pub dac: DacCode,
    /// For the robot's digital inputs.
    pub indicators: Indicators,
    /// For whoever is looking.
    pub snapshot: Snapshot,
    /// For whoever must know.
    pub events: Events,
}

/// The controller. The firmware, the simulated gripper, the replay of traces and the tests all call
/// [`Controller::step`] and nothing else.
#[derive(Debug, Clone)]
pub struct Controller {
    table: &'static FingerTable,
    active: Active,
    conditioner: Conditioner,
    estimator: Estimator,
    detector: Detector,
    supervisor: Supervisor,
    regulator: Regulator,
    motion: Motion,
}

impl Controller {
    /// A gripper at rest.
    pub fn new(table: &'static FingerTable, active: Active) -> Self {
        Self::starting_with(None, table, active)
    }

    /// A gripper at rest, with a fault that the program has started with.
    pub fn starting_with(
        fault: Option<Fault>,
        table: &'static FingerTable,
        active: Active,
    ) -> Self {
        Self {
            table,
            active,
            conditioner: Conditioner::new(),
            estimator: Estimator::new(),
            detector: Detector::new(),
            supervisor: Supervisor::new(fault),
            regulator: Regulator::new(),
            motion: Motion::default(),
        }
    }

    /// The settings in use.
    pub fn active(&self) -> &Active {
        &self.active
    }

    /// One tick; to be called every [`crate::TICK_US`]. `now` must not run backwards.
    // Never inlined, so that its cost and what it calls can be read off the image.
    #[inline(never)]
    pub fn step(&mut self, now: Instant, frame: &RawFrame, command: Command) -> Outputs {
        let (table, active) = (self.table, &self.active);
        let mut events = Events::new();
        if let Command::Motion(motion) = command {
            self.motion = motion;
        }

        let free = self.estimator.free_strain(table, active);
        let reading = self.conditioner.step(frame, &active.front_end, free);
        let tare = self.conditioner.tare_step(&reading);
        let contact = self.estimator.step(&reading, table, active);

        let air = self.regulator.observe(now, reading.monitor);
        let verdict = self.detector.step(
            now,
            &contact,
            &self.conditioner.noise_variance(),
            air,
            self.supervisor.state().is_holding().then_some(self.motion),
            active,
        );

        let situation = Situation {
            reading: &reading,
            contact: &contact,
            verdict,
            air,
            tare,
            deviating_us: self.regulator.deviating_us(now),
        };
        match self
            .supervisor
            .step(now, command, &situation, table, active, &mut events)
        {
            Request::None => {}
            Request::StartTare => self.conditioner.start_tare(),
            Request::CancelTare => self.conditioner.cancel_tare(),
            Request::ClearFaults => {
                self.conditioner.clear_faults();
                self.regulator.restart(reading.monitor);
            }
        }

        let state = self.supervisor.state();
        let pressure = self.regulator.step(state.target(), active);
        let dac = interlock(pressure, &state, reading.monitor, active);
        Outputs {
            dac,
            indicators: self.indicators(&reading),
            snapshot: self.snapshot(now, &reading, &contact),
            events,
        }
    }

    fn indicators(&self, reading: &Reading) -> Indicators {
        let state = self.supervisor.state();
        let lost = self.supervisor.lost().is_some();
        let in_fault = matches!(state, State::Fault { .. });
        let gauge_failed = reading
            .gauges
            .iter()
            .any(|gauge| matches!(gauge, Gauge::Failed(_)));
        Indicators {
            ready: !lost && !in_fault,
            holding: state.is_holding(),
            lost,
            fault: in_fault || gauge_failed,
        }
    }

    fn snapshot(&self, now: Instant, reading: &Reading, contact: &Contact) -> Snapshot {
        let noise = self.conditioner.noise_variance().map(root);
        Snapshot {
            now,
            state: self.supervisor.state(),
            lost: self.supervisor.lost(),
            pressure: match reading.monitor {
                Monitor::Valid(pressure) => Some(pressure),
                Monitor::Missing | Monitor::TooHigh | Monitor::Lost => None,
            },
            setpoint: self.regulator.setpoint(),
            residual: contact.residual,
            touching: contact.touching,
            bend: contact.bend,
            level: self.detector.level(),
            margin: self
                .supervisor
                .payload()
                .and_then(|payload| payload.margin(self.table, self.estimator.lagged_pressure())),
            noise: noise.map(Microstrain),
        }
    }
}

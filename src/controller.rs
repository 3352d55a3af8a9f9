//! One control tick, from converter codes to converter codes.

use crate::FINGERS;
use crate::command::{Answer, Command, Motion};
use crate::condition::{Conditioner, Expected, Gauge, Monitor, RawFrame, Reading};
use crate::detect::{Detector, Watch};
use crate::estimate::{Contact, Estimator};
use crate::event::Events;
use crate::fault::Fault;
use crate::grasp::{Situation, State, Supervisor};
use crate::interlock::interlock;
use crate::math::root;
use crate::regulate::Regulator;
use crate::settings::Active;
use crate::table::FingerTable;
use crate::telemetry::{Indicators, Snapshot};
use crate::units::{DacCode, Instant, Kilopascals, Microstrain};
use crate::zero::Zero;

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
    /// For whoever gave the command; none for [`Command::Continue`].
    pub answer: Option<Answer>,
}

/// The controller. The firmware, the simulated gripper, the replay of traces and the tests all call
/// [`Controller::step`] and nothing else.
#[derive(Debug, Clone)]
pub struct Controller {
    table: &'static FingerTable,
    active: Active,
    conditioner: Conditioner,
    estimator: Estimator,
    zero: Zero,
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
            zero: Zero::new(),
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
        let before = self.supervisor.state();
        if let Command::Motion(motion) = command {
            self.motion = motion;
        }

        let expected = Expected {
            free_strain: self.estimator.free_strain(),
            pressure: self.regulator.expected(),
        };
        let reading =
            self.conditioner
                .step(frame, &active.front_end, self.zero.offsets_ue(), expected);
        let contact = self.estimator.step(&reading, table, active);
        let idle = before == State::Idle;
        let tare = self.zero.step(&reading, &contact, idle, active.contact_ue);

        let air = self.regulator.observe(now, reading.monitor);
        let watch = before.is_holding().then_some(Watch {
            motion: self.motion,
            carrying: self.supervisor.carrying(),
            pressure_changes: matches!(before, State::Closing { reached: None, .. }),
        });
        let noise = self.conditioner.noise_variance();
        let verdict = self
            .detector
            .step(now, &contact, &noise, air, watch, active);

        let tare_due = self.zero.tare_is_due();
        let situation = Situation {
            reading: &reading,
            contact: &contact,
            verdict,
            air,
            tare,
            taring: self.zero.is_taring(),
            tare_due,
            deviating_us: self.regulator.deviating_us(now),
        };
        let answer = self
            .supervisor
            .step(now, command, &situation, table, active, &mut events);
        match (command, answer) {
            (Command::Tare, Some(Answer::Accepted)) => self.zero.start_tare(),
            (Command::Acknowledge, Some(Answer::Accepted)) => self.conditioner.acknowledge(),
            _ => {}
        }

        let state = self.supervisor.state();
        let pressure = if state.is_vented() {
            self.regulator.vent(active);
            Kilopascals(0.0)
        } else {
            self.regulator.step(state.target(), active)
        };
        let dac = interlock(pressure, &state, reading.monitor, active);
        Outputs {
            dac,
            indicators: self.indicators(&reading),
            snapshot: self.snapshot(now, &reading, &contact, noise),
            events,
            answer,
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

    fn snapshot(
        &self,
        now: Instant,
        reading: &Reading,
        contact: &Contact,
        noise_variance: [f32; FINGERS],
    ) -> Snapshot {
        let noise = noise_variance.map(root);
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
            drift: self.zero.drift(),
            tare_due: self.zero.tare_is_due(),
        }
    }
}

//! One control tick, from converter codes to converter codes.

use crate::air::AirModel;
use crate::command::{Answer, Command, Motion, Refusal};
use crate::condition::{Conditioner, Expected, Gauge, RawFrame, Reading};
use crate::detect::Detector;
use crate::detect::limits::Signs;
use crate::estimate::{Calibration, Contact, Estimator};
use crate::event::{Event, Events};
use crate::fault::{Fault, GaugeFault};
use crate::grasp::{Situation, State, Supervisor};
use crate::interlock::interlock;
use crate::math::root;
use crate::regulate::Regulator;
use crate::settings::Active;
use crate::table::FingerTable;
use crate::telemetry::{Indicators, Snapshot};
use crate::units::{DacCode, FINGERS, Instant, Microstrain};
use crate::zero::{Zero, ZeroReport};

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
// What every tick uses comes first: an instruction loads a number from the first 1020 bytes alone.
#[repr(C)]
pub struct Controller {
    conditioner: Conditioner,
    active: Active,
    feedback: Feedback,
    air: AirModel,
    estimator: Estimator,
    detector: Detector,
    zero: Zero,
    regulator: Regulator,
    /// Noise of each gauge, rms. It is an average over 250 ms, so one root in a tick is enough.
    noise: [Microstrain; FINGERS],
    /// Whose turn it is: of none, then of each gauge.
    turn: usize,
    table: &'static FingerTable,
    supervisor: Supervisor,
}

/// Ticks in which every gauge has its turn.
const TURNS: usize = FINGERS + 1;

/// What one tick leaves for the next.
#[derive(Debug, Clone, Copy)]
struct Feedback {
    /// What the models make of the next tick.
    expected: Expected,
    /// What is latched has been acknowledged.
    acknowledged: bool,
    /// A tare begins.
    tare_begins: bool,
    /// What the arm does.
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
            feedback: Feedback {
                expected: Expected {
                    zero_ue: active.tare_ue,
                    ..Expected::default()
                },
                acknowledged: false,
                tare_begins: false,
                motion: Motion::default(),
            },
            conditioner: Conditioner::new(),
            air: AirModel::new(),
            estimator: Estimator::new(),
            zero: Zero::starting_at(active.tare_ue),
            detector: Detector::new(),
            supervisor: Supervisor::new(fault),
            regulator: Regulator::new(),
            noise: [Microstrain(0.0); FINGERS],
            turn: 0,
        }
    }

    /// What the last tare measured of each gauge, µε; what the settings said before one.
    pub fn tare_ue(&self) -> [f32; FINGERS] {
        self.zero.tare_ue()
    }

    /// Takes other settings, all at once, from the next tick on. What is running goes on: a hold keeps its pressure and
    /// its plateau and is judged by the new limits, a ramp goes on at the new slew, latches and timers stay. Where the
    /// tare of a gauge is another one, every zero starts anew.
    ///
    /// # Errors
    /// [`Refusal::NotIdle`] for a lower limit of the pressure while there may be more: that would be an overpressure, which
    /// opens the fingers. Nothing is changed then.
    pub fn apply(&mut self, active: Active) -> Result<(), Refusal> {
        let lower = active.regulator.max_pressure.0 < self.active.regulator.max_pressure.0;
        if lower && self.supervisor.state() != State::Idle {
            return Err(Refusal::NotIdle);
        }
        if active.tare_ue != self.active.tare_ue {
            self.zero = Zero::starting_at(active.tare_ue);
            self.feedback.expected.zero_ue = active.tare_ue;
        }
        self.active = active;
        Ok(())
    }

    /// The settings in use.
    pub fn active(&self) -> &Active {
        &self.active
    }

    /// What a sweep has found, once: to be made settings ([`Calibration::stated`])
    /// and kept.
    pub fn take_calibration(&mut self) -> Option<Calibration> {
        let mut found = self.supervisor.take_calibration()?;
        let swing_ms = self.active.finger.silicone.swing_ms();
        found.lag_ms = found.lag_ms.map(|lag_ms| lag_ms - swing_ms);
        found.regulator_ms = self.air.delay_ms();
        Some(found)
    }

    /// What the detector looked at in the last tick; none while nothing is held at a steady pressure.
    pub fn signs(&self) -> Option<Signs> {
        self.detector.signs()
    }

    /// What has failed of each gauge.
    pub fn gauge_faults(&self) -> [Option<GaugeFault>; FINGERS] {
        self.conditioner.failures()
    }

    /// One tick; to be called every [`TICK_US`](crate::units::TICK_US). `now` must not run backwards.
    // Never inlined, so that its cost and what it calls can be read off the image.
    #[inline(never)]
    pub fn step(&mut self, now: Instant, frame: &RawFrame, command: Command) -> Outputs {
        let (table, active) = (self.table, &self.active);
        let feedback = &mut self.feedback;
        match command {
            Command::Motion(motion) => feedback.motion = motion,
            Command::Slew(share) => self.regulator.set_speed(share),
            _ => {}
        }
        let idle = self.supervisor.state() == State::Idle;
        let watch = self.supervisor.watch(feedback.motion);
        let mut events = Events::new();

        let reading = self.conditioner.step(
            frame,
            &active.front_end,
            &feedback.expected,
            feedback.acknowledged,
        );
        let air = self.air.observe(now, reading.monitor, &active.air);
        if let Some(delay_ms) = self.air.take_learned() {
            events.add(Event::Regulator { delay_ms });
        }
        let contact = self.estimator.step(&reading, table, &active.finger);
        let contact_ue = active.finger.contact_ue;
        let zero = self
            .zero
            .step(&reading, &contact, idle, feedback.tare_begins, contact_ue);
        let verdict = self
            .detector
            .step(now, &reading, &contact, &air, watch, &active.detection);
        let situation = Situation {
            reading: &reading,
            air: &air,
            contact: &contact,
            zero: &zero,
            verdict,
        };
        let answer =
            self.supervisor
                .step(now, command, &situation, table, &active.grip, &mut events);
        let state = self.supervisor.state();
        let target = (!state.is_vented()).then(|| state.target());
        let limits = (&active.regulator, &active.air);
        let pressure = self.regulator.step(target, &air, &mut self.air, limits);
        let limit = active.regulator.max_pressure;
        let dac = interlock(pressure, &state, reading.monitor, limit, &active.front_end);

        feedback.expected = Expected {
            zero_ue: self.zero.offsets_ue(),
            free_strain: self.estimator.free_strain(),
            pressure: self.air.expected(),
        };
        // The first of four ticks is the one in which the estimator finds the bend.
        let gauge = self.turn.wrapping_sub(1);
        if let (Some(shown), Some(variance)) =
            (self.noise.get_mut(gauge), reading.noise_variance.get(gauge))
        {
            *shown = Microstrain(root(*variance));
        }
        self.turn = self.turn.wrapping_add(1) % TURNS;
        let accepted = matches!(answer, Some(Answer::Accepted));
        feedback.acknowledged = accepted && matches!(command, Command::Acknowledge);
        feedback.tare_begins = accepted && matches!(command, Command::Tare);
        Outputs {
            dac,
            indicators: self.indicators(&reading),
            snapshot: self.snapshot(now, &reading, &contact, &zero),
            events,
            answer,
        }
    }

    fn indicators(&self, reading: &Reading) -> Indicators {
        let state = self.supervisor.state();
        let lost = self.supervisor.lost().is_some();
        let in_fault = matches!(state, State::Fault { .. });
        let gauge_failed = reading.gauges.map(Gauge::has_failed).contains(&true);
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
        zero: &ZeroReport,
    ) -> Snapshot {
        Snapshot {
            now,
            state: self.supervisor.state(),
            lost: self.supervisor.lost(),
            pressure: reading.monitor.pressure(),
            setpoint: self.regulator.setpoint(),
            residual: contact.residual,
            touching: contact.touching,
            bend: contact.bend,
            level: self.detector.level(),
            margin: self
                .supervisor
                .payload()
                .and_then(|payload| payload.margin(self.table, self.estimator.lagged_pressure())),
            noise: self.noise,
            drift: self.zero.drift(),
            tare_due: zero.tare_due,
        }
    }
}

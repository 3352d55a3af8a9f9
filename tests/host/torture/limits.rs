//! What must hold in every tick for any input at all: the command's limits, the latches, one answer to
//! each command, one end to each tare, no event without room, no number that is none.

use crate::torture::{Breach, must};
use softgrip::command::{Answer, Refusal};
use softgrip::detect::Loss;
use softgrip::fault::Fault;
use softgrip::frontend::FrontEnd;
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;
use softgrip::{Command, Outputs};

/// Half a code of rounding, and some of arithmetic.
const ROUNDING_CODES: f32 = 0.5 + 0.05;
/// The regulation's proportional gain.
const PROPORTIONAL: f32 = 0.1;
/// The trim's limit, and what of a deviation it may change in a tick: 4/s.
const TRIM_KPA: f32 = 10.0;
const TRIM_STEP: f32 = 4.0 * 1e-3;
/// A tare averages 200 ticks.
const TARE_TICKS: u32 = 205;

/// What the ticks so far oblige the next one to.
#[derive(Debug, Clone)]
pub struct Limits {
    front_end: FrontEnd,
    rounding_kpa: f32,
    /// Up to this deviation the pressure follows, and is corrected.
    following_kpa: f32,
    max_kpa: f32,
    slew_kpa: f32,
    dac_kpa: f32,
    measured_kpa: f32,
    fault: Option<Fault>,
    /// It has been acknowledged.
    fault_was_seen: bool,
    lost: Option<Loss>,
    gauge_failed: bool,
    /// Ticks with a usable gauge since a tare was begun that has not ended.
    tare: Option<u32>,
}

impl Limits {
    pub fn new(settings: &Settings, fault: Option<Fault>) -> Self {
        let front_end = FrontEnd::of(&settings.front_end, settings.gauge.gain);
        Self {
            front_end,
            rounding_kpa: ROUNDING_CODES / front_end.command_codes_per_kpa,
            following_kpa: settings.air.following_kpa,
            max_kpa: settings.regulator.max_pressure_kpa,
            slew_kpa: settings.regulator.slew_kpa_per_s * 1e-3,
            dac_kpa: 0.0,
            measured_kpa: 0.0,
            fault,
            fault_was_seen: false,
            lost: None,
            gauge_failed: false,
            tare: None,
        }
    }

    /// Checks one tick. `pressure_kpa` is the true pressure, where there is a plant.
    pub fn check(
        &mut self,
        command: Command,
        outputs: &Outputs,
        pressure_kpa: Option<f32>,
    ) -> Result<(), Breach> {
        must(outputs.events.lost() == 0, "every event has room", || {
            outputs.events.clone()
        })?;
        must(
            outputs.answer.is_some() == (command != Command::Continue),
            "every command has one answer",
            || (command, outputs.answer),
        )?;
        if let Some(name) = not_finite(outputs) {
            return Err(Breach::of("every number is finite", (name, outputs)));
        }
        self.check_output(outputs, pressure_kpa)?;
        self.check_latches(command, outputs)?;
        self.check_tare(command, outputs)
    }

    fn check_output(&mut self, outputs: &Outputs, pressure_kpa: Option<f32>) -> Result<(), Breach> {
        let dac_kpa = self.front_end.commanded(outputs.dac).0;
        let (rounding_kpa, following_kpa) = (self.rounding_kpa, self.following_kpa);
        // What the command may be above the pressure without having risen there by its slew: the pressure is the
        // expected one to within this before a deviation counts, and the correction comes on top.
        let above_kpa = (1.0 + PROPORTIONAL) * following_kpa + TRIM_KPA;
        // What it may rise in a tick beyond the slew: the proportional part from end to end, and the trim's step.
        let step_kpa = (2.0 * PROPORTIONAL + TRIM_STEP) * following_kpa;
        must(
            (0.0..=self.max_kpa + rounding_kpa).contains(&dac_kpa),
            "the command is within the limit",
            || (dac_kpa, self.max_kpa),
        )?;
        if let Some(measured) = outputs.snapshot.pressure {
            self.measured_kpa = measured.0;
        }
        let pressure = pressure_kpa.unwrap_or(0.0).max(self.measured_kpa);
        let allowed = (self.dac_kpa + step_kpa).max(pressure + above_kpa)
            + self.slew_kpa
            + 3.0 * rounding_kpa;
        must(
            dac_kpa <= allowed,
            "the command rises no faster than its slew",
            || {
                format!(
                    "{} to {dac_kpa} kPa at {pressure} kPa, {:?}",
                    self.dac_kpa, outputs.snapshot.state
                )
            },
        )?;
        self.dac_kpa = dac_kpa;
        Ok(())
    }

    fn check_latches(&mut self, command: Command, outputs: &Outputs) -> Result<(), Breach> {
        let acknowledged = command == Command::Acknowledge;
        // An acknowledged fault ends with its cause; a stop that comes after it is a new one.
        self.fault_was_seen |= acknowledged && self.fault.is_some();
        let snapshot = &outputs.snapshot;
        let fault = match snapshot.state {
            State::Fault { fault, .. } => Some(fault),
            _ => None,
        };
        if let Some(before) = self.fault {
            let may_go = self.fault_was_seen && before.rule().acknowledges;
            must(
                fault == Some(before) || may_go,
                "a fault is latched until it is acknowledged",
                || (before, snapshot.state),
            )?;
        }
        self.fault_was_seen &= fault.is_some() && fault == self.fault && command != Command::Stop;
        self.fault = fault;

        must(
            self.lost.is_none() || snapshot.lost == self.lost || acknowledged,
            "a loss is latched until it is acknowledged",
            || (self.lost, snapshot.lost),
        )?;
        self.lost = snapshot.lost;
        must(
            outputs.indicators.lost == self.lost.is_some(),
            "the output LOST says what is latched",
            || (outputs.indicators, self.lost),
        )?;

        self.gauge_failed &= !acknowledged;
        let failed = |event: &Event| {
            matches!(
                event,
                Event::Fault {
                    finger: Some(_),
                    ..
                }
            )
        };
        self.gauge_failed |= outputs.events.iter().any(failed);
        must(
            outputs.indicators.fault || !(fault.is_some() || self.gauge_failed),
            "the output FAULT says what is latched",
            || (outputs.indicators, fault, self.gauge_failed),
        )
    }

    fn check_tare(&mut self, command: Command, outputs: &Outputs) -> Result<(), Breach> {
        for event in outputs.events.iter().filter(|event| ends_tare(event)) {
            must(self.tare.take().is_some(), "a tare ends once", || *event)?;
        }
        if let Some(ticks) = &mut self.tare {
            *ticks += u32::from(outputs.snapshot.residual.iter().any(Option::is_some));
            must(*ticks < TARE_TICKS, "a tare ends", || *ticks)?;
        }
        if command == Command::Tare && outputs.answer == Some(Answer::Accepted) {
            self.tare = Some(0);
        }
        Ok(())
    }
}

fn ends_tare(event: &Event) -> bool {
    matches!(
        event,
        Event::Tared | Event::Refused(Refusal::TareRejected(_))
    )
}

/// The name of a number that is none.
fn not_finite(outputs: &Outputs) -> Option<&'static str> {
    let snapshot = &outputs.snapshot;
    let residual = |i: usize| snapshot.residual[i].map_or(0.0, |residual| residual.0);
    let all = [
        ("target", snapshot.state.target().0),
        ("pressure", snapshot.pressure.map_or(0.0, |kpa| kpa.0)),
        ("setpoint", snapshot.setpoint.0),
        ("residual", residual(0) + residual(1) + residual(2)),
        ("bend", snapshot.bend.0),
        ("level", snapshot.level.unwrap_or(0.0)),
        ("margin", snapshot.margin.unwrap_or(0.0)),
        ("noise", snapshot.noise.iter().map(|noise| noise.0).sum()),
        (
            "evidence",
            snapshot.lost.map_or(0.0, |loss| evidence(&loss)),
        ),
    ];
    let events = outputs.events.iter().map(|event| match event {
        Event::Slip { rate } => ("slip", *rate),
        Event::Lost(loss) => ("evidence", evidence(loss)),
        Event::Refused(Refusal::PayloadTooHeavy { possible }) => ("possible", possible.0),
        _ => ("", 0.0),
    });
    all.into_iter()
        .chain(events)
        .find(|(_, number)| !number.is_finite())
        .map(|(name, _)| name)
}

fn evidence(loss: &Loss) -> f32 {
    loss.evidence.iter().flatten().sum()
}

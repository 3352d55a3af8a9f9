//! A free-bend sweep of the simulated gripper, with nothing in the grip.

use anyhow::{bail, ensure};
use softgrip::command::{Answer, Refusal};
use softgrip::settings::{Calibration, Settings};
use softgrip::telemetry::Event;
use softgrip::units::{DacCode, Instant};
use softgrip::{Command, RawFrame, TICK_US};

use crate::plant::Plant;
use crate::run;
use crate::setup::Setup;

/// A sweep that has not ended then never will, s.
const LONGEST_S: f64 = 120.0;

/// A sweep, and what it has found.
#[derive(Debug, Clone)]
pub struct Swept {
    /// What it has found.
    pub calibration: Calibration,
    /// How long it took, s.
    pub duration_s: f64,
}

/// Tares the gripper of a setup and sweeps it, under a controller with these settings.
///
/// # Errors
/// If the settings are not valid, or the controller refuses the tare or the sweep; the message says why.
pub fn sweep(setup: &Setup, settings: &Settings) -> anyhow::Result<Swept> {
    sweep_with(setup.emptied().plant(), setup, settings)
}

/// As [`sweep`], of a gripper with whatever is in its grip.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_with(plant: Plant, setup: &Setup, settings: &Settings) -> anyhow::Result<Swept> {
    let mut rig = Rig {
        controller: run::controller(setup.table(), settings)?,
        plant,
        dac: DacCode(0),
        tick: 0,
    };
    // The arm's moves would bend the fingers.
    let rest_s = rig.plant.profile().duration_s() + 1.0;
    while rig.t_s() < rest_s {
        rig.step(Command::Alive)?;
    }
    rig.step(Command::Tare)?;
    while !rig.step(Command::Continue)?.contains(&Event::Tared) {
        ensure!(rig.t_s() < rest_s + LONGEST_S, "the tare does not end");
    }
    let begin_s = rig.t_s();
    rig.step(Command::Sweep)?;
    loop {
        rig.step(Command::Continue)?;
        if let Some(calibration) = rig.controller.take_calibration() {
            return Ok(Swept {
                calibration,
                duration_s: rig.t_s() - begin_s,
            });
        }
        ensure!(rig.t_s() < begin_s + LONGEST_S, "the sweep does not end");
    }
}

struct Rig {
    controller: softgrip::Controller,
    plant: Plant,
    dac: DacCode,
    tick: u64,
}

impl Rig {
    fn t_s(&self) -> f64 {
        1e-6 * (TICK_US * self.tick) as f64
    }

    /// One tick; gives its events.
    fn step(&mut self, command: Command) -> anyhow::Result<Vec<Event>> {
        self.tick += 1;
        let (frame, _): (RawFrame, _) = self.plant.step(self.dac);
        let now = Instant::from_micros(TICK_US * self.tick);
        let outputs = self.controller.step(now, &frame, command);
        self.dac = outputs.dac;
        if let Some(Answer::Refused(refusal)) = outputs.answer {
            bail!("the gripper refuses: {refusal:?}");
        }
        let events: Vec<Event> = outputs.events.iter().copied().collect();
        for event in &events {
            match event {
                Event::Refused(Refusal::SweepRejected(fault)) => bail!(
                    "the sweep is refused: {fault:?} (docs/calibration.md says why, and what to do)"
                ),
                Event::Refused(Refusal::TareRejected(fault)) => {
                    bail!("the tare is refused: {fault:?}")
                }
                Event::Fault { fault, .. } => bail!(
                    "the gripper stops with the fault {fault:?} (docs/faults.md says why, and what to do)"
                ),
                _ => {}
            }
        }
        Ok(events)
    }
}

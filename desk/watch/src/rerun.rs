//! A recording's ticks once more through the controller.

use std::collections::VecDeque;

use anyhow::{Context, bail};
use settings::Values;
use sim::events::TimedEvent;
use softgrip::settings::Active;
use softgrip::table::FingerTable;
use softgrip::telemetry::Event;
use softgrip::{Controller, TICK_US};

use crate::fields::{FIELDS, Place};
use crate::observation::Observation;
use crate::tick::{Scale, Tick};
use crate::told::Told;

/// The controller, and how far it is in a recording.
pub struct Rerun {
    table: &'static FingerTable,
    /// Settings that take the place of those of the recording, by number.
    stated: Vec<(u16, f32)>,
    /// The settings in use.
    values: Option<Values>,
    /// The controller has not taken them yet.
    is_changed: bool,
    controller: Option<Controller>,
    comparison: Comparison,
    result: Outcome,
    /// The tick before.
    last: Option<Tick>,
}

/// What has come of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// What the controller reports.
    pub events: Vec<TimedEvent>,
    /// Ticks that it made.
    pub ticks: u64,
    /// From the first of them to the last, s.
    pub length_s: f64,
    /// The recording begins with the controller's first tick.
    pub from_start: bool,
    /// Ticks that are missing: so many, after this time, s.
    pub gaps: Vec<(f64, u64)>,
    /// When the comparison began, s; none if the controller was never where the recorded one was.
    pub compared_from_s: Option<f64>,
    /// DAC codes that were compared.
    pub codes: u64,
    /// Snapshots that were compared.
    pub snapshots: u64,
    /// What differs first.
    pub difference: Option<Difference>,
}

/// A difference between a recording and what the controller makes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// When, s since the gripper's start.
    pub t_s: f64,
    /// Of what.
    pub name: String,
    /// As it was recorded.
    pub recorded: String,
    /// As the controller makes it here.
    pub here: String,
}

/// What is recorded against what the controller makes of it.
#[derive(Default)]
struct Comparison {
    scale: Option<Scale>,
    /// Snapshots of ticks that have not been made yet.
    recorded: VecDeque<Observation>,
    /// The last tick's.
    here: Option<Observation>,
    /// Both are at the same place.
    is_on: bool,
}

impl Rerun {
    /// With the fingers of this table, and these settings in place of those of the recording.
    pub fn new(table: &'static FingerTable, stated: Vec<(u16, f32)>) -> Self {
        Self {
            table,
            stated,
            values: None,
            is_changed: false,
            controller: None,
            comparison: Comparison::default(),
            result: Outcome::default(),
            last: None,
        }
    }

    /// What has come of it so far.
    pub fn outcome(self) -> Outcome {
        self.result
    }

    /// Takes what is told of a recording.
    ///
    /// # Errors
    /// If its settings, or those in their place, are not valid for the finger, or it was recorded with another finger.
    pub fn take(&mut self, told: &Told) -> anyhow::Result<()> {
        match told {
            Told::Provenance(about) => {
                let table = format!("{:016x}", self.table.inputs_hash);
                if !about.table.is_empty() && !table.starts_with(&about.table) {
                    bail!(
                        "it was recorded with the finger {} ({}), and not with {} ({table}): name its recipe with --recipe",
                        about.recipe,
                        about.table,
                        self.table.recipe,
                    );
                }
            }
            Told::Settings(told) => {
                let values = self.with_stated(told.values)?;
                self.values = Some(values);
                self.is_changed |= told.applied;
                self.comparison.scale = Some(Scale::of(&values));
            }
            Told::Tick(tick) => self.tick(tick)?,
            Told::Observation(seen) => self.comparison.recorded.push_back(**seen),
            Told::Event(_) | Told::Note(_) | Told::Ended(_) | Told::Failed(_) => {}
        }
        self.compare();
        Ok(())
    }

    fn with_stated(&self, mut values: Values) -> anyhow::Result<Values> {
        for (number, value) in &self.stated {
            values
                .set(*number, *value)
                .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
        }
        Ok(values)
    }

    fn tick(&mut self, tick: &Tick) -> anyhow::Result<()> {
        let t_s = 1e-6 * tick.now.micros() as f64;
        self.count(tick, t_s);
        let values = self.values.context(
            "there are ticks before any settings: a recording of `softgrip record` begins with them",
        )?;
        let active = || {
            let active = Active::of(&values, self.table);
            active.map_err(|error| anyhow::anyhow!("settings: {error}"))
        };
        let controller = match &mut self.controller {
            Some(controller) => {
                if self.is_changed {
                    // Once it may, as the gripper does.
                    self.is_changed = controller.apply(active()?).is_err();
                }
                controller
            }
            None => {
                self.is_changed = false;
                self.controller
                    .insert(Controller::new(self.table, active()?))
            }
        };
        let outputs = controller.step(tick.now, &tick.frame, tick.command);
        for &event in outputs.events.iter() {
            if matches!(event, Event::Swept { .. }) {
                // What it found comes with the recording's settings.
                controller.take_calibration();
            }
            self.result.events.push(TimedEvent { t_s, event });
        }
        let gauges = Some(controller.gauge_faults());
        let scale = self.comparison.scale.unwrap_or_else(|| Scale::of(&values));
        let here = Tick {
            dac: outputs.dac,
            ..*tick
        };
        self.comparison.here = Some(scale.observe(&here, &outputs.snapshot, gauges));
        if self.comparison.is_on {
            self.result.codes += 1;
            if outputs.dac != tick.dac {
                self.differs(Difference {
                    t_s,
                    name: "DAC code".into(),
                    recorded: tick.dac.0.to_string(),
                    here: outputs.dac.0.to_string(),
                });
            }
        }
        Ok(())
    }

    /// Counts a tick, and what is missing before it.
    fn count(&mut self, tick: &Tick, t_s: f64) {
        let outcome = &mut self.result;
        match &self.last {
            None => {
                outcome.from_start = tick.number == 1;
                self.comparison.is_on = outcome.from_start;
                outcome.compared_from_s = outcome.from_start.then_some(t_s);
            }
            Some(last) => {
                let before_s = 1e-6 * last.now.micros() as f64;
                let since_us = tick.now.micros_since(last.now);
                let missing = ((since_us + TICK_US / 2) / TICK_US).saturating_sub(1);
                if missing > 0 {
                    outcome.gaps.push((before_s, missing));
                    // From here on it is another history.
                    self.comparison.is_on = false;
                }
                outcome.length_s += (t_s - before_s).max(0.0);
            }
        }
        outcome.ticks += 1;
        self.last = Some(*tick);
    }

    /// Compares the last tick with its snapshot, if there is one.
    fn compare(&mut self) {
        let Some(mut here) = self.comparison.here else {
            return;
        };
        let before = |seen: &Observation| seen.t_s < here.t_s;
        while self.comparison.recorded.front().is_some_and(before) {
            self.comparison.recorded.pop_front();
        }
        let is_here = |seen: &Observation| seen.t_s == here.t_s;
        if !self.comparison.recorded.front().is_some_and(is_here) {
            return;
        }
        let Some(mut seen) = self.comparison.recorded.pop_front() else {
            return;
        };
        let difference = difference(&mut seen, &mut here);
        if !self.comparison.is_on {
            self.comparison.is_on = difference.is_none();
            if difference.is_none() && self.result.compared_from_s.is_none() {
                self.result.compared_from_s = here.t_s;
            }
            return;
        }
        self.result.snapshots += 1;
        if let Some(difference) = difference {
            self.differs(difference);
        }
    }

    fn differs(&mut self, difference: Difference) {
        self.result.difference.get_or_insert(difference);
    }
}

/// The first value in which two observations of one moment differ by a bit. A whole number or a flag that was not
/// recorded was not told.
fn difference(recorded: &mut Observation, here: &mut Observation) -> Option<Difference> {
    FIELDS.iter().find_map(|field| {
        let is_same = match ((field.place)(recorded), (field.place)(here)) {
            (Place::Double(a), Place::Double(b)) => a.map(f64::to_bits) == b.map(f64::to_bits),
            (Place::Float(a), Place::Float(b)) => a.map(f32::to_bits) == b.map(f32::to_bits),
            (Place::Whole(a), Place::Whole(b)) => a.is_none() || a == b,
            (Place::Flag(a), Place::Flag(b)) => a.is_none() || a == b,
            _ => false,
        };
        (!is_same).then(|| Difference {
            t_s: here.t_s.unwrap_or_default(),
            name: field.name.into(),
            recorded: field.text(recorded),
            here: field.text(here),
        })
    })
}

//! Checked settings, as the control tick takes them.

use softgrip_settings::all_limits;

use super::error::SettingsError;
use super::tree::{Settings, ceiling_kpa};
use crate::frontend::FrontEnd;
use crate::table::FingerTable;
use crate::units::Kilopascals;
use crate::{air, detect, estimate, grasp, regulate};

/// Settings in the form that the control tick uses; made by [`Settings::validate`] alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) front_end: FrontEnd,
    pub(crate) air: air::Active,
    pub(crate) finger: estimate::Active,
    pub(crate) detection: detect::Active,
    pub(crate) grip: grasp::Active,
    pub(crate) regulator: regulate::Active,
}

impl Active {
    /// Pressure of a grip that names none.
    pub fn grip_pressure(&self) -> Kilopascals {
        self.grip.grip_pressure
    }

    /// What [`Estimator::step`](estimate::Estimator::step) takes.
    pub fn finger(&self) -> &estimate::Active {
        &self.finger
    }
}

impl Settings {
    /// Every setting that is out of its range, for this board and finger, in the order of their numbers.
    pub fn problems(
        &self,
        front_end: &FrontEnd,
        table: &FingerTable,
    ) -> impl Iterator<Item = SettingsError> {
        let ceiling_kpa = ceiling_kpa(front_end, table);
        let max_kpa = self.regulator.max_pressure_kpa;
        all_limits().iter().filter_map(move |limit| {
            let limit = limit.at(ceiling_kpa, max_kpa);
            let value = self.get(limit.number)?;
            (!limit.allows(value)).then(|| SettingsError::of(&limit, value))
        })
    }

    /// Checks every setting against the board and the finger; the first that is out of its range is the error, and
    /// [`Settings::problems`] gives them all.
    pub fn validate(
        &self,
        front_end: &FrontEnd,
        table: &FingerTable,
    ) -> Result<Active, SettingsError> {
        if let Some(problem) = self.problems(front_end, table).next() {
            return Err(problem);
        }
        let regulator = self.regulator.active();
        Ok(Active {
            front_end: *front_end,
            air: self.air.active(),
            finger: self.finger.active(table.max_pressure_kpa),
            detection: self.detection.active(),
            grip: self.grip.active(regulator.max_pressure),
            regulator,
        })
    }
}

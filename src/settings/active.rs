//! Checked settings, as the control tick takes them.

use softgrip_settings::{SettingsError, Values};

use super::factory;
use super::tree::Settings;
use crate::frontend::FrontEnd;
use crate::table::FingerTable;
use crate::units::{FINGERS, Kilopascals};
use crate::{air, detect, estimate, grasp, io, regulate};

/// Settings in the form that the control tick uses; made by [`Active::of`] alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) front_end: FrontEnd,
    /// What each gauge shows at rest when the controller starts, µε.
    pub(crate) tare_ue: [f32; FINGERS],
    pub(crate) air: air::Active,
    pub(crate) finger: estimate::Active,
    pub(crate) detection: detect::Active,
    pub(crate) grip: grasp::Active,
    pub(crate) regulator: regulate::Active,
    pub(crate) io: io::Settings,
    pub(crate) telemetry_us: u32,
    pub(crate) bus: io::BusSettings,
}

impl Active {
    /// Checks every value against the finger.
    ///
    /// # Errors
    /// The first that is out of its range; [`Values::problems`] gives them all.
    pub fn of(values: &Values, table: &FingerTable) -> Result<Self, SettingsError> {
        if let Some(problem) = values.first_problem(table.max_pressure_kpa) {
            return Err(problem);
        }
        let settings = Settings::of(values);
        let regulator = settings.regulator.active();
        let finger = settings.finger.active(table);
        Ok(Self {
            front_end: FrontEnd::of(&settings.front_end, settings.gauge.gain),
            tare_ue: settings.gauge.tare_ue,
            air: settings.air.active(),
            finger,
            detection: settings.detection.active(),
            grip: settings.grip.active(regulator.max_pressure, finger.meeting),
            regulator,
            io: settings.io,
            telemetry_us: (1e3 * settings.telemetry.period_ms) as u32,
            bus: settings.bus,
        })
    }

    /// Pressure of a grip that names none.
    pub fn grip_pressure(&self) -> Kilopascals {
        self.grip.grip_pressure
    }

    /// At which level each digital signal is on.
    pub fn io(&self) -> &io::Settings {
        &self.io
    }

    /// Time between two snapshots, µs.
    pub fn telemetry_us(&self) -> u32 {
        self.telemetry_us
    }

    /// The line to the robot.
    pub fn bus(&self) -> io::BusSettings {
        self.bus
    }

    /// What [`Estimator::step`](estimate::Estimator::step) takes.
    pub fn finger(&self) -> &estimate::Active {
        &self.finger
    }
}

impl Settings {
    /// The defaults for a finger: what is a pressure, or strain of contact, in proportion to what its table and the
    /// regulator reach, and never above [`Settings::default`]; see [`Values::for_finger`].
    pub fn for_finger(table: &FingerTable) -> Self {
        Self::of(&factory::defaults(table))
    }

    /// These settings with what somebody states of them, by number. Pressures that are not stated go no higher than
    /// those that are.
    ///
    /// # Errors
    /// If there is no such setting, or its value is not in its range; whether they go together is left to
    /// [`Settings::validate`].
    pub fn with(&self, stated: &[(u16, f32)], table: &FingerTable) -> Result<Self, SettingsError> {
        let values = self.values().with(stated, table.max_pressure_kpa)?;
        Ok(Self::of(&values))
    }

    /// Every setting that is out of its range, for this finger, in the order of their numbers.
    pub fn problems(&self, table: &FingerTable) -> impl Iterator<Item = SettingsError> {
        self.values().problems(table.max_pressure_kpa)
    }

    /// Checks every setting against the finger; the first that is out of its range is the error, and
    /// [`Settings::problems`] gives them all.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn validate(&self, table: &FingerTable) -> Result<Active, SettingsError> {
        Active::of(&self.values(), table)
    }
}

//! What a user may choose, by the stage that uses it; checked once and turned into what the control tick needs.

use crate::frontend::FrontEnd;
use crate::table::{self, FingerTable};
use crate::units::Kilopascals;
use crate::{air, detect, estimate, grasp, regulate};

pub use crate::estimate::{Calibration, GaugeSense};
pub use crate::grasp::{OnFault, OnLoss};
pub use crate::range::SettingsError;

/// The controller's settings in the units that people use. The defaults are for a finger that is good for
/// 160 kPa, as the default one is; [`Settings::for_finger`] takes any.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// The regulator's response.
    pub air: air::Settings,
    /// The fingers, and what counts as contact.
    pub finger: estimate::Settings,
    /// What counts as a slip and as a loss, of the object or of air.
    pub detection: detect::Settings,
    /// Grips, and what is done when one fails.
    pub grip: grasp::Settings,
    /// Limits of the commanded pressure.
    pub regulator: regulate::Settings,
}

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
    /// The defaults for a finger: what is a pressure, or strain of contact, in proportion to what its
    /// table and the board's regulator reach, and never above [`Settings::default`].
    ///
    /// Free strain tells how far the finger bends; noise and errors of the electronics do not shrink with
    /// it, so contact and loss of air keep a floor. Times, shares and lags stay: a table does not tell them.
    pub fn for_finger(front_end: &FrontEnd, table: &FingerTable) -> Self {
        /// Of the highest pressure: 140 of 160 kPa. One regrip takes the rest.
        const GRIP: f32 = 0.875;
        /// Of free strain at the highest pressure: below what half the default finger's bend would give.
        const CONTACT: f32 = 0.04;
        /// Five times the noise of a decent amplifier, ten codes of the converter.
        const LEAST_CONTACT_UE: f32 = 100.0;
        /// Twice what a regulator of 200 kPa may be wrong by, ±1 % of full scale.
        const LEAST_AIR_LOSS_KPA: f32 = 4.0;

        let mut settings = Self::default();
        let regulator = &mut settings.regulator;
        let max = ceiling_kpa(front_end, table).min(regulator.max_pressure_kpa);
        let share = max / regulator.max_pressure_kpa;
        regulator.max_pressure_kpa = max;
        // The whole stroke takes as long as the default's.
        regulator.slew_kpa_per_s *= share;
        // What is the least that may be set.
        settings.grip.grip_pressure_kpa = (GRIP * max).max(1.0);
        settings.grip.regrip_raise_kpa = (1.0 - GRIP) * max;
        let (free, _) = table::free_strain(table, Kilopascals(max));
        let contact_ue = &mut settings.finger.contact_ue;
        *contact_ue = (CONTACT * free.0).clamp(LEAST_CONTACT_UE, *contact_ue);
        let air_loss_kpa = &mut settings.detection.air_loss_kpa;
        *air_loss_kpa = (share * *air_loss_kpa).max(LEAST_AIR_LOSS_KPA);
        settings
    }

    /// These, with what a sweep has found of the mounted fingers.
    #[must_use]
    pub fn calibrated(mut self, found: &Calibration, table: &FingerTable) -> Self {
        self.finger = self.finger.calibrated(found, table.max_pressure_kpa);
        self
    }

    /// Checks every field against the board and the finger; the first that is out of its range is the error.
    pub fn validate(
        &self,
        front_end: &FrontEnd,
        table: &FingerTable,
    ) -> Result<Active, SettingsError> {
        let ceiling_kpa = ceiling_kpa(front_end, table);
        let regulator = self.regulator.validate(ceiling_kpa)?;
        let finger = self.finger.validate(table)?;
        Ok(Active {
            front_end: *front_end,
            air: self.air.validate()?,
            finger,
            detection: self.detection.validate()?,
            grip: self
                .grip
                .validate(regulator.max_pressure, ceiling_kpa, finger.meeting)?,
            regulator,
        })
    }
}

/// Above the table nothing is known of the finger, above full scale nothing can be commanded, kPa.
fn ceiling_kpa(front_end: &FrontEnd, table: &FingerTable) -> f32 {
    table.max_pressure_kpa.min(front_end.regulator_full_scale.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{FINGER, ROWS};
    use std::string::ToString;

    fn error(settings: Settings) -> std::string::String {
        settings
            .validate(&FrontEnd::REFERENCE, &FINGER)
            .expect_err("a wrong setting")
            .to_string()
    }

    #[test]
    fn the_defaults_are_valid() {
        assert!(
            Settings::default()
                .validate(&FrontEnd::REFERENCE, &FINGER)
                .is_ok()
        );
    }

    /// The default finger up to this pressure only.
    fn shorter(max_pressure_kpa: f32) -> FingerTable {
        let row = |i: usize| {
            let share = i as f32 / (ROWS - 1) as f32;
            table::row(&FINGER, Kilopascals(share * max_pressure_kpa)).0
        };
        FingerTable {
            max_pressure_kpa,
            rows: core::array::from_fn(row),
            ..FINGER
        }
    }

    #[test]
    fn the_default_finger_has_the_default_settings() {
        let settings = Settings::for_finger(&FrontEnd::REFERENCE, &FINGER);
        assert_eq!(settings, Settings::default());
        let stronger = FingerTable {
            max_pressure_kpa: 500.0,
            ..FINGER
        };
        assert_eq!(
            Settings::for_finger(&FrontEnd::REFERENCE, &stronger)
                .regulator
                .max_pressure_kpa,
            160.0
        );
    }

    #[test]
    fn the_defaults_stay_within_what_finger_and_regulator_reach() {
        for max in [1.0, 8.0, 30.0, 33.3, 75.0, 160.0, 400.0] {
            let settings = Settings::for_finger(&FrontEnd::REFERENCE, &shorter(max));
            let active = settings.validate(&FrontEnd::REFERENCE, &shorter(max));
            assert!(active.is_ok(), "{max}: {active:?}");
            assert!(settings.grip.grip_pressure_kpa <= settings.regulator.max_pressure_kpa);
            let regrip = settings.grip.grip_pressure_kpa + settings.grip.regrip_raise_kpa;
            assert!(max <= 1.0 || regrip <= settings.regulator.max_pressure_kpa);
        }
        let small = FrontEnd {
            regulator_full_scale: Kilopascals(100.0),
            ..FrontEnd::REFERENCE
        };
        let settings = Settings::for_finger(&small, &FINGER);
        assert_eq!(settings.regulator.max_pressure_kpa, 100.0);
        assert_eq!(settings.grip.grip_pressure_kpa, 87.5);
        assert!(settings.validate(&small, &FINGER).is_ok());
        // A setting that somebody makes is not bent to fit.
        let error = Settings::default()
            .validate(&FrontEnd::REFERENCE, &shorter(30.0))
            .expect_err("too high");
        assert_eq!(
            error.to_string(),
            "max_pressure_kpa = 160: must lie within 1 and 30"
        );
    }

    #[test]
    fn a_finger_that_strains_little_is_touched_by_less() {
        let table = shorter(30.0);
        let (free, _) = table::free_strain(&table, Kilopascals(30.0));
        let settings = Settings::for_finger(&FrontEnd::REFERENCE, &table);
        assert!(settings.finger.contact_ue < 500.0 && settings.finger.contact_ue >= 100.0);
        assert!(settings.finger.contact_ue < 0.5 * free.0, "{free:?}");
    }

    #[test]
    fn a_wrong_setting_is_named_with_its_range() {
        for (change, expected) in [
            (
                (|s| s.regulator.max_pressure_kpa = 170.0) as fn(&mut Settings),
                "max_pressure_kpa = 170: must lie within 1 and 160",
            ),
            (
                |s| s.grip.settle_ms = f32::NAN,
                "settle_ms = NaN: must lie within 0 and 10000",
            ),
            (
                |s| {
                    s.grip.grip_pressure_kpa = 150.0;
                    s.regulator.max_pressure_kpa = 120.0;
                },
                "grip_pressure_kpa = 150: must lie within 1 and 120",
            ),
        ] {
            let mut settings = Settings::default();
            change(&mut settings);
            assert_eq!(error(settings), expected);
        }
    }
}

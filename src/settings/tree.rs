//! The settings as a tree of typed fields.

use crate::frontend::FrontEnd;
use crate::math::smaller;
use crate::table::{self, FingerTable};
use crate::units::Kilopascals;
use crate::{air, detect, estimate, grasp, regulate};

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

    /// Lowers the pressures to what finger, regulator and each other allow.
    pub(super) fn fit(&mut self, front_end: &FrontEnd, table: &FingerTable) {
        let ceiling_kpa = ceiling_kpa(front_end, table);
        let max_kpa = &mut self.regulator.max_pressure_kpa;
        *max_kpa = smaller(*max_kpa, ceiling_kpa);
        let grip = &mut self.grip;
        grip.grip_pressure_kpa = smaller(grip.grip_pressure_kpa, *max_kpa);
        grip.regrip_raise_kpa = smaller(grip.regrip_raise_kpa, ceiling_kpa);
    }
}

/// Above the table nothing is known of the finger, above full scale nothing can be commanded, kPa.
pub(super) fn ceiling_kpa(front_end: &FrontEnd, table: &FingerTable) -> f32 {
    smaller(table.max_pressure_kpa, front_end.regulator_full_scale.0)
}

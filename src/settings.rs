//! What a user may choose, checked once and turned into what the control tick needs.

use crate::TICK_US;
use crate::frontend::FrontEnd;
use crate::math::lag_gain;
use crate::table::{self, FingerTable};
use crate::units::{Kilopascals, Volts};

/// What the outputs do when a fault is latched, where the fault leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OnFault {
    /// Let the air out: the fingers open.
    Vent,
    /// Keep the pressure: what is held stays held.
    Hold,
}

/// What the fingers do once the object is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OnLoss {
    /// Stay as they are, until the robot says what is to happen.
    Hold,
    /// Let the air out: the fingers open.
    Vent,
    /// Close harder, once, and say whether something is there again.
    Regrip,
}

/// What the gauges see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GaugeSense {
    /// Bending: strain follows the finger's curvature, contact takes some of it away.
    Bend,
    /// Contact alone: no strain while the finger bends freely, as in the paper's figures 25–28.
    Contact,
}

/// The controller's settings in the units that people use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Pressure of a grip that names none.
    pub grip_pressure_kpa: f32,
    /// No command and no grip goes above.
    pub max_pressure_kpa: f32,
    /// Steepest change of the commanded pressure.
    pub slew_kpa_per_s: f32,
    /// Time constant of the regulator, command to pressure.
    pub regulator_lag_ms: f32,
    /// Time constant of a finger's inflation, pressure to joint torque.
    pub inflation_lag_ms: f32,
    /// Natural frequency of a finger's bending, joint torque to curvature.
    pub bending_hz: f32,
    /// Damping ratio of a finger's bending.
    pub bending_damping: f32,
    /// What the gauges see.
    pub gauge_sense: GaugeSense,
    /// Measured free-bend strain over the table's, per finger: the result of a calibration.
    pub free_bend_gain: [f32; 3],
    /// A finger touches when its residual exceeds this …
    pub contact_ue: f32,
    /// … plus this share of the free-bend strain, which the table may be wrong by.
    pub contact_percent: f32,
    /// From reaching the set-point to judging whether something is held.
    pub settle_ms: f32,
    /// Loss: fall of the summed residual, in percent of its plateau, that counts for nothing.
    pub loss_allowance_percent: f32,
    /// Loss: evidence at which the object is gone, as fall beyond the allowance times its duration.
    pub loss_evidence_percent_ms: f32,
    /// Slip: change of the summed residual at constant pressure, in percent of its plateau.
    pub slip_percent: f32,
    /// The air is going when the pressure lies this far below what the command should give.
    pub air_loss_kpa: f32,
    /// Any longer deviation of the pressure from what the command should give is a fault.
    pub not_following_ms: f32,
    /// Lowest supply voltage.
    pub supply_min_v: f32,
    /// Lift that a grip for a payload must have beyond the payload's load.
    pub lift_margin_percent: f32,
    /// The robot must say something this often, be it [`Alive`](crate::Command::Alive); zero if it need
    /// not, as with digital inputs alone.
    pub host_timeout_ms: f32,
    /// What the outputs do in a fault.
    pub on_fault: OnFault,
    /// What the fingers do once the object is gone.
    pub on_loss: OnLoss,
    /// How much harder they close then, as far as the limit allows.
    pub regrip_raise_kpa: f32,
}

impl Default for Settings {
    /// For a finger that is good for 160 kPa, as the default one is; [`Settings::for_finger`] takes any.
    fn default() -> Self {
        Self {
            grip_pressure_kpa: 140.0,
            max_pressure_kpa: 160.0,
            slew_kpa_per_s: 400.0,
            // 50–100 ms for proportional regulators of this size.
            regulator_lag_ms: 75.0,
            // Fitted to free closes and openings of the simulated finger: 0.003 rad at worst, where
            // two first-order lags leave 0.04.
            inflation_lag_ms: 80.0,
            bending_hz: 5.9,
            bending_damping: 0.45,
            gauge_sense: GaugeSense::Bend,
            free_bend_gain: [1.0; 3],
            contact_ue: 500.0,
            contact_percent: 5.0,
            settle_ms: 150.0,
            loss_allowance_percent: 5.0,
            loss_evidence_percent_ms: 8.0,
            slip_percent: 7.0,
            air_loss_kpa: 8.0,
            not_following_ms: 300.0,
            // 24 V − 15 %, the lower limit of most regulators.
            supply_min_v: 20.4,
            // The finger's table is good for 6 % of bend, friction for a few percent more.
            lift_margin_percent: 20.0,
            host_timeout_ms: 0.0,
            on_fault: OnFault::Hold,
            on_loss: OnLoss::Hold,
            regrip_raise_kpa: 20.0,
        }
    }
}

/// A setting out of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SettingsError {
    /// The field.
    pub field: &'static str,
    /// Its value.
    pub value: f32,
    /// The lowest value that would be right.
    pub min: f32,
    /// The highest value that would be right.
    pub max: f32,
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            field,
            value,
            min,
            max,
        } = self;
        write!(f, "{field} = {value}: must lie within {min} and {max}")
    }
}

/// Settings in the form that the control tick uses; made by [`Settings::validate`] alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) front_end: FrontEnd,
    pub(crate) grip_pressure: Kilopascals,
    pub(crate) max_pressure: Kilopascals,
    pub(crate) slew_kpa_per_tick: f32,
    pub(crate) regulator_gain: f32,
    pub(crate) inflation_gain: f32,
    /// `(ω dt)²` and `2 ζ ω dt` of the bending.
    pub(crate) bending: [f32; 2],
    pub(crate) gauge_sense: GaugeSense,
    pub(crate) free_bend_gain: [f32; 3],
    pub(crate) contact_ue: f32,
    pub(crate) contact_fraction: f32,
    pub(crate) settle_us: u64,
    pub(crate) loss_allowance: f32,
    pub(crate) loss_evidence: f32,
    pub(crate) slip: f32,
    pub(crate) air_loss_kpa: f32,
    pub(crate) not_following_us: u64,
    pub(crate) supply_min: Volts,
    pub(crate) lift_margin: f32,
    /// None without a host that must speak.
    pub(crate) host_timeout_us: Option<u64>,
    pub(crate) on_fault: OnFault,
    pub(crate) on_loss: OnLoss,
    pub(crate) regrip_raise_kpa: f32,
}

impl Active {
    /// Pressure of a grip that names none.
    pub fn grip_pressure(&self) -> Kilopascals {
        self.grip_pressure
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

        let default = Self::default();
        let max = ceiling(front_end, table).min(default.max_pressure_kpa);
        let share = max / default.max_pressure_kpa;
        let (free, _) = table::free_strain(table, Kilopascals(max));
        Self {
            // What is the least that may be set.
            grip_pressure_kpa: (GRIP * max).max(1.0),
            max_pressure_kpa: max,
            // The whole stroke takes as long as the default's.
            slew_kpa_per_s: share * default.slew_kpa_per_s,
            contact_ue: (CONTACT * free.0).clamp(LEAST_CONTACT_UE, default.contact_ue),
            air_loss_kpa: (share * default.air_loss_kpa).max(LEAST_AIR_LOSS_KPA),
            regrip_raise_kpa: (1.0 - GRIP) * max,
            ..default
        }
    }

    /// Checks every field against the board and the finger.
    pub fn validate(
        &self,
        front_end: &FrontEnd,
        table: &FingerTable,
    ) -> Result<Active, SettingsError> {
        let ceiling = ceiling(front_end, table);
        for (field, value, min, max) in [
            ("max_pressure_kpa", self.max_pressure_kpa, 1.0, ceiling),
            (
                "grip_pressure_kpa",
                self.grip_pressure_kpa,
                1.0,
                self.max_pressure_kpa,
            ),
            ("regrip_raise_kpa", self.regrip_raise_kpa, 0.0, ceiling),
            ("host_timeout_ms", self.host_timeout_ms, 0.0, 60_000.0),
            ("slew_kpa_per_s", self.slew_kpa_per_s, 1.0, 10_000.0),
            ("regulator_lag_ms", self.regulator_lag_ms, 1.0, 1_000.0),
            ("inflation_lag_ms", self.inflation_lag_ms, 1.0, 1_000.0),
            ("bending_hz", self.bending_hz, 0.1, 50.0),
            ("bending_damping", self.bending_damping, 0.1, 2.0),
            ("free_bend_gain[0]", self.free_bend_gain[0], 0.5, 2.0),
            ("free_bend_gain[1]", self.free_bend_gain[1], 0.5, 2.0),
            ("free_bend_gain[2]", self.free_bend_gain[2], 0.5, 2.0),
            ("contact_ue", self.contact_ue, 1.0, 20_000.0),
            ("contact_percent", self.contact_percent, 0.0, 50.0),
            ("settle_ms", self.settle_ms, 0.0, 10_000.0),
            (
                "loss_allowance_percent",
                self.loss_allowance_percent,
                1.0,
                50.0,
            ),
            (
                "loss_evidence_percent_ms",
                self.loss_evidence_percent_ms,
                1.0,
                10_000.0,
            ),
            ("slip_percent", self.slip_percent, 1.0, 50.0),
            ("air_loss_kpa", self.air_loss_kpa, 1.0, 100.0),
            ("not_following_ms", self.not_following_ms, 10.0, 10_000.0),
            ("supply_min_v", self.supply_min_v, 0.0, 30.0),
            (
                "lift_margin_percent",
                self.lift_margin_percent,
                0.0,
                1_000.0,
            ),
        ] {
            // A NaN is in no range.
            if !(min..=max).contains(&value) {
                return Err(SettingsError {
                    field,
                    value,
                    min,
                    max,
                });
            }
        }
        let omega_dt = core::f32::consts::TAU * self.bending_hz * TICK_US as f32 * 1e-6;
        Ok(Active {
            front_end: *front_end,
            grip_pressure: Kilopascals(self.grip_pressure_kpa),
            max_pressure: Kilopascals(self.max_pressure_kpa),
            slew_kpa_per_tick: self.slew_kpa_per_s * TICK_US as f32 * 1e-6,
            regulator_gain: lag_gain(self.regulator_lag_ms),
            inflation_gain: lag_gain(self.inflation_lag_ms),
            bending: [omega_dt * omega_dt, 2.0 * self.bending_damping * omega_dt],
            gauge_sense: self.gauge_sense,
            free_bend_gain: self.free_bend_gain,
            contact_ue: self.contact_ue,
            contact_fraction: 0.01 * self.contact_percent,
            settle_us: micros(self.settle_ms),
            loss_allowance: 0.01 * self.loss_allowance_percent,
            loss_evidence: 0.01 * self.loss_evidence_percent_ms * 1e3 / TICK_US as f32,
            slip: 0.01 * self.slip_percent,
            air_loss_kpa: self.air_loss_kpa,
            not_following_us: micros(self.not_following_ms),
            supply_min: Volts(self.supply_min_v),
            lift_margin: 0.01 * self.lift_margin_percent,
            host_timeout_us: (self.host_timeout_ms > 0.0).then(|| micros(self.host_timeout_ms)),
            on_fault: self.on_fault,
            on_loss: self.on_loss,
            regrip_raise_kpa: self.regrip_raise_kpa,
        })
    }
}

/// Above the table nothing is known of the finger, above full scale nothing can be commanded, kPa.
fn ceiling(front_end: &FrontEnd, table: &FingerTable) -> f32 {
    table.max_pressure_kpa.min(front_end.regulator_full_scale.0)
}

fn micros(ms: f32) -> u64 {
    (1e3 * ms) as u64
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
            Settings::for_finger(&FrontEnd::REFERENCE, &stronger).max_pressure_kpa,
            160.0
        );
    }

    #[test]
    fn the_defaults_stay_within_what_finger_and_regulator_reach() {
        for max in [1.0, 8.0, 30.0, 33.3, 75.0, 160.0, 400.0] {
            let settings = Settings::for_finger(&FrontEnd::REFERENCE, &shorter(max));
            let active = settings.validate(&FrontEnd::REFERENCE, &shorter(max));
            assert!(active.is_ok(), "{max}: {active:?}");
            assert!(settings.grip_pressure_kpa <= settings.max_pressure_kpa);
            let regrip = settings.grip_pressure_kpa + settings.regrip_raise_kpa;
            assert!(max <= 1.0 || regrip <= settings.max_pressure_kpa);
        }
        let small = FrontEnd {
            regulator_full_scale: Kilopascals(100.0),
            ..FrontEnd::REFERENCE
        };
        let settings = Settings::for_finger(&small, &FINGER);
        assert_eq!(settings.max_pressure_kpa, 100.0);
        assert_eq!(settings.grip_pressure_kpa, 87.5);
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
        assert!(settings.contact_ue < 500.0 && settings.contact_ue >= 100.0);
        assert!(settings.contact_ue < 0.5 * free.0, "{free:?}");
    }

    #[test]
    fn a_wrong_setting_is_named_with_its_range() {
        assert_eq!(
            error(Settings {
                max_pressure_kpa: 170.0,
                ..Settings::default()
            }),
            "max_pressure_kpa = 170: must lie within 1 and 160"
        );
        assert_eq!(
            error(Settings {
                settle_ms: f32::NAN,
                ..Settings::default()
            }),
            "settle_ms = NaN: must lie within 0 and 10000"
        );
        assert_eq!(
            error(Settings {
                grip_pressure_kpa: 150.0,
                max_pressure_kpa: 120.0,
                ..Settings::default()
            }),
            "grip_pressure_kpa = 150: must lie within 1 and 120"
        );
    }
}

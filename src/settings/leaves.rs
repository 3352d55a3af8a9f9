//! Every setting by its number.

use softgrip_settings::{Limit, all_limits};

use super::error::SettingsError;
use super::tree::Settings;
use crate::estimate::GaugeSense;
use crate::grasp::{OnFault, OnLoss};

/// Where a setting is kept.
enum Leaf<'a> {
    Number(&'a mut f32),
    GaugeSense(&'a mut GaugeSense),
    OnFault(&'a mut OnFault),
    OnLoss(&'a mut OnLoss),
}

impl Settings {
    /// Where the setting with this number is kept.
    // Never inlined: once in the image is enough.
    #[inline(never)]
    fn leaf(&mut self, number: u16) -> Option<Leaf<'_>> {
        let Self {
            air,
            finger,
            detection,
            grip,
            regulator,
        } = self;
        let silicone = &mut finger.silicone;
        let place = match number {
            200 => return Some(Leaf::GaugeSense(&mut finger.gauge_sense)),
            406 => return Some(Leaf::OnFault(&mut grip.on_fault)),
            407 => return Some(Leaf::OnLoss(&mut grip.on_loss)),

            100 => &mut regulator.max_pressure_kpa,
            101 => &mut regulator.slew_kpa_per_s,
            110 => &mut air.regulator_lag_ms,
            201 => &mut finger.contact_ue,
            202 => &mut finger.contact_percent,
            210 => &mut silicone.inflation_lag_ms,
            211 => &mut silicone.deflation_lag_ms,
            212 => &mut silicone.hysteresis_percent,
            213 => &mut silicone.creep_percent,
            214 => &mut silicone.creep_time_s,
            215 => &mut silicone.bending_hz,
            216 => &mut silicone.bending_damping,
            220..=222 => finger.free_bend_gain.get_mut(usize::from(number - 220))?,
            230..=232 => finger.tare_ue.get_mut(usize::from(number - 230))?,
            300 => &mut detection.loss_allowance_percent,
            301 => &mut detection.loss_evidence_percent_ms,
            302 => &mut detection.slip_percent,
            303 => &mut detection.air_loss_kpa,
            400 => &mut grip.grip_pressure_kpa,
            401 => &mut grip.settle_ms,
            402 => &mut grip.lift_margin_percent,
            403 => &mut grip.not_following_ms,
            404 => &mut grip.supply_min_v,
            405 => &mut grip.host_timeout_ms,
            408 => &mut grip.regrip_raise_kpa,
            _ => return None,
        };
        Some(Leaf::Number(place))
    }

    /// The value of a setting, a choice's place in the list of its words; none if there is no setting of this number.
    pub fn get(&self, number: u16) -> Option<f32> {
        let mut copy = *self;
        Some(match copy.leaf(number)? {
            Leaf::Number(place) => *place,
            Leaf::GaugeSense(sense) => f32::from(*sense as u8),
            Leaf::OnFault(on_fault) => f32::from(*on_fault as u8),
            Leaf::OnLoss(on_loss) => f32::from(*on_loss as u8),
        })
    }

    /// Sets what is in its range.
    ///
    /// # Errors
    /// If it is not, or if there is no setting of this number; nothing is changed then. What finger, regulator and other
    /// settings allow is left to [`Settings::problems`].
    pub fn set(&mut self, number: u16, value: f32) -> Result<(), SettingsError> {
        let limit = all_limits().iter().find(|limit| limit.number == number);
        let none = Limit {
            number,
            min: f32::NAN,
            max: f32::NAN,
        };
        let limit = limit.unwrap_or(&none);
        let error = SettingsError::of(limit, value);
        if !limit.allows(value) {
            return Err(error);
        }
        match self.leaf(number).ok_or(error)? {
            Leaf::Number(place) => *place = value,
            Leaf::GaugeSense(place) => *place = chosen(value, &GaugeSense::ALL).ok_or(error)?,
            Leaf::OnFault(place) => *place = chosen(value, &OnFault::ALL).ok_or(error)?,
            Leaf::OnLoss(place) => *place = chosen(value, &OnLoss::ALL).ok_or(error)?,
        }
        Ok(())
    }
}

/// What stands at this place of a list, if the number is whole.
fn chosen<T: Copy>(place: f32, all: &[T]) -> Option<T> {
    let whole = place as u8;
    let chosen = all.get(usize::from(whole)).copied();
    chosen.filter(|_| f32::from(whole) == place)
}

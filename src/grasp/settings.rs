//! How to grip, and what to do when something goes wrong.

use crate::math::micros;
use crate::units::{Kilopascals, Volts};

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

impl OnLoss {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 3] = [Self::Hold, Self::Vent, Self::Regrip];
}

/// What the outputs do when a fault is latched, where the fault leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OnFault {
    /// Let the air out: the fingers open.
    Vent,
    /// Keep the pressure: what is held stays held.
    Hold,
}

impl OnFault {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 2] = [Self::Vent, Self::Hold];
}

/// How to grip, and what to do when something goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Pressure of a grip that names none.
    pub grip_pressure_kpa: f32,
    /// From reaching the set-point to judging whether something is held.
    pub settle_ms: f32,
    /// Lift that a grip for a payload must have beyond the payload's load.
    pub lift_margin_percent: f32,
    /// Any longer deviation of the pressure from what the command should give is a fault.
    pub not_following_ms: f32,
    /// Lowest supply voltage.
    pub supply_min_v: f32,
    /// The robot must say something this often, be it [`Alive`](crate::Command::Alive); zero if it need not, as with
    /// digital inputs alone.
    pub host_timeout_ms: f32,
    /// What the outputs do in a fault.
    pub on_fault: OnFault,
    /// What the fingers do once the object is gone.
    pub on_loss: OnLoss,
    /// How much harder they close then, as far as the limit allows.
    pub regrip_raise_kpa: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            grip_pressure_kpa: 140.0,
            settle_ms: 150.0,
            // The finger's table is good for 6 % of bend, friction for a few percent more.
            lift_margin_percent: 20.0,
            not_following_ms: 300.0,
            // 24 V − 15 %, the lower limit of most regulators.
            supply_min_v: 20.4,
            host_timeout_ms: 0.0,
            on_fault: OnFault::Hold,
            on_loss: OnLoss::Hold,
            regrip_raise_kpa: 20.0,
        }
    }
}

impl Settings {
    /// Of settings that are in their ranges. `limit`: no command goes above.
    pub(crate) fn active(&self, limit: Kilopascals) -> Active {
        let timeout_ms = self.host_timeout_ms;
        Active {
            max_pressure: limit,
            grip_pressure: Kilopascals(self.grip_pressure_kpa),
            settle_us: micros(self.settle_ms),
            lift_margin: 0.01 * self.lift_margin_percent,
            not_following_us: micros(self.not_following_ms),
            supply_min: Volts(self.supply_min_v),
            host_timeout_us: (timeout_ms > 0.0).then(|| micros(timeout_ms)),
            on_fault: self.on_fault,
            on_loss: self.on_loss,
            regrip_raise_kpa: self.regrip_raise_kpa,
        }
    }
}

/// The settings in the form that the control tick uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// No grip goes above.
    pub(crate) max_pressure: Kilopascals,
    pub(crate) grip_pressure: Kilopascals,
    pub(crate) settle_us: u64,
    pub(crate) lift_margin: f32,
    pub(crate) not_following_us: u64,
    pub(crate) supply_min: Volts,
    /// None without a host that must speak.
    pub(crate) host_timeout_us: Option<u64>,
    pub(crate) on_fault: OnFault,
    pub(crate) on_loss: OnLoss,
    pub(crate) regrip_raise_kpa: f32,
}

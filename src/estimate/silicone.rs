//! How the shape of a finger follows its pressure: silicone lags behind, more on its way back, keeps a part of where it
//! came from, and creeps; then the finger swings.
//!
//! What it keeps is a Prandtl-Ishlinskii operator of four plays, rate-independent and without drift (Kuhnen,
//! Eur. J. Control 9, 2003), around the table's curve:
//!
//! ```text
//! F_j ← max(p − r_j, min(p + r_j, F_j)),   y = p + w Σ (F_j − p),   r_j = j r / 4,   j = 1…4
//! ```

use crate::math::{lag_gain, larger, smaller};
use crate::units::{Kilopascals, TICK_US};

/// Play operators.
const PLAYS: usize = 4;
/// The widest play as a share of the highest pressure: the loop of a full stroke narrows over twice that.
const WIDEST: f32 = 0.25;
/// A shape is known after so many time constants of the lag.
const KNOWN_AFTER: f32 = 6.0;

/// What is known of the silicone of the fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time constant of a finger's inflation, pressure to joint torque.
    pub inflation_lag_ms: f32,
    /// The same while the pressure falls: silicone recovers more slowly than it stretches.
    pub deflation_lag_ms: f32,
    /// A finger has the same shape at pressures that are this far apart on the way up and down, in percent of the
    /// table's highest pressure, half of it to each side of the table's curve.
    pub hysteresis_percent: f32,
    /// So much of the shape follows late, beyond the table's.
    pub creep_percent: f32,
    /// Time constant of the creep.
    pub creep_time_s: f32,
    /// Natural frequency of a finger's bending, joint torque to curvature.
    pub bending_hz: f32,
    /// Damping ratio of a finger's bending.
    pub bending_damping: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            // Fitted to free closes and openings of the simulated finger: 0.003 rad at worst, where
            // two first-order lags leave 0.04.
            inflation_lag_ms: 80.0,
            deflation_lag_ms: 80.0,
            // What silicone adds is known only of a finger that has been measured.
            hysteresis_percent: 0.0,
            creep_percent: 0.0,
            creep_time_s: 30.0,
            bending_hz: 5.9,
            bending_damping: 0.45,
        }
    }
}

/// How wide the loop is where the pressure has fallen by so much, as a share of what it is in the end, for a table that
/// ends at `max_kpa`.
pub(crate) fn loop_share(fallen_kpa: f32, max_kpa: f32) -> f32 {
    let (mut open_kpa, mut full_kpa) = (0.0, 0.0);
    for j in 1..=PLAYS {
        let twice_kpa = 2.0 * WIDEST * max_kpa * j as f32 / PLAYS as f32;
        open_kpa += larger(0.0, smaller(fallen_kpa, twice_kpa));
        full_kpa += twice_kpa;
    }
    open_kpa / full_kpa
}

/// The model's constants for one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// Shares of the way to the pressure that the finger goes in one tick, up and down.
    inflation_gain: f32,
    deflation_gain: f32,
    /// Thresholds of the plays, kPa, and their weight.
    plays_kpa: [f32; PLAYS],
    weight: f32,
    creep: f32,
    creep_gain: f32,
    /// `(ω dt)²` and `2 ζ ω dt` of the bending.
    bending: [f32; 2],
    /// Ticks after which the shape follows from the pressure alone.
    pub known_after_ticks: u16,
}

impl Active {
    /// How far the swing alone comes behind, ms: `2 ζ/ω` of a second-order lag.
    pub(crate) fn swing_ms(&self) -> f32 {
        let [stiffness, damping] = self.bending;
        damping / stiffness * (1e-3 * TICK_US as f32)
    }
}

impl Active {
    /// Of settings that are in their ranges, for a table that ends at `max_kpa`.
    pub fn of(settings: &Settings, max_kpa: f32) -> Self {
        let (up_ms, down_ms) = (settings.inflation_lag_ms, settings.deflation_lag_ms);
        let omega_dt = core::f32::consts::TAU * settings.bending_hz * TICK_US as f32 * 1e-6;
        let plays_kpa: [f32; PLAYS] =
            core::array::from_fn(|j| WIDEST * max_kpa * (j + 1) as f32 / PLAYS as f32);
        let summed_kpa: f32 = plays_kpa.iter().sum();
        Self {
            inflation_gain: lag_gain(up_ms),
            deflation_gain: lag_gain(down_ms),
            plays_kpa,
            weight: 0.01 * settings.hysteresis_percent * max_kpa / (2.0 * summed_kpa),
            creep: 0.01 * settings.creep_percent,
            creep_gain: lag_gain(1e3 * settings.creep_time_s),
            bending: [
                omega_dt * omega_dt,
                2.0 * settings.bending_damping * omega_dt,
            ],
            known_after_ticks: (KNOWN_AFTER * larger(up_ms, down_ms) * 1e3 / TICK_US as f32) as u16,
        }
    }
}

/// The pressure that a finger has followed so far, kPa.
#[derive(Debug, Clone, Copy)]
pub(super) struct Silicone {
    inflated_kpa: f32,
    /// Outputs of the plays, less that.
    plays_kpa: [f32; PLAYS],
    crept_kpa: f32,
    bent_kpa: f32,
    rate_kpa: f32,
}

impl Silicone {
    /// A finger that has been at this pressure for long, having come from none.
    pub fn at_rest(pressure: Kilopascals, active: &Active) -> Self {
        let mut silicone = Self {
            inflated_kpa: pressure.0,
            plays_kpa: [0.0; PLAYS],
            crept_kpa: 0.0,
            bent_kpa: 0.0,
            rate_kpa: 0.0,
        };
        silicone.bent_kpa = silicone.rub(pressure.0, active);
        silicone
    }

    /// The pressure at which the table has the shape of now.
    pub fn pressure(&self) -> Kilopascals {
        Kilopascals(self.bent_kpa)
    }

    /// One tick at this pressure.
    pub fn step(&mut self, pressure: Kilopascals, active: &Active) {
        let gain = match pressure.0 > self.inflated_kpa {
            true => active.inflation_gain,
            false => active.deflation_gain,
        };
        let change_kpa = gain * (pressure.0 - self.inflated_kpa);
        self.inflated_kpa += change_kpa;
        let rubbed_kpa = self.rub(change_kpa, active);
        self.crept_kpa += active.creep_gain * (rubbed_kpa - self.crept_kpa);
        let followed_kpa = rubbed_kpa + active.creep * self.crept_kpa;
        // Semi-implicit Euler: stable up to ω dt = 2, and the settings end at 0.3.
        let [stiffness, damping] = active.bending;
        self.rate_kpa += stiffness * (followed_kpa - self.bent_kpa) - damping * self.rate_kpa;
        self.bent_kpa += self.rate_kpa;
    }

    /// Takes a change of the pressure to the plays; gives what they make of it.
    fn rub(&mut self, change_kpa: f32, active: &Active) -> f32 {
        let mut left_kpa = 0.0;
        for (play, threshold) in self.plays_kpa.iter_mut().zip(active.plays_kpa) {
            let mut behind = *play - change_kpa;
            if behind > threshold {
                behind = threshold;
            } else if behind < -threshold {
                behind = -threshold;
            }
            *play = behind;
            left_kpa += behind;
        }
        self.inflated_kpa + active.weight * left_kpa
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAX_KPA: f32 = 160.0;

    fn active(settings: &Settings) -> Active {
        Active::of(settings, MAX_KPA)
    }

    /// What the finger has followed after so many ticks at each of these pressures.
    fn follow(settings: &Settings, ticks: u32, pressures_kpa: &[f32]) -> std::vec::Vec<f32> {
        let active = active(settings);
        let mut silicone = Silicone::at_rest(Kilopascals(0.0), &active);
        let settled = pressures_kpa.iter().map(|&kpa| {
            for _ in 0..ticks {
                silicone.step(Kilopascals(kpa), &active);
            }
            silicone.pressure().0
        });
        settled.collect()
    }

    #[test]
    fn the_way_down_is_as_far_from_the_way_up_as_the_setting_says() {
        let settings = Settings {
            hysteresis_percent: 5.0,
            ..Settings::default()
        };
        let shapes = follow(&settings, 3_000, &[100.0, 160.0, 70.0]);
        // 5 % of 160 kPa are 8 kPa, half to each side.
        assert!((shapes[0] - 96.0).abs() < 0.05, "{shapes:?}");
        assert!((shapes[2] - 74.0).abs() < 0.05, "{shapes:?}");
        // A small loop closes.
        let shapes = follow(&settings, 3_000, &[120.0, 100.0, 120.0]);
        assert!((shapes[0] - shapes[2]).abs() < 0.05, "{shapes:?}");
    }

    #[test]
    fn a_finger_deflates_with_a_lag_of_its_own() {
        let settings = Settings {
            inflation_lag_ms: 100.0,
            deflation_lag_ms: 800.0,
            bending_hz: 50.0,
            bending_damping: 1.0,
            ..Settings::default()
        };
        let shapes = follow(&settings, 800, &[100.0, 0.0]);
        assert!((shapes[0] - 100.0).abs() < 0.2, "{shapes:?}");
        assert!((shapes[1] - 36.8).abs() < 1.0, "{shapes:?}");
    }

    #[test]
    fn creep_comes_with_its_time_constant() {
        let settings = Settings {
            creep_percent: 10.0,
            creep_time_s: 1.0,
            ..Settings::default()
        };
        let early = follow(&settings, 1_100, &[100.0])[0];
        let late = follow(&settings, 9_000, &[100.0])[0];
        assert!((early - 106.3).abs() < 0.5, "{early}");
        assert!((late - 110.0).abs() < 0.1, "{late}");
    }

    #[test]
    fn a_finger_found_under_pressure_has_come_from_none() {
        let settings = Settings {
            hysteresis_percent: 5.0,
            ..Settings::default()
        };
        let found = Silicone::at_rest(Kilopascals(100.0), &active(&settings));
        assert!((found.pressure().0 - 96.0).abs() < 0.05, "{found:?}");
    }
}

//! Model of the regulator: the pressure that the commands so far should have given, against the measured one.

use crate::condition::Monitor;
use crate::math::lag_gain;
use crate::range::{SettingsError, within};
use crate::units::{Instant, Kilopascals};

/// The pressure, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Measured pressure, where there is a measurement.
    pub measured: Option<Kilopascals>,
    /// What the commands so far should have given; unknown before the first measurement.
    pub expected: Option<Kilopascals>,
    /// The pressure has deviated from that for this long, µs.
    pub deviating_us: u64,
}

impl Air {
    /// Measured less expected, kPa, where both are known.
    pub fn deviation_kpa(&self) -> Option<f32> {
        match (self.measured, self.expected) {
            (Some(measured), Some(expected)) => Some(measured.0 - expected.0),
            _ => None,
        }
    }
}

/// The pressure follows while it is within this of what the command should give.
pub(crate) const FOLLOWING_KPA: f32 = 8.0;

/// What is known of the regulator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time constant of the regulator, command to pressure.
    pub regulator_lag_ms: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            // 50–100 ms for proportional regulators of this size.
            regulator_lag_ms: 75.0,
        }
    }
}

impl Settings {
    pub(crate) fn validate(&self) -> Result<Active, SettingsError> {
        let lag_ms = within("regulator_lag_ms", self.regulator_lag_ms, 1.0, 1_000.0)?;
        Ok(Active {
            gain: lag_gain(lag_ms),
        })
    }
}

/// The model's constants for one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// Share of the way to the set-point that the pressure goes in one tick.
    pub(crate) gain: f32,
}

/// A first-order lag behind the set-point.
#[derive(Debug, Clone, Copy)]
pub struct AirModel {
    /// Unknown before the first measurement.
    expected: Option<f32>,
    deviating_since: Option<Instant>,
}

impl AirModel {
    /// At rest at the first pressure that will be measured.
    pub fn new() -> Self {
        Self {
            expected: None,
            deviating_since: None,
        }
    }

    /// What the commands so far should have given; unknown before the first measurement.
    pub fn expected(&self) -> Option<Kilopascals> {
        self.expected.map(Kilopascals)
    }

    /// Compares the pressure with what it should be.
    pub fn observe(&mut self, now: Instant, monitor: Monitor) -> Air {
        let measured = monitor.pressure();
        if let Some(measured) = measured {
            let expected = *self.expected.get_or_insert(measured.0);
            self.deviating_since = match (measured.0 - expected).abs() > FOLLOWING_KPA {
                true => Some(self.deviating_since.unwrap_or(now)),
                false => None,
            };
        }
        Air {
            measured,
            expected: self.expected(),
            deviating_us: self
                .deviating_since
                .map_or(0, |since| now.micros_since(since)),
        }
    }

    /// Goes one tick towards the set-point, and says where that leads.
    pub fn drive(&mut self, setpoint_kpa: f32, active: &Active) -> Option<Kilopascals> {
        if let Some(expected) = &mut self.expected {
            *expected += active.gain * (setpoint_kpa - *expected);
        }
        self.expected()
    }
}

impl Default for AirModel {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::from_micros(1_000 * ms)
    }

    fn valid(kpa: f32) -> Monitor {
        Monitor::Valid(Kilopascals(kpa))
    }

    #[test]
    fn the_model_starts_at_the_first_measurement_and_then_lags_behind_the_setpoint() {
        let active = Settings::default().validate().expect("the defaults");
        let mut model = AirModel::new();
        assert_eq!(model.drive(100.0, &active), None);
        assert_eq!(model.observe(at(0), Monitor::Missing).expected, None);
        let air = model.observe(at(1), valid(3.0));
        assert_eq!(air.expected, Some(Kilopascals(3.0)));
        for _ in 0..75 {
            model.drive(103.0, &active);
        }
        // 63 % of the way after one time constant.
        let expected = model.expected().expect("known").0;
        assert!((expected - 66.2).abs() < 0.1, "{expected}");
    }

    #[test]
    fn a_deviation_counts_from_its_first_tick_and_a_tick_without_a_measurement_is_no_news() {
        let mut model = AirModel::new();
        let deviating =
            |model: &mut AirModel, ms, monitor| model.observe(at(ms), monitor).deviating_us;
        assert_eq!(deviating(&mut model, 0, valid(100.0)), 0);
        for kpa in [108.0, 92.0] {
            assert_eq!(deviating(&mut model, 5, valid(kpa)), 0, "{kpa}");
        }
        for kpa in [108.5, 91.5] {
            assert_eq!(deviating(&mut model, 10, valid(kpa)), 0);
            assert_eq!(deviating(&mut model, 11, valid(kpa)), 1_000);
            assert_eq!(deviating(&mut model, 12, Monitor::Missing), 2_000);
            assert_eq!(deviating(&mut model, 13, valid(100.0)), 0);
            assert_eq!(deviating(&mut model, 14, Monitor::Missing), 0);
        }
    }
}

//! Target pressure → commanded pressure: slew limit, feed-forward, and a PI on the monitor.

use crate::condition::Monitor;
use crate::math::{larger, smaller};
use crate::settings::Active;
use crate::units::Kilopascals;
use crate::{TICK_US, units::Instant};

/// Proportional gain on the deviation. The regulator has its own loop; this one only trims it.
const PROPORTIONAL: f32 = 0.1;
/// Integral gain, 1/s: well below the regulator's own bandwidth of about 1/(75 ms).
const INTEGRAL_PER_S: f32 = 4.0;
/// The trim never exceeds this: five times the regulator's stated error of ±1 % of 200 kPa.
const TRIM_LIMIT_KPA: f32 = 10.0;
/// A ramp is over when the expected pressure is this close to the set-point.
const STEADY_KPA: f32 = 1.0;
/// The pressure follows while it is within this of what the command should give.
const FOLLOWING_KPA: f32 = 8.0;

/// The pressure, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Measured pressure, where there is a measurement.
    pub measured: Option<Kilopascals>,
    /// What the commands so far should have given.
    pub expected: Kilopascals,
}

/// The regulator's set-point, model and trim.
#[derive(Debug, Clone, Copy)]
pub struct Regulator {
    setpoint: f32,
    /// What the pressure should be by now; unknown before the first measurement.
    expected: Option<f32>,
    trim: f32,
    deviation: Option<f32>,
    deviating_since: Option<Instant>,
}

impl Regulator {
    /// At rest without pressure.
    pub fn new() -> Self {
        Self {
            setpoint: 0.0,
            expected: None,
            trim: 0.0,
            deviation: None,
            deviating_since: None,
        }
    }

    /// The slew-limited set-point.
    pub fn setpoint(&self) -> Kilopascals {
        Kilopascals(self.setpoint)
    }

    /// What the commands so far should have given; unknown before the first measurement.
    pub fn expected(&self) -> Option<Kilopascals> {
        self.expected.map(Kilopascals)
    }

    /// Compares the pressure with what the commands so far should have given.
    pub fn observe(&mut self, now: Instant, monitor: Monitor) -> Air {
        let measured = match monitor {
            Monitor::Valid(pressure) => Some(pressure),
            Monitor::Missing | Monitor::TooHigh | Monitor::Lost => None,
        };
        self.deviation =
            measured.map(|pressure| pressure.0 - *self.expected.get_or_insert(pressure.0));
        match self.deviation {
            Some(deviation) if deviation.abs() > FOLLOWING_KPA => {
                self.deviating_since.get_or_insert(now);
            }
            Some(_) => self.deviating_since = None,
            None => {}
        }
        Air {
            measured,
            expected: Kilopascals(self.expected.unwrap_or(0.0)),
        }
    }

    /// How long the pressure has not followed, µs.
    pub fn deviating_us(&self, now: Instant) -> u64 {
        self.deviating_since
            .map_or(0, |since| now.micros_since(since))
    }

    /// The output has been set to zero past this: the next rise starts from there.
    pub fn vent(&mut self, active: &Active) {
        self.setpoint = 0.0;
        self.trim = 0.0;
        if let Some(expected) = &mut self.expected {
            *expected -= active.regulator_gain * *expected;
        }
    }

    /// The command for this tick.
    pub fn step(&mut self, target: Kilopascals, active: &Active) -> Kilopascals {
        let slew = active.slew_kpa_per_tick;
        let target = smaller(larger(target.0, 0.0), active.max_pressure.0);
        if let Some(expected) = &mut self.expected {
            // A ramp starts from the pressure that is there: a rise from no more than that, even if the model
            // of the regulator is wrong, and a fall from no more than that, so that it stops a rise at once.
            if self.setpoint < target {
                let low = self.deviation.map_or(0.0, |off| *expected + off.min(0.0));
                self.setpoint = self.setpoint.max(low.min(target));
            } else if self.setpoint > target {
                let high = self
                    .deviation
                    .map_or(*expected, |off| *expected + off.max(0.0));
                self.setpoint = self.setpoint.min(high.max(target));
            }
            if self.setpoint != target {
                self.setpoint += (target - self.setpoint).max(-slew).min(slew);
            }
            *expected += active.regulator_gain * (self.setpoint - *expected);
        }

        // Deviations from the expected response, not from the set-point: the regulator's lag is not
        // an error to integrate.
        let error = -self.deviation.unwrap_or(0.0);
        // A pressure that does not follow is a fault to report, not an error to chase.
        let chased = error.clamp(-FOLLOWING_KPA, FOLLOWING_KPA);
        let command = self.setpoint + PROPORTIONAL * chased + self.trim;
        // Anti-windup: no trim for a command at its limit, none for a regulator that does not follow,
        // and none on a ramp, where a regulator quicker or slower than its model is no error to trim.
        let saturated = !(0.0..=active.max_pressure.0).contains(&command);
        let steady = self
            .expected
            .is_some_and(|expected| (self.setpoint - expected).abs() < STEADY_KPA);
        if !saturated && steady && error.abs() < FOLLOWING_KPA {
            self.trim = (self.trim + INTEGRAL_PER_S * error * TICK_US as f32 * 1e-6)
                .clamp(-TRIM_LIMIT_KPA, TRIM_LIMIT_KPA);
        }
        if self.setpoint <= 0.0 {
            self.trim = 0.0;
            return Kilopascals(0.0);
        }
        Kilopascals(command)
    }
}

impl Default for Regulator {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frontend::FrontEnd;
    use crate::settings::Settings;
    use crate::table::FINGER;

    fn active() -> Active {
        Settings::default()
            .validate(&FrontEnd::REFERENCE, &FINGER)
            .expect("good settings")
    }

    /// Runs a regulator with gain and offset errors for a second and returns the pressure.
    fn run(regulator: &mut Regulator, target: f32, gain: f32, offset: f32, ms: u64) -> f32 {
        let active = active();
        let mut pressure = 0.0;
        for tick in 0..ms {
            let now = Instant::from_micros(1_000 * tick);
            regulator.observe(now, Monitor::Valid(Kilopascals(pressure)));
            let command = regulator.step(Kilopascals(target), &active);
            pressure += (gain * command.0 + offset - pressure) / 60.0;
        }
        pressure
    }

    #[test]
    fn the_trim_removes_the_regulators_error() {
        let mut regulator = Regulator::new();
        let pressure = run(&mut regulator, 140.0, 0.99, -1.0, 6_000);
        assert!((pressure - 140.0).abs() < 0.1, "{pressure}");
    }

    #[test]
    fn the_setpoint_never_rises_faster_than_its_slew() {
        let active = active();
        let mut regulator = Regulator::new();
        let mut before = 0.0;
        let at_rest = Monitor::Valid(Kilopascals(0.0));
        regulator.observe(Instant::default(), at_rest);
        for _ in 0..1_000 {
            regulator.step(Kilopascals(160.0), &active);
            let now = regulator.setpoint().0;
            assert!(now - before <= active.slew_kpa_per_tick * 1.001);
            before = now;
        }
        assert_eq!(before, 160.0);
    }

    #[test]
    fn a_stuck_regulator_is_seen_and_does_not_wind_the_trim_up() {
        let mut regulator = Regulator::new();
        run(&mut regulator, 140.0, 0.0, 0.0, 2_000);
        assert!(regulator.deviating_us(Instant::from_micros(2_000_000)) > 1_500_000);
        assert!(regulator.trim.abs() < 1.0, "{}", regulator.trim);
    }

    #[test]
    fn without_a_target_nothing_is_commanded() {
        let mut regulator = Regulator::new();
        regulator.observe(Instant::default(), Monitor::Valid(Kilopascals(-2.0)));
        let command = regulator.step(Kilopascals(0.0), &active());
        assert_eq!(command, Kilopascals(0.0));
    }
}

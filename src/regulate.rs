//! Target pressure → commanded pressure: slew limit, feed-forward, and a PI on the monitor.

use crate::air::{self, Air, AirModel};
use crate::command::LEAST_SLEW;
use crate::math::{larger, smaller};
use crate::units::{Kilopascals, TICK_US};

/// Proportional gain on the deviation. The regulator has its own loop; this one only trims it.
const PROPORTIONAL: f32 = 0.1;
/// Integral gain, 1/s: well below the regulator's own bandwidth of about 1/(75 ms).
const INTEGRAL_PER_S: f32 = 4.0;
/// The trim never exceeds this: five times the regulator's stated error of ±1 % of 200 kPa.
const TRIM_LIMIT_KPA: f32 = 10.0;
/// A ramp is over when the expected pressure is this close to the set-point.
const STEADY_KPA: f32 = 1.0;

/// How far and how fast the pressure may be commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// No command and no grip goes above.
    pub max_pressure_kpa: f32,
    /// Steepest change of the commanded pressure.
    pub slew_kpa_per_s: f32,
}

impl Default for Settings {
    /// For a finger that is good for 160 kPa, as the default one is.
    fn default() -> Self {
        Self {
            max_pressure_kpa: 160.0,
            slew_kpa_per_s: 400.0,
        }
    }
}

impl Settings {
    /// Of settings that are in their ranges.
    pub(crate) fn active(&self) -> Active {
        Active {
            max_pressure: Kilopascals(self.max_pressure_kpa),
            slew_kpa_per_tick: self.slew_kpa_per_s * TICK_US as f32 * 1e-6,
        }
    }
}

/// The limits for one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) max_pressure: Kilopascals,
    pub(crate) slew_kpa_per_tick: f32,
}

/// The slew-limited set-point, and the trim that removes the regulator's own error.
#[derive(Debug, Clone, Copy)]
pub struct Regulator {
    setpoint: f32,
    trim: f32,
    /// Share of the slew of the settings.
    speed: f32,
}

impl Regulator {
    /// At rest without pressure.
    pub fn new() -> Self {
        Self {
            setpoint: 0.0,
            trim: 0.0,
            speed: 1.0,
        }
    }

    /// How fast the set-point moves, as a share of the slew of the settings; at least [`LEAST_SLEW`] of it.
    pub fn set_speed(&mut self, share: f32) {
        self.speed = larger(smaller(share, 1.0), LEAST_SLEW);
    }

    /// The slew-limited set-point.
    pub fn setpoint(&self) -> Kilopascals {
        Kilopascals(self.setpoint)
    }

    /// The command for this tick, which drives the model too; none to let all air out at once: the next rise
    /// starts from there.
    pub fn step(
        &mut self,
        target: Option<Kilopascals>,
        air: &Air,
        model: &mut AirModel,
        (active, air_active): (&Active, &air::Active),
    ) -> Kilopascals {
        let Some(target) = target else {
            *self = Self::new();
            model.drive(0.0, 0.0, air.measured, air_active);
            return Kilopascals(0.0);
        };
        let target = smaller(larger(target.0, 0.0), active.max_pressure.0);
        if let Some(expected) = air.expected {
            let most = self.speed * active.slew_kpa_per_tick;
            self.slew(target, expected.0, air.deviation_kpa(), most);
        }
        let expected = model.drive(self.setpoint, target, air.measured, air_active);

        // Deviations from the expected response, not from the set-point: the regulator's lag is not
        // an error to integrate.
        let error = -air.deviation_kpa().unwrap_or(0.0);
        let following = air_active.following_kpa;
        // A pressure that does not follow is a fault to report, not an error to chase.
        let chased = smaller(larger(error, -following), following);
        let command = self.setpoint + PROPORTIONAL * chased + self.trim;
        // Anti-windup: no trim for a command at its limit, none for a regulator that does not follow,
        // and none on a ramp, where a regulator quicker or slower than its model is no error to trim.
        let saturated = !(0.0..=active.max_pressure.0).contains(&command);
        let steady =
            expected.is_some_and(|expected| (self.setpoint - expected.0).abs() < STEADY_KPA);
        if !saturated && steady && error.abs() < following {
            self.trim = (self.trim + INTEGRAL_PER_S * error * TICK_US as f32 * 1e-6)
                .clamp(-TRIM_LIMIT_KPA, TRIM_LIMIT_KPA);
        }
        if self.setpoint <= 0.0 {
            self.trim = 0.0;
            return Kilopascals(0.0);
        }
        Kilopascals(command)
    }

    /// Moves the set-point towards the target. A ramp starts from the pressure that is there: a rise from no
    /// more than that, even if the model of the regulator is wrong, and a fall from no more than that, so that
    /// it stops a rise at once.
    fn slew(&mut self, target: f32, expected: f32, deviation: Option<f32>, most: f32) {
        if self.setpoint < target {
            let low = deviation.map_or(0.0, |off| expected + smaller(off, 0.0));
            self.setpoint = larger(self.setpoint, smaller(low, target));
        } else if self.setpoint > target {
            let high = deviation.map_or(expected, |off| expected + larger(off, 0.0));
            self.setpoint = smaller(self.setpoint, larger(high, target));
        }
        if self.setpoint != target {
            self.setpoint += smaller(larger(target - self.setpoint, -most), most);
        }
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
    use crate::condition::Monitor;
    use crate::units::Instant;

    fn active() -> Active {
        Settings::default().active()
    }

    /// A regulator and what it drives.
    #[derive(Clone)]
    struct Loop {
        regulator: Regulator,
        model: AirModel,
        tick: u64,
    }

    impl Loop {
        fn new() -> Self {
            Self {
                regulator: Regulator::new(),
                model: AirModel::new(),
                tick: 0,
            }
        }

        /// One tick at a measured pressure, kPa.
        fn step(&mut self, target: Option<f32>, measured: Option<f32>) -> f32 {
            self.tick += 1;
            let now = Instant::from_micros(1_000 * self.tick);
            let monitor = match measured {
                Some(kpa) => Monitor::Valid(Kilopascals(kpa)),
                None => Monitor::Missing,
            };
            let air = self
                .model
                .observe(now, monitor, &air::Settings::default().active());
            let air_active = air::Settings::default().active();
            let target = target.map(Kilopascals);
            self.regulator
                .step(target, &air, &mut self.model, (&active(), &air_active))
                .0
        }

        /// Runs a regulator with gain and offset errors and returns the pressure.
        fn run(&mut self, target: f32, gain: f32, offset: f32, ms: u64) -> f32 {
            let mut pressure = 0.0;
            for _ in 0..ms {
                let command = self.step(Some(target), Some(pressure));
                pressure += (gain * command + offset - pressure) / 60.0;
            }
            pressure
        }
    }

    #[test]
    fn the_trim_removes_the_regulators_error() {
        for (gain, offset) in [(0.99, -1.0), (1.01, 1.0)] {
            let pressure = Loop::new().run(140.0, gain, offset, 6_000);
            assert!((pressure - 140.0).abs() < 0.1, "{pressure}");
        }
    }

    #[test]
    fn the_setpoint_never_rises_faster_than_its_slew_nor_above_the_limit() {
        let mut control = Loop::new();
        let mut before = 0.0;
        for _ in 0..1_000 {
            let following = control.model.expected().map_or(0.0, |kpa| kpa.0);
            control.step(Some(200.0), Some(following));
            let now = control.regulator.setpoint().0;
            assert!(now - before <= active().slew_kpa_per_tick * 1.001);
            before = now;
        }
        assert_eq!(before, 160.0);
    }

    #[test]
    fn a_stuck_regulator_is_seen_and_does_not_wind_the_trim_up() {
        let mut control = Loop::new();
        control.run(140.0, 0.0, 0.0, 2_000);
        let now = Instant::from_micros(2_000_000);
        let air = control
            .model
            .observe(now, Monitor::Missing, &air::Settings::default().active());
        assert!(air.deviating_us > 1_500_000);
        assert!(
            control.regulator.trim.abs() < 1.0,
            "{}",
            control.regulator.trim
        );
    }

    #[test]
    fn the_trim_is_limited_and_a_command_at_its_limit_does_not_wind_it_up() {
        let mut control = Loop::new();
        // 7 kPa too little, for ever: a deviation that is no fault.
        for _ in 0..20_000 {
            let following = control.model.expected().map_or(0.0, |kpa| kpa.0);
            control.step(Some(100.0), Some(following - 7.0));
        }
        assert_eq!(control.regulator.trim, TRIM_LIMIT_KPA);
        let mut control = Loop::new();
        for _ in 0..20_000 {
            let following = control.model.expected().map_or(0.0, |kpa| kpa.0);
            let command = control.step(Some(160.0), Some(following - 7.0));
            assert!(command <= 161.0, "{command}");
        }
        assert!(control.regulator.trim < 1.0, "{}", control.regulator.trim);
    }

    #[test]
    fn the_integral_takes_out_four_times_the_error_each_second() {
        let mut control = Loop::new();
        control.run(100.0, 1.0, 0.0, 3_000);
        let before = control.regulator.trim;
        for _ in 0..250 {
            let following = control.model.expected().map_or(0.0, |kpa| kpa.0);
            control.step(Some(100.0), Some(following - 2.0));
        }
        let gained = control.regulator.trim - before;
        assert!((gained - 2.0).abs() < 0.01, "{gained}");
    }

    #[test]
    fn a_new_ramp_starts_from_the_pressure_that_is_there() {
        // Up, after the output has been set to zero: from what is left, by measurement or model.
        for (measured, most) in [(100.0, 100.4), (150.0, 139.0)] {
            let mut control = Loop::new();
            control.run(140.0, 1.0, 0.0, 3_000);
            control.step(None, Some(140.0));
            control.step(Some(160.0), Some(measured));
            let setpoint = control.regulator.setpoint().0;
            assert!((most - 1.0..=most + 0.01).contains(&setpoint), "{setpoint}");
        }
        // Down: the model lags behind the set-point, so that a rise stops at once.
        let mut control = Loop::new();
        control.run(140.0, 1.0, 0.0, 200);
        let expected = control.model.expected().expect("known").0;
        assert!(control.regulator.setpoint().0 > expected + 10.0);
        let slew = active().slew_kpa_per_tick;
        // From the model where less is measured, or nothing, and from more than that where more is.
        for (measured, from) in [
            (Some(expected - 3.0), expected),
            (None, expected),
            (Some(expected + 5.0), expected + 5.0),
        ] {
            let mut control = control.clone();
            control.step(Some(10.0), measured);
            let setpoint = control.regulator.setpoint().0;
            assert!((setpoint - (from - slew)).abs() < 1e-3, "{setpoint}");
        }
    }

    #[test]
    fn up_and_down_the_setpoint_moves_by_400_kpa_per_second_and_stops_at_its_target() {
        let mut control = Loop::new();
        control.run(100.0, 1.0, 0.0, 3_000);
        for (target, step) in [(120.0, 0.4), (90.0, -0.4)] {
            let before = control.regulator.setpoint().0;
            control.step(Some(target), control.model.expected().map(|kpa| kpa.0));
            let after = control.regulator.setpoint().0;
            assert!((after - before - step).abs() < 1e-2, "{after}");
            control.run(target, 1.0, 0.0, 1_000);
            assert_eq!(control.regulator.setpoint().0, target);
        }
    }

    #[test]
    fn a_deviation_is_answered_with_a_tenth_of_it_and_chased_no_further_than_a_fault() {
        // On a ramp, where nothing is trimmed.
        let mut ramp = Loop::new();
        ramp.run(140.0, 1.0, 0.0, 200);
        let trim = ramp.regulator.trim;
        let expected = ramp.model.expected().expect("known").0;
        for (deviation, answer) in [(-2.0, 0.2), (2.0, -0.2), (-20.0, 0.8), (20.0, -0.8)] {
            let mut ramp = ramp.clone();
            let command = ramp.step(Some(140.0), Some(expected + deviation));
            let answered = command - ramp.regulator.setpoint().0 - trim;
            assert!(
                (answered - answer).abs() < 1e-3,
                "{answered} to {deviation}"
            );
            assert_eq!(ramp.regulator.trim, trim);
        }
        // And without a measurement with nothing.
        let command = ramp.step(Some(140.0), None);
        assert_eq!(command, ramp.regulator.setpoint().0 + trim);
    }

    #[test]
    fn too_much_pressure_for_ever_is_trimmed_down_to_the_limit_of_the_trim() {
        let mut control = Loop::new();
        for _ in 0..20_000 {
            let following = control.model.expected().map_or(0.0, |kpa| kpa.0);
            control.step(Some(100.0), Some(following + 7.0));
        }
        assert_eq!(control.regulator.trim, -TRIM_LIMIT_KPA);
    }

    #[test]
    fn without_a_target_nothing_is_commanded_and_after_a_vent_it_starts_from_zero() {
        let mut control = Loop::new();
        assert_eq!(control.step(Some(0.0), Some(-2.0)), 0.0);
        control.run(140.0, 0.99, 0.0, 3_000);
        assert_eq!(control.step(None, Some(138.0)), 0.0);
        assert_eq!(control.regulator.setpoint().0, 0.0);
        assert_eq!(control.regulator.trim, 0.0);
    }

    #[test]
    fn a_ramp_of_400_kpa_per_second_takes_0_4_in_a_tick() {
        assert!((active().slew_kpa_per_tick - 0.4).abs() < 1e-6);
    }

    #[test]
    fn nothing_is_commanded_before_the_first_measurement() {
        let mut control = Loop::new();
        for _ in 0..100 {
            assert_eq!(control.step(Some(140.0), None), 0.0);
        }
    }
}

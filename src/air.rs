//! Model of the regulator: the pressure that the commands so far should have given, against the measured one.

mod rise;

use rise::{Progress, Rise};

use crate::condition::Monitor;
use crate::math::{lag_gain, larger, smaller};
use crate::units::{Instant, Kilopascals, TICK_US};

/// The pressure, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Measured pressure, where there is a measurement.
    pub measured: Option<Kilopascals>,
    /// What the commands so far should have given; unknown before the first measurement.
    pub expected: Option<Kilopascals>,
    /// The pressure has deviated from that for this long without progress, µs; zero while it follows.
    pub deviating_us: u64,
    /// When it deviated last.
    pub deviated: Instant,
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

/// The pressure has reached its set-point within this: the regulator is good for ±1 % of 200 kPa.
pub(crate) const REACHED_KPA: f32 = 3.0;
/// One that lags further behind is on its way while it comes this much nearer in the time that is allowed:
/// more than the ripple of a regulator that is stuck, and less than the slowest pump loops make of 300 ms.
const PROGRESS_KPA: f32 = 3.0;

/// A delay that is off from what is known by this factor is news.
const NEWS: f32 = 0.6;
/// Between these it is believed, ms.
const SHORTEST_MS: f32 = 5.0;
const LONGEST_MS: f32 = 1_000.0;
const TICKS_PER_MS: f32 = 1e3 / TICK_US as f32;

/// What is known of the regulator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time constant of the regulator, command to pressure.
    pub regulator_lag_ms: f32,
    /// The pressure follows while it is within this of what the command should give.
    pub following_kpa: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            // 50–100 ms for proportional regulators of this size.
            regulator_lag_ms: 75.0,
            following_kpa: 8.0,
        }
    }
}

impl Settings {
    /// Of settings that are in their ranges.
    pub(crate) fn active(&self) -> Active {
        Active {
            gain: lag_gain(self.regulator_lag_ms),
            following_kpa: self.following_kpa,
        }
    }
}

/// The model's constants for one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// Share of the way to the set-point that the pressure goes in one tick.
    pub(crate) gain: f32,
    pub(crate) following_kpa: f32,
}

/// A first-order lag behind the set-point.
#[derive(Debug, Clone, Copy)]
pub struct AirModel {
    /// Unknown before the first measurement.
    expected: Option<f32>,
    target: f32,
    deviation: Option<Deviation>,
    /// When it deviated last.
    deviated: Instant,
    rise: Option<Rise>,
    learned_ms: Option<u16>,
    /// Share of the way that the pressure goes in one tick, where it has been learned.
    gain: Option<f32>,
}

/// A pressure that does not follow.
#[derive(Debug, Clone, Copy)]
struct Deviation {
    /// Since when it has made no progress.
    since: Instant,
    /// Where it was then, kPa.
    from: f32,
}

impl AirModel {
    /// At rest at the first pressure that will be measured.
    pub fn new() -> Self {
        Self {
            expected: None,
            target: 0.0,
            deviation: None,
            deviated: Instant::from_micros(0),
            rise: None,
            learned_ms: None,
            gain: None,
        }
    }

    /// What the commands so far should have given; unknown before the first measurement.
    pub fn expected(&self) -> Option<Kilopascals> {
        self.expected.map(Kilopascals)
    }

    /// Delay of the regulator, ms, which a rise has just told, if it is not what was known.
    pub fn take_learned(&mut self) -> Option<u16> {
        self.learned_ms.take()
    }

    /// Compares the pressure with what it should be. One that lies between that and the target follows, too: its
    /// regulator is faster than the model, or got its command without the slew limit. One that lags behind follows
    /// as long as it makes progress: its regulator is slower, or has a dead time.
    pub fn observe(&mut self, now: Instant, monitor: Monitor, active: &Active) -> Air {
        let measured = monitor.pressure();
        if let Some(measured) = measured {
            let expected = *self.expected.get_or_insert(measured.0);
            let near = (measured.0 - expected).abs() <= active.following_kpa;
            if near {
                self.deviation = None;
            } else if self.leads(measured.0, expected, active.following_kpa) {
                self.deviation = None;
                if (measured.0 - self.target).abs() <= REACHED_KPA {
                    // It has answered, whatever the model makes of the rest of the way.
                    self.expected = Some(measured.0);
                }
            } else {
                self.deviated = now;
                let on_its_way = |off: Deviation| off.progresses(measured.0, expected);
                if self.deviation.is_none_or(on_its_way) {
                    self.deviation = Some(Deviation {
                        since: now,
                        from: measured.0,
                    });
                }
            }
        }
        if self.deviation.is_some() && measured.is_none() {
            self.deviated = now;
        }
        Air {
            measured,
            expected: self.expected(),
            deviating_us: self
                .deviation
                .map_or(0, |deviation| now.micros_since(deviation.since)),
            deviated: self.deviated,
        }
    }

    /// Whether the pressure is further on its way to the target than expected, and not beyond it.
    fn leads(&self, measured: f32, expected: f32, following_kpa: f32) -> bool {
        let (low, high) = match self.target > expected {
            true => (expected, self.target + following_kpa),
            false => (self.target - following_kpa, expected),
        };
        self.target != expected && (low..=high).contains(&measured)
    }

    /// Goes one tick towards the set-point, which is on its way to the target, and says where that leads.
    pub fn drive(
        &mut self,
        setpoint_kpa: f32,
        target_kpa: f32,
        measured: Option<Kilopascals>,
        active: &Active,
    ) -> Option<Kilopascals> {
        if self.rise.is_some() || target_kpa != self.target {
            self.learn(setpoint_kpa, target_kpa, measured, active);
        }
        self.target = target_kpa;
        if let Some(expected) = &mut self.expected {
            let gain = self.gain.unwrap_or(active.gain);
            *expected += gain * (setpoint_kpa - *expected);
        }
        self.expected()
    }

    /// Watches how the pressure follows a rise of the target from rest.
    // Not inlined: most ticks have no rise.
    #[inline(never)]
    fn learn(
        &mut self,
        setpoint_kpa: f32,
        target_kpa: f32,
        measured: Option<Kilopascals>,
        active: &Active,
    ) {
        let Some(measured) = measured else {
            // Only what has been seen whole tells anything.
            self.rise = None;
            return;
        };
        if target_kpa != self.target {
            self.rise = Rise::begins(setpoint_kpa, measured.0, target_kpa);
        }
        let Some(rise) = &mut self.rise else {
            return;
        };
        match rise.step(setpoint_kpa, measured.0) {
            Progress::Rises => return,
            Progress::Over(delay_ms) => {
                let delay_ms = larger(smaller(delay_ms, LONGEST_MS), SHORTEST_MS);
                // The share of its way that a first-order lag goes in one tick.
                let gain = 1.0 / (0.5 + TICKS_PER_MS * delay_ms);
                let known = self.gain.unwrap_or(active.gain);
                if gain < NEWS * known || known < NEWS * gain {
                    self.learned_ms = Some(delay_ms as u16);
                    self.gain = Some(gain);
                }
            }
            Progress::Failed => {}
        }
        self.rise = None;
    }
}

impl Deviation {
    /// Whether the pressure has come nearer to what it should be by enough.
    fn progresses(&self, measured: f32, expected: f32) -> bool {
        let nearer = match measured < expected {
            true => measured - self.from,
            false => self.from - measured,
        };
        nearer >= PROGRESS_KPA
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

    fn active() -> Active {
        Settings::default().active()
    }

    fn at(ms: u64) -> Instant {
        Instant::from_micros(1_000 * ms)
    }

    fn valid(kpa: f32) -> Monitor {
        Monitor::Valid(Kilopascals(kpa))
    }

    #[test]
    fn the_model_starts_at_the_first_measurement_and_then_lags_behind_the_setpoint() {
        let mut model = AirModel::new();
        assert_eq!(model.drive(100.0, 100.0, None, &active()), None);
        assert_eq!(
            model.observe(at(0), Monitor::Missing, &active()).expected,
            None
        );
        let air = model.observe(at(1), valid(3.0), &active());
        assert_eq!(air.expected, Some(Kilopascals(3.0)));
        for _ in 0..75 {
            model.drive(103.0, 103.0, None, &active());
        }
        // 63 % of the way after one time constant.
        let expected = model.expected().expect("known").0;
        assert!((expected - 66.2).abs() < 0.1, "{expected}");
    }

    #[test]
    fn the_deviation_is_what_is_measured_beyond_what_is_expected_where_both_are_known() {
        let air = |measured: Option<f32>, expected: Option<f32>| Air {
            measured: measured.map(Kilopascals),
            expected: expected.map(Kilopascals),
            deviating_us: 0,
            deviated: at(0),
        };
        assert_eq!(air(Some(97.0), Some(100.0)).deviation_kpa(), Some(-3.0));
        assert_eq!(air(Some(104.0), Some(100.0)).deviation_kpa(), Some(4.0));
        for unknown in [
            air(None, Some(100.0)),
            air(Some(97.0), None),
            air(None, None),
        ] {
            assert_eq!(unknown.deviation_kpa(), None);
        }
    }

    #[test]
    fn a_deviation_counts_from_its_first_tick_and_a_tick_without_a_measurement_is_no_news() {
        let mut model = AirModel::new();
        let deviating = |model: &mut AirModel, ms, monitor| {
            model.observe(at(ms), monitor, &active()).deviating_us
        };
        assert_eq!(deviating(&mut model, 0, valid(100.0)), 0);
        model.drive(100.0, 100.0, None, &active());
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

    /// A model at 50 kPa on its way to 100.
    fn rising() -> AirModel {
        let mut model = AirModel::new();
        model.observe(at(0), valid(0.0), &active());
        while model.expected().is_some_and(|kpa| kpa.0 < 50.0) {
            model.drive(100.0, 100.0, None, &active());
        }
        model
    }

    #[test]
    fn a_pressure_ahead_of_the_model_follows_up_to_the_target_and_no_further() {
        for (kpa, follows) in [
            (41.0, false),
            (43.0, true),
            (99.0, true),
            (107.0, true),
            (109.0, false),
        ] {
            let mut model = rising();
            model.observe(at(1), valid(kpa), &active());
            let air = model.observe(at(2), valid(kpa), &active());
            assert_eq!(air.deviating_us == 0, follows, "{kpa}");
        }
    }

    #[test]
    fn a_pressure_that_lags_behind_is_given_its_time_again_with_each_3_kpa_of_progress() {
        let mut model = rising();
        let mut us = |ms, kpa| model.observe(at(ms), valid(kpa), &active()).deviating_us;
        assert_eq!(us(100, 20.0), 0);
        assert_eq!(us(200, 22.9), 100_000);
        assert_eq!(us(300, 23.1), 0);
        // Ripple is no progress, and neither is what goes the other way.
        for ms in 301..500 {
            let ripple = if ms % 2 == 0 { 1.0 } else { -5.0 };
            assert_eq!(us(ms, 23.1 + ripple), 1_000 * (ms - 300));
        }
        let air = model.observe(at(500), valid(50.0), &active());
        assert_eq!((air.deviating_us, air.deviated), (0, at(499)));
    }

    /// Deviation, kPa, at its largest in a grip at 140 kPa by a regulator with this lag, and what is learned.
    fn grip(model: &mut AirModel, lag_ms: f32) -> (f32, Option<u16>) {
        let (mut pressure, mut most, mut learned) = (0.0f32, 0.0f32, None);
        let begin = Kilopascals(0.0);
        model.expected = Some(begin.0);
        for ms in 0..3_000 {
            let setpoint = (0.4 * ms as f32).min(140.0);
            pressure += (setpoint - pressure) / lag_ms;
            let measured = Some(Kilopascals(pressure));
            model.drive(setpoint, 140.0, measured, &active());
            let air = model.observe(at(ms), valid(pressure), &active());
            most = most.max(air.deviation_kpa().map_or(0.0, f32::abs));
            learned = model.take_learned().or(learned);
        }
        model.drive(0.0, 0.0, Some(begin), &active());
        (most, learned)
    }

    #[test]
    fn a_regulator_that_is_not_the_settings_is_learned_in_one_grip() {
        for (lag_ms, is_news) in [(20.0, true), (60.0, false), (80.0, false), (200.0, true)] {
            let mut model = AirModel::new();
            let (before, learned) = grip(&mut model, lag_ms);
            assert_eq!(learned.is_some(), is_news, "{lag_ms}: {learned:?}");
            assert!(
                learned.is_none_or(|ms| (f32::from(ms) - lag_ms).abs() < 0.12 * lag_ms),
                "{lag_ms}: {learned:?}"
            );
            let (after, again) = grip(&mut model, lag_ms);
            assert_eq!(again, None);
            assert!(
                !is_news || before > 10.0 && after < 6.0,
                "{lag_ms}: {before}, then {after}"
            );
        }
    }
}

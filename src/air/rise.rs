//! What a grip tells of the regulator: how far the pressure comes behind the set-point.
//!
//! Whatever is between the two, lag, dead time or slew: the area between them over the height of the rise is the sum of
//! all delays (Åström and Hägglund, Advanced PID Control, 2006, chapter 2: average residence time).

use crate::units::TICK_US;

/// A smaller rise drowns in the monitor's error.
const LEAST_KPA: f32 = 40.0;
/// Pressure and set-point are at rest within this, kPa.
const REST_KPA: f32 = 3.0;
/// The rise is over when the pressure has been within this of its end for so long, and is given up after this. What a
/// lag of 200 ms has left then makes the delay 9 % too short; a grip is judged later.
const NEAR_KPA: f32 = 4.0;
const NEAR_TICKS: u16 = 120;
const LONGEST_TICKS: u16 = 4_000;
const TICK_MS: f32 = 1e-3 * TICK_US as f32;

/// A rise that is being watched.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rise {
    from_kpa: f32,
    to_kpa: f32,
    ticks: u16,
    near_ticks: u16,
    /// Sum of what the pressure was behind the set-point, kPa·ticks.
    behind: f32,
}

/// What has become of a rise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Progress {
    /// It goes on.
    Rises,
    /// It is over, and this has been the delay, ms.
    Over(f32),
    /// The pressure has not got there.
    Failed,
}

impl Rise {
    /// A rise of the target that is worth watching.
    pub fn begins(setpoint_kpa: f32, measured_kpa: f32, target_kpa: f32) -> Option<Self> {
        let is_at_rest = (setpoint_kpa - measured_kpa).abs() < REST_KPA;
        (is_at_rest && target_kpa - measured_kpa > LEAST_KPA).then_some(Self {
            from_kpa: measured_kpa,
            to_kpa: target_kpa,
            ticks: 0,
            near_ticks: 0,
            behind: 0.0,
        })
    }

    /// Takes one tick.
    pub fn step(&mut self, setpoint_kpa: f32, measured_kpa: f32) -> Progress {
        self.ticks = self.ticks.saturating_add(1);
        let behind_kpa = setpoint_kpa - measured_kpa;
        self.behind += behind_kpa;
        self.near_ticks = match (self.to_kpa - measured_kpa).abs() < NEAR_KPA {
            true => self.near_ticks.saturating_add(1),
            false => 0,
        };
        if self.near_ticks >= NEAR_TICKS {
            // What it is wrong by in the end is no delay.
            let wrong = behind_kpa * f32::from(self.ticks);
            let height_kpa = measured_kpa - self.from_kpa;
            Progress::Over(TICK_MS * (self.behind - wrong) / height_kpa)
        } else if self.ticks >= LONGEST_TICKS {
            Progress::Failed
        } else {
            Progress::Rises
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The delay of a regulator with this lag and dead time, ms, and slew, kPa/ms, behind a set-point that rises to
    /// 140 kPa at 400 kPa/s.
    fn delay_ms(lag_ms: f32, dead_ms: usize, slew: f32) -> f32 {
        let mut rise = Rise::begins(0.0, 0.0, 140.0).expect("a rise");
        let mut commands = std::vec::Vec::new();
        let (mut setpoint, mut valve, mut pressure) = (0.0f32, 0.0f32, 0.0f32);
        loop {
            setpoint = (setpoint + 0.4).min(140.0);
            commands.push(setpoint);
            let command = commands
                .len()
                .checked_sub(dead_ms + 1)
                .map_or(0.0, |i| commands[i]);
            valve += (command - valve).clamp(-slew, slew);
            // 1 % too low in the end.
            pressure += (0.99 * valve - pressure) / lag_ms;
            match rise.step(setpoint, pressure) {
                Progress::Rises => {}
                Progress::Over(delay_ms) => return delay_ms,
                Progress::Failed => panic!("{pressure} kPa"),
            }
        }
    }

    #[test]
    fn the_delay_is_the_sum_of_lag_dead_time_and_slew_within_a_tenth() {
        for lag_ms in [20.0, 80.0, 200.0] {
            for dead_ms in [0, 50, 150] {
                let delay_ms = delay_ms(lag_ms, dead_ms, f32::MAX);
                let sum_ms = lag_ms + dead_ms as f32;
                assert!(
                    (delay_ms - sum_ms).abs() < 3.0 + 0.1 * sum_ms,
                    "{lag_ms} {dead_ms}: {delay_ms}"
                );
            }
        }
        // 140 kPa take 1 400 ms, and the set-point 350.
        let delay_ms = delay_ms(20.0, 50, 0.1);
        assert!(
            (delay_ms - (20.0 + 50.0 + 0.5 * (1_400.0 - 350.0))).abs() < 10.0,
            "{delay_ms}"
        );
    }

    #[test]
    fn a_pressure_that_does_not_get_there_tells_nothing() {
        let mut rise = Rise::begins(0.0, 0.0, 140.0).expect("a rise");
        let mut last = Progress::Rises;
        while last == Progress::Rises {
            last = rise.step(140.0, 60.0);
        }
        assert_eq!(last, Progress::Failed);
    }

    #[test]
    fn a_small_rise_and_one_in_motion_are_not_watched() {
        assert!(Rise::begins(100.0, 100.0, 130.0).is_none());
        assert!(Rise::begins(50.0, 20.0, 140.0).is_none());
    }
}

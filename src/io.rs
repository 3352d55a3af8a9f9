//! Digital inputs and outputs: the level at which each is on, and how often snapshots are sent.
//!
//! The stop circuit, ACK, READY and FAULT have fixed levels. A broken wire must be a stop and no board be ready before it
//! runs, and in a failure the program reads ACK and shows FAULT without any settings.

use crate::inputs::Levels;
use crate::telemetry::Indicators;

/// The level at which a signal is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// 24 V.
    #[default]
    High,
    /// 0 V.
    Low,
}

impl Level {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 2] = [Self::High, Self::Low];

    /// Whether a signal that is high is on, and whether one that is on is high.
    fn is(self, on: bool) -> bool {
        on == (self == Self::High)
    }
}

/// The level at which each signal is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// The input GRIP.
    pub grip: Level,
    /// The input RELEASE.
    pub release: Level,
    /// The output HOLDING.
    pub holding: Level,
    /// The output LOST.
    pub lost: Level,
}

impl Settings {
    /// Which inputs are on, from those that are high.
    pub fn on(&self, high: Levels) -> Levels {
        Levels {
            grip: self.grip.is(high.grip),
            release: self.release.is(high.release),
            ..high
        }
    }

    /// Which outputs are high, from those that are on.
    pub fn high(&self, on: Indicators) -> Indicators {
        Indicators {
            holding: self.holding.is(on.holding),
            lost: self.lost.is(on.lost),
            ..on
        }
    }
}

/// How the program reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TelemetrySettings {
    /// Time between two snapshots.
    pub period_ms: f32,
}

impl Default for TelemetrySettings {
    fn default() -> Self {
        Self { period_ms: 20.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_on_at_the_level_that_the_settings_say_and_the_others_are_fixed() {
        let low = Settings {
            grip: Level::Low,
            release: Level::Low,
            holding: Level::Low,
            lost: Level::Low,
        };
        for high in [false, true] {
            let levels = Levels {
                grip: high,
                release: high,
                stop_closed: high,
                acknowledge: high,
            };
            let on = Indicators {
                ready: high,
                holding: high,
                lost: high,
                fault: high,
            };
            let usual = Settings::default();
            assert_eq!((usual.on(levels), usual.high(on)), (levels, on));
            let inverted = Levels {
                grip: !high,
                release: !high,
                ..levels
            };
            assert_eq!(low.on(levels), inverted);
            let inverted = Indicators {
                holding: !high,
                lost: !high,
                ..on
            };
            assert_eq!(low.high(on), inverted);
        }
    }
}

//! Digital inputs and outputs: the level at which each is on; how often snapshots are sent; the line to the robot.
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

/// Bits per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Baud {
    /// 9600.
    B9600,
    /// 19 200, as the protocol has it where nobody says another.
    B19200,
    /// 38 400.
    B38400,
    /// 57 600.
    B57600,
    /// 115 200, as drivers of the Robotiq convention have it.
    #[default]
    B115200,
    /// 230 400.
    B230400,
}

impl Baud {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 6] = [
        Self::B9600,
        Self::B19200,
        Self::B38400,
        Self::B57600,
        Self::B115200,
        Self::B230400,
    ];

    /// The number.
    pub const fn bits_per_s(self) -> u32 {
        match self {
            Self::B9600 => 9_600,
            Self::B19200 => 19_200,
            Self::B38400 => 38_400,
            Self::B57600 => 57_600,
            Self::B115200 => 115_200,
            Self::B230400 => 230_400,
        }
    }
}

/// The line to the robot; always 8 bits, no parity, one stop bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusSettings {
    /// The slave's id, 1 to 247.
    pub id: u8,
    /// Bits per second.
    pub baud: Baud,
}

impl Default for BusSettings {
    fn default() -> Self {
        Self {
            id: 9,
            baud: Baud::default(),
        }
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

//! Digital inputs of the robot → command.

use crate::command::{Command, Grip};
use crate::units::TICK_US;

/// What the robot applies to the inputs in one tick; `true` is 24 V.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Levels {
    /// A rising edge grips, at the pressure of the settings.
    pub grip: bool,
    /// A rising edge lets go.
    pub release: bool,
    /// The stop circuit is closed. It is normally closed: a broken wire is a stop.
    pub stop_closed: bool,
    /// A rising edge acknowledges what is latched.
    pub acknowledge: bool,
}

/// A contact bounces for less than this; a relay or a PLC output does not pulse shorter.
const DEBOUNCE_TICKS: u8 = (5_000 / TICK_US) as u8;

/// One debounced input that acts on its rising edge.
#[derive(Debug, Clone, Copy)]
struct Edge {
    level: bool,
    against: u8,
    pending: bool,
}

impl Edge {
    /// Taken as on, so that an input that is on when the power comes must go off first.
    const START: Self = Self {
        level: true,
        against: 0,
        pending: false,
    };

    fn step(&mut self, level: bool) {
        if level == self.level {
            self.against = 0;
            return;
        }
        self.against = self.against.saturating_add(1);
        if self.against >= DEBOUNCE_TICKS {
            self.level = level;
            self.against = 0;
            self.pending = level;
        }
    }

    fn take(&mut self) -> bool {
        core::mem::take(&mut self.pending)
    }
}

/// The inputs' memory.
#[derive(Debug, Clone, Copy)]
pub struct Inputs {
    grip: Edge,
    release: Edge,
    acknowledge: Edge,
}

impl Inputs {
    /// Waits for every input to be off once.
    pub const fn new() -> Self {
        Self {
            grip: Edge::START,
            release: Edge::START,
            acknowledge: Edge::START,
        }
    }

    /// The command of this tick. A stop acts at once and as long as its circuit is open; what was
    /// asked for meanwhile is dropped. Edges of the same tick are obeyed one after the other,
    /// acknowledge before grip, but a release drops a grip.
    pub fn step(&mut self, levels: Levels) -> Command {
        self.grip.step(levels.grip);
        self.release.step(levels.release);
        self.acknowledge.step(levels.acknowledge);
        if !levels.stop_closed {
            for edge in [&mut self.grip, &mut self.release, &mut self.acknowledge] {
                edge.pending = false;
            }
            Command::Stop
        } else if self.release.take() {
            self.grip.pending = false;
            Command::Release
        } else if self.acknowledge.take() {
            Command::Acknowledge
        } else if self.grip.take() {
            Command::Grip(Grip::Default)
        } else {
            Command::Continue
        }
    }
}

impl Default for Inputs {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const OFF: Levels = Levels {
        grip: false,
        release: false,
        stop_closed: true,
        acknowledge: false,
    };
    const GRIP: Levels = Levels { grip: true, ..OFF };

    /// The commands, with their tick, of levels that change at the given ticks.
    fn commands(changes: &[(u32, Levels)], ticks: u32) -> Vec<(u32, Command)> {
        let mut inputs = Inputs::new();
        let mut levels = OFF;
        (0..ticks)
            .filter_map(|tick| {
                if let Some((_, new)) = changes.iter().find(|(at, _)| *at == tick) {
                    levels = *new;
                }
                match inputs.step(levels) {
                    Command::Continue => None,
                    command => Some((tick, command)),
                }
            })
            .collect()
    }

    #[test]
    fn an_edge_counts_once_and_after_5_ms() {
        let got = commands(&[(10, GRIP)], 100);
        assert_eq!(got, [(14, Command::Grip(Grip::Default))]);
    }

    #[test]
    fn a_bounce_shorter_than_5_ms_is_nothing() {
        let bouncing = [(10, GRIP), (14, OFF), (15, GRIP), (19, OFF)];
        assert_eq!(commands(&bouncing, 100), []);
    }

    #[test]
    fn an_input_that_is_on_at_power_up_must_go_off_first() {
        assert_eq!(commands(&[(0, GRIP)], 100), []);
        let got = commands(&[(0, GRIP), (20, OFF), (40, GRIP)], 100);
        assert_eq!(got, [(44, Command::Grip(Grip::Default))]);
    }

    #[test]
    fn an_open_stop_circuit_acts_at_once_as_long_as_it_is_open_and_drops_edges() {
        let open = Levels {
            stop_closed: false,
            ..GRIP
        };
        let got = commands(&[(10, open), (30, GRIP)], 100);
        assert_eq!(got.len(), 20);
        assert_eq!(got[0], (10, Command::Stop));
        assert!(got.iter().all(|(_, command)| *command == Command::Stop));
    }

    #[test]
    fn edges_of_one_tick_are_obeyed_in_order_and_a_release_drops_a_grip() {
        let both = Levels {
            acknowledge: true,
            ..GRIP
        };
        let got = commands(&[(10, both)], 100);
        assert_eq!(
            got,
            [
                (14, Command::Acknowledge),
                (15, Command::Grip(Grip::Default))
            ]
        );
        let contradicting = Levels {
            release: true,
            ..GRIP
        };
        assert_eq!(
            commands(&[(10, contradicting)], 100),
            [(14, Command::Release)]
        );
    }
}

//! What is kept of a failure of the program itself across the restart that follows it, and when there
//! have been so many that another restart helps nobody.
//!
//! The firmware keeps a record in RAM that start-up leaves alone. After a power-on that RAM holds
//! anything, hence the checksum.

use crate::checksum::checksum;
use crate::grasp::State;

/// Words of an encoded record.
pub const WORDS: usize = 15;
/// Calls that are kept of a panic: two of the language's own, and the way to where it happened.
pub const CALLS: usize = 6;
/// Ticks in which [`LOOP`] failures are a loop: ten seconds.
const LOOP_TICKS: u32 = 10_000;
/// Failures that make a loop.
pub const LOOP: usize = 3;
/// No failure came before.
const NEVER: u32 = u32::MAX;

/// The watchdog is fed when both tasks have checked in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Task {
    /// The 1 kHz control task.
    Control,
    /// The task that tells the host.
    Telemetry,
}

/// Why the program stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// It panicked.
    Panic {
        /// Where each call would have returned to, from the innermost out; zero beyond the last.
        calls: [u32; CALLS],
    },
    /// The core took a hard fault.
    HardFault {
        /// The instruction that failed.
        pc: u32,
        /// Where its function would have returned to.
        lr: u32,
        /// The core's configurable fault status register.
        cfsr: u32,
    },
    /// The same with a stack pointer outside the stack, as after an overflow; there is no frame to read.
    StackFault {
        /// The stack pointer.
        sp: u32,
        /// The core's configurable fault status register.
        cfsr: u32,
    },
    /// An interrupt or exception that has no handler.
    Interrupt {
        /// Its number; the core's own exceptions are negative, and −14 is a failed clock.
        number: i32,
    },
    /// The watchdog was not fed.
    Watchdog {
        /// The task that had not checked in.
        task: Task,
    },
}

/// What the gripper was doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Activity {
    /// No tick had been finished.
    Starting = 0,
    /// [`State::Idle`].
    Idle = 1,
    /// [`State::Closing`].
    Closing = 2,
    /// [`State::Holding`].
    Holding = 3,
    /// [`State::Empty`].
    Empty = 4,
    /// [`State::Releasing`].
    Releasing = 5,
    /// [`State::Fault`].
    Fault = 6,
    /// [`State::Sweeping`].
    Sweeping = 7,
}

impl Activity {
    /// The activity with this number; a number that none has is a start.
    pub fn from_number(number: u32) -> Self {
        let all = [
            Self::Idle,
            Self::Closing,
            Self::Holding,
            Self::Empty,
            Self::Releasing,
            Self::Fault,
            Self::Sweeping,
        ];
        all.into_iter()
            .find(|&activity| activity as u32 == number)
            .unwrap_or(Self::Starting)
    }
}

impl From<&State> for Activity {
    fn from(state: &State) -> Self {
        match state {
            State::Idle => Self::Idle,
            State::Closing { .. } => Self::Closing,
            State::Holding { .. } => Self::Holding,
            State::Empty { .. } => Self::Empty,
            State::Releasing { .. } => Self::Releasing,
            State::Fault { .. } => Self::Fault,
            State::Sweeping { .. } => Self::Sweeping,
        }
    }
}

/// A failure of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failure {
    /// Why.
    pub cause: Cause,
    /// Ticks since the start that it ended.
    pub tick: u32,
    /// What the gripper was doing in the last of them.
    pub activity: Activity,
    /// Ticks since the failure before this one, and since the one before that. Restarts are not counted:
    /// they take some milliseconds each.
    since: [u32; LOOP - 1],
}

impl Failure {
    /// A failure after `tick` ticks, where the run before ended with `previous`.
    pub fn new(cause: Cause, tick: u32, activity: Activity, previous: Option<&Self>) -> Self {
        let before = previous.map_or([NEVER; LOOP - 1], |previous| previous.since);
        let last = if previous.is_some() { tick } else { NEVER };
        Self {
            cause,
            tick,
            activity,
            since: [last, last.saturating_add(before[0])],
        }
    }

    /// Whether this is the third within ten seconds, so that a restart leads to the next.
    pub fn is_loop(&self) -> bool {
        self.since[LOOP - 2] <= LOOP_TICKS
    }

    /// The record, its checksum last.
    pub fn encode(&self) -> [u32; WORDS] {
        let (kind, a, b, c) = match self.cause {
            Cause::Panic { .. } => (1, 0, 0, 0),
            Cause::HardFault { pc, lr, cfsr } => (2, pc, lr, cfsr),
            Cause::StackFault { sp, cfsr } => (3, sp, cfsr, 0),
            Cause::Interrupt { number } => (4, number.cast_unsigned(), 0, 0),
            Cause::Watchdog { task } => (5, task as u32, 0, 0),
        };
        let activity = self.activity as u32;
        let head = [
            kind,
            a,
            b,
            c,
            self.tick,
            activity,
            self.since[0],
            self.since[1],
        ];
        let calls = match self.cause {
            Cause::Panic { calls } => calls,
            _ => [0; CALLS],
        };
        let mut words = [0; WORDS];
        for (word, value) in words.iter_mut().zip(head.into_iter().chain(calls)) {
            *word = value;
        }
        words[WORDS - 1] = sum(&words);
        words
    }

    /// The failure in a record; none unless its checksum is right.
    pub fn decode(words: &[u32; WORDS]) -> Option<Self> {
        if words[WORDS - 1] != sum(words) {
            return None;
        }
        let [kind, a, b, c, tick, activity, last, first, calls @ .., _] = *words;
        let cause = match kind {
            1 => Cause::Panic { calls },
            2 => Cause::HardFault {
                pc: a,
                lr: b,
                cfsr: c,
            },
            3 => Cause::StackFault { sp: a, cfsr: b },
            4 => Cause::Interrupt {
                number: a.cast_signed(),
            },
            5 => Cause::Watchdog {
                task: match a {
                    0 => Task::Control,
                    1 => Task::Telemetry,
                    _ => return None,
                },
            },
            _ => return None,
        };
        Some(Self {
            cause,
            tick,
            activity: Activity::from_number(activity),
            since: [last, first],
        })
    }
}

/// The checksum of all words but the last.
fn sum(words: &[u32; WORDS]) -> u32 {
    let words = words.iter().take(WORDS - 1);
    words.fold(0, |sum, word| checksum(sum, &word.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const PANIC: Cause = Cause::Panic {
        calls: [
            0x0800_1235,
            0x0800_2345,
            0x0800_0457,
            0x0800_5679,
            0xffff_fff9,
            0,
        ],
    };

    fn causes() -> [Cause; 6] {
        [
            PANIC,
            Cause::HardFault {
                pc: 0x0800_1234,
                lr: 0x0800_5678,
                cfsr: 0x0001_0000,
            },
            Cause::StackFault {
                sp: 0x1fff_fff0,
                cfsr: 0x1000,
            },
            Cause::Interrupt { number: -14 },
            Cause::Watchdog {
                task: Task::Control,
            },
            Cause::Watchdog {
                task: Task::Telemetry,
            },
        ]
    }

    #[test]
    fn a_record_comes_back_as_it_was() {
        for cause in causes() {
            let first = Failure::new(cause, 123_456, Activity::Holding, None);
            assert_eq!(Failure::decode(&first.encode()), Some(first));
            let second = Failure::new(cause, 7, Activity::Fault, Some(&first));
            assert_eq!(Failure::decode(&second.encode()), Some(second));
        }
    }

    #[test]
    fn one_wrong_bit_makes_it_no_record() {
        for cause in causes() {
            let words = Failure::new(cause, 5, Activity::Idle, None).encode();
            for bit in 0..32 * WORDS {
                let mut wrong = words;
                wrong[bit / 32] ^= 1 << (bit % 32);
                assert_eq!(Failure::decode(&wrong), None, "{cause:?}, bit {bit}");
            }
        }
    }

    #[test]
    fn ram_after_a_power_on_holds_no_record() {
        assert_eq!(Failure::decode(&[0; WORDS]), None);
        assert_eq!(Failure::decode(&[u32::MAX; WORDS]), None);
        let mut noise = fastrand::Rng::with_seed(1);
        for _ in 0..10_000 {
            let words = core::array::from_fn(|_| noise.u32(..));
            assert_eq!(Failure::decode(&words), None);
        }
    }

    /// After which of several failures, so many ticks after the start before each, a loop is seen.
    fn loops(ticks: &[u32]) -> Vec<bool> {
        let mut previous = None;
        ticks
            .iter()
            .map(|&tick| {
                let failure = Failure::new(PANIC, tick, Activity::Idle, previous.as_ref());
                previous = Some(failure);
                failure.is_loop()
            })
            .collect()
    }

    #[test]
    fn the_third_failure_in_ten_seconds_is_a_loop() {
        assert_eq!(loops(&[0, 0, 0]), [false, false, true]);
        // What ran before the first does not count.
        assert_eq!(loops(&[u32::MAX, 5_000, 5_000]), [false, false, true]);
        assert_eq!(loops(&[1, 5_000, 5_001]), [false, false, false]);
        let rare = loops(&[1, 9_000, 9_000, 9_000, 100, 100]);
        assert_eq!(rare, [false, false, false, false, true, true]);
    }

    #[test]
    fn every_activity_has_its_number() {
        for number in 0..=7 {
            assert_eq!(Activity::from_number(number) as u32, number);
        }
        assert_eq!(Activity::from_number(8), Activity::Starting);
    }
}

//! When each tick is due, and how late they come.

use std::time::{Duration, Instant};

use softgrip::TICK_US;

/// Further behind than this, the gripper does not hurry after the clock on the wall: its own stands still instead.
const FURTHEST: Duration = Duration::from_millis(100);

/// The clock on the wall, in ticks.
pub struct Pace {
    /// Between two ticks.
    period: Duration,
    due: Instant,
    late: u64,
    worst: Duration,
    lost: Duration,
}

impl Pace {
    /// Begins now; `speed` is 1 in real time.
    pub fn new(speed: f64) -> Self {
        let period = Duration::from_secs_f64(1e-6 * TICK_US as f64 / speed);
        Self {
            period,
            due: Instant::now() + period,
            late: 0,
            worst: Duration::ZERO,
            lost: Duration::ZERO,
        }
    }

    /// Time until the next tick; none if it is due.
    pub fn left(&self) -> Option<Duration> {
        let left = self.due.saturating_duration_since(Instant::now());
        Some(left).filter(|left| !left.is_zero())
    }

    /// A tick begins. Says so the first time that it is too late to be made up for.
    pub fn tick(&mut self) -> bool {
        let behind = Instant::now().saturating_duration_since(self.due);
        self.due += self.period;
        self.worst = self.worst.max(behind);
        if behind >= self.period {
            self.late += 1;
        }
        if behind <= FURTHEST {
            return false;
        }
        let is_first = self.lost.is_zero();
        self.lost += behind;
        self.due += behind;
        is_first
    }

    /// Ticks that began when the next one was due already.
    pub fn late(&self) -> u64 {
        self.late
    }

    /// The latest of them.
    pub fn worst(&self) -> Duration {
        self.worst
    }

    /// How far the gripper's own clock is behind that on the wall, because the machine was too slow.
    pub fn lost(&self) -> Duration {
        self.lost
    }
}

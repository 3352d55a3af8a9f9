//! Why the program stopped itself the last time, in RAM that start-up leaves alone.
//!
//! Only this record, or the watchdog's own flag, makes a restart a fault: a debugger resets the chip by
//! the same request as [`reset`](crate::failsafe) does.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use softgrip::failure::{Activity, Cause, Failure, Task, WORDS};
use softgrip::grasp::State;

use crate::board::ResetReason;

/// The last failure. Written where the program fails, and by start-up.
#[unsafe(link_section = ".uninit.record")]
static RECORD: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];

/// [`UNTOLD`] from a failure to the start that tells it.
#[unsafe(link_section = ".uninit.record")]
static STATUS: AtomicU32 = AtomicU32::new(0);
const UNTOLD: u32 = 0x5afe_dead;

/// Ticks since the start. The control task counts them; what they were is read after a watchdog's reset.
#[unsafe(link_section = ".uninit.record")]
static TICKS: AtomicU32 = AtomicU32::new(0);

/// The number of what the gripper does. Written by the control task.
#[unsafe(link_section = ".uninit.record")]
static ACTIVITY: AtomicU32 = AtomicU32::new(0);

/// [`TICKS`] when the telemetry task last ran. Written by it.
#[unsafe(link_section = ".uninit.record")]
static TELEMETRY_RAN_AT: AtomicU32 = AtomicU32::new(0);

/// The telemetry task runs at least every 50 ms, and the watchdog's time is 68 ms at least: whoever is
/// behind by more than this when it comes is late.
const LATE_TICKS: u32 = 60;

/// The control task has finished a tick.
pub fn ticked(state: &State) {
    TICKS.store(TICKS.load(Relaxed).wrapping_add(1), Relaxed);
    ACTIVITY.store(Activity::from(state) as u32, Relaxed);
}

/// The telemetry task has run.
pub fn told() {
    TELEMETRY_RAN_AT.store(TICKS.load(Relaxed), Relaxed);
}

/// Keeps a failure of the program for the start that follows.
pub fn keep(cause: Cause) {
    write(cause);
    STATUS.store(UNTOLD, Relaxed);
}

fn write(cause: Cause) -> Failure {
    let activity = Activity::from_number(ACTIVITY.load(Relaxed));
    let failure = Failure::new(cause, TICKS.load(Relaxed), activity, read().as_ref());
    for (word, value) in RECORD.iter().zip(failure.encode()) {
        word.store(value, Relaxed);
    }
    failure
}

fn read() -> Option<Failure> {
    let mut words = [0; WORDS];
    for (word, kept) in words.iter_mut().zip(&RECORD) {
        *word = kept.load(Relaxed);
    }
    Failure::decode(&words)
}

/// The failure that has led to this start. It stays recorded, to see whether the next one comes soon; any
/// other start forgets it. To be called once.
pub fn at_start(reset: ResetReason) -> Option<Failure> {
    let untold = STATUS.load(Relaxed) == UNTOLD;
    let failure = match (reset, read()) {
        // The watchdog may come while a host still reads why.
        (ResetReason::Software | ResetReason::Watchdog, Some(failure)) if untold => Some(failure),
        (ResetReason::Watchdog, _) => {
            let behind = TICKS
                .load(Relaxed)
                .wrapping_sub(TELEMETRY_RAN_AT.load(Relaxed));
            let task = match behind > LATE_TICKS {
                true => Task::Telemetry,
                false => Task::Control,
            };
            Some(write(Cause::Watchdog { task }))
        }
        _ => None,
    };
    if failure.is_none() {
        forget();
    }
    for word in [&STATUS, &TICKS, &ACTIVITY, &TELEMETRY_RAN_AT] {
        word.store(0, Relaxed);
    }
    failure
}

/// Nothing has failed.
pub fn forget() {
    for word in &RECORD {
        word.store(0, Relaxed);
    }
}

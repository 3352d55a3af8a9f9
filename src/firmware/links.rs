//! Everything that one task has for another. The control task writes here, and never waits.

use core::sync::atomic::{AtomicBool, AtomicU32};

use embassy_executor::InterruptExecutor;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use softgrip::telemetry::{Event, Snapshot};
use softgrip::units::Instant;

/// An event with its number, which counts the lost ones too.
pub struct Numbered {
    pub number: u32,
    pub at: Instant,
    pub event: Event,
}

/// Four ticks that are as eventful as a tick can be.
const EVENTS_HELD: usize = 4 * softgrip::telemetry::EVENTS;

/// Runs the control task; polled by the board's spare interrupt.
pub static HIGH_PRIORITY: InterruptExecutor = InterruptExecutor::new();

/// The latest tick. The telemetry task takes it when it is due; a newer one replaces it.
pub static SNAPSHOT: Signal<CriticalSectionRawMutex, Snapshot> = Signal::new();

/// Every event. The telemetry task drains it as soon as it is not empty.
pub static EVENTS: Channel<CriticalSectionRawMutex, Numbered, EVENTS_HELD> = Channel::new();

/// Events that found no room since start-up. The telemetry task reads it.
pub static EVENTS_LOST: AtomicU32 = AtomicU32::new(0);

/// The longest tick since the last report, µs. The telemetry task takes it with every snapshot.
pub static LONGEST_TICK_US: AtomicU32 = AtomicU32::new(0);

/// The telemetry task has run. The control task clears it when it feeds the watchdog.
pub static TELEMETRY_RAN: AtomicBool = AtomicBool::new(false);

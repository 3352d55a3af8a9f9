//! Everything that one task has for another. The control task writes here, and never waits.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

use bus::robot::{Status, Wishes};
use embassy_executor::InterruptExecutor;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::spsc::{Consumer, Producer, Queue};
use softgrip::blackbox::{self, Memory};
use softgrip::settings::{Active, Calibration, FACTORY, Values};
use softgrip::telemetry::{Event, Snapshot};
use softgrip::units::{DacCode, FINGERS, Instant};
use softgrip::{Command, RawFrame};

/// An event with its number, which counts the lost ones too.
pub struct Numbered {
    pub number: u32,
    pub at: Instant,
    pub event: Event,
}

/// What the control task saw, what it did, and how it looks at things: with every tick of a run, the
/// run can be done again elsewhere, bit for bit.
pub struct Tick {
    pub frame: RawFrame,
    pub command: Command,
    pub dac: DacCode,
    pub snapshot: Snapshot,
}

/// Two ticks that are as eventful as a tick can be.
pub const EVENTS_HELD: usize = 2 * softgrip::telemetry::EVENTS;

/// Runs the control task; polled by the board's spare interrupt.
pub static HIGH_PRIORITY: InterruptExecutor = InterruptExecutor::new();

/// The latest tick. The telemetry task takes it when it is due; a newer one replaces it.
pub static TICK: Signal<CriticalSectionRawMutex, Tick> = Signal::new();

/// Every event, from the control task to the telemetry task, which drains it as soon as it is told.
/// None but for the first caller. Unlike a channel of embassy's it has no lock, and with it no panic.
pub fn events() -> Option<(Producer<'static, Numbered>, Consumer<'static, Numbered>)> {
    let queue = cortex_m::singleton!(
        EVENTS: Queue<Numbered, { EVENTS_HELD + 1 }> = Queue::new()
    );
    Some(queue?.split())
}

/// Something is in the queue of events. The telemetry task waits for it.
pub static EVENT_SENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Time between two snapshots, µs. What the settings say, until a debugger writes it; the telemetry task reads it. At 1000
/// every tick is sent, which is a recording; above 50 000 it counts as 50 000, so that the watchdog hears of
/// the task in time. `used`: the optimiser must not take it for a constant.
#[used]
pub static TELEMETRY_PERIOD_US: AtomicU32 = AtomicU32::new(20_000);

/// A debugger that writes 1 is told once more what runs here. The telemetry task reads and clears it.
#[used]
pub static TELL_IDENTITY: AtomicU32 = AtomicU32::new(0);

/// A debugger that writes 1 has the gauges tared. The control task reads and clears it.
#[used]
pub static TARE: AtomicU32 = AtomicU32::new(0);

/// A debugger that writes 1 has the mounted fingers learned in a free-bend sweep. The control task reads and clears it.
#[used]
pub static SWEEP: AtomicU32 = AtomicU32::new(0);

/// What a tare has measured, µε, from the control task to the storage task; a newer one replaces it.
pub static TARED: Signal<CriticalSectionRawMutex, [f32; FINGERS]> = Signal::new();

/// What a sweep has found, the same way.
pub static SWEPT: Signal<CriticalSectionRawMutex, Calibration> = Signal::new();

/// One of the two has come. The storage task waits for it.
pub static LEARNED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// What a request on the bus wants of the next ticks, from the bus task to the control task.
pub static WISHES: Signal<CriticalSectionRawMutex, Wishes> = Signal::new();

/// There is something. To ask the signal itself is to copy it.
pub static WISHES_SENT: AtomicBool = AtomicBool::new(false);

/// What the last of those ticks shows.
pub static STATUS: Signal<CriticalSectionRawMutex, Status> = Signal::new();

/// The settings in use, for tasks that do not come between one another; the factory's if none.
static VALUES: Mutex<CriticalSectionRawMutex, Cell<Option<Values>>> = Mutex::new(Cell::new(None));

/// What is in use.
pub fn values() -> Values {
    VALUES.lock(Cell::get).unwrap_or(FACTORY)
}

/// Uses others, once the control task has them as well.
pub fn set_values(values: Values) {
    VALUES.lock(|cell| cell.set(Some(values)));
}

/// They are to be stored. The storage task reads and clears it.
pub static SAVE: AtomicBool = AtomicBool::new(false);

/// They have been, or could not be: from the storage task to the bus task.
pub static STORED: Signal<CriticalSectionRawMutex, bool> = Signal::new();

/// Settings that the control task is to use from its next tick on, from the storage task.
pub static SETTINGS: Signal<CriticalSectionRawMutex, Active> = Signal::new();

/// There are some. To ask the signal itself is to copy them.
pub static SETTINGS_SENT: AtomicBool = AtomicBool::new(false);

/// Passes settings to the control task; newer ones replace them.
pub fn send_settings(active: Active) {
    SETTINGS.signal(active);
    SETTINGS_SENT.store(true, Relaxed);
}

/// The black box. The control task writes it, and nobody once something stands there.
#[unsafe(link_section = ".uninit.record")]
pub static BLACK_BOX: Memory = [const { AtomicU32::new(0) }; blackbox::WORDS];

/// What stands in it has been seen: it is to run again. The control task reads and clears it.
#[used]
pub static CLEAR_BLACK_BOX: AtomicU32 = AtomicU32::new(0);

/// Something has come to stand in it, or has been cleared. The storage task reads and clears it.
pub static BLACK_BOX_CHANGED: AtomicBool = AtomicBool::new(false);

/// Events that found no room since start-up. The telemetry task reads it.
pub static EVENTS_LOST: AtomicU32 = AtomicU32::new(0);

/// The longest tick since the last report, µs. The telemetry task takes it with every snapshot.
pub static LONGEST_TICK_US: AtomicU32 = AtomicU32::new(0);

/// The longest tick of the last whole second, µs. The telemetry task writes it and says it; a debugger reads
/// it without a host.
#[used]
pub static LONGEST_TICK_OF_SECOND_US: AtomicU32 = AtomicU32::new(0);

/// The telemetry task has run. The control task clears it when it feeds the watchdog.
pub static TELEMETRY_RAN: AtomicBool = AtomicBool::new(false);

//! The telemetry task: every event at once, and a numbered snapshot 50 times per second, or as often as a
//! debugger asks for, over RTT.
//!
//! A host that does not read costs nothing: what does not fit is dropped, and the numbers tell.

use core::sync::atomic::Ordering::Relaxed;

use embassy_time::{Duration, Instant, with_deadline};
use heapless::spsc::Consumer;
use softgrip::TICK_US;

use crate::links::{
    EVENT_SENT, EVENTS_LOST, LONGEST_TICK_US, Numbered, TELEMETRY_PERIOD_US, TELEMETRY_RAN, TICK,
};

/// More often than once per tick there is nothing new.
fn period() -> Duration {
    let micros = TELEMETRY_PERIOD_US.load(Relaxed);
    Duration::from_micros(u64::from(micros).max(TICK_US))
}

#[embassy_executor::task]
pub async fn run(mut events: Consumer<'static, Numbered>) -> ! {
    let mut number = 0u32;
    let mut due = Instant::now() + period();
    loop {
        while let Some(Numbered { number, at, event }) = events.dequeue() {
            defmt::info!("event {=u32} {}: {}", number, at, event);
        }
        if with_deadline(due, EVENT_SENT.wait()).await.is_ok() {
            continue;
        }
        due += period();
        TELEMETRY_RAN.store(true, Relaxed);
        if let Some(tick) = TICK.try_take() {
            number = number.wrapping_add(1);
            defmt::info!(
                "snapshot {=u32}: {}, from {} and {} to {}, longest tick {=u32} us, events lost {=u32}",
                number,
                tick.snapshot,
                tick.frame,
                tick.command,
                tick.dac,
                LONGEST_TICK_US.swap(0, Relaxed),
                EVENTS_LOST.load(Relaxed),
            );
        }
    }
}

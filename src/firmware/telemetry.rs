//! The telemetry task: every event at once, and a numbered snapshot 50 times per second, over RTT.
//!
//! A host that does not read costs nothing: what does not fit is dropped, and the numbers tell.

use core::sync::atomic::Ordering::Relaxed;

use embassy_time::{Duration, Instant, with_deadline};

use crate::links::{EVENTS, EVENTS_LOST, LONGEST_TICK_US, Numbered, SNAPSHOT, TELEMETRY_RAN};

const PERIOD: Duration = Duration::from_hz(50);

#[embassy_executor::task]
pub async fn run() -> ! {
    let mut number = 0u32;
    let mut due = Instant::now() + PERIOD;
    loop {
        if let Ok(Numbered { number, at, event }) = with_deadline(due, EVENTS.receive()).await {
            defmt::info!("event {=u32} {}: {}", number, at, event);
            continue;
        }
        due += PERIOD;
        TELEMETRY_RAN.store(true, Relaxed);
        if let Some(snapshot) = SNAPSHOT.try_take() {
            number = number.wrapping_add(1);
            defmt::info!(
                "snapshot {=u32}: {}, longest tick {=u32} us, events lost {=u32}",
                number,
                snapshot,
                LONGEST_TICK_US.swap(0, Relaxed),
                EVENTS_LOST.load(Relaxed),
            );
        }
    }
}

//! The telemetry task: every event at once, and a numbered record of a tick 50 times per second, or as often as a
//! debugger asks for, over RTT.
//!
//! A host that does not read costs nothing: what does not fit is dropped, and the numbers tell.

use core::sync::atomic::Ordering::Relaxed;

use embassy_time::{Duration, Instant, with_deadline};
use heapless::spsc::Consumer;
use softgrip::TICK_US;
use softgrip::telemetry::Record;

use crate::board::Clock;
use crate::identity::{self, Identity};
use crate::links::{
    EVENT_SENT, EVENTS_LOST, LONGEST_TICK_OF_SECOND_US, LONGEST_TICK_US, Numbered,
    TELEMETRY_PERIOD_US, TELEMETRY_RAN, TELL_IDENTITY, TICK,
};
use crate::record;

/// The watchdog's time may be as short as 68 ms, and a tick feeds it only after this task has run.
const LONGEST_PERIOD_US: u64 = 50_000;

const HALF_A_TICK: Duration = Duration::from_micros(TICK_US / 2);

/// More often than once per tick there is nothing new.
fn period() -> Duration {
    let micros = u64::from(TELEMETRY_PERIOD_US.load(Relaxed));
    Duration::from_micros(micros.clamp(TICK_US, LONGEST_PERIOD_US))
}

/// The longest tick, second by second.
struct Second {
    ends: Instant,
    longest_us: u32,
}

impl Second {
    const LENGTH: Duration = Duration::from_secs(1);

    fn add(&mut self, longest_us: u32) {
        self.longest_us = self.longest_us.max(longest_us);
        if Instant::now() < self.ends {
            return;
        }
        self.ends += Self::LENGTH;
        LONGEST_TICK_OF_SECOND_US.store(self.longest_us, Relaxed);
        defmt::info!("longest tick of the last second {=u32} us", self.longest_us);
        // Whoever comes later is to know soon whether he reads what runs.
        identity::tell_build();
        self.longest_us = 0;
    }
}

#[embassy_executor::task]
pub async fn run(mut events: Consumer<'static, Numbered>, identity: Identity) -> ! {
    let mut number = 0u32;
    let mut second = Second {
        ends: Instant::now() + Second::LENGTH,
        longest_us: 0,
    };
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
        record::told();
        if TELL_IDENTITY.swap(0, Relaxed) != 0 {
            identity.tell();
        }
        let longest_us = LONGEST_TICK_US.swap(0, Relaxed);
        second.add(longest_us);
        if let Some(tick) = TICK.try_take() {
            if number == 0 {
                // Between two ticks from now on, so that the clock does not come into one.
                let began = Instant::from_micros(tick.snapshot.now.micros());
                due = began + period() + HALF_A_TICK;
            }
            number = number.wrapping_add(1);
            let record = Record {
                number,
                longest_tick_us: longest_us,
                events_lost: EVENTS_LOST.load(Relaxed),
                internal_clock: identity.clock == Clock::Internal,
                frame: tick.frame,
                command: tick.command,
                dac: tick.dac,
                snapshot: tick.snapshot,
            };
            let mut bytes = [0; Record::BYTES];
            defmt::info!("record {=[u8]}", record.encode(&mut bytes));
        }
    }
}

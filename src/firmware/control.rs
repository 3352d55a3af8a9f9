//! The control task: board → controller → board, once per millisecond, above every other task.
//!
//! It owns all that it uses, waits for nothing but its ticker and logs nothing.

use core::sync::atomic::Ordering::Relaxed;

use embassy_time::{Duration, Instant, Ticker};
use softgrip::inputs::Inputs;
use softgrip::telemetry::Events;
use softgrip::{Controller, TICK_US};

use crate::board::Board;
use crate::links::{EVENTS, EVENTS_LOST, LONGEST_TICK_US, Numbered, SNAPSHOT, TELEMETRY_RAN};

#[embassy_executor::task]
pub async fn run(mut board: Board, mut controller: Controller) -> ! {
    let mut inputs = Inputs::new();
    let mut numbering = Numbering::default();
    let mut scan = board.converter.start();
    let mut ticker = Ticker::every(Duration::from_micros(TICK_US));
    board.watchdog.unleash();
    loop {
        ticker.next().await;
        let began = Instant::now();
        let now = softgrip::units::Instant::from_micros(began.as_micros());

        let frame = scan.frame();
        if frame.overrun {
            // An overrun stops the transfer in the middle of a scan: start again at channel one.
            drop(scan);
            scan = board.converter.start();
        }
        let command = inputs.step(board.inputs.levels());
        let outputs = controller.step(now, &frame, command);
        board.regulator.set(outputs.dac);
        board.indicators.set(outputs.indicators);

        SNAPSHOT.signal(outputs.snapshot);
        numbering.send(now, &outputs.events);
        LONGEST_TICK_US.fetch_max(began.elapsed().as_micros() as u32, Relaxed);
        // Only a tick gets here, so the watchdog is fed when both tasks are alive.
        if TELEMETRY_RAN.swap(false, Relaxed) {
            board.watchdog.pet();
        }
    }
}

/// The number of the last event.
#[derive(Default)]
struct Numbering(u32);

impl Numbering {
    fn send(&mut self, at: softgrip::units::Instant, events: &Events) {
        for &event in events.iter() {
            self.0 = self.0.wrapping_add(1);
            let number = self.0;
            if EVENTS.try_send(Numbered { number, at, event }).is_err() {
                EVENTS_LOST.fetch_add(1, Relaxed);
            }
        }
        let lost = u32::from(events.lost());
        self.0 = self.0.wrapping_add(lost);
        EVENTS_LOST.fetch_add(lost, Relaxed);
    }
}

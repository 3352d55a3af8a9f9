//! The control task: board → controller → board, once per millisecond, above every other task.
//!
//! It owns all that it uses, waits for nothing but its ticker and logs nothing.

use core::sync::atomic::Ordering::Relaxed;

use bus::robot::Link;
use embassy_time::{Duration, Instant, Ticker};
use heapless::spsc::Producer;
use softgrip::blackbox::Recorder;
use softgrip::inputs::Inputs;
use softgrip::telemetry::{Event, Events};
use softgrip::{Command, Controller, RawFrame, TICK_US};

use crate::board::{self, Board, Clock, IndicatorPins, InputPins, Regulator};
use crate::links::{
    BLACK_BOX_CHANGED, CLEAR_BLACK_BOX, EVENT_SENT, EVENTS_HELD, EVENTS_LOST, LEARNED,
    LONGEST_TICK_US, Numbered, SETTINGS, SETTINGS_SENT, STATUS, SWEEP, SWEPT, TARE, TARED,
    TELEMETRY_RAN, TICK, Tick, WISHES, WISHES_SENT,
};
use crate::{links, record};

#[embassy_executor::task]
pub async fn run(
    board: Board,
    controller: &'static mut Controller,
    clock: Clock,
    events: Producer<'static, Numbered>,
    black_box: Recorder,
) -> ! {
    let mut converter = board.converter;
    let mut control = Control {
        inputs: board.inputs,
        debounced: Inputs::new(),
        controller,
        regulator: board.regulator,
        indicators: board.indicators,
        events,
        black_box,
        bus: Link::new(),
        number: 0,
    };
    if clock == Clock::Internal {
        let mut events = Events::new();
        events.add(Event::ClockInternal);
        control.send(now(Instant::now()), &events);
    }
    let mut ticker = Ticker::every(Duration::from_micros(TICK_US));
    board::feed_watchdog();
    loop {
        ticker.next().await;
        let began = Instant::now();
        let frame = converter.frame();
        control.tick(began, frame);
    }
}

/// A moment as the controller takes it.
pub fn now(moment: Instant) -> softgrip::units::Instant {
    softgrip::units::Instant::from_micros(moment.as_micros())
}

/// All that a tick uses but the converter.
struct Control {
    inputs: InputPins,
    debounced: Inputs,
    controller: &'static mut Controller,
    regulator: Regulator,
    indicators: IndicatorPins,
    events: Producer<'static, Numbered>,
    black_box: Recorder,
    bus: Link,
    /// The number of the last event.
    number: u32,
}

impl Control {
    // Never inlined, so that what it can reach can be read off the image: no panic.
    #[inline(never)]
    fn tick(&mut self, began: Instant, frame: RawFrame) {
        let now = now(began);
        if SETTINGS_SENT.swap(false, Relaxed) {
            self.apply_settings();
        }
        let levels = self.controller.active().io().on(self.inputs.levels());
        if WISHES_SENT.swap(false, Relaxed)
            && let Some(wishes) = WISHES.try_take()
        {
            self.bus.ask(wishes);
        }
        let command = match self.debounced.step(levels) {
            Command::Continue if TARE.swap(0, Relaxed) != 0 => Command::Tare,
            Command::Continue if SWEEP.swap(0, Relaxed) != 0 => Command::Sweep,
            pins => self.bus.command(pins),
        };
        let outputs = self.controller.step(now, &frame, command);
        self.regulator.set(outputs.dac);
        self.indicators
            .set(outputs.indicators, self.controller.active().io());

        if let Some(status) = self.bus.ticked(self.controller, &outputs) {
            STATUS.signal(status);
        }
        record::ticked(&outputs.snapshot.state);
        TICK.signal(Tick {
            frame,
            command,
            dac: outputs.dac,
            snapshot: outputs.snapshot,
        });
        self.send(now, &outputs.events);
        if CLEAR_BLACK_BOX.swap(0, Relaxed) != 0 {
            self.black_box.clear();
            self.keep_black_box();
        }
        if self.black_box.step(&frame, outputs.dac) {
            self.keep_black_box();
        }
        let took_us = Instant::now().as_micros().saturating_sub(began.as_micros());
        LONGEST_TICK_US.fetch_max(took_us as u32, Relaxed);
        // Only a tick gets here, so the watchdog is fed when both tasks are alive.
        if TELEMETRY_RAN.swap(false, Relaxed) {
            board::feed_watchdog();
        }
    }

    #[inline(never)]
    fn apply_settings(&mut self) {
        if let Some(active) = SETTINGS.try_take()
            && self.controller.apply(active).is_err()
        {
            // Once the gripper is idle.
            links::send_settings(active);
        }
    }

    /// What stands in the black box is to be stored, or that nothing does.
    fn keep_black_box(&self) {
        BLACK_BOX_CHANGED.store(true, Relaxed);
        LEARNED.signal(());
    }

    #[inline(never)]
    fn pass_calibration(&mut self) {
        if let Some(found) = self.controller.take_calibration() {
            SWEPT.signal(found);
            LEARNED.signal(());
        }
    }

    /// Passes a tick's events on, and counts what finds no room.
    fn send(&mut self, at: softgrip::units::Instant, events: &Events) {
        for &event in events.iter() {
            self.black_box.report(at, &event);
            match event {
                Event::Tared => {
                    TARED.signal(self.controller.tare_ue());
                    LEARNED.signal(());
                }
                Event::Swept { .. } => self.pass_calibration(),
                _ => {}
            }
            self.number = self.number.wrapping_add(1);
            let number = self.number;
            // The first always holds: it tells the compiler that the queue does not divide by zero.
            let sent = self.events.capacity() <= EVENTS_HELD
                && self.events.enqueue(Numbered { number, at, event }).is_ok();
            if !sent {
                EVENTS_LOST.fetch_add(1, Relaxed);
            }
            EVENT_SENT.signal(());
        }
        let lost = u32::from(events.lost());
        self.number = self.number.wrapping_add(lost);
        EVENTS_LOST.fetch_add(lost, Relaxed);
    }
}

//! The bus task: bytes from the line → requests → the control task, and its status → the reply.
//!
//! Below the control task, which it asks for one status per request and never holds up.

use core::sync::atomic::Ordering::Relaxed;

use bus::modbus::{Receiver, Reply, Timing};
use bus::robot::{Robot, Status, Work};
use embassy_time::{Instant, Timer, with_deadline};
use softgrip::io::BusSettings;
use softgrip::settings::{Active, Values};
use softgrip::table::FINGER;

use crate::board::Serial;
use crate::control::now;
use crate::links::{
    self, BLACK_BOX, CLEAR_BLACK_BOX, LEARNED, SAVE, STATUS, STORED, WISHES, WISHES_SENT,
};

/// A slave on the line.
struct Slave {
    robot: Robot,
    receiver: Receiver,
    timing: Timing,
    reply: Reply,
    serial: Serial,
}

/// What is to be done.
enum Next {
    /// The reply is to be sent.
    Reply,
    /// The control task is to be waited for.
    Ask,
}

impl Slave {
    fn new(mut serial: Serial, settings: BusSettings) -> Self {
        let baud = settings.baud.bits_per_s();
        serial.start(baud);
        let timing = Timing::line(baud);
        Self {
            robot: Robot::new(settings.id, &FINGER, &BLACK_BOX),
            receiver: Receiver::new(settings.id, timing),
            timing,
            reply: Reply::new(),
            serial,
        }
    }

    /// Takes what has come, up to the next request.
    // Never inlined, as the next one, so that what it can reach can be read off the image: no panic.
    #[inline(never)]
    fn take(&mut self, at: softgrip::units::Instant) -> Option<Next> {
        loop {
            let byte = self.serial.received();
            if let Some(byte) = byte {
                self.receiver.receive(at, byte);
            }
            if let Some(frame) = self.receiver.frame(at) {
                let mut values = links::values();
                let work = self.robot.request(at, &frame, &mut values, &mut self.reply);
                return Some(match work {
                    Some(work) => {
                        pass(&work, values);
                        Next::Ask
                    }
                    None => Next::Reply,
                });
            }
            byte?;
        }
    }

    /// Makes the reply to the request that waits.
    #[inline(never)]
    fn answer(&mut self, at: softgrip::units::Instant, status: &Status) {
        if let Some(good) = STORED.try_take() {
            self.robot.stored(good);
        }
        let damaged = self.receiver.damaged();
        self.robot
            .answer(at, status, damaged, &links::values(), &mut self.reply);
    }
}

/// Passes what a request wants to the other tasks.
fn pass(work: &Work, values: Values) {
    if work.settings_changed
        && let Ok(active) = Active::of(&values, &FINGER)
    {
        links::set_values(values);
        links::send_settings(active);
    }
    if work.save {
        STORED.reset();
        SAVE.store(true, Relaxed);
        LEARNED.signal(());
    }
    if work.clear_black_box {
        CLEAR_BLACK_BOX.store(1, Relaxed);
    }
    STATUS.reset();
    WISHES.signal(work.wishes);
    WISHES_SENT.store(true, Relaxed);
}

/// So much later. Other than a sum of embassy's it does not panic.
fn later(moment: Instant, us: u64) -> Instant {
    Instant::from_micros(moment.as_micros().wrapping_add(us))
}

#[embassy_executor::task]
pub async fn run(serial: Serial, settings: BusSettings) -> ! {
    let mut slave = Slave::new(serial, settings);
    let silence_us = u64::from(slave.timing.silence_us());
    loop {
        if slave.receiver.has_begun() {
            // What ends with a silence only is looked at again after it.
            let _ = with_deadline(later(Instant::now(), silence_us), slave.serial.silence()).await;
        } else {
            slave.serial.silence().await;
        }
        let came = Instant::now();
        let at = now(came);
        while let Some(next) = slave.take(at) {
            if matches!(next, Next::Ask) {
                let status = STATUS.wait().await;
                slave.answer(now(Instant::now()), &status);
            }
            // The master listens this long after its request at the latest (Serial Line, 2.5.1.1).
            Timer::at(later(came, silence_us)).await;
            if !slave.reply.bytes().is_empty() {
                slave.serial.send(slave.reply.bytes()).await;
            }
        }
    }
}

//! Controller events with their time, as text.

use softgrip::FINGERS;
use softgrip::detect::{Loss, LossCause};
use softgrip::telemetry::Event;

/// An event at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedEvent {
    /// Seconds since the start; of a trace, by its own clock.
    pub t_s: f64,
    /// The controller's event.
    pub event: Event,
}

impl TimedEvent {
    /// The event as one line of text.
    pub fn words(&self) -> String {
        match self.event {
            Event::Contact { finger } => format!("finger {} touches", finger + 1),
            Event::Holding { touching } if touching.contains(&false) => {
                format!("holding with fingers {:?} alone", fingers(touching))
            }
            Event::Holding { .. } => "holding".into(),
            Event::Empty => "closed on nothing".into(),
            Event::Slip { rate } => {
                format!(
                    "SLIP: the grip changes by {:+.0} % per second",
                    100.0 * rate
                )
            }
            Event::Lost(loss) => format!(
                "LOST: the object is gone (since {:.3} s, {})",
                self.onset_s(&loss),
                cause(loss.cause)
            ),
            Event::Regripping => "closing harder to catch it".into(),
            Event::Released => "released".into(),
            Event::AirLoss => "AIR LOSS: the pressure is going".into(),
            Event::Fault { fault, finger } => match finger {
                Some(finger) => {
                    format!("FAULT {}: {fault:?}, finger {}", fault.code(), finger + 1)
                }
                None => format!("FAULT {}: {fault:?}", fault.code()),
            },
            Event::Refused(refusal) => format!("command refused: {refusal:?}"),
            Event::Regulator { delay_ms } => {
                format!("the regulator comes {delay_ms} ms behind its command, which is learned")
            }
            Event::Tared => "gauges zeroed".into(),
            Event::Swept { error_percent } => {
                format!("fingers learned within {error_percent:.1} % of full scale")
            }
            Event::TareDue => {
                "TARE DUE: a gauge's zero has moved, or something leans on a finger".into()
            }
            Event::Acknowledged => "acknowledged".into(),
            Event::ClockInternal => {
                "runs on its own oscillator: the external clock is missing, times are off by up to 8 %".into()
            }
        }
    }

    /// Onset of a loss that is reported now, s; the controller's clock counts from its own start.
    pub fn onset_s(&self, loss: &Loss) -> f64 {
        self.t_s - loss.latency_us() as f64 * 1e-6
    }
}

/// The fingers that are meant, counted from 1.
pub fn fingers(which: [bool; FINGERS]) -> Vec<usize> {
    (1..=FINGERS).filter(|finger| which[finger - 1]).collect()
}

/// Name of the cause of a loss, as in JSON.
pub fn cause(cause: LossCause) -> &'static str {
    match cause {
        LossCause::Collapse => "collapse",
        LossCause::OneSided => "one_sided",
        LossCause::Missing => "missing",
    }
}

/// Every event's name.
pub const NAMES: [&str; 16] = [
    "contact",
    "holding",
    "empty",
    "slip",
    "lost",
    "regripping",
    "released",
    "air_loss",
    "fault",
    "refused",
    "regulator",
    "tared",
    "swept",
    "tare_due",
    "acknowledged",
    "clock_internal",
];

/// The event's name on every wire, one of [`NAMES`].
pub fn name(event: &Event) -> &'static str {
    match event {
        Event::Contact { .. } => "contact",
        Event::Holding { .. } => "holding",
        Event::Empty => "empty",
        Event::Slip { .. } => "slip",
        Event::Lost(_) => "lost",
        Event::Regripping => "regripping",
        Event::Released => "released",
        Event::AirLoss => "air_loss",
        Event::Fault { .. } => "fault",
        Event::Refused(_) => "refused",
        Event::Regulator { .. } => "regulator",
        Event::Tared => "tared",
        Event::Swept { .. } => "swept",
        Event::TareDue => "tare_due",
        Event::ClockInternal => "clock_internal",
        Event::Acknowledged => "acknowledged",
    }
}

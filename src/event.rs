//! What the controller reports: events, which are not dropped without being counted.

use crate::command::Refusal;
use crate::detect::Loss;
use crate::fault::Fault;
use crate::units::FINGERS;

/// Something that happened in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A finger touched something while closing.
    Contact {
        /// Which one, from zero.
        finger: u8,
    },
    /// At least two fingers hold something.
    Holding {
        /// Which ones; a finger that is missing makes it a partial grasp.
        touching: [bool; FINGERS],
    },
    /// The fingers closed around nothing.
    Empty,
    /// The residual drifts at constant pressure: the object may be sliding.
    Slip {
        /// Change of the normalised residual, 1/s.
        rate: f32,
    },
    /// The object is gone.
    Lost(Loss),
    /// The pressure is raised, once, to catch what has been lost.
    Regripping,
    /// What was held has been let go on command.
    Released,
    /// The pressure is going.
    AirLoss,
    /// Something is wrong.
    Fault {
        /// What.
        fault: Fault,
        /// Which finger, if one.
        finger: Option<u8>,
    },
    /// A command was not carried out.
    Refused(Refusal),
    /// The pressure comes by this much behind the set-point, ms, and not by what the settings say; it is expected so
    /// from now on.
    Regulator {
        /// Lag, dead time and slew together.
        delay_ms: u16,
    },
    /// New gauge offsets are in use.
    Tared,
    /// A sweep has learned the mounted fingers; what it found is there to be taken.
    Swept {
        /// Largest difference between free fingers and what is now expected of them, percent of full scale.
        error_percent: f32,
    },
    /// The zero of a gauge has moved further than is tracked, or a finger seems to lean on something for
    /// long: a tare is asked for.
    TareDue,
    /// What was latched has been acknowledged.
    Acknowledged,
    /// The board's external clock is missing, and it runs on the chip's own oscillator. The firmware says it
    /// at its start; the controller never does.
    ClockInternal,
}

/// Events of one tick: three contacts or gauge faults, a fault and its cause, a state change, and
/// answers to one command fit.
pub const EVENTS: usize = 8;

/// The events of one tick, and how many found no room.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Events {
    list: heapless::Vec<Event, EVENTS>,
    lost: u8,
}

impl Events {
    /// None yet.
    pub const fn new() -> Self {
        Self {
            list: heapless::Vec::new(),
            lost: 0,
        }
    }

    /// Adds one, or counts it where there is no room.
    pub fn add(&mut self, event: Event) {
        if self.list.push(event).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// Events that found no room.
    pub fn lost(&self) -> u8 {
        self.lost
    }

    /// The events in their order.
    pub fn iter(&self) -> impl Iterator<Item = &Event> {
        self.list.iter()
    }
}

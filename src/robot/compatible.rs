//! The block that drivers for the Robotiq grippers know: what its bits want, and what they show.
//!
//! A go-to is an event, not a state: rGTO 0→1, another rPR, or an activation with rGTO set. The same registers
//! written again and again change nothing. Another rSP or rFR takes effect with the next go-to.

use super::link::{Fate, Status, Wish, Wishes};
use crate::command::{Command, Grip};
use crate::estimate::OPEN_KPA;
use crate::fault::Fault;
use crate::grasp::{Purpose, State};
use crate::math::{larger, smaller};
use crate::modbus::Exception;
use crate::table::{self, FingerTable};
use crate::units::{Degrees, Instant, Kilopascals};

// Bits of the action request, and of the gripper status.
const ACTIVATE: u8 = 1 << 0;
const GO_TO: u8 = 1 << 3;
const AUTOMATIC_RELEASE: u8 = 1 << 4;

/// Position requests up to this release: gPO shows no less for open fingers.
const OPEN: u8 = 3;
/// What gPO shows for closed ones, as on a 2F-85: drivers map 3 to 230 to their stroke.
const CLOSED: f32 = 230.0;

/// An activation shows for this long at least: a driver that polls ten times a second sees it …
const ACTIVATION_SHOWS_US: u64 = 100_000;
/// … and this long at most, whether the fingers are open or not: the shortest patience of a driver is 5 s.
const ACTIVATION_LIMIT_US: u64 = 3_000_000;

/// Slew at rSP 0, of that at 255.
const SLOWEST: f32 = 0.1;
/// Highest pressure at rFR 0, of that at 255: the default fingers meet at less, so they still grip.
const WEAKEST: f32 = 0.5;

/// Where the gripper is in the convention's eyes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Not activated.
    Reset,
    /// The fingers open.
    Activating { since: Instant },
    /// It obeys.
    Active,
    /// An automatic release is running.
    Releasing,
    /// It has been done; only an activation goes on from here.
    Released,
}

/// What the requests want, by bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Request {
    activate: bool,
    go_to: bool,
    release: bool,
    position: u8,
    speed: u8,
    force: u8,
}

impl Request {
    fn of([action, position, speed_force]: [u16; 3]) -> Self {
        let [action, _] = action.to_be_bytes();
        let [_, position] = position.to_be_bytes();
        let [speed, force] = speed_force.to_be_bytes();
        Self {
            activate: action & ACTIVATE != 0,
            go_to: action & GO_TO != 0,
            release: action & AUTOMATIC_RELEASE != 0,
            position,
            speed,
            force,
        }
    }
}

/// The fingers that the block drives.
#[derive(Debug, Clone, Copy)]
pub struct Fingers {
    /// Their table.
    pub table: &'static FingerTable,
    /// No grip goes above.
    pub limit: Kilopascals,
}

impl Fingers {
    /// Bend of a free finger where the table ends.
    pub fn full_bend(&self) -> Degrees {
        let last = self.table.rows.last();
        Degrees(last.map_or(0.0, |row| row.tip_angle_deg))
    }

    /// The pressure for a position and a force.
    fn pressure(&self, position: u8, force: u8) -> Kilopascals {
        let bend = Degrees(f32::from(position) / 255.0 * self.full_bend().0);
        let (pressure, _) = table::pressure_for_bend(self.table, bend);
        Kilopascals(smaller(pressure.0, share(WEAKEST, force) * self.limit.0))
    }
}

/// From `least` at 0 to 1 at 255.
fn share(least: f32, byte: u8) -> f32 {
    least + (1.0 - least) * f32::from(byte) / 255.0
}

/// The block's memory.
#[derive(Debug, Clone, Copy)]
pub struct Compatible {
    written: [u16; 3],
    /// rACT has been 0 since the start: a driver that only repeats what it wrote before a restart closes nothing.
    reset_seen: bool,
    phase: Phase,
    /// A go-to waits for the end of the activation.
    due: bool,
    /// The speed that the controller has; unknown after a command was dropped.
    speed: Option<u8>,
    /// When the loss that is latched was reported, …
    lost: Option<Instant>,
    /// … and that of the one which has been in an answer.
    shown: Option<Instant>,
}

impl Compatible {
    /// Not activated.
    pub const fn new() -> Self {
        Self {
            written: [0; 3],
            reset_seen: false,
            phase: Phase::Reset,
            due: false,
            speed: Some(u8::MAX),
            lost: None,
            shown: None,
        }
    }

    /// What was written to one of the three registers.
    pub fn written(&self, place: usize) -> u16 {
        self.written.get(place).copied().unwrap_or_default()
    }

    /// Whether the gripper obeys the block.
    pub fn is_active(&self) -> bool {
        self.phase == Phase::Active
    }
}

//! What a robot on the bus sees of the gripper and wants of it: two blocks of registers, and the settings.
//!
//! ```text
//! request ─► Robot::request ─► Wishes ─► Link::command ─► one command a tick ─► Controller::step
//! reply ◄─── Robot::answer ◄── Status ◄─ Link::ticked ◄── outputs of the tick of the last of them
//! ```
//!
//! [`Robot`] belongs to whoever has the line, [`Link`] to the control tick; [`Wishes`] and [`Status`] go between them.
//! A request without a command is answered with the status of the next tick. A write shows in its own answer.

mod compatible;
mod link;
mod numbers;
mod own;
mod registers;

pub use link::{Fate, Link, Record, Status, Wish, Wishes};
pub use registers::{Access, MAP_VERSION, REGISTERS, Register};

use compatible::Compatible;
use own::Own;

use crate::modbus::{Exception, Frame, Range, Reply};
use crate::settings::Values;
use crate::table::FingerTable;
use crate::units::Instant;

/// What a request asks for before it is answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// What the control tick is to do, for [`Link::ask`].
    pub wishes: Wishes,
    /// The settings have been changed: they are to be used from the next tick on
    /// ([`Controller::apply`](crate::Controller::apply)).
    pub settings_changed: bool,
    /// The settings are to be stored; [`Robot::stored`] tells what has become of it.
    pub save: bool,
}

/// The request that waits for its answer.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    since: Instant,
    is_broadcast: bool,
    code: u8,
    write_address: u16,
    write_count: u16,
    read: Range,
}

/// What a robot sees and wants.
#[derive(Debug, Clone, Copy)]
pub struct Robot {
    id: u8,
    table: &'static FingerTable,
    compatible: Compatible,
    own: Own,
    waiting: Option<Waiting>,
}

impl Robot {
    /// Nobody has said anything, to the slave with this id.
    pub const fn new(id: u8, table: &'static FingerTable) -> Self {
        Self {
            id,
            table,
            compatible: Compatible::new(),
            own: Own::new(),
            waiting: None,
        }
    }

    /// Takes a request that came at `now`, and the settings in use, which it may change. A request that waits for its
    /// answer is given up.
    ///
    /// Some work: [`Robot::answer`] is to be called with the status after it. None: `reply` is to be sent at once; it is
    /// an exception, and nothing has been changed, or empty, where nobody is to be answered.
    pub fn request(
        &mut self,
        now: Instant,
        frame: &Frame,
        values: &mut Values,
        reply: &mut Reply,
    ) -> Option<Work> {
        self.waiting = None;
        let _ = (now, self.table, &self.own, values);
        reply.except(self.id, frame.code, Exception::DeviceFailure);
        None
    }

    /// Writes the reply to the request that waits: with the status of the tick that has done the last of its work.
    /// `damaged`: [`Receiver::damaged`](crate::modbus::Receiver::damaged). The reply is empty where nobody is to be
    /// answered, and where it would come later than [`STALE_US`](crate::modbus::STALE_US) after the request.
    pub fn answer(
        &mut self,
        now: Instant,
        status: &Status,
        damaged: u16,
        values: &Values,
        reply: &mut Reply,
    ) {
        let _ = (now, status, damaged, values, reply, &self.compatible);
    }

    /// The settings have been stored, or could not be.
    pub fn stored(&mut self, good: bool) {
        let _ = good;
    }
}

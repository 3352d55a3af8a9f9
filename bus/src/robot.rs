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

pub use link::{Fate, Link, Record, Status, Wishes};
pub use numbers::{DETAILS, REFUSALS, of_cause};
pub use registers::{
    Access, BLACK_BOX_FROM, FINGERS_IN_A_ROW, FOURTH, FOURTH_FROM, Item, MAP_VERSION, REGISTERS,
    Register, SETTINGS_FROM, Shape, address,
};

use compatible::{Compatible, Fingers};
use own::{Act, Own};
use registers::{At, Half};

use crate::modbus::{Exception, Frame, Function, Range, Reply, Request, STALE_US};
use softgrip::blackbox::{self, Memory, Phase};
use softgrip::command::Command;
use softgrip::grasp::State;
use softgrip::settings::Values;
use softgrip::table::FingerTable;
use softgrip::units::{Instant, Kilopascals};

/// The number of the setting `regulator.max_pressure_kpa`.
const MAX_PRESSURE: u16 = 100;

/// What a request asks for before it is answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// What the control tick is to do, for [`Link::ask`].
    pub wishes: Wishes,
    /// The settings have been changed: they are to be used from the next tick on
    /// ([`Controller::apply`](softgrip::Controller::apply)).
    pub settings_changed: bool,
    /// The settings are to be stored; [`Robot::stored`] tells what has become of it.
    pub save: bool,
    /// The black box has been seen: it is to run again ([`Recorder::clear`](softgrip::blackbox::Recorder::clear)).
    pub clear_black_box: bool,
}

/// The request that waits for its answer.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    since: Instant,
    is_broadcast: bool,
    code: u8,
    /// What is echoed of a write: address, and value or count.
    echo: [u16; 2],
    read: Range,
}

/// Where a request writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Write {
    Nothing,
    Compatible { place: u16 },
    Own,
    Settings,
}

/// What a robot sees and wants.
#[derive(Debug, Clone, Copy)]
pub struct Robot {
    id: u8,
    table: &'static FingerTable,
    black_box: &'static Memory,
    compatible: Compatible,
    own: Own,
    /// In the last status a sweep was running.
    sweeps: bool,
    waiting: Option<Waiting>,
}

impl Robot {
    /// Nobody has said anything, to the slave with this id.
    pub const fn new(id: u8, table: &'static FingerTable, black_box: &'static Memory) -> Self {
        Self {
            id,
            table,
            black_box,
            compatible: Compatible::new(),
            own: Own::new(),
            sweeps: false,
            waiting: None,
        }
    }

    /// Takes a request that came at `now`, and the settings in use, which it may change. While another one waits for its
    /// answer it is refused as busy, up to [`STALE_US`]: what that one wants must not be lost.
    ///
    /// Some work: [`Robot::answer`] is to be called with the status after it, also for a broadcast. None: `reply` is to
    /// be sent at once; it is an exception, and nothing has been changed, or empty, where nobody is to be answered.
    pub fn request(
        &mut self,
        now: Instant,
        frame: &Frame,
        values: &mut Values,
        reply: &mut Reply,
    ) -> Option<Work> {
        reply.clear();
        let mut work = Work {
            wishes: Wishes::NONE,
            settings_changed: false,
            save: false,
            clear_black_box: false,
        };
        let taken = match frame.request {
            Ok(_) if self.is_busy(now) => Err(Exception::Busy),
            Ok(request) => self.take(now, frame.is_broadcast, &request, values, &mut work),
            Err(exception) => Err(exception),
        };
        self.own.count(taken.is_ok());
        if let (Err(exception), false) = (taken, frame.is_broadcast) {
            reply.except(self.id, frame.code, exception);
        }
        taken.is_ok().then_some(work)
    }

    fn is_busy(&self, now: Instant) -> bool {
        let waiting = self.waiting.as_ref();
        waiting.is_some_and(|waiting| now.micros_since(waiting.since) <= STALE_US)
    }

    /// Carries a request out, all of it or nothing.
    fn take(
        &mut self,
        now: Instant,
        is_broadcast: bool,
        request: &Request,
        values: &mut Values,
        work: &mut Work,
    ) -> Result<(), Exception> {
        let fingers = self.fingers(values);
        let write = self.check(request, values, &fingers)?;
        match write {
            Write::Nothing => {}
            Write::Compatible { place } => {
                let written = request.values.iter();
                let compatible = &mut self.compatible;
                if compatible.write(now, place, written, &fingers, &mut work.wishes) {
                    self.own.acknowledge();
                }
            }
            Write::Own => self.write_own(request, work),
            Write::Settings => {
                *values = self.set(request, *values)?;
                self.own.changed = true;
                work.settings_changed = true;
            }
        }
        self.compatible.go_if_due(&fingers, &mut work.wishes);
        if work.wishes.is_empty() {
            work.wishes.add(Command::Alive);
        }
        let first = request.values.iter().next().unwrap_or_default();
        self.waiting = Some(Waiting {
            since: now,
            is_broadcast,
            code: request.function as u8,
            echo: match request.function {
                Function::WriteOne => [request.write_address, first],
                _ => [request.write_address, request.values.count()],
            },
            read: request.read,
        });
        Ok(())
    }

    /// Writes to the own block.
    fn write_own(&mut self, request: &Request, work: &mut Work) {
        for (address, value) in request.written() {
            if let Some(At::Item(item, _)) = registers::find(address) {
                self.own.write(item, value);
            }
        }
        // A command takes what the same request has written behind it, too.
        for (address, _) in request.written() {
            if let Some(At::Item(item, _)) = registers::find(address) {
                match self.own.act(item, &mut work.wishes) {
                    Act::Nothing => {}
                    Act::Save => work.save = true,
                    Act::ClearBlackBox => work.clear_black_box = true,
                }
                if item == Item::Command && !work.wishes.is_empty() {
                    self.compatible.stay();
                }
            }
        }
    }

    /// Checks all of a request but the values of settings, and says where it writes.
    fn check(
        &self,
        request: &Request,
        values: &Values,
        fingers: &Fingers,
    ) -> Result<Write, Exception> {
        for address in request.read.addresses() {
            match registers::find(address) {
                Some(At::Item(..) | At::BlackBox(..)) => {}
                Some(At::Setting(number, _)) if values.get(number).is_some() => {}
                _ => return Err(Exception::IllegalAddress),
            }
        }
        if request.values.count() == 0 {
            return Ok(Write::Nothing);
        }
        let write = match registers::find(request.write_address) {
            Some(At::Item(Item::Action, _)) => Write::Compatible { place: 0 },
            Some(At::Item(Item::Position, _)) => Write::Compatible { place: 1 },
            Some(At::Item(Item::SpeedForce, _)) => Write::Compatible { place: 2 },
            Some(At::Item(..)) => Write::Own,
            // Half a value is none.
            Some(At::Setting(_, Half::Upper)) if request.values.count().is_multiple_of(2) => {
                Write::Settings
            }
            Some(At::Setting(..) | At::BlackBox(..)) | None => {
                return Err(Exception::IllegalAddress);
            }
        };
        for (address, value) in request.written() {
            match (write, registers::find(address)) {
                (Write::Compatible { .. }, Some(At::Item(item, _)))
                    if item.access() == Access::ReadWrite => {}
                (Write::Own, Some(At::Item(item, _))) => Own::check(item, value, fingers)?,
                (Write::Settings, Some(At::Setting(number, _))) if values.get(number).is_some() => {
                }
                _ => return Err(Exception::IllegalAddress),
            }
        }
        Ok(write)
    }

    /// The settings with what a request writes of them.
    fn set(&self, request: &Request, mut values: Values) -> Result<Values, Exception> {
        // A sweep would be judged by other settings than it began with.
        if self.sweeps {
            return Err(Exception::Busy);
        }
        let mut upper = 0;
        for (address, value) in request.written() {
            match registers::find(address) {
                Some(At::Setting(_, Half::Upper)) => upper = value,
                Some(At::Setting(number, Half::Lower)) => {
                    let bits = u32::from(upper) << 16 | u32::from(value);
                    let set = values.set(number, f32::from_bits(bits));
                    set.map_err(|_| Exception::IllegalValue)?;
                }
                _ => return Err(Exception::IllegalAddress),
            }
        }
        match values.first_problem(self.table.max_pressure_kpa) {
            None => Ok(values),
            Some(_) => Err(Exception::IllegalValue),
        }
    }

    /// Writes the reply to the request that waits: with the status of the tick that has done the last of its work.
    /// `damaged`: [`Receiver::damaged`](crate::modbus::Receiver::damaged). The reply is empty where nobody is to be
    /// answered, and where it would come later than [`STALE_US`] after the request.
    pub fn answer(
        &mut self,
        now: Instant,
        status: &Status,
        damaged: u16,
        values: &Values,
        reply: &mut Reply,
    ) {
        reply.clear();
        self.sweeps = matches!(status.snapshot.state, State::Sweeping { .. });
        self.compatible.observe(status);
        self.own.observe(status);
        let is_late = !self.is_busy(now);
        let Some(waiting) = self.waiting.take() else {
            return;
        };
        if is_late || waiting.is_broadcast {
            return;
        }
        reply.begin(self.id, waiting.code);
        if waiting.read.count > 0 {
            reply.byte((waiting.read.count << 1) as u8);
            let fingers = self.fingers(values);
            for address in waiting.read.addresses() {
                let word = match registers::find(address) {
                    Some(At::Item(item, offset)) => {
                        self.shows(item, offset, status, damaged, &fingers)
                    }
                    Some(At::Setting(number, half)) => {
                        let bits = values.get(number).unwrap_or_default().to_bits();
                        half.of(bits)
                    }
                    Some(At::BlackBox(word, half)) => half.of(blackbox::load(self.black_box, word)),
                    None => 0,
                };
                reply.word(word);
            }
        } else {
            let [address, value] = waiting.echo;
            reply.word(address);
            reply.word(value);
        }
        reply.finish();
    }

    /// The register with this offset in the item's row.
    fn shows(
        &mut self,
        item: Item,
        offset: u16,
        status: &Status,
        damaged: u16,
        fingers: &Fingers,
    ) -> u16 {
        let compatible = &mut self.compatible;
        match item {
            Item::Action => compatible.written(0),
            Item::Position => compatible.written(1),
            Item::SpeedForce => compatible.written(2),
            Item::Status => compatible.shows(0, status, fingers),
            Item::FaultEcho => compatible.shows(1, status, fingers),
            Item::PositionPressure => compatible.shows(2, status, fingers),
            Item::Activated => compatible.is_active().into(),
            Item::Damaged => damaged,
            Item::BlackBox => (blackbox::load(self.black_box, 0) == Phase::Stands as u32).into(),
            _ => self.own.shows(item, offset, status, fingers),
        }
    }

    /// The settings have been stored, or could not be.
    pub fn stored(&mut self, good: bool) {
        self.own.changed = !good;
    }

    fn fingers(&self, values: &Values) -> Fingers {
        Fingers {
            table: self.table,
            limit: Kilopascals(values.get(MAX_PRESSURE).unwrap_or_default()),
        }
    }
}

//! The bus in the control tick: one of its commands at a time, after what the digital inputs want.

use softgrip::command::{Answer, Command, Refusal};
use softgrip::controller::{Controller, Outputs};
use softgrip::detect::Loss;
use softgrip::event::{Event, Events};
use softgrip::fault::GaugeFault;
use softgrip::telemetry::Snapshot;
use softgrip::units::{FINGERS, Instant};

/// One request leads to no more commands: an acknowledgement, a speed, a grip or a release.
const MOST_WISHES: usize = 3;

/// What one request wants of the next ticks: one command in each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wishes {
    /// First, the loss that was reported at this moment is acknowledged, unless it is no longer latched, or a fault is.
    lost: Option<Instant>,
    /// In this order; [`Command::Continue`] is none.
    commands: [Command; MOST_WISHES],
}

impl Wishes {
    /// Nothing.
    pub const NONE: Self = Self {
        lost: None,
        commands: [Command::Continue; MOST_WISHES],
    };

    /// Appends a command. There is room for what any request wants.
    pub fn add(&mut self, command: Command) {
        let mut places = self.commands.iter_mut();
        if let Some(place) = places.find(|place| matches!(place, Command::Continue)) {
            *place = command;
        }
    }

    /// Before all commands, an acknowledgement of the loss that was reported at this moment.
    pub fn acknowledge(&mut self, lost: Instant) {
        self.lost = Some(lost);
    }

    /// Whether nothing is wanted any more.
    pub fn is_empty(&self) -> bool {
        let mut commands = self.commands.iter();
        self.lost.is_none() && commands.all(|command| matches!(command, Command::Continue))
    }

    /// The next command, where this loss could be acknowledged.
    fn take(&mut self, lost: Option<Instant>) -> Command {
        if let Some(wanted) = self.lost.take() {
            return match lost == Some(wanted) {
                true => Command::Acknowledge,
                false => Command::Continue,
            };
        }
        let mut places = self.commands.iter_mut();
        let place = places.find(|place| !matches!(place, Command::Continue));
        place.map_or(Command::Continue, |place| {
            core::mem::replace(place, Command::Continue)
        })
    }

    /// Leaves out what is void where the digital inputs want `pins`: a stop drops all, a release what would close the
    /// fingers, and any command says that somebody is there. True if something is dropped that would have been done.
    fn drop(&mut self, pins: Command) -> bool {
        let stops = matches!(pins, Command::Stop);
        let mut dropped = stops && self.lost.take().is_some();
        for place in &mut self.commands {
            let (is_void, counts) = match place {
                Command::Continue | Command::Alive => (true, false),
                Command::Grip(_) | Command::Sweep => {
                    (stops || matches!(pins, Command::Release), true)
                }
                _ => (stops, true),
            };
            if is_void {
                *place = Command::Continue;
                dropped |= counts;
            }
        }
        dropped
    }
}

/// What has become of a request's commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// The last is being carried out.
    Accepted,
    /// The last asks for what is being done already.
    Unchanged,
    /// One is not carried out.
    Refused(Refusal),
    /// A stop, or a release by the digital inputs, came before one of them.
    Dropped,
}

/// What has happened since the start, for those who look now and then. The numbers wrap.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Record {
    /// Holds that were recognised.
    pub holds: u16,
    /// Losses.
    pub losses: u16,
    /// The latest one.
    pub loss: Option<Loss>,
    /// Refusals.
    pub refusals: u16,
    /// The latest one.
    pub refusal: Option<Refusal>,
    /// Tares that gave new offsets.
    pub tares: u16,
    /// Sweeps that have learned the fingers.
    pub sweeps: u16,
    /// Events that found no room in their tick.
    pub lost_events: u16,
}

impl Record {
    fn add(&mut self, events: &Events) {
        for event in events.iter() {
            let count = match *event {
                Event::Holding { .. } => &mut self.holds,
                Event::Lost(loss) => {
                    self.loss = Some(loss);
                    &mut self.losses
                }
                Event::Refused(refusal) => {
                    self.refusal = Some(refusal);
                    &mut self.refusals
                }
                Event::Tared => &mut self.tares,
                Event::Swept { .. } => &mut self.sweeps,
                _ => continue,
            };
            *count = count.wrapping_add(1);
        }
        self.lost_events = self.lost_events.wrapping_add(events.lost().into());
    }
}

/// The gripper after a tick, as the bus shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// The tick.
    pub snapshot: Snapshot,
    /// What has become of the commands; none if there was none but [`Command::Alive`].
    pub fate: Option<Fate>,
    /// What has happened so far.
    pub record: Record,
    /// What has failed of each gauge.
    pub gauges: [Option<GaugeFault>; FINGERS],
}

/// What the control tick keeps of the bus.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    wishes: Wishes,
    /// Somebody waits for a status.
    asked: bool,
    /// The command of this tick is the bus's.
    is_from_bus: bool,
    /// When the loss was reported that can be acknowledged alone: no fault is latched.
    lost: Option<Instant>,
    fate: Option<Fate>,
    record: Record,
}

impl Link {
    /// Nobody wants anything.
    pub fn new() -> Self {
        Self {
            wishes: Wishes::NONE,
            asked: false,
            is_from_bus: false,
            lost: None,
            fate: None,
            record: Record::default(),
        }
    }

    /// Takes what a request wants; [`Link::ticked`] gives a status when it has been done. What is left of one before is
    /// dropped.
    pub fn ask(&mut self, wishes: Wishes) {
        self.wishes = wishes;
        self.asked = true;
        self.fate = None;
    }

    /// The command of the next tick, where the digital inputs want `pins`. They come first, and the bus waits for a tick
    /// in which they want nothing. A stop drops what the bus wants, a release what would close the fingers.
    pub fn command(&mut self, pins: Command) -> Command {
        self.is_from_bus = false;
        if matches!(pins, Command::Continue) {
            return self.next();
        }
        if self.wishes.drop(pins) {
            self.fate = Some(Fate::Dropped);
        }
        pins
    }

    fn next(&mut self) -> Command {
        let command = self.wishes.take(self.lost);
        self.is_from_bus = !matches!(command, Command::Continue | Command::Alive);
        command
    }

    /// Takes what the tick has put out. A status once all that was asked for has been done.
    pub fn ticked(&mut self, controller: &Controller, outputs: &Outputs) -> Option<Status> {
        self.record.add(&outputs.events);
        let snapshot = &outputs.snapshot;
        let no_fault = snapshot.state.fault().is_none();
        self.lost = snapshot.lost.filter(|_| no_fault).map(|loss| loss.flagged);
        if let (true, Some(answer)) = (self.is_from_bus, outputs.answer)
            && !matches!(self.fate, Some(Fate::Refused(_) | Fate::Dropped))
        {
            self.fate = Some(match answer {
                Answer::Accepted => Fate::Accepted,
                Answer::Unchanged => Fate::Unchanged,
                Answer::Refused(refusal) => Fate::Refused(refusal),
            });
        }
        if !self.asked || !self.wishes.is_empty() {
            return None;
        }
        self.asked = false;
        Some(Status {
            snapshot: outputs.snapshot,
            fate: self.fate.take(),
            record: self.record,
            gauges: controller.gauge_faults(),
        })
    }
}

impl Default for Link {
    fn default() -> Self {
        Self::new()
    }
}

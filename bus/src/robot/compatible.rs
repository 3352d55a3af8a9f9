//! The block that drivers for the Robotiq grippers know: what its bits want, and what they show.
//!
//! A go-to is an event, not a state: rGTO 0→1, another rPR, or an activation with rGTO set. The same registers
//! written again and again change nothing. Another rSP or rFR takes effect with the next go-to.

use super::link::{Fate, Status, Wish, Wishes};
use softgrip::command::{Command, Grip};
use softgrip::estimate::OPEN_KPA;
use softgrip::fault::Fault;
use softgrip::grasp::{Purpose, State};
use softgrip::table::{self, FingerTable};
use softgrip::units::{Degrees, Instant, Kilopascals};

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
        let most = share(WEAKEST, force) * self.limit.0;
        // Not `f32::min`, which is a call into the runtime on the target.
        Kilopascals(if pressure.0 < most { pressure.0 } else { most })
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
    pub fn written(&self, place: u16) -> u16 {
        let place = self.written.get(usize::from(place));
        place.copied().unwrap_or_default()
    }

    /// Whether the gripper obeys the block.
    pub fn is_active(&self) -> bool {
        self.phase == Phase::Active
    }

    /// Takes the values of registers from `place` on, all three or fewer. True if that acknowledges what is latched.
    pub fn write(
        &mut self,
        now: Instant,
        place: u16,
        values: impl Iterator<Item = u16>,
        fingers: &Fingers,
        wishes: &mut Wishes,
    ) -> bool {
        let before = Request::of(self.written);
        let places = self.written.iter_mut().skip(place.into());
        places.zip(values).for_each(|(place, value)| *place = value);
        let wanted = Request::of(self.written);
        let was_reset = self.reset_seen;
        self.reset_seen |= place == 0 && !wanted.activate;

        if wanted.release && !before.release {
            self.phase = Phase::Releasing;
            self.due = false;
            self.open(wishes);
            return false;
        }
        if wanted.release {
            return false;
        }
        if !wanted.activate {
            self.phase = Phase::Reset;
            self.due = false;
            if before.activate {
                wishes.add(Wish::Command(Command::Halt));
                wishes.add(Wish::Command(Command::Acknowledge));
            }
            return before.activate;
        }
        let begins = !before.activate && was_reset;
        if begins {
            self.phase = Phase::Activating { since: now };
            wishes.add(Wish::Command(Command::Acknowledge));
            self.open(wishes);
        }
        let moved = wanted.go_to && (!before.go_to || wanted.position != before.position);
        match self.phase {
            // What is open is where it is to go.
            Phase::Activating { .. } => self.due = wanted.go_to && wanted.position > OPEN,
            Phase::Active if moved => self.go(wanted, fingers, wishes),
            Phase::Active if before.go_to && !wanted.go_to => {
                self.due = false;
                wishes.add(Wish::Command(Command::Halt));
            }
            Phase::Active | Phase::Reset | Phase::Releasing | Phase::Released => {}
        }
        begins
    }

    /// Goes where a request has wanted to go before the activation had ended.
    pub fn go_if_due(&mut self, fingers: &Fingers, wishes: &mut Wishes) {
        if self.due && self.phase == Phase::Active {
            self.go(Request::of(self.written), fingers, wishes);
        }
    }

    fn go(&mut self, wanted: Request, fingers: &Fingers, wishes: &mut Wishes) {
        self.due = false;
        // A loss that nobody has been shown is not acknowledged: until then the controller refuses a grip.
        if let Some(lost) = self.lost.filter(|_| self.lost == self.shown) {
            wishes.add(Wish::AcknowledgeLoss(lost));
        }
        self.hurry(wanted.speed, wishes);
        let command = match wanted.position {
            ..=OPEN => Command::Release,
            position => {
                let pressure = fingers.pressure(position, wanted.force);
                Command::Grip(Grip::Pressure(pressure))
            }
        };
        wishes.add(Wish::Command(command));
    }

    /// Lets go, at full speed.
    fn open(&mut self, wishes: &mut Wishes) {
        self.hurry(u8::MAX, wishes);
        wishes.add(Wish::Command(Command::Release));
    }

    fn hurry(&mut self, speed: u8, wishes: &mut Wishes) {
        if self.speed != Some(speed) {
            self.speed = Some(speed);
            wishes.add(Wish::Command(Command::Slew(share(SLOWEST, speed))));
        }
    }

    /// Takes a status: before it is shown.
    pub fn observe(&mut self, status: &Status) {
        let snapshot = &status.snapshot;
        self.lost = snapshot.lost.map(|loss| loss.flagged);
        if status.fate == Some(Fate::Dropped) {
            self.speed = None;
        }
        let is_open = snapshot.state.target().0 <= 0.0
            && snapshot.pressure.is_some_and(|kpa| kpa.0 < OPEN_KPA);
        self.phase = match self.phase {
            Phase::Activating { since } => match snapshot.now.micros_since(since) {
                ACTIVATION_LIMIT_US.. => Phase::Active,
                ACTIVATION_SHOWS_US.. if is_open => Phase::Active,
                _ => self.phase,
            },
            Phase::Releasing if is_open => Phase::Released,
            phase => phase,
        };
    }

    /// The value of one of the three status registers. The first one shows a loss.
    pub fn shows(&mut self, place: u16, status: &Status, fingers: &Fingers) -> u16 {
        let wanted = Request::of(self.written);
        let bytes = match place {
            0 => {
                self.shown = self.lost;
                [self.status(wanted, status), 0]
            }
            1 => [self.fault(wanted, status), wanted.position],
            _ => {
                let kpa = status.snapshot.pressure.unwrap_or_default().0;
                [position(status, fingers), kpa as u8]
            }
        };
        u16::from_be_bytes(bytes)
    }

    /// gACT, gGTO, gSTA and gOBJ.
    fn status(&self, wanted: Request, status: &Status) -> u8 {
        let is_activated = wanted.activate && self.phase != Phase::Reset;
        let stage = match self.phase {
            Phase::Activating { .. } => 1,
            _ if is_activated => 3,
            _ => 0,
        };
        u8::from(is_activated) * ACTIVATE
            | u8::from(wanted.go_to) * GO_TO
            | stage << 4
            | self.object(status) << 6
    }

    /// gOBJ: 0 moving, 2 holding, 3 where it is to be without an object, or after its loss.
    fn object(&self, status: &Status) -> u8 {
        let snapshot = &status.snapshot;
        let is_inflated = snapshot.pressure.is_some_and(|kpa| kpa.0 >= OPEN_KPA);
        match snapshot.state {
            State::Releasing { .. } | State::Sweeping { .. } => 0,
            _ if self.due => 0,
            state if state.is_vented() && is_inflated => 0,
            _ if snapshot.lost.is_some() => 3,
            state if state.is_holding() => 2,
            State::Closing {
                purpose: Purpose::Grip | Purpose::Regrip,
                ..
            } => 0,
            _ => 3,
        }
    }

    /// gFLT; its upper half, kFLT, is 0.
    fn fault(&self, wanted: Request, status: &Status) -> u8 {
        match self.phase {
            Phase::Releasing => return 0xB,
            Phase::Released => return 0xF,
            // rACT = 0 alone clears it, or drivers refuse to activate.
            Phase::Reset if !wanted.activate && !wanted.go_to => return 0,
            _ => {}
        }
        match status.snapshot.state.fault() {
            Some(Fault::HostSilent) => 9,
            Some(Fault::SupplyLow) => 0xA,
            Some(Fault::OverPressure) => 0xE,
            Some(_) => 0xC,
            None => match self.phase {
                Phase::Reset if !wanted.activate => 7,
                Phase::Reset => 5,
                Phase::Activating { .. } if wanted.go_to => 5,
                _ => 0,
            },
        }
    }
}

/// gPO.
fn position(status: &Status, fingers: &Fingers) -> u8 {
    let open = f32::from(OPEN);
    let bend = status.snapshot.bend.0 / fingers.full_bend().0;
    // A bend that is no number shows as open.
    let bend = bend.clamp(0.0, 1.0);
    (open + (CLOSED - open) * bend + 0.5) as u8
}

//! The block that drivers for the Robotiq grippers know: what its bits want, and what they show.
//!
//! A go-to is an event, not a state: rGTO 0→1, another rPR, or an activation with rGTO set. The same registers
//! written again and again change nothing. Another rSP or rFR takes effect with the next go-to.

use super::link::{Fate, Status, Wishes};
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

/// Position requests up to this release. It is what robotiq2f makes of the whole stroke; the pressure that so small a bend
/// takes holds nothing.
const RELEASES: u8 = 12;
/// What gPO shows for open and for closed fingers, as on a 2F-85: drivers map that to their stroke.
const OPEN: f32 = 3.0;
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
    Activating,
    /// It obeys.
    Active,
    /// An automatic release is running.
    Releasing,
    /// It has been done; only an activation goes on from here.
    Released,
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
    /// When the last activation began.
    since: Instant,
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
            since: Instant::from_micros(0),
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

    /// The two bytes of one of them, the upper one first.
    fn bytes(&self, place: u16) -> [u8; 2] {
        self.written(place).to_be_bytes()
    }

    /// rACT, rGTO, rATR.
    fn action(&self) -> u8 {
        let [action, _] = self.bytes(0);
        action
    }

    /// rPR.
    fn position(&self) -> u8 {
        let [_, position] = self.bytes(1);
        position
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
        let (before, position) = (self.action(), self.position());
        let places = self.written.iter_mut().skip(place.into());
        places.zip(values).for_each(|(place, value)| *place = value);
        let wanted = self.action();
        let (risen, fallen) = (wanted & !before, before & !wanted);
        let was_reset = self.reset_seen;
        self.reset_seen |= place == 0 && wanted & ACTIVATE == 0;

        if wanted & AUTOMATIC_RELEASE != 0 {
            if risen & AUTOMATIC_RELEASE != 0 {
                self.phase = Phase::Releasing;
                self.due = false;
                self.open(wishes);
            }
            return false;
        }
        if wanted & ACTIVATE == 0 {
            self.phase = Phase::Reset;
            self.due = false;
            let reset = fallen & ACTIVATE != 0;
            if reset {
                wishes.add(Command::Halt);
                wishes.add(Command::Acknowledge);
            }
            return reset;
        }
        let begins = risen & ACTIVATE != 0 && was_reset;
        if begins {
            self.phase = Phase::Activating;
            self.since = now;
            wishes.add(Command::Acknowledge);
            self.open(wishes);
        }
        let goes = wanted & GO_TO != 0;
        match self.phase {
            // What is open is where it is to go.
            Phase::Activating => self.due = goes && self.position() > RELEASES,
            Phase::Active if goes => {
                if risen & GO_TO != 0 || self.position() != position {
                    self.go(fingers, wishes);
                }
            }
            Phase::Active if fallen & GO_TO != 0 => {
                self.due = false;
                wishes.add(Command::Halt);
            }
            Phase::Active | Phase::Reset | Phase::Releasing | Phase::Released => {}
        }
        begins
    }

    /// Goes where a request has wanted to go before the activation had ended.
    pub fn go_if_due(&mut self, fingers: &Fingers, wishes: &mut Wishes) {
        if self.due && self.phase == Phase::Active {
            self.go(fingers, wishes);
        }
    }

    /// Does not go there: something else is wanted since.
    pub fn stay(&mut self) {
        self.due = false;
    }

    fn go(&mut self, fingers: &Fingers, wishes: &mut Wishes) {
        let [speed, force] = self.bytes(2);
        self.due = false;
        // A loss that nobody has been shown is not acknowledged: until then the controller refuses a grip.
        if let Some(lost) = self.lost.filter(|_| self.lost == self.shown) {
            wishes.acknowledge(lost);
        }
        self.hurry(speed, wishes);
        let command = match self.position() {
            ..=RELEASES => Command::Release,
            position => {
                let pressure = fingers.pressure(position, force);
                Command::Grip(Grip::Pressure(pressure))
            }
        };
        wishes.add(command);
    }

    /// Lets go, at full speed.
    fn open(&mut self, wishes: &mut Wishes) {
        self.hurry(u8::MAX, wishes);
        wishes.add(Command::Release);
    }

    fn hurry(&mut self, speed: u8, wishes: &mut Wishes) {
        if self.speed != Some(speed) {
            self.speed = Some(speed);
            wishes.add(Command::Slew(share(SLOWEST, speed)));
        }
    }

    /// Takes a status: before it is shown.
    pub fn observe(&mut self, status: &Status) {
        let snapshot = &status.snapshot;
        self.lost = snapshot.lost.map(|loss| loss.flagged);
        if matches!(status.fate, Some(Fate::Dropped)) {
            self.speed = None;
            self.due = false;
        }
        let is_open = !is_inflated(status);
        match self.phase {
            Phase::Activating => {
                let micros = snapshot.now.micros_since(self.since);
                if micros >= ACTIVATION_LIMIT_US || is_open && micros >= ACTIVATION_SHOWS_US {
                    self.phase = Phase::Active;
                }
            }
            Phase::Releasing if is_open => self.phase = Phase::Released,
            _ => {}
        }
    }

    /// The value of one of the three status registers. The first one shows a loss.
    pub fn shows(&mut self, place: u16, status: &Status, fingers: &Fingers) -> u16 {
        let bytes = match place {
            0 => {
                self.shown = self.lost;
                [self.status(status), 0]
            }
            1 => [self.fault(status), self.position()],
            _ => {
                let kpa = status.snapshot.pressure.unwrap_or_default().0;
                [position(status, fingers), kpa as u8]
            }
        };
        u16::from_be_bytes(bytes)
    }

    /// gACT, gGTO, gSTA and gOBJ.
    fn status(&self, status: &Status) -> u8 {
        let mut shown = self.action() & (ACTIVATE | GO_TO);
        if self.phase == Phase::Reset {
            shown &= !ACTIVATE;
        }
        let stage = match self.phase {
            Phase::Activating => 1,
            _ if shown & ACTIVATE != 0 => 3,
            _ => 0,
        };
        shown | stage << 4 | self.object(status) << 6
    }

    /// gOBJ: 0 moving, 2 holding, 3 where it is to be without an object, or after its loss.
    fn object(&self, status: &Status) -> u8 {
        let snapshot = &status.snapshot;
        match snapshot.state {
            State::Releasing { .. } | State::Sweeping { .. } => 0,
            _ if self.due => 0,
            state if state.is_vented() && is_inflated(status) => 0,
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
    fn fault(&self, status: &Status) -> u8 {
        let wanted = self.action();
        match self.phase {
            Phase::Releasing => return 0xB,
            Phase::Released => return 0xF,
            // rACT = 0 alone clears it, or drivers refuse to activate.
            Phase::Reset if wanted & (ACTIVATE | GO_TO) == 0 => return 0,
            _ => {}
        }
        match status.snapshot.state.fault() {
            Some(Fault::HostSilent) => 9,
            Some(Fault::SupplyLow) => 0xA,
            Some(Fault::OverPressure) => 0xE,
            Some(_) => 0xC,
            None => match self.phase {
                Phase::Reset if wanted & ACTIVATE == 0 => 7,
                Phase::Reset => 5,
                Phase::Activating if wanted & GO_TO != 0 => 5,
                _ => 0,
            },
        }
    }
}

/// Whether there is air in the fingers, or nobody knows.
fn is_inflated(status: &Status) -> bool {
    !status.snapshot.pressure.is_some_and(|kpa| kpa.0 < OPEN_KPA)
}

/// gPO.
fn position(status: &Status, fingers: &Fingers) -> u8 {
    let bend = status.snapshot.bend.0 / fingers.full_bend().0;
    // A bend that is no number shows as open.
    let share = match bend > 0.0 {
        true => bend.clamp(0.0, 1.0),
        false => 0.0,
    };
    (OPEN + (CLOSED - OPEN) * share + 0.5) as u8
}

//! What the controller promises about an object: a loss is told, in time, and only if there was one.

use crate::mock::GaugeState;
use crate::torture::plant::{Object, Plant};
use crate::torture::{Breach, must};
use softgrip::grasp::State;
use softgrip::telemetry::Event;
use softgrip::{Command, Outputs};

/// At less pressure the object, which is met at 60 kPa, is hardly held: what such a grip feels is no
/// matter of a promise.
pub const WEAK_KPA: f32 = 85.0;
/// Usable ticks from the beginning of a fall to its report, by fingers that feel it with a good gauge. With
/// three it takes 40 ms but just after the pressure has been lowered, when a fall may be the pressure's.
const TOLD_MS: [u32; 4] = [u32::MAX, u32::MAX, 150, 60];
/// What has been falling for so long is no longer between the fingers: the fall itself, the debouncing of
/// contact, and what 400 µε of noise make of that.
const GONE_MS: u16 = 90;
/// The same while the pressure changes: at the slowest slew and lag, and settled.
const CHANGE_MS: u32 = 3_500;

/// What has been said about the object, and what is to be said.
#[derive(Debug, Clone, Default)]
pub struct Promises {
    /// *Holding* has been said, and nothing since that takes it back.
    holds: bool,
    /// The object was not there, or not all the way, at some time since.
    gone: bool,
    /// The pressure was too low at some time since.
    weak: bool,
    /// Fingers that carry the object with a gauge that has been good, and used, since.
    trusted: [bool; 3],
    /// Usable ticks since an object fell that is still said to be held, at rest and while the pressure changes.
    owed: Option<(u32, u32)>,
    pub tally: Tally,
}

/// What a run has seen, to tell that it has seen enough.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    pub holds: u64,
    pub losses: u64,
    pub empties: u64,
    pub faults: u64,
    /// Longest time from the beginning of a fall to its report, ms, with two and with three fingers.
    pub latest_ms: [u32; 2],
}

impl Tally {
    pub fn add(&mut self, other: &Self) {
        self.holds += other.holds;
        self.losses += other.losses;
        self.empties += other.empties;
        self.faults += other.faults;
        for (mine, theirs) in self.latest_ms.iter_mut().zip(other.latest_ms) {
            *mine = (*mine).max(theirs);
        }
    }
}

impl Promises {
    /// Checks one tick.
    pub fn check(
        &mut self,
        plant: &Plant,
        command: Command,
        outputs: &Outputs,
    ) -> Result<(), Breach> {
        let state = outputs.snapshot.state;
        self.gone |= !plant.is_carried();
        self.weak |= state.target().0 > 0.0 && state.target().0 < WEAK_KPA;
        let good = std::array::from_fn(|i| {
            let used = outputs.snapshot.residual[i].is_some() || plant.is_blind();
            used && plant.board.gauges[i] == GaugeState::Good
        });
        for (trusted, good) in self.trusted.iter_mut().zip(good) {
            *trusted &= good;
        }
        if command == Command::Release && state.target().0 <= 0.0 {
            self.holds = false;
        }
        for event in outputs.events.iter() {
            self.hear(plant, event, &state, good)?;
        }
        self.count(plant, &state)
    }

    /// `good`: fingers whose gauge is good, and used.
    fn hear(
        &mut self,
        plant: &Plant,
        event: &Event,
        state: &State,
        good: [bool; 3],
    ) -> Result<(), Breach> {
        match event {
            Event::Holding { touching } => {
                // A gauge that has frozen while its amplifier is silent is not known as stuck yet.
                let deceived = (0..3).any(|i| touching[i] && !good[i]);
                must(
                    deceived || plant.collapsing_ticks().is_none_or(|ticks| ticks < GONE_MS),
                    "only what is there is held",
                    || *state,
                )?;
                self.tally.holds += 1;
                self.holds = true;
                self.gone = !plant.is_carried();
                self.weak = state.target().0 < WEAK_KPA;
                let (Object::In(_, fingers) | Object::Out(_, _, fingers)) = plant.object;
                self.trusted = std::array::from_fn(|i| fingers[i] && good[i]);
            }
            Event::Lost(loss) => {
                must(self.holds, "only what is held is lost", || *loss)?;
                // A gauge that breaks into 1700 µε of noise looks like a loss once in some hundred times.
                let excused = self.weak || plant.noise_breaks_out();
                must(self.gone || excused, "only what fell is lost", || *loss)?;
                self.tally.losses += 1;
                self.holds = false;
                if let Some((ms, 0)) = self.owed {
                    let fingers = self.trusted.iter().filter(|trusted| **trusted).count();
                    // One may have failed in this very tick.
                    if let Some(latest) = self.tally.latest_ms.get_mut(fingers.wrapping_sub(2)) {
                        *latest = (*latest).max(ms);
                    }
                }
            }
            Event::Empty => {
                self.tally.empties += 1;
                let right = !self.holds || self.weak;
                must(right, "what was held is lost, not empty", || *state)?;
                self.holds = false;
            }
            Event::Fault {
                fault,
                finger: None,
            } => {
                self.tally.faults += 1;
                // What is told first is told; only a fault that watches, and holds, owes a loss as well.
                self.holds &= fault.rule().watches && state.target().0 > 0.0;
            }
            _ => {}
        }
        Ok(())
    }

    fn count(&mut self, plant: &Plant, state: &State) -> Result<(), Breach> {
        let fingers = self.trusted.iter().filter(|trusted| **trusted).count();
        let fallen = plant.collapsing_ticks().is_some();
        if !(self.holds && fallen && fingers >= 2) || self.weak {
            self.owed = None;
            return Ok(());
        }
        let (rest, change) = self.owed.get_or_insert((0, 0));
        if plant.is_blind() {
            return Ok(());
        }
        match state {
            State::Closing { .. } => *change += 1,
            _ => *rest += 1,
        }
        let found = (*rest, *change, fingers, *state);
        // Of an object that leaves sideways two gauges may see one finger only that empties, while the other
        // holds on: for two, that is a shift of the load.
        let lingers = match plant.lingers() {
            Some((last, ms)) if fingers == 2 && self.trusted[last] => u32::from(ms),
            _ => 0,
        };
        let in_time = *rest <= TOLD_MS[fingers] + lingers && *change <= CHANGE_MS;
        must(in_time, "a fall is told in time", || found)
    }
}

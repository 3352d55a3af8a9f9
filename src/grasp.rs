//! The supervisor: the only state machine. Commands and verdicts → what the gripper is to do.
//!
//! ```text
//!          grip                 contact               release
//! Idle ───────────► Closing ───────────► Holding ───────────────► Releasing ─► Idle
//!                   ▲  │ nothing there      │ lost                    ▲
//!                   │  └──────► Empty ◄─────┤ (hold)                  │
//!                   └───────────────────────┤ (regrip, once)          │
//!                                           └ (vent) ─────────────────┤
//!                               Empty ─────── release ────────────────┘
//! Idle ── sweep ─► Sweeping ── learned, refused, release ─► Releasing
//! any ── fault, stop ─► Fault ── acknowledge ─► Closing (pressure kept) or Releasing (vented)
//! ```
//!
//! *Lost* is latched beside the state: it outlives a release and stands until it is acknowledged.
//! What a fault leaves in the grip is watched on, where the gauges can still tell.

mod approach;
mod failures;
mod obey;
mod settings;
mod situation;
mod state;
mod sweep;

use approach::Approach;

use crate::air::{Air, REACHED_KPA};
use crate::command::{Answer, Command, Motion, Payload, Refusal};
use crate::detect::{Loss, LossCause, Verdict, Watch};
use crate::estimate::{Calibration, Contact, OPEN_KPA};
use crate::event::{Event, Events};
use crate::fault::Fault;
use crate::table::FingerTable;
use crate::units::{FINGERS, Instant, Kilopascals};

pub(crate) use settings::Active;
pub use settings::{OnFault, OnLoss, Settings};
pub use situation::Situation;
pub use state::{Purpose, State};
use sweep::{Progress, Sweep};

/// A grip needs this many fingers.
const FINGERS_OF_A_GRIP: usize = 2;
/// The pressure should have reached its set-point when the expected one is this close.
const DUE_KPA: f32 = 0.5;
/// One that falls short of its set-point, but not by a fault's worth, is given this long to get there.
const SHORT_US: u64 = 300_000;
/// A release has ended its hold after this at the latest, even if contact never clears.
const RELEASE_LIMIT_US: u64 = 1_000_000;

/// The supervisor.
#[derive(Debug, Clone, Copy)]
// As in the controller: what few ticks use comes last.
#[repr(C)]
pub struct Supervisor {
    state: State,
    lost: Option<Loss>,
    /// The present grip has been tightened after a loss.
    regripped: bool,
    payload: Option<Payload>,
    slipping: bool,
    /// When the robot last said something; unknown before the first tick.
    heard: Option<Instant>,
    touched: [bool; FINGERS],
    approach: Approach,
    /// Fingers that touched when the hold was recognised.
    carrying: [bool; FINGERS],
    failed: [bool; FINGERS],
    supply_ticks: u16,
    rail_ticks: u16,
    tare_was_due: bool,
    /// The last command but acknowledgements, when it came last, and its answer.
    asked: Option<(Command, Instant, Answer)>,
    /// When the last acknowledgement came.
    acknowledged: Option<Instant>,
    /// The latched fault has been acknowledged, and ends with its cause.
    fault_was_seen: bool,
    sweep: Sweep,
    /// What a sweep has found and nobody has taken.
    calibration: Option<Calibration>,
}

impl Supervisor {
    /// Idle, nothing latched but a fault that the program has started with.
    pub fn new(fault: Option<Fault>) -> Self {
        Self {
            state: match fault {
                Some(fault) => State::Fault {
                    fault,
                    target: Kilopascals(0.0),
                    watching: false,
                },
                None => State::Idle,
            },
            lost: None,
            regripped: false,
            payload: None,
            slipping: false,
            heard: None,
            touched: [false; FINGERS],
            approach: Approach::unseen(),
            carrying: [false; FINGERS],
            failed: [false; FINGERS],
            supply_ticks: 0,
            rail_ticks: 0,
            tare_was_due: false,
            asked: None,
            acknowledged: None,
            fault_was_seen: false,
            sweep: Sweep::begins(Kilopascals(0.0)),
            calibration: None,
        }
    }

    /// Where the gripper is.
    pub fn state(&self) -> State {
        self.state
    }

    /// What a sweep has found, once.
    pub fn take_calibration(&mut self) -> Option<Calibration> {
        self.calibration.take()
    }

    /// The loss that is latched.
    pub fn lost(&self) -> Option<Loss> {
        self.lost
    }

    /// How what is held is to be watched, if something is.
    pub fn watch(&self, motion: Motion) -> Option<Watch> {
        self.state.is_holding().then_some(Watch {
            motion,
            carrying: self.carrying,
            pressure_changes: matches!(self.state, State::Closing { reached: None, .. }),
            fingers_follow: matches!(
                self.state,
                State::Closing {
                    reached: Some(_),
                    ..
                }
            ),
        })
    }

    /// What the present grip was asked to carry.
    pub fn payload(&self) -> Option<Payload> {
        match self.state {
            State::Closing { .. } | State::Holding { .. } => self.payload,
            State::Idle
            | State::Empty { .. }
            | State::Sweeping { .. }
            | State::Releasing { .. }
            | State::Fault { .. } => None,
        }
    }

    /// Decides what to do in this tick, and answers the command; the new state's target is the pressure to
    /// go to.
    pub fn step(
        &mut self,
        now: Instant,
        command: Command,
        situation: &Situation,
        table: &FingerTable,
        active: &Active,
        events: &mut Events,
    ) -> Option<Answer> {
        if let (None, State::Fault { fault, .. }) = (self.heard, self.state) {
            events.add(Event::Fault {
                fault,
                finger: None,
            });
        }
        if self.heard.is_none() || command != Command::Continue {
            self.heard = Some(now);
        }
        self.report_gauges(situation.reading, events);
        self.report_zero(situation, events);
        if !self.state.is_holding() {
            self.approach.step(situation.contact, active.meeting);
        }
        // Only what was latched before this tick can have been seen by whoever acknowledges now.
        let latched = self.state.fault();
        let cause = self.find_fault(now, situation, active);
        if let Some(fault) = cause {
            self.enter_fault(fault, situation.air, active, events);
        }
        self.leave_fault(now, cause, situation, events);
        // A command comes before the verdict: what the robot lets go in this tick is not lost.
        let answer = match command {
            Command::Continue => None,
            Command::Alive | Command::Motion(_) | Command::Slew(_) => Some(Answer::Accepted),
            Command::Acknowledge => Some(self.acknowledge(now, latched, situation.reading, events)),
            Command::Grip(_)
            | Command::Release
            | Command::Halt
            | Command::Stop
            | Command::Tare
            | Command::Sweep => Some(self.obey(now, command, situation, table, active, events)),
        };
        // A grip that has just begun has changed nothing yet, be its pressure as near as it may.
        if !matches!(
            (command, answer),
            (Command::Grip(_), Some(Answer::Accepted))
        ) {
            self.advance(now, situation, table, active, events);
        }
        answer
    }

    fn advance(
        &mut self,
        now: Instant,
        situation: &Situation,
        table: &FingerTable,
        active: &Active,
        events: &mut Events,
    ) {
        if let Verdict::Lost {
            onset,
            cause,
            evidence,
        } = situation.verdict
            && self.state.is_holding()
        {
            let loss = Loss {
                onset,
                flagged: now,
                cause,
                evidence,
            };
            self.lose(loss, self.state.target(), active, events);
            return;
        }
        match self.state {
            State::Idle | State::Empty { .. } => {}
            State::Sweeping { .. } => match self.sweep.step(situation, table) {
                Progress::At(target) => self.state = State::Sweeping { target },
                Progress::Ended(result) => self.end_sweep(now, result, events),
            },
            State::Closing {
                target,
                reached: None,
                purpose,
            } => {
                self.report_touch(situation.contact, events);
                if has_reached(now, target, situation.air) {
                    self.state = State::Closing {
                        target,
                        reached: Some(now),
                        purpose,
                    };
                }
            }
            State::Closing {
                target,
                reached: Some(since),
                purpose,
            } => {
                self.report_touch(situation.contact, events);
                // Air that is going is no object that is, and without its pressure a finger feels nothing.
                let settled = now.micros_since(since) >= active.settle_us;
                if settled && situation.air.deviating_us == 0 && situation.contact.known {
                    self.judge_grip(now, target, purpose, situation.contact, active, events);
                }
            }
            State::Holding { .. } | State::Fault { watching: true, .. } => {
                self.report_hold(situation, active, events);
            }
            State::Fault {
                watching: false, ..
            } => {}
            State::Releasing { since, holding } => {
                self.let_go(now, since, holding, situation, events);
            }
        }
    }

    /// Says whether something is held, once the pressure is where it should be.
    fn judge_grip(
        &mut self,
        now: Instant,
        target: Kilopascals,
        purpose: Purpose,
        contact: &Contact,
        active: &Active,
        events: &mut Events,
    ) {
        let (gripping, needed) = match purpose {
            // What they touch is one another.
            Purpose::Grip if self.approach.is_free(contact, active.meeting) => {
                (0, FINGERS_OF_A_GRIP)
            }
            Purpose::Grip | Purpose::Regrip => (contact.touching_count(), FINGERS_OF_A_GRIP),
            // What two fingers hold is still held when the gauge of one of them fails.
            Purpose::Change => (
                contact.touching_count(),
                self.living_carriers(contact).clamp(1, FINGERS_OF_A_GRIP),
            ),
        };
        if gripping >= needed {
            self.slipping = false;
            self.carrying = contact.touching;
            self.state = State::Holding { target, since: now };
            events.add(Event::Holding {
                touching: contact.touching,
            });
        } else if purpose == Purpose::Change {
            let loss = Loss {
                onset: now,
                flagged: now,
                cause: LossCause::Missing,
                evidence: [None; FINGERS],
            };
            self.lose(loss, target, active, events);
        } else {
            self.state = State::Empty { target };
            events.add(Event::Empty);
        }
    }

    /// Reports what the detector sees of what is held.
    fn report_hold(&mut self, situation: &Situation, active: &Active, events: &mut Events) {
        match situation.verdict {
            Verdict::Unarmed | Verdict::Holding | Verdict::Lost { .. } => self.slipping = false,
            Verdict::Slipping { rate } => {
                if !self.slipping {
                    self.slipping = true;
                    events.add(Event::Slip { rate });
                }
            }
            Verdict::AirLoss => {
                events.add(Event::AirLoss);
                self.enter_fault(Fault::AirLoss, situation.air, active, events);
            }
        }
    }

    /// Ends a release when the fingers are open, and its hold when they feel nothing any more.
    fn let_go(
        &mut self,
        now: Instant,
        since: Instant,
        holding: bool,
        situation: &Situation,
        events: &mut Events,
    ) {
        let open = situation.air.measured.is_some_and(|p| p.0 < OPEN_KPA);
        let gone = situation.contact.touching_count() == 0
            || open
            || now.micros_since(since) > RELEASE_LIMIT_US;
        if holding && gone {
            events.add(Event::Released);
            self.state = State::Releasing {
                since,
                holding: false,
            };
        }
        if open {
            self.state = State::Idle;
        }
    }

    /// Latches a loss and reacts as the settings say. The first loss stays latched; each is an event.
    fn lose(&mut self, loss: Loss, target: Kilopascals, active: &Active, events: &mut Events) {
        self.lost.get_or_insert(loss);
        events.add(Event::Lost(loss));
        if let State::Fault { watching, .. } = &mut self.state {
            *watching = false;
            return;
        }
        let tightened = (target.0 + active.regrip_raise_kpa).min(active.max_pressure.0);
        let tightens = !self.regripped && tightened > target.0;
        self.state = match active.on_loss {
            OnLoss::Vent => State::Releasing {
                since: loss.flagged,
                holding: false,
            },
            OnLoss::Regrip if tightens => {
                self.regripped = true;
                events.add(Event::Regripping);
                State::Closing {
                    target: Kilopascals(tightened),
                    reached: None,
                    purpose: Purpose::Regrip,
                }
            }
            OnLoss::Hold | OnLoss::Regrip => State::Empty { target },
        };
    }

    /// Fingers that carry what is held, with a gauge that is usable.
    fn living_carriers(&self, contact: &Contact) -> usize {
        let living = contact.residual.map(|residual| residual.is_some());
        let mut count = 0usize;
        for (carries, lives) in self.carrying.into_iter().zip(living) {
            count = count.saturating_add((carries && lives).into());
        }
        count
    }

    fn report_touch(&mut self, contact: &Contact, events: &mut Events) {
        for (finger, touched) in self.touched.iter_mut().enumerate() {
            if contact.touching[finger] && !*touched {
                *touched = true;
                events.add(Event::Contact {
                    finger: finger as u8,
                });
            }
        }
    }

    /// Answers a tare that has ended, and asks for one that is due.
    fn report_zero(&mut self, situation: &Situation, events: &mut Events) {
        match situation.zero.tare {
            Some(Ok(())) => events.add(Event::Tared),
            Some(Err(fault)) => events.add(Event::Refused(Refusal::TareRejected(fault))),
            None => {}
        }
        if situation.zero.tare_due && !self.tare_was_due {
            events.add(Event::TareDue);
        }
        self.tare_was_due = situation.zero.tare_due;
    }
}

/// Whether the pressure is where it should be, or where it can get: a regulator may fall short of its
/// set-point, but not by a fault's worth.
fn has_reached(now: Instant, target: Kilopascals, air: &Air) -> bool {
    let near = air
        .measured
        .is_some_and(|p| (p.0 - target.0).abs() <= REACHED_KPA);
    let due = (air.expected.unwrap_or_default().0 - target.0).abs() <= DUE_KPA;
    near || due && now.micros_since(air.deviated) >= SHORT_US
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new(None)
    }
}

#[cfg(test)]
mod tests;

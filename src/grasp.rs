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
//! any ── fault, stop ─► Fault ── acknowledge ─► Closing (pressure kept) or Releasing (vented)
//! ```
//!
//! *Lost* is latched beside the state: it outlives a release and stands until it is acknowledged.
//! What a fault leaves in the grip is watched on, where the gauges can still tell.

use crate::FINGERS;
use crate::command::{Answer, Command, Grip, Payload, Refusal};
use crate::condition::{Gauge, Monitor, Reading};
use crate::detect::{Air, LossCause, Verdict};
use crate::estimate::{Contact, OPEN_KPA};
use crate::fault::{Fault, SafeOutput};
use crate::settings::{Active, OnFault, OnLoss};
use crate::table::{FingerTable, Range};
use crate::telemetry::{Event, Events};
use crate::units::{Instant, Kilopascals};
use crate::zero::TareResult;

/// Where the gripper is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// Open, without pressure.
    Idle,
    /// Pressure is rising, or changing.
    Closing {
        /// The set-point.
        target: Kilopascals,
        /// When the pressure got there.
        reached: Option<Instant>,
        /// What for.
        purpose: Purpose,
    },
    /// Something is held.
    Holding {
        /// The set-point.
        target: Kilopascals,
        /// When the hold was recognised.
        since: Instant,
    },
    /// Closed around nothing.
    Empty {
        /// The set-point.
        target: Kilopascals,
    },
    /// Letting the air out on command.
    Releasing {
        /// When the command came.
        since: Instant,
        /// Something was held, and its contact is not gone yet.
        holding: bool,
    },
    /// In the safe state.
    Fault {
        /// What went wrong first.
        fault: Fault,
        /// The pressure that is kept; zero if vented.
        target: Kilopascals,
        /// Something is held, and the gauges can still tell a loss.
        watching: bool,
    },
}

/// Why the pressure changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Purpose {
    /// To find out whether there is something to hold.
    Grip,
    /// What is held is to be held at another pressure.
    Change,
    /// What has been lost is to be caught.
    Regrip,
}

impl State {
    /// The pressure that this state asks for.
    pub fn target(&self) -> Kilopascals {
        match *self {
            Self::Closing { target, .. }
            | Self::Holding { target, .. }
            | Self::Empty { target }
            | Self::Fault { target, .. } => target,
            Self::Idle | Self::Releasing { .. } => Kilopascals(0.0),
        }
    }

    /// Whether something is held, and the detector is to watch it: also while it is held at another
    /// pressure, and in a fault that leaves it in the grip.
    pub fn is_holding(&self) -> bool {
        matches!(
            self,
            Self::Holding { .. }
                | Self::Closing {
                    purpose: Purpose::Change,
                    ..
                }
                | Self::Fault { watching: true, .. }
        )
    }
}

/// A latched loss.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loss {
    /// When the collapse began, as estimated.
    pub onset: Instant,
    /// When it was reported.
    pub flagged: Instant,
    /// How it showed.
    pub cause: LossCause,
    /// How far each finger's residual had fallen when it was reported, as a share of its plateau; none
    /// without a usable gauge.
    pub evidence: [Option<f32>; FINGERS],
}

impl Loss {
    /// From the onset to the report, µs.
    pub fn latency_us(&self) -> u64 {
        self.flagged.micros_since(self.onset)
    }
}

/// What the supervisor sees in one tick.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The readings.
    pub reading: &'a Reading,
    /// What the fingers feel.
    pub contact: &'a Contact,
    /// The detector's verdict.
    pub verdict: Verdict,
    /// The pressure, and what it should be.
    pub air: Air,
    /// A tare that ended in this tick.
    pub tare: Option<TareResult>,
    /// A tare is running.
    pub taring: bool,
    /// A tare is asked for.
    pub tare_due: bool,
    /// The pressure has deviated from the command for this long, µs.
    pub deviating_us: u64,
}

/// A grip needs this many fingers.
const FINGERS_OF_A_GRIP: usize = 2;
/// The pressure has reached its set-point within this: the regulator is good for ±1 % of 200 kPa.
const REACHED_KPA: f32 = 3.0;
/// The pressure should have reached its set-point when the expected one is this close.
const DUE_KPA: f32 = 0.5;
/// A release has ended its hold after this at the latest, even if contact never clears.
const RELEASE_LIMIT_US: u64 = 1_000_000;
/// Measured pressure may exceed the limit by this before it is a fault: 2.5 % of full scale.
const OVER_PRESSURE_KPA: f32 = 5.0;
/// Ticks without usable data: two are a hiccup.
const STALE_TICKS: u32 = 5;
/// The robot's 24 V may come this much later than the board's own supply.
const POWER_UP_US: u64 = 1_000_000;
/// Supply must be low this long: 24 V devices ride through gaps of 10 ms (IEC 61131-2).
const SUPPLY_TICKS: u16 = 20;
/// A command that comes again within this time, with no other in between, is the same command: drivers
/// rewrite it up to 100 times a second, and the slowest that are known do once in half a second.
const REPEAT_US: u64 = 1_000_000;
/// Set-points this close are the same: a quarter of the regulator's repeatability of ±1 % of 200 kPa.
const SAME_KPA: f32 = 0.5;

/// The supervisor.
#[derive(Debug, Clone, Copy)]
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
    failed: [bool; FINGERS],
    supply_ticks: u16,
    tare_was_due: bool,
    /// The last command but acknowledgements, with its answer.
    asked: Option<Asked>,
    /// When the last acknowledgement came.
    acknowledged: Option<Instant>,
}

/// A command that may come again.
#[derive(Debug, Clone, Copy)]
struct Asked {
    command: Command,
    last: Instant,
    answer: Answer,
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
            failed: [false; FINGERS],
            supply_ticks: 0,
            tare_was_due: false,
            asked: None,
            acknowledged: None,
        }
    }

    /// Where the gripper is.
    pub fn state(&self) -> State {
        self.state
    }

    /// The loss that is latched.
    pub fn lost(&self) -> Option<Loss> {
        self.lost
    }

    /// What the present grip was asked to carry.
    pub fn payload(&self) -> Option<Payload> {
        match self.state {
            State::Closing { .. } | State::Holding { .. } => self.payload,
            State::Idle | State::Empty { .. } | State::Releasing { .. } | State::Fault { .. } => {
                None
            }
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
        // Only what was latched before this tick can have been seen by whoever acknowledges now.
        let seen = matches!(self.state, State::Fault { .. });
        let cause = self.find_fault(now, situation, active);
        if let Some(fault) = cause {
            self.enter_fault(fault, situation.air, active, events);
        }
        // A command comes before the verdict: what the robot lets go in this tick is not lost.
        let answer = match command {
            Command::Continue => None,
            Command::Alive | Command::Motion(_) => Some(Answer::Accepted),
            Command::Acknowledge => {
                Some(self.acknowledge(now, cause.filter(|_| seen), situation, seen, events))
            }
            Command::Grip(_) | Command::Release | Command::Stop | Command::Tare => {
                Some(self.obey(now, command, situation, table, active, events))
            }
        };
        self.advance(now, situation, active, events);
        answer
    }

    /// Carries a command out, unless it is the last one come again.
    fn obey(
        &mut self,
        now: Instant,
        command: Command,
        situation: &Situation,
        table: &FingerTable,
        active: &Active,
        events: &mut Events,
    ) -> Answer {
        let asked = self.asked.filter(|asked| asked.command.is_same(&command));
        if let Some(asked) = asked
            && now.micros_since(asked.last) < REPEAT_US
            && command != Command::Stop
        {
            self.asked = Some(Asked { last: now, ..asked });
            return match asked.answer {
                Answer::Refused(_) => asked.answer,
                Answer::Accepted | Answer::Unchanged => Answer::Unchanged,
            };
        }
        let answer = match command {
            Command::Grip(grip) => self.grip(grip, asked.is_some(), table, active),
            Command::Release => self.release(now, situation.contact, events),
            Command::Stop => {
                self.enter_fault(Fault::Stopped, situation.air, active, events);
                Answer::Accepted
            }
            Command::Tare if situation.taring => Answer::Unchanged,
            Command::Tare if self.state == State::Idle => Answer::Accepted,
            Command::Tare => Answer::Refused(Refusal::NotIdle),
            Command::Continue | Command::Alive | Command::Motion(_) | Command::Acknowledge => {
                Answer::Unchanged
            }
        };
        if let Answer::Refused(refusal) = answer {
            events.add(Event::Refused(refusal));
        }
        self.asked = Some(Asked {
            command,
            last: now,
            answer,
        });
        answer
    }

    /// `again`: no other command has come since the last grip like this.
    fn grip(&mut self, grip: Grip, again: bool, table: &FingerTable, active: &Active) -> Answer {
        let new = match self.accept_grip(grip, table, active) {
            Ok(target) => target,
            Err(refusal) => return Answer::Refused(refusal),
        };
        let payload = match grip {
            Grip::Payload(payload) => Some(payload),
            Grip::Default | Grip::Pressure(_) | Grip::Bend(_) => None,
        };
        let same = (new.0 - self.state.target().0).abs() <= SAME_KPA;
        let purpose = match self.state {
            State::Closing { .. } | State::Holding { .. } if same => {
                let unchanged = payload == self.payload;
                self.payload = payload;
                return match unchanged {
                    true => Answer::Unchanged,
                    false => Answer::Accepted,
                };
            }
            State::Empty { .. } if same && again => return Answer::Unchanged,
            State::Closing { purpose, .. } => purpose,
            State::Holding { .. } => Purpose::Change,
            State::Idle | State::Empty { .. } | State::Releasing { .. } | State::Fault { .. } => {
                self.touched = [false; FINGERS];
                self.regripped = false;
                Purpose::Grip
            }
        };
        self.payload = payload;
        self.state = State::Closing {
            target: new,
            reached: None,
            purpose,
        };
        Answer::Accepted
    }

    fn release(&mut self, now: Instant, contact: &Contact, events: &mut Events) -> Answer {
        let holding = self.state.is_holding();
        match &mut self.state {
            // Whoever stops the gripper does not want it to drop what it holds.
            State::Fault {
                fault: Fault::Stopped,
                ..
            } => Answer::Refused(Refusal::FaultLatched),
            // Any other fault must not keep the robot from putting down what it holds.
            State::Fault {
                target, watching, ..
            } if target.0 > 0.0 => {
                *target = Kilopascals(0.0);
                *watching = false;
                if holding {
                    events.add(Event::Released);
                }
                Answer::Accepted
            }
            State::Idle | State::Releasing { .. } | State::Fault { .. } => Answer::Unchanged,
            State::Closing { .. } | State::Holding { .. } | State::Empty { .. } => {
                let touches = contact.touching_count() > 0;
                let empty = matches!(self.state, State::Empty { .. });
                self.state = State::Releasing {
                    since: now,
                    holding: holding || touches && !empty,
                };
                Answer::Accepted
            }
        }
    }

    /// Clears what is latched and has no cause any more. No clock starts again, so whoever acknowledges
    /// all the time hides nothing. `cause`: what is wrong in this tick; `seen`: a fault was latched before.
    fn acknowledge(
        &mut self,
        now: Instant,
        cause: Option<Fault>,
        situation: &Situation,
        seen: bool,
        events: &mut Events,
    ) -> Answer {
        let repeated = self
            .acknowledged
            .replace(now)
            .is_some_and(|last| now.micros_since(last) < REPEAT_US);
        let mut cleared = self.lost.take().is_some();
        let mut remains = None;
        for (reported, gauge) in self.failed.iter_mut().zip(situation.reading.gauges) {
            match gauge {
                Gauge::Failed(fault) => remains = Some(fault.into()),
                Gauge::Valid(_) | Gauge::Missing => cleared |= core::mem::take(reported),
            }
        }
        if let State::Fault {
            fault,
            target,
            watching,
        } = self.state
        {
            let still = match seen {
                true => remaining(fault, cause, situation),
                false => Some(fault),
            };
            match still {
                Some(still) if still == fault => remains = Some(fault),
                // What is gone is cleared, and what is still there takes its place.
                Some(still) => {
                    self.state = State::Fault {
                        fault: still,
                        target,
                        watching: watching && still.rule().watches,
                    };
                    events.add(Event::Fault {
                        fault: still,
                        finger: None,
                    });
                    cleared = true;
                }
                // What is held stays held: acknowledging must not drop it.
                None => {
                    self.state = after_fault(now, target, watching);
                    cleared = true;
                }
            }
        }
        if cleared {
            // From here on the robot's last command is a new one.
            self.asked = None;
        }
        let answer = match remains {
            Some(fault) if !cleared => Answer::Refused(Refusal::CauseRemains(fault)),
            None if !cleared && repeated => Answer::Unchanged,
            _ => Answer::Accepted,
        };
        match answer {
            Answer::Refused(refusal) if !repeated => events.add(Event::Refused(refusal)),
            Answer::Accepted => events.add(Event::Acknowledged),
            Answer::Refused(_) | Answer::Unchanged => {}
        }
        answer
    }

    fn accept_grip(
        &self,
        grip: Grip,
        table: &FingerTable,
        active: &Active,
    ) -> Result<Kilopascals, Refusal> {
        if matches!(self.state, State::Fault { .. }) {
            return Err(Refusal::FaultLatched);
        }
        if self.lost.is_some() {
            return Err(Refusal::LostLatched);
        }
        let limit = active.max_pressure.0;
        match grip {
            Grip::Default => Ok(active.grip_pressure),
            // A NaN is in no range.
            Grip::Pressure(pressure) if pressure.0 > 0.0 && pressure.0 <= limit => Ok(pressure),
            Grip::Pressure(_) => Err(Refusal::PressureOutOfRange),
            Grip::Bend(bend) => match table.pressure_for_bend(bend) {
                (pressure, Range::Inside) if pressure.0 > 0.0 && pressure.0 <= limit => {
                    Ok(pressure)
                }
                _ => Err(Refusal::BendOutOfRange),
            },
            Grip::Payload(payload) => payload.pressure(table, active),
        }
    }

    fn advance(
        &mut self,
        now: Instant,
        situation: &Situation,
        active: &Active,
        events: &mut Events,
    ) {
        let contact = situation.contact;
        let pressure = situation.air.measured.map(|pressure| pressure.0);
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
            State::Closing {
                target,
                reached,
                purpose,
            } => {
                self.report_touch(contact, events);
                let Some(since) = reached else {
                    let near = pressure.is_some_and(|p| (p - target.0).abs() <= REACHED_KPA);
                    // A regulator that falls short of its set-point, but not by a fault's worth, has
                    // reached what it can.
                    let due = (situation.air.expected.0 - target.0).abs() <= DUE_KPA;
                    if near || due && situation.deviating_us == 0 {
                        self.state = State::Closing {
                            target,
                            reached: Some(now),
                            purpose,
                        };
                    }
                    return;
                };
                if now.micros_since(since) < active.settle_us {
                    return;
                }
                if contact.touching_count() >= FINGERS_OF_A_GRIP {
                    self.slipping = false;
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
            State::Holding { .. } | State::Fault { watching: true, .. } => {
                match situation.verdict {
                    Verdict::Unarmed | Verdict::Holding | Verdict::Lost { .. } => {
                        self.slipping = false
                    }
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
            State::Fault {
                watching: false, ..
            } => {}
            State::Releasing { since, holding } => {
                let open = pressure.is_some_and(|p| p < OPEN_KPA);
                let gone = contact.touching_count() == 0
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

    fn report_gauges(&mut self, reading: &Reading, events: &mut Events) {
        for (finger, reported) in self.failed.iter_mut().enumerate() {
            if let Gauge::Failed(fault) = reading.gauges[finger]
                && !*reported
            {
                *reported = true;
                events.add(Event::Fault {
                    fault: fault.into(),
                    finger: Some(finger as u8),
                });
            }
        }
    }

    /// Answers a tare that has ended, and asks for one that is due.
    fn report_zero(&mut self, situation: &Situation, events: &mut Events) {
        match situation.tare {
            Some(Ok(())) => events.add(Event::Tared),
            Some(Err(fault)) => events.add(Event::Refused(Refusal::TareRejected(fault))),
            None => {}
        }
        if situation.tare_due && !self.tare_was_due {
            events.add(Event::TareDue);
        }
        self.tare_was_due = situation.tare_due;
    }

    /// The first thing that makes going on unsafe.
    fn find_fault(
        &mut self,
        now: Instant,
        situation: &Situation,
        active: &Active,
    ) -> Option<Fault> {
        let reading = situation.reading;
        match reading.monitor {
            Monitor::Valid(pressure) if pressure.0 > active.max_pressure.0 + OVER_PRESSURE_KPA => {
                return Some(Fault::OverPressure);
            }
            Monitor::TooHigh => return Some(Fault::MonitorHigh),
            Monitor::Lost => return Some(Fault::MonitorLost),
            Monitor::Valid(_) | Monitor::Missing => {}
        }
        if reading.stale_ticks >= STALE_TICKS {
            return Some(match reading.overrun {
                true => Fault::AdcOverrun,
                false => Fault::AdcStale,
            });
        }
        if let Some(supply) = reading.supply {
            self.supply_ticks = if supply.0 < active.supply_min.0 {
                self.supply_ticks.saturating_add(1)
            } else {
                0
            };
        }
        if self.supply_ticks >= SUPPLY_TICKS && now.micros() > POWER_UP_US {
            return Some(Fault::SupplyLow);
        }
        if situation.deviating_us >= active.not_following_us {
            return Some(Fault::NotFollowing);
        }
        let silent_us = self.heard.map_or(0, |heard| now.micros_since(heard));
        if active.host_timeout_us.is_some_and(|most| silent_us > most) {
            return Some(Fault::HostSilent);
        }
        // Two fingers still tell a loss; one cannot tell a loss from a shift of the load.
        let mut failures = reading.gauges.iter().filter_map(|gauge| match gauge {
            Gauge::Failed(fault) => Some(*fault),
            Gauge::Valid(_) | Gauge::Missing => None,
        });
        failures.next()?;
        failures.next().map(Fault::from)
    }

    /// Goes to the safe state. The first fault stays latched; one that comes on top of it can only take
    /// more away.
    fn enter_fault(&mut self, fault: Fault, air: Air, active: &Active, events: &mut Events) {
        let rule = fault.rule();
        let vents = rule.output == SafeOutput::Vent || active.on_fault == OnFault::Vent;
        match &mut self.state {
            State::Fault {
                target, watching, ..
            } => {
                let takes_target = vents && target.0 > 0.0;
                let takes_watch = *watching && !rule.watches;
                if !takes_target && !takes_watch {
                    return;
                }
                if takes_target {
                    *target = Kilopascals(0.0);
                }
                *watching = false;
            }
            State::Idle
            | State::Closing { .. }
            | State::Holding { .. }
            | State::Empty { .. }
            | State::Releasing { .. } => {
                self.state = State::Fault {
                    fault,
                    target: match vents {
                        true => Kilopascals(0.0),
                        false => held_pressure(&self.state, air),
                    },
                    watching: !vents && rule.watches && self.state.is_holding(),
                };
            }
        }
        events.add(Event::Fault {
            fault,
            finger: None,
        });
    }
}

/// The pressure that a fault which holds keeps: the one that is there, where it is on its way to another.
/// Never more than the commands account for.
fn held_pressure(state: &State, air: Air) -> Kilopascals {
    let target = state.target();
    match state {
        State::Closing { .. } => {
            let measured = air.measured.unwrap_or(air.expected);
            Kilopascals(measured.0.min(air.expected.0.max(target.0)).max(0.0))
        }
        State::Idle
        | State::Holding { .. }
        | State::Empty { .. }
        | State::Releasing { .. }
        | State::Fault { .. } => target,
    }
}

/// Why a latched fault cannot be acknowledged yet. `cause`: what is wrong in this tick.
fn remaining(fault: Fault, cause: Option<Fault>, situation: &Situation) -> Option<Fault> {
    let pressure_is_off =
        matches!(fault, Fault::NotFollowing | Fault::AirLoss) && situation.deviating_us > 0;
    cause.or((pressure_is_off || !fault.rule().acknowledges).then_some(fault))
}

/// Where an acknowledged fault leads: on with the pressure that it kept, or open.
fn after_fault(now: Instant, target: Kilopascals, watching: bool) -> State {
    if target.0 > 0.0 {
        State::Closing {
            target,
            reached: None,
            purpose: match watching {
                true => Purpose::Change,
                false => Purpose::Grip,
            },
        }
    } else {
        State::Releasing {
            since: now,
            holding: false,
        }
    }
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new(None)
    }
}

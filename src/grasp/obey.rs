//! Commands → answers. Commands are streams: drivers rewrite the last one up to 100 times a second, PLCs
//! pulse inputs twice, people acknowledge again and again.

use super::failures::held_pressure;
use super::sweep::Sweep;
use super::{Active, Purpose, Situation, State, Supervisor};
use crate::command::{Answer, Command, Grip, Refusal, SweepFault};
use crate::condition::{Gauge, Reading};
use crate::estimate::{Calibration, Contact, OPEN_KPA};
use crate::event::{Event, Events};
use crate::fault::Fault;
use crate::table::{self, FingerTable, Range};
use crate::units::{FINGERS, Instant, Kilopascals};

/// A command that comes again within this time, with no other in between, is the same command: drivers
/// rewrite it up to 100 times a second, and the slowest that are known do once in half a second.
const REPEAT_US: u64 = 1_000_000;
/// The same for an acknowledgement, which says of what was latched at the time that it has been seen: a
/// button that is pressed four times a second is one.
const REPEATED_ACKNOWLEDGEMENT_US: u64 = 300_000;
/// Set-points this close are the same: a quarter of the regulator's repeatability of ±1 % of 200 kPa.
const SAME_KPA: f32 = 0.5;

impl Supervisor {
    /// Carries a command out, unless it is the last one come again.
    pub(super) fn obey(
        &mut self,
        now: Instant,
        command: Command,
        situation: &Situation,
        table: &FingerTable,
        active: &Active,
        events: &mut Events,
    ) -> Answer {
        let asked = self.asked.filter(|(asked, ..)| asked.is_same(&command));
        if let Some((_, last, answer)) = asked
            && now.micros_since(last) < REPEAT_US
            && command != Command::Stop
        {
            self.asked = Some((command, now, answer));
            return match answer {
                Answer::Refused(_) => answer,
                Answer::Accepted | Answer::Unchanged => Answer::Unchanged,
            };
        }
        if asked.is_none() {
            // An acknowledgement after something new is a new one.
            self.acknowledged = None;
        }
        let answer = match command {
            Command::Grip(grip) => self.grip(grip, asked.is_some(), table, active),
            Command::Release => self.release(now, situation.contact, events),
            Command::Halt => self.halt(now, situation),
            Command::Stop => {
                self.fault_was_seen = false;
                self.enter_fault(Fault::Stopped, situation.air, active, events);
                Answer::Accepted
            }
            Command::Tare if situation.zero.taring => Answer::Unchanged,
            Command::Tare if self.state == State::Idle => Answer::Accepted,
            Command::Tare => Answer::Refused(Refusal::NotIdle),
            Command::Sweep => self.sweep(active),
            Command::Continue
            | Command::Alive
            | Command::Motion(_)
            | Command::Slew(_)
            | Command::Acknowledge => Answer::Unchanged,
        };
        if let Answer::Refused(refusal) = answer {
            events.add(Event::Refused(refusal));
        }
        self.asked = Some((command, now, answer));
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
            State::Idle
            | State::Empty { .. }
            | State::Sweeping { .. }
            | State::Releasing { .. }
            | State::Fault { .. } => {
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
            State::Sweeping { .. } => {
                self.end_sweep(now, Err(SweepFault::Interrupted), events);
                Answer::Accepted
            }
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

    /// Keeps the pressure that is there, where it is on its way up; too little of it to close anything is let out.
    fn halt(&mut self, now: Instant, situation: &Situation) -> Answer {
        let State::Closing {
            target,
            reached: None,
            purpose,
        } = self.state
        else {
            return Answer::Unchanged;
        };
        let kept = held_pressure(&self.state, situation.air);
        if kept.0 >= target.0 {
            return Answer::Unchanged;
        }
        self.state = match kept.0 < OPEN_KPA && purpose == Purpose::Grip {
            true => State::Releasing {
                since: now,
                holding: false,
            },
            false => State::Closing {
                target: kept,
                reached: None,
                purpose,
            },
        };
        Answer::Accepted
    }

    /// Begins a sweep.
    fn sweep(&mut self, active: &Active) -> Answer {
        match self.state {
            State::Sweeping { .. } => return Answer::Unchanged,
            State::Fault { .. } => return Answer::Refused(Refusal::FaultLatched),
            State::Idle => {}
            _ => return Answer::Refused(Refusal::NotIdle),
        }
        if self.lost.is_some() {
            return Answer::Refused(Refusal::LostLatched);
        }
        self.sweep = Sweep::begins(active.max_pressure);
        self.state = State::Sweeping {
            target: Kilopascals(0.0),
        };
        Answer::Accepted
    }

    /// Ends a sweep: the fingers open, and what it has found can be taken.
    pub(super) fn end_sweep(
        &mut self,
        now: Instant,
        result: Result<Calibration, SweepFault>,
        events: &mut Events,
    ) {
        self.state = State::Releasing {
            since: now,
            holding: false,
        };
        match result {
            Ok(calibration) => {
                self.calibration = Some(calibration);
                events.add(Event::Swept {
                    error_percent: calibration.error_percent,
                });
            }
            Err(fault) => events.add(Event::Refused(Refusal::SweepRejected(fault))),
        }
    }

    /// Somebody has seen what is latched: a loss is cleared, a fault ends with its cause, now or later (as
    /// ISA 18.2 has it for alarms). No clock starts again, so acknowledging all the time hides nothing.
    /// `latched`: the fault that was latched before this tick.
    pub(super) fn acknowledge(
        &mut self,
        now: Instant,
        latched: Option<Fault>,
        reading: &Reading,
        events: &mut Events,
    ) -> Answer {
        let repeated = self
            .acknowledged
            .replace(now)
            .is_some_and(|last| now.micros_since(last) < REPEATED_ACKNOWLEDGEMENT_US);
        if repeated {
            return Answer::Unchanged;
        }
        let failed = reading.gauges.map(Gauge::has_failed);
        let gauges = failed.contains(&true) || self.failed != failed;
        if latched.is_some() || gauges || self.lost.take().is_some() {
            // From here on the robot's last command is a new one.
            self.asked = None;
        }
        self.lost = None;
        self.fault_was_seen = latched.is_some() && latched == self.state.fault();
        events.add(Event::Acknowledged);
        Answer::Accepted
    }

    fn accept_grip(
        &self,
        grip: Grip,
        table: &FingerTable,
        active: &Active,
    ) -> Result<Kilopascals, Refusal> {
        match self.state {
            State::Fault { .. } => return Err(Refusal::FaultLatched),
            State::Sweeping { .. } => return Err(Refusal::Sweeping),
            _ => {}
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
            Grip::Bend(bend) => match table::pressure_for_bend(table, bend) {
                (pressure, Range::Inside) if pressure.0 > 0.0 && pressure.0 <= limit => {
                    Ok(pressure)
                }
                _ => Err(Refusal::BendOutOfRange),
            },
            Grip::Payload(payload) => {
                payload.pressure(table, active.lift_margin, active.max_pressure)
            }
        }
    }
}

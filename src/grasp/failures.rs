//! What makes going on unsafe, and the safe state that it leads to.

use super::{Active, OnFault, Purpose, Situation, State, Supervisor};
use crate::air::Air;
use crate::command::{Refusal, SweepFault};
use crate::condition::{Gauge, Monitor, Reading};
use crate::event::{Event, Events};
use crate::fault::{Fault, SafeOutput};
use crate::units::{FINGERS, Instant, Kilopascals};

/// Measured pressure may exceed the limit by this before it is a fault: 2.5 % of full scale.
const OVER_PRESSURE_KPA: f32 = 5.0;
/// Ticks without usable data: two are a hiccup.
const STALE_TICKS: u32 = 5;
/// The robot's 24 V may come this much later than the board's own supply.
const POWER_UP_US: u64 = 1_000_000;
/// Ticks with a rail that is off: fewer are a spike.
const RAIL_TICKS: u16 = 10;
/// Supply must be low this long: 24 V devices ride through gaps of 10 ms (IEC 61131-2).
const SUPPLY_TICKS: u16 = 20;

impl Supervisor {
    pub(super) fn report_gauges(&mut self, reading: &Reading, events: &mut Events) {
        for (finger, reported) in self.failed.iter_mut().enumerate() {
            match reading.gauges[finger] {
                Gauge::Failed(fault) if !*reported => {
                    *reported = true;
                    events.add(Event::Fault {
                        fault: fault.into(),
                        finger: Some(finger as u8),
                    });
                }
                Gauge::Failed(_) | Gauge::Missing => {}
                // Acknowledged, and good again.
                Gauge::Valid(_) => *reported = false,
            }
        }
    }

    /// The first thing that makes going on unsafe.
    pub(super) fn find_fault(
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
        if reading.rail_is_off {
            self.rail_ticks = self.rail_ticks.saturating_add(1);
            if self.rail_ticks >= RAIL_TICKS {
                return Some(Fault::RailOff);
            }
        } else {
            self.rail_ticks = 0;
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
        if situation.air.deviating_us >= active.not_following_us {
            return Some(Fault::NotFollowing);
        }
        // Open fingers, and those that open, harm nobody: a robot that is off, or starts later, is no fault.
        let waits = !matches!(self.state, State::Idle | State::Releasing { .. });
        let silent_us = self.heard.map_or(0, |heard| now.micros_since(heard));
        if waits && active.host_timeout_us.is_some_and(|most| silent_us > most) {
            return Some(Fault::HostSilent);
        }
        // Two fingers still tell a loss; one cannot tell a loss from a shift of the load. So this is the failure that leaves
        // fewer than two.
        let mut failures = reading.gauges.iter().filter_map(|gauge| match gauge {
            Gauge::Failed(fault) => Some(*fault),
            Gauge::Valid(_) | Gauge::Missing => None,
        });
        failures.nth(FINGERS - 2).map(Fault::from)
    }

    /// Goes to the safe state. The first fault stays latched; one that comes on top of it can only take
    /// more away.
    pub(super) fn enter_fault(
        &mut self,
        fault: Fault,
        air: &Air,
        active: &Active,
        events: &mut Events,
    ) {
        let rule = fault.rule();
        let vents = rule.output == SafeOutput::Vent || active.on_fault == OnFault::Vent;
        let mut swept = false;
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
            | State::Sweeping { .. }
            | State::Releasing { .. } => {
                swept = matches!(self.state, State::Sweeping { .. });
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
        if swept {
            let interrupted = Refusal::SweepRejected(SweepFault::Interrupted);
            events.add(Event::Refused(interrupted));
        }
    }

    /// Ends a fault that has been acknowledged, once nothing is wrong any more. `cause`: what is wrong in
    /// this tick.
    pub(super) fn leave_fault(
        &mut self,
        now: Instant,
        cause: Option<Fault>,
        situation: &Situation,
        events: &mut Events,
    ) {
        let State::Fault {
            fault,
            target,
            watching,
        } = self.state
        else {
            self.fault_was_seen = false;
            return;
        };
        if !self.fault_was_seen {
            return;
        }
        match remaining(fault, cause, situation) {
            // What is held stays held: acknowledging must not drop it.
            None => self.state = after_fault(now, target, watching),
            Some(still) if still == fault => return,
            // What has gone is cleared; what is still there takes its place, to be acknowledged in its turn.
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
            }
        }
        self.fault_was_seen = false;
    }
}

/// The pressure that a fault which holds keeps: the one that is there, where it is on its way to another.
/// Never more than the commands account for.
pub(super) fn held_pressure(state: &State, air: &Air) -> Kilopascals {
    let target = state.target();
    match state {
        State::Closing { .. } => {
            let expected = air.expected.unwrap_or_default();
            let measured = air.measured.unwrap_or(expected);
            Kilopascals(measured.0.min(expected.0.max(target.0)).max(0.0))
        }
        // Nothing is in the grip.
        State::Sweeping { .. } => Kilopascals(0.0),
        State::Idle
        | State::Holding { .. }
        | State::Empty { .. }
        | State::Releasing { .. }
        | State::Fault { .. } => target,
    }
}

/// What keeps a latched fault from ending. `cause`: what is wrong in this tick.
fn remaining(fault: Fault, cause: Option<Fault>, situation: &Situation) -> Option<Fault> {
    if !fault.rule().acknowledges {
        return Some(fault);
    }
    let pressure_is_off =
        matches!(fault, Fault::NotFollowing | Fault::AirLoss) && situation.air.deviating_us > 0;
    cause.or(pressure_is_off.then_some(fault))
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

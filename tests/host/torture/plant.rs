//! What can happen to the mocked board: an object that comes and goes, and everything that breaks for a
//! while or for good.

use crate::mock::{GaugeState, MockBoard};
use softgrip::units::AdcCode;
use softgrip::{Command, Outputs};

/// Ticks in which an object that is put in presses the fingers aside; faster would be a gauge's jump.
const PUT_IN_MS: f32 = 30.0;
/// A fall takes the residual from 90 % to 10 % in 35 ms.
const FALL_MS: f32 = 44.0;
/// What is left of the residual when the object has gone. The weight of a simulated finger leaves up to four
/// times as much, which at low pressure is more than the contact threshold: such a floor has to be learned
/// from an empty close, and no threshold can tell it from an object.
const FLOOR: f32 = 0.04;
/// A gauge that breaks into noise is known as noisy within this time.
const OUTBREAK_MS: u16 = 20;
/// The next object comes when the fingers have felt the last one go.
const AFTER_ANOTHER_MS: u16 = 200;
/// A hose that bursts at the gripper empties it with this time constant.
const BURST_MS: f32 = 10.0;

/// Something that happens to the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Happening {
    /// An object comes between these fingers.
    PutIn([bool; 3]),
    /// It falls.
    Fall,
    /// It leaves sideways: this finger follows the others after so many ms.
    Sideways { last: usize, after_ms: u16 },
    /// It slides so far in so many ms that the residual rises by this share, and then falls.
    SlideOut { rise: f32, ms: u16 },
    /// One gauge fails, or is good again.
    Gauge(usize, GaugeState),
    /// The valve moves no more.
    ValveStuck,
    /// The valve gives this pressure, whatever it is told.
    ValveForced(f32),
    /// The valve and the hose become quicker or slower by this factor.
    ValveLag(f32),
    /// The hose leaks: the pressure never gets above this, kPa.
    Leak(f32),
    /// The hose bursts.
    Burst,
    /// Valve and hose are good again.
    AirRepaired,
    /// The supply is gone for so many ms.
    SupplyDip(u16),
    /// The monitor's wire carries this code, or its signal again.
    MonitorWire(Option<AdcCode>),
    /// So many ticks without converter data.
    Late(u16),
    /// So many ticks with lost converter data.
    Overrun(u16),
}

/// Where the object is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Object {
    /// Not there, or on its way out since so many ms, from between these fingers.
    Out(Exit, u16, [bool; 3]),
    /// Between these fingers, since so many ms.
    In(u16, [bool; 3]),
}

/// How an object leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exit {
    Fall,
    Sideways { last: usize, after_ms: u16 },
    Slide { rise: f32, ms: u16 },
}

/// The board and what surrounds it.
#[derive(Clone)]
pub struct Plant {
    pub board: MockBoard,
    pub object: Object,
    /// Of the good valve and hose, ms.
    hose_lag_ms: f32,
    late_ticks: u16,
    overrun_ticks: u16,
    dip_ticks: u16,
    /// Ticks in which a gauge that has broken into noise may not be known as noisy yet.
    outbreak_ticks: u16,
}

impl Plant {
    pub fn new(board: MockBoard) -> Self {
        Self {
            hose_lag_ms: board.valve_lag_ms,
            board,
            object: Object::Out(Exit::Fall, u16::MAX, [false; 3]),
            late_ticks: 0,
            overrun_ticks: 0,
            dip_ticks: 0,
            outbreak_ticks: 0,
        }
    }

    pub fn happen(&mut self, happening: Happening) {
        let board = &mut self.board;
        match happening {
            Happening::PutIn(fingers) => {
                if let Object::Out(_, ms, _) = self.object
                    && ms >= AFTER_ANOTHER_MS
                {
                    self.object = Object::In(0, fingers);
                }
            }
            Happening::Fall => self.leave(Exit::Fall),
            Happening::Sideways { last, after_ms } => self.leave(Exit::Sideways { last, after_ms }),
            Happening::SlideOut { rise, ms } => self.leave(Exit::Slide { rise, ms }),
            Happening::Gauge(finger, state) => {
                board.gauges[finger] = state;
                if let GaugeState::Noisy(_) = state {
                    self.outbreak_ticks = OUTBREAK_MS;
                }
            }
            Happening::ValveStuck => board.valve_stuck = true,
            Happening::ValveForced(kpa) => board.valve_forced_kpa = Some(kpa),
            Happening::ValveLag(factor) => board.valve_lag_ms = factor * self.hose_lag_ms,
            Happening::Leak(kpa) => board.leak_kpa = kpa,
            Happening::Burst => {
                board.leak_kpa = 0.0;
                board.valve_lag_ms = BURST_MS;
            }
            Happening::AirRepaired => self.repair_air(),
            Happening::SupplyDip(ticks) => self.dip_ticks = ticks,
            Happening::MonitorWire(code) => board.monitor_wire = code,
            Happening::Late(ticks) => self.late_ticks = ticks,
            Happening::Overrun(ticks) => self.overrun_ticks = ticks,
        }
    }

    /// Everything is good again; the object stays where it is.
    pub fn repair(&mut self) {
        self.repair_air();
        self.board.gauges = [GaugeState::Good; 3];
        self.board.monitor_wire = None;
        (self.late_ticks, self.overrun_ticks, self.dip_ticks) = (0, 0, 0);
    }

    fn repair_air(&mut self) {
        self.board.valve_stuck = false;
        self.board.valve_forced_kpa = None;
        self.board.leak_kpa = f32::MAX;
        self.board.valve_lag_ms = self.hose_lag_ms;
    }

    fn leave(&mut self, exit: Exit) {
        // One that is still on its way in goes on.
        if let Object::In(_, fingers) = self.object
            && self.is_carried()
        {
            // Between two fingers nothing is held by one.
            let sideways = matches!(exit, Exit::Sideways { .. }) && fingers != [true; 3];
            let exit = if sideways { Exit::Fall } else { exit };
            self.object = Object::Out(exit, 0, fingers);
        }
    }

    /// One tick.
    pub fn step(&mut self, command: Command) -> Outputs {
        self.prepare();
        self.board.quiet_step(command)
    }

    /// What the surroundings do to the board in this tick.
    pub fn prepare(&mut self) {
        let grip = &mut self.board.grip;
        match &mut self.object {
            Object::In(ms, fingers) => {
                *ms = ms.saturating_add(1);
                for (grip, touches) in grip.iter_mut().zip(fingers) {
                    let wanted = if *touches { 1.0 } else { 0.0 };
                    *grip += (wanted - *grip).clamp(-1.0 / PUT_IN_MS, 1.0 / PUT_IN_MS);
                }
            }
            Object::Out(exit, ms, fingers) => {
                *ms = ms.saturating_add(1);
                for (finger, grip) in grip.iter_mut().enumerate() {
                    if fingers[finger] {
                        *grip = exit.share(finger, *ms);
                    }
                }
            }
        }
        let pass = |ticks: &mut u16| {
            let on = *ticks > 0;
            *ticks = ticks.saturating_sub(1);
            on
        };
        pass(&mut self.outbreak_ticks);
        self.board.late = pass(&mut self.late_ticks);
        self.board.overrun = pass(&mut self.overrun_ticks);
        self.board.supply_v = if pass(&mut self.dip_ticks) {
            10.0
        } else {
            24.0
        };
    }

    /// A gauge has just broken into noise that may look like anything until it is known.
    pub fn noise_breaks_out(&self) -> bool {
        self.outbreak_ticks > 0
    }

    /// The converter delivers nothing usable in this tick.
    pub fn is_blind(&self) -> bool {
        self.board.late || self.board.overrun
    }

    /// The object is all the way in.
    pub fn is_carried(&self) -> bool {
        // One tick more, for the steps do not add up to one exactly.
        matches!(self.object, Object::In(ms, _) if f32::from(ms) > PUT_IN_MS)
    }

    /// The only finger that still feels the object while it leaves sideways, and for how long, ms.
    pub fn lingers(&self) -> Option<(usize, u16)> {
        match self.object {
            Object::Out(Exit::Sideways { last, after_ms }, ..) => Some((last, after_ms)),
            _ => None,
        }
    }

    /// Ticks since the object's grip began to collapse; none while it is there, or still slides.
    pub fn collapsing_ticks(&self) -> Option<u16> {
        match self.object {
            Object::In(..) => None,
            Object::Out(Exit::Slide { ms: slide, .. }, ms, _) => ms.checked_sub(slide),
            Object::Out(_, ms, _) => Some(ms),
        }
    }
}

impl Exit {
    /// Share of the object's grip that a finger still feels, `ms` after it began.
    fn share(self, finger: usize, ms: u16) -> f32 {
        let fall = |ms: u16| (1.0 - f32::from(ms) / FALL_MS).max(FLOOR);
        match self {
            Self::Fall => fall(ms),
            Self::Sideways { last, after_ms } if finger == last => {
                fall(ms.saturating_sub(after_ms))
            }
            Self::Sideways { .. } => fall(ms),
            Self::Slide { rise, ms: slide } => match ms.checked_sub(slide) {
                Some(ms) => (1.0 + rise) * fall(ms),
                None => 1.0 + rise * f32::from(ms) / f32::from(slide),
            },
        }
    }
}

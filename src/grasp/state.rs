//! Where the gripper is.

use crate::fault::Fault;
use crate::units::{Instant, Kilopascals};

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
    /// A free-bend sweep is running: the pressure goes up and down, and nothing may be in the grip.
    Sweeping {
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
            | Self::Sweeping { target }
            | Self::Fault { target, .. } => target,
            Self::Idle | Self::Releasing { .. } => Kilopascals(0.0),
        }
    }

    /// The fault that is latched.
    pub fn fault(&self) -> Option<Fault> {
        match *self {
            Self::Fault { fault, .. } => Some(fault),
            _ => None,
        }
    }

    /// Whether nothing but zero may be commanded: a fault that has let the air out.
    pub fn is_vented(&self) -> bool {
        matches!(self, Self::Fault { target, .. } if target.0 <= 0.0)
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

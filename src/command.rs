//! What the robot wants, and why it may not get it.

use crate::table::{self, FingerTable, ObjectKind, Range};
use crate::units::{Degrees, Kilograms, Kilopascals, MetresPerSecondSquared, Newtons};

/// How hard to grip.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Grip {
    /// At the pressure of the settings.
    Default,
    /// At this pressure.
    Pressure(Kilopascals),
    /// At the pressure that bends a free finger this far.
    Bend(Degrees),
    /// At the lowest pressure that lifts this with the margin of the settings.
    Payload(Payload),
}

/// What the arm does, if the robot tells. A slip or a loss at rest is then told sooner, for it need not be
/// told from what an arm's motion does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motion {
    /// It may move, or nobody says.
    #[default]
    Moving,
    /// It stands still.
    Still,
}

/// What is to be carried, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Payload {
    /// Its shape, in the size of the recipe.
    pub kind: ObjectKind,
    /// Its mass.
    pub mass: Kilograms,
    /// Greatest acceleration of the arm, upwards.
    pub acceleration: MetresPerSecondSquared,
}

/// The slowest that the set-point may be told to move, as a share of the slew of the settings.
pub const LEAST_SLEW: f32 = 0.01;

/// Standard gravity, m/s².
const GRAVITY: f32 = 9.806_65;

/// A margin is taken of no less than this, so that it stays a number: the weight of 0.1 g.
const LEAST_LOAD_N: f32 = 1e-3;

impl Payload {
    /// What the fingers must lift: `m (g + a)` (paper, eq. 35, corrected).
    pub fn load(&self) -> Newtons {
        Newtons(self.mass.0 * (GRAVITY + self.acceleration.0))
    }

    /// Lift at `pressure` beyond the load, as a share of the load; none where the lift is not known.
    pub fn margin(&self, table: &FingerTable, pressure: Kilopascals) -> Option<f32> {
        let (lift, _) = table::lift(table, self.kind, pressure)?;
        Some(lift.0 / self.load().0.max(LEAST_LOAD_N) - 1.0)
    }

    /// The lowest pressure that lifts the payload with this margin, as a share of the load, or why there is
    /// none up to `limit`.
    pub(crate) fn pressure(
        &self,
        table: &FingerTable,
        margin: f32,
        limit: Kilopascals,
    ) -> Result<Kilopascals, Refusal> {
        // A NaN is in no range.
        if !(self.mass.0 > 0.0 && self.acceleration.0 >= 0.0 && self.load().0.is_finite()) {
            return Err(Refusal::PayloadInvalid);
        }
        let wanted = Newtons(self.load().0 * (1.0 + margin));
        match table::pressure_for_lift(table, self.kind, wanted) {
            Some((pressure, Range::Inside)) if pressure.0 <= limit.0 => Ok(pressure),
            _ => {
                let (most, _) = table::lift(table, self.kind, limit).ok_or(Refusal::LiftUnknown)?;
                let per_kilogram = (1.0 + margin) * (GRAVITY + self.acceleration.0);
                Err(Refusal::PayloadTooHeavy {
                    possible: Kilograms(most.0 / per_kilogram),
                })
            }
        }
    }
}

/// What the robot wants. The latest command wins; a tick without a new one gets `Continue`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Nothing has come from the robot.
    Continue,
    /// The robot is there and wants nothing new; any other command says that too.
    Alive,
    /// What the arm does from now on.
    Motion(Motion),
    /// The set-point moves by this share of the slew of the settings from now on. Above 1, and what is no number, is 1;
    /// below [`LEAST_SLEW`] is that.
    Slew(f32),
    /// Close the fingers.
    Grip(Grip),
    /// Let go.
    Release,
    /// Keep the pressure that is there, where it is on its way up. What is held stays held, a release goes on.
    Halt,
    /// Go to the safe state at once.
    Stop,
    /// The operator has seen what is latched.
    Acknowledge,
    /// Take the present strain as zero.
    Tare,
    /// Learn the mounted fingers in a free-bend sweep, with nothing in the grip.
    Sweep,
}

/// Why a command was not carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The pressure is not a number between zero and the limit.
    PressureOutOfRange,
    /// No pressure within the limit bends the finger that far.
    BendOutOfRange,
    /// Mass or acceleration is not a positive number.
    PayloadInvalid,
    /// No pressure within the limit lifts that much with the margin of the settings.
    PayloadTooHeavy {
        /// What could be lifted at that acceleration.
        possible: Kilograms,
    },
    /// The finger's table does not know what is lifted at the pressures that it would take: the recipe
    /// has no grasp, or fingers and object find no equilibrium there.
    LiftUnknown,
    /// A fault is latched.
    FaultLatched,
    /// A loss is latched.
    LostLatched,
    /// A tare or a sweep needs open fingers without pressure.
    NotIdle,
    /// A sweep is running; a release or a stop ends it.
    Sweeping,
    /// A tare did not give new offsets.
    TareRejected(TareFault),
    /// A sweep has learned nothing: what was known before is kept.
    SweepRejected(SweepFault),
}

/// Why a sweep has learned nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SweepFault {
    /// A gauge has failed, or the gauges do not see bending.
    Gauge,
    /// The pressure did not come within 8 kPa of a step: the supply is low, or the air leaks.
    Pressure,
    /// The fingers bend less than free ones, or stop before they can have met: something is in the grip.
    Contact,
    /// More noise than a loss could be told from.
    Noise,
    /// A finger's curve is none of this recipe's: it touches something, or is another finger.
    Shape,
    /// A finger bends more than any mould or gauge would explain: it is not this recipe's.
    OutOfRange,
    /// A release, a stop or a fault came in between.
    Interrupted,
}

/// Why a tare did not give new offsets, judged over its whole length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TareFault {
    /// A gauge has failed.
    Gauge,
    /// There was pressure.
    Pressure,
    /// A finger was bent back from where it rests: something is in the grip.
    Contact,
    /// More noise than a loss could be told from.
    Noise,
    /// The strain was not steady.
    Drift,
    /// Further from zero than the unbalance of any bridge.
    OutOfRange,
    /// A grip, a stop or a fault came in between.
    Interrupted,
}

/// What becomes of a command. Every command but [`Command::Continue`] has exactly one, in its tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Answer {
    /// It is being carried out.
    Accepted,
    /// It asks for what is being done already.
    Unchanged,
    /// It is not carried out.
    Refused(Refusal),
}

impl Command {
    /// Whether both ask for the same, to the bit. Two numbers that are none are the same too: whoever
    /// repeats nonsense has one answer.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Grip(Grip::Pressure(a)), Self::Grip(Grip::Pressure(b))) => {
                a.0.to_bits() == b.0.to_bits()
            }
            (Self::Grip(Grip::Bend(a)), Self::Grip(Grip::Bend(b))) => {
                a.0.to_bits() == b.0.to_bits()
            }
            (Self::Grip(Grip::Payload(a)), Self::Grip(Grip::Payload(b))) => {
                a.kind == b.kind
                    && a.mass.0.to_bits() == b.mass.0.to_bits()
                    && a.acceleration.0.to_bits() == b.acceleration.0.to_bits()
            }
            _ => self == other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::FINGER;

    fn sphere(kg: f32) -> Payload {
        Payload {
            kind: ObjectKind::Sphere,
            mass: Kilograms(kg),
            acceleration: MetresPerSecondSquared(5.0),
        }
    }

    fn pressure(table: &FingerTable, kg: f32) -> Result<Kilopascals, Refusal> {
        sphere(kg).pressure(table, 0.2, Kilopascals(160.0))
    }

    #[test]
    fn what_the_table_cannot_tell_is_refused_as_unknown() {
        let without = FingerTable {
            lift_rows: [0, 81],
            ..FINGER
        };
        assert_eq!(pressure(&without, 0.05), Err(Refusal::LiftUnknown));
        assert_eq!(sphere(0.05).margin(&without, Kilopascals(140.0)), None);
        assert_eq!(pressure(&without, -1.0), Err(Refusal::PayloadInvalid));

        let partly = FingerTable {
            lift_rows: [61, 81],
            ..FINGER
        };
        assert_eq!(pressure(&partly, 0.02), pressure(&FINGER, 0.02));
        assert!(pressure(&FINGER, 0.02).is_ok());
        assert_eq!(pressure(&partly, 2.0), Err(Refusal::LiftUnknown));
        assert!(matches!(
            pressure(&FINGER, 2.0),
            Err(Refusal::PayloadTooHeavy { .. })
        ));
    }
}

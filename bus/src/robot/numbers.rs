//! Numbers on the bus of what has names in the code. They never change their meaning.

use super::link::Fate;
use softgrip::command::{Refusal, SweepFault, TareFault};
use softgrip::detect::LossCause;

/// Refusals by number, with what each means, for the manual.
#[rustfmt::skip]
pub const REFUSALS: [(u16, &str); 11] = [
    (1, "The pressure is not between zero and the highest"),
    (2, "No pressure up to the highest bends the fingers that far"),
    (3, "Mass or acceleration is not a positive number"),
    (4, "No pressure up to the highest lifts that much with the margin of the settings; the detail is the mass in g that would be possible"),
    (5, "The finger's table does not know what is lifted"),
    (6, "A fault is latched"),
    (7, "A loss is latched"),
    (8, "A tare or a sweep needs open fingers without pressure"),
    (9, "A sweep is running"),
    (10, "A tare gave no new zeros; the detail says why"),
    (11, "A sweep has learned nothing; the detail says why"),
];

/// Why a tare or a sweep has failed, by number, for the manual.
pub const DETAILS: [(u16, &str); 8] = [
    (1, "A gauge has failed, or the gauges do not see bending"),
    (2, "There was pressure, or it did not come to a step"),
    (3, "Something is in the grip"),
    (4, "More noise than a loss could be told from"),
    (5, "The strain was not steady"),
    (6, "Out of the range of any gauge or finger"),
    (7, "Another command, a stop or a fault came in between"),
    (8, "A finger's curve is none of the recipe's"),
];

/// The number of a refusal and its detail.
pub fn of_refusal(refusal: Refusal) -> (u16, u16) {
    match refusal {
        Refusal::PressureOutOfRange => (1, 0),
        Refusal::BendOutOfRange => (2, 0),
        Refusal::PayloadInvalid => (3, 0),
        // Below zero or beyond 65 kg it is the nearest that there is a number for.
        Refusal::PayloadTooHeavy { possible } => (4, (1e3 * possible.0) as u16),
        Refusal::LiftUnknown => (5, 0),
        Refusal::FaultLatched => (6, 0),
        Refusal::LostLatched => (7, 0),
        Refusal::NotIdle => (8, 0),
        Refusal::Sweeping => (9, 0),
        Refusal::TareRejected(fault) => (10, of_tare(fault)),
        Refusal::SweepRejected(fault) => (11, of_sweep(fault)),
    }
}

fn of_tare(fault: TareFault) -> u16 {
    match fault {
        TareFault::Gauge => 1,
        TareFault::Pressure => 2,
        TareFault::Contact => 3,
        TareFault::Noise => 4,
        TareFault::Drift => 5,
        TareFault::OutOfRange => 6,
        TareFault::Interrupted => 7,
    }
}

fn of_sweep(fault: SweepFault) -> u16 {
    match fault {
        SweepFault::Gauge => 1,
        SweepFault::Pressure => 2,
        SweepFault::Contact => 3,
        SweepFault::Noise => 4,
        SweepFault::OutOfRange => 6,
        SweepFault::Interrupted => 7,
        SweepFault::Shape => 8,
    }
}

/// The number of how a loss showed; zero is for none.
pub fn of_cause(cause: LossCause) -> u16 {
    match cause {
        LossCause::Collapse => 1,
        LossCause::OneSided => 2,
        LossCause::Missing => 3,
    }
}

/// The number of what has become of a command; zero is for none.
pub fn of_fate(fate: Fate) -> u16 {
    match fate {
        Fate::Accepted => 1,
        Fate::Unchanged => 2,
        Fate::Refused(_) => 3,
        Fate::Dropped => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrip::units::Kilograms;
    use std::vec::Vec;

    #[test]
    fn every_refusal_has_its_own_number_and_its_line_in_the_manual() {
        let possible = Kilograms(0.0425);
        let refusals = [
            Refusal::PressureOutOfRange,
            Refusal::BendOutOfRange,
            Refusal::PayloadInvalid,
            Refusal::PayloadTooHeavy { possible },
            Refusal::LiftUnknown,
            Refusal::FaultLatched,
            Refusal::LostLatched,
            Refusal::NotIdle,
            Refusal::Sweeping,
            Refusal::TareRejected(TareFault::Drift),
            Refusal::SweepRejected(SweepFault::Shape),
        ];
        let numbers: Vec<u16> = refusals.iter().map(|&r| of_refusal(r).0).collect();
        let listed: Vec<u16> = REFUSALS.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, listed);
        let details: Vec<u16> = refusals.iter().map(|&r| of_refusal(r).1).collect();
        assert_eq!(details, [0, 0, 0, 42, 0, 0, 0, 0, 0, 5, 8]);
    }

    #[test]
    fn a_possible_mass_that_has_no_register_is_the_nearest_one() {
        for (kg, shown) in [(-1.0, 0), (f32::NAN, 0), (1e9, u16::MAX)] {
            let possible = Kilograms(kg);
            let heavy = Refusal::PayloadTooHeavy { possible };
            assert_eq!(of_refusal(heavy), (4, shown));
        }
    }
}

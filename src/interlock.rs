//! The last word before the hardware: whatever the stages above say, the output is a pressure
//! between zero and the limit, and zero where only zero is safe.

use crate::condition::Monitor;
use crate::frontend::FrontEnd;
use crate::grasp::State;
use crate::math::{larger, smaller};
use crate::units::{DacCode, Kilopascals};

/// The code for a command that may be applied: from zero to `limit`.
pub fn interlock(
    command: Kilopascals,
    state: &State,
    monitor: Monitor,
    limit: Kilopascals,
    front_end: &FrontEnd,
) -> DacCode {
    let too_high = matches!(monitor, Monitor::TooHigh);
    if state.is_vented() || too_high || command.0.is_nan() {
        return DacCode(0);
    }
    let limited = smaller(larger(command.0, 0.0), limit.0);
    front_end.command(Kilopascals(limited))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use proptest::prelude::*;

    const FE: FrontEnd = FrontEnd::REFERENCE;
    const LIMIT: Kilopascals = Kilopascals(160.0);

    proptest! {
        #[test]
        fn no_number_at_all_leaves_the_limits(bits: u32) {
            let command = Kilopascals(f32::from_bits(bits));
            let code = interlock(command, &State::Idle, Monitor::Missing, LIMIT, &FE);
            // Half a code of rounding.
            let limit = LIMIT.0 + 0.5 / FE.command_codes_per_kpa;
            prop_assert!(FE.commanded(code).0 <= limit);
        }

        #[test]
        fn what_lies_within_the_limits_is_applied(kpa in 0.0f32..160.0) {
            let valid = Monitor::Valid(Kilopascals(kpa));
            for monitor in [valid, Monitor::Missing, Monitor::Lost] {
                let code = interlock(Kilopascals(kpa), &State::Idle, monitor, LIMIT, &FE);
                let off = FE.commanded(code).0 - kpa;
                prop_assert!(off.abs() <= 0.51 / FE.command_codes_per_kpa, "{}", off);
            }
        }
    }

    #[test]
    fn a_fault_overrules_the_command_where_it_vents_and_only_there() {
        for (kept, vents) in [(0.0, true), (80.0, false)] {
            let state = State::Fault {
                fault: Fault::OverPressure,
                target: Kilopascals(kept),
                watching: false,
            };
            let code = interlock(Kilopascals(100.0), &state, Monitor::Missing, LIMIT, &FE);
            assert_eq!(code == DacCode(0), vents);
        }
    }

    #[test]
    fn nothing_is_commanded_to_a_monitor_above_its_range_nor_for_a_command_that_is_no_number() {
        for (command, monitor) in [(100.0, Monitor::TooHigh), (f32::NAN, Monitor::Missing)] {
            let code = interlock(Kilopascals(command), &State::Idle, monitor, LIMIT, &FE);
            assert_eq!(code, DacCode(0));
        }
    }
}

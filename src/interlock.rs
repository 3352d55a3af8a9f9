//! The last word before the hardware: whatever the stages above say, the output is a pressure
//! between zero and the limit, and zero where only zero is safe.

use crate::condition::Monitor;
use crate::grasp::State;
use crate::math::{larger, smaller};
use crate::settings::Active;
use crate::units::{DacCode, Kilopascals};

/// The code for a command that may be applied.
pub fn interlock(
    command: Kilopascals,
    state: &State,
    monitor: Monitor,
    active: &Active,
) -> DacCode {
    let too_high = matches!(monitor, Monitor::TooHigh);
    if state.is_vented() || too_high || command.0.is_nan() {
        return DacCode(0);
    }
    let limited = smaller(larger(command.0, 0.0), active.max_pressure.0);
    active.front_end.command(Kilopascals(limited))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::frontend::FrontEnd;
    use crate::settings::Settings;
    use crate::table::FINGER;
    use proptest::prelude::*;

    fn active() -> Active {
        Settings::default()
            .validate(&FrontEnd::REFERENCE, &FINGER)
            .expect("good settings")
    }

    proptest! {
        #[test]
        fn no_number_at_all_leaves_the_limits(bits: u32) {
            let active = active();
            let command = Kilopascals(f32::from_bits(bits));
            let code = interlock(command, &State::Idle, Monitor::Missing, &active);
            // Half a code of rounding.
            let limit = active.max_pressure.0 + 0.5 / active.front_end.command_codes_per_kpa;
            prop_assert!(active.front_end.commanded(code).0 <= limit);
        }
    }

    #[test]
    fn a_vented_fault_overrules_the_command() {
        let state = State::Fault {
            fault: Fault::OverPressure,
            target: Kilopascals(0.0),
            watching: false,
        };
        let code = interlock(Kilopascals(100.0), &state, Monitor::Missing, &active());
        assert_eq!(code, DacCode(0));
    }
}

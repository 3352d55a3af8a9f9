//! No input at all breaks the controller's limits, latches or arithmetic, and none leaves a state or a
//! fault untried.

use crate::torture::hostile::{Hostile, any_settings, wrong_settings};
use fastrand::Rng;
use softgrip::table::FINGER;

const SEED: u64 = 1;
const TICKS: u64 = 1_000_000;

#[test]
fn hostile_inputs_break_no_limit_no_latch_and_no_arithmetic() {
    let mut hostile = Hostile::new(SEED);
    let mut life = 0;
    while hostile.census.ticks < TICKS {
        if let Err(failure) = hostile.live(life) {
            panic!("seed {SEED}, life {life}: {failure}");
        }
        life += 1;
    }
    let missing = hostile.census.missing();
    assert!(missing.is_empty(), "never seen: {missing:?}");
}

#[test]
fn settings_at_any_place_of_their_ranges_are_valid_and_one_wrong_number_is_named() {
    let mut rng = Rng::with_seed(SEED);
    for _ in 0..10_000 {
        let settings = any_settings(&mut rng);
        let valid = settings.validate(&FINGER);
        assert!(valid.is_ok(), "{valid:?}");
        let (settings, number) = wrong_settings(&mut rng);
        let error = settings.validate(&FINGER).expect_err("a wrong setting");
        // A wrong limit may be found by what it limits.
        assert!(error.number == number || number == 630, "{number}: {error}");
    }
}

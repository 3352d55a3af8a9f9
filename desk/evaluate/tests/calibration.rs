//! What a sweep makes of random castings, at pressures and in closes that it has not seen.

use evaluate::calibration::{self, Options};
use sim::setup::Setup;
use sim::sweep;

fn recipe() -> finger::recipe::Recipe {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    finger::recipe::load(path.as_ref()).expect("the default recipe")
}

#[test]
fn a_sweep_makes_the_table_true_up_to_where_the_fingers_meet_and_tells_empty_closes_from_grips() {
    let options = Options {
        seed: 1,
        hands: 4,
        grips: 3,
    };
    let measured = calibration::measure(&recipe(), &options, &|| ()).expect("four hands");
    assert!(measured.refused.is_empty(), "{:?}", measured.refused);
    for hand in measured.hands {
        assert!(hand.sweep_s < 60.0);
        let [before, after] = hand.error_percent;
        assert!(after < 1.0 && after < 0.5 * before, "{before} {after} %");
        let [_, swept] = hand.closes;
        assert_eq!(swept.empty, [options.grips; 2]);
        assert_eq!(swept.held[0], swept.held[1]);
    }
}

#[test]
fn a_sweep_makes_the_table_true_over_the_whole_range_where_fingers_do_not_meet() {
    for seed in 1..=3 {
        let mut setup = Setup::with_castings(&recipe(), seed).expect("three fingers");
        setup.gripper.hand.fingers_touch = false;
        let swept = sweep::sweep(&setup, &setup.settings()).expect("a sweep");
        assert_eq!(swept.calibration.meeting, None);
        let [before, after] = calibration::errors_percent(&setup, &swept).expect("settings");
        let half_loop = calibration::half_loop_percent(&setup, &swept);
        assert!(
            before > 7.0 && after < 1.0 + half_loop,
            "{before} {after} %"
        );
    }
}

//! What a sweep makes of random castings, at pressures and in closes that it has not seen.

use evaluate::calibration::{self, Options};
use evaluate::mounted::{self, Hands};
use evaluate::options;
use evaluate::surrogate::{GaugeErrors, Surrogate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sim::setup::Setup;
use sim::sweep;
use softgrip::units::Kilopascals;

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
fn an_empty_close_is_told_even_where_noise_has_spoilt_the_lag() {
    // 300 µε of noise: the sweep finds 49 ms where there are 80.
    let options = Options {
        seed: 1010,
        hands: 1,
        grips: 8,
    };
    let measured = calibration::measure(&recipe(), &options, &|| ()).expect("a hand");
    let [_, swept] = measured.hands[0].closes;
    assert_eq!(swept.empty, [options.grips; 2]);
    assert_eq!(swept.held[0], swept.held[1]);
}

#[test]
fn whoever_knows_a_mounted_hand_exactly_expects_of_it_what_a_sweep_has_seen() {
    let recipe = recipe();
    let setup = Setup::with_castings(&recipe, 7).expect("three fingers");
    let found = sweep::sweep(&setup, &setup.settings()).expect("a sweep");
    let found = found.calibration;
    let (mounted, weightless) = (
        calibration::mounted(&setup),
        setup.hand().likeness(&recipe.chain),
    );
    let full_ue = recipe.chain.free_strain_ue(recipe.chain.max_pressure_kpa());
    let percent = |gain: f64, stiffness: f64| {
        100.0 * gain * recipe.chain.free_strain_ue(80.0 / stiffness) / full_ue
    };
    for i in 0..3 {
        let exactly = percent(mounted.gain[i], mounted.stiffness[i]);
        let swept = percent(found.gain[i].into(), found.stiffness[i].into());
        let alone = percent(weightless.gain[i], weightless.stiffness[i]);
        assert!((swept - exactly).abs() < 1.5, "{swept} {exactly} %");
        // The fingers' own weight takes a part of their bend.
        assert!(alone > exactly + 2.0, "{alone} {exactly} %");
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

#[test]
fn the_surrogates_free_fingers_strain_as_the_castings_that_they_stand_for() {
    let recipe = recipe();
    let setup = Setup::with_castings(&recipe, 7).expect("three fingers");
    let hand = setup.hand();
    let likeness = hand.likeness(&recipe.chain);
    let mut gripper = setup.gripper.clone();
    gripper.hand.finger_stiffness = likeness.stiffness;
    (gripper.hand.hysteresis_percent, gripper.hand.creep_percent) = (0.0, 0.0);
    gripper.gauge.creep_percent = 0.0;
    (gripper.regulator.gain, gripper.regulator.offset_kpa) = (1.0, 0.0);
    let gauges = likeness.gain.map(|gain| GaugeErrors {
        gain,
        offset_ue: 0.0,
        noise_ue: 0.0,
    });
    let noise = ChaCha8Rng::seed_from_u64(1);
    let mut surrogate = Surrogate::new(&gripper, setup.table(), gauges, noise);
    let front_end = gripper.front_end();
    let full_ue = recipe.chain.free_strain_ue(recipe.chain.max_pressure_kpa());
    let mut recipe_off_ue = 0.0f64;
    for kpa in [60.0, 100.0, 140.0] {
        let dac = front_end.command(Kilopascals(kpa as f32));
        (0..3_000).for_each(|_| _ = surrogate.step(dac, [0.0; 3], 0.0));
        let frame = surrogate.step(dac, [0.0; 3], 0.0);
        let shown_ue = front_end.strains(&frame.gauges);
        for (i, shown_ue) in shown_ue.into_iter().enumerate() {
            let strain_ue = hand.gauge_gain[i] * hand.chains[i].free_strain_ue(kpa);
            let off_percent = 100.0 * (f64::from(shown_ue.0) - strain_ue).abs() / full_ue;
            assert!(
                off_percent < 1.0,
                "finger {i} at {kpa} kPa: {off_percent} %"
            );
            let recipe_ue = recipe.chain.free_strain_ue(kpa);
            recipe_off_ue = recipe_off_ue.max((strain_ue - recipe_ue).abs());
        }
    }
    assert!(recipe_off_ue > 0.05 * full_ue);
}

#[test]
fn a_hand_is_judged_on_the_same_losses_and_hours_however_it_is_known() {
    let recipe = recipe();
    let base = Setup::of(&recipe).expect("a setup");
    let options = options::Options {
        seed: 1,
        losses: 2,
        hours: 0.01,
        recordings: None,
        slowest: 0,
        settings: base.settings(),
    };
    let hands = Hands { first: 3, count: 2 };
    let measured = mounted::measure(&recipe, &base, &options, hands, &|_| ());
    let measured = measured.expect("two hands");
    assert!(measured.refused.is_empty(), "{:?}", measured.refused);
    let [recipe, sweep, exact] = measured.rows;
    for row in [&sweep, &exact] {
        assert_eq!(row.losses, 2);
        assert_eq!(
            (row.losses, row.held, row.hours),
            (recipe.losses, recipe.held, recipe.hours)
        );
    }
    let ms = |row: &mounted::Row| (row.ms.min, row.ms.p50, row.ms.max);
    // What a sweep has found is close to the exact hand; the recipe is not.
    assert!(ms(&recipe) != ms(&sweep) && ms(&recipe) != ms(&exact));
}

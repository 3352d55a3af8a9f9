//! The free-bend sweep on the simulated gripper: what it finds, and when it refuses.

use sim::fault::Injected;
use sim::setup::Setup;
use sim::sweep::{self, Swept};
use softgrip::estimate::Casting;
use softgrip::frontend::FrontEnd;
use softgrip::units::Kilopascals;

fn recipe() -> finger::recipe::Recipe {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    finger::recipe::load(path.as_ref()).expect("the default recipe")
}

/// The castings of a seed, with a decent amplifier.
fn setup(seed: u64) -> Setup {
    let mut setup = Setup::with_castings(&recipe(), seed).expect("three fingers");
    setup.scenario.noise_ue = 20.0;
    setup
}

fn sweep(setup: &Setup) -> anyhow::Result<Swept> {
    sweep::sweep(setup, &setup.settings())
}

/// Strain of each finger with nothing in the grip, and the pressure, at rest on the way up, where fingers pass through
/// one another.
fn free_strains(setup: &Setup, pressures_kpa: &[f64]) -> Vec<(f64, [f64; 3])> {
    let mut free = setup.clone();
    free.scenario.noise_ue = 0.0;
    free.gripper.hand.fingers_touch = false;
    free.gripped_mut().depth_m = 1.0;
    let mut plant = free.plant();
    let mut rest = |kpa: f64| {
        let dac = FrontEnd::REFERENCE.command(Kilopascals(kpa as f32));
        (0..1_500).for_each(|_| _ = plant.step(dac));
        let (frame, truth) = plant.step(dac);
        let gauges = FrontEnd::REFERENCE.gauges;
        let strain_ue: [f64; 3] =
            std::array::from_fn(|i| f64::from(gauges[i].strain(frame.gauges[i]).0));
        (truth.pressure_kpa, strain_ue)
    };
    // Past the arm's moves.
    let (_, zero) = (0..6).map(|_| rest(0.0)).last().expect("rest");
    let strains = pressures_kpa.iter().map(|&kpa| {
        let (kpa, strain_ue) = rest(kpa);
        (kpa, std::array::from_fn(|i| strain_ue[i] - zero[i]))
    });
    strains.collect()
}

/// Largest error of what is expected of free fingers, in percent of full scale, with the recipe's table alone and after
/// the sweep, at pressures that the sweep did not stop at.
fn errors_percent(setup: &Setup, swept: &Swept, up_to_kpa: f64) -> [f64; 2] {
    let calibrated = setup
        .settings()
        .calibrated(&swept.calibration, setup.table())
        .finger;
    let full_ue = setup.chain.free_strain_ue(setup.chain.max_pressure_kpa());
    let pressures: Vec<f64> = (1..=10).map(|n| 16.0 * f64::from(n) - 3.0).collect();
    let mut worst = [0.0f64; 2];
    for (kpa, strain_ue) in free_strains(setup, &pressures) {
        if kpa > up_to_kpa {
            continue;
        }
        // The way up is half a loop behind the middle, which the table means.
        let middle_kpa = kpa - 0.5 * f64::from(swept.calibration.hysteresis_kpa);
        for (i, strain_ue) in strain_ue.into_iter().enumerate() {
            let (gain, stiffness) = (calibrated.free_bend_gain[i], calibrated.stiffness[i]);
            let casting = Casting::of(setup.table(), gain, stiffness);
            let nominal_ue = setup.chain.free_strain_ue(middle_kpa);
            let expected_ue = nominal_ue * f64::from(casting.ratio((nominal_ue / full_ue) as f32));
            let recipe_ue = setup.chain.free_strain_ue(kpa);
            for (worst, expected_ue) in worst.iter_mut().zip([recipe_ue, expected_ue]) {
                *worst = worst.max(100.0 * (expected_ue - strain_ue).abs() / full_ue);
            }
        }
    }
    worst
}

#[test]
fn a_sweep_makes_the_table_true_for_fingers_that_meet_up_to_where_they_do() {
    for seed in 1..=4 {
        let setup = setup(seed);
        let swept = sweep(&setup).expect("a sweep");
        assert!(swept.duration_s < 60.0, "{}", swept.duration_s);
        let meeting = swept.calibration.meeting.expect("they meet");
        let [before, after] = errors_percent(&setup, &swept, 0.9 * f64::from(meeting.0));
        assert!(
            after < 1.0 && after < before / 2.0,
            "{seed}: {before} {after} %"
        );
    }
}

#[test]
fn a_sweep_makes_the_table_true_over_the_whole_range_where_fingers_do_not_meet() {
    for seed in 1..=3 {
        let mut setup = setup(seed);
        setup.gripper.hand.fingers_touch = false;
        let swept = sweep(&setup).expect("a sweep");
        assert_eq!(swept.calibration.meeting, None);
        let [before, after] = errors_percent(&setup, &swept, 160.0);
        let half_loop = 0.5 * f64::from(swept.calibration.hysteresis_kpa) / 1.6;
        assert!(
            before > 7.0 && after < 1.0 + half_loop,
            "{seed}: {before} {after} %"
        );
    }
}

#[test]
fn a_sweep_measures_lags_and_hysteresis_of_the_silicone() {
    let mut setup = setup(1);
    let hand = &mut setup.gripper.hand;
    (hand.inflation_lag_ms, hand.deflation_lag_ms) = (200.0, 400.0);
    (hand.hysteresis_percent, hand.creep_percent) = (4.0, 0.0);
    setup.gripper.gauge.creep_percent = 0.0;
    let swept = sweep(&setup).expect("a sweep");
    let silicone = setup
        .settings()
        .calibrated(&swept.calibration, setup.table())
        .finger
        .silicone;
    assert!(
        (silicone.inflation_lag_ms - 200.0).abs() < 20.0,
        "{silicone:?}"
    );
    assert!(
        (silicone.deflation_lag_ms - 400.0).abs() < 40.0,
        "{silicone:?}"
    );
    assert!(
        (silicone.hysteresis_percent - 4.0).abs() < 0.5,
        "{silicone:?}"
    );
}

#[test]
fn a_sweep_is_refused_with_an_object_in_the_grip_and_stays_below_its_pressure() {
    for (seed, width_m) in [(1, 0.070), (2, 0.060)] {
        let mut setup = setup(seed);
        setup.scenario.mass_kg = 0.1;
        setup
            .set(
                "grasp.diameter_mm",
                sim::setup::Value::Number(1e3 * width_m),
            )
            .expect("a width");
        // The arm has set it down and gone back to where it took it from: it lies between the fingers.
        let mut plant_setup = setup.clone();
        plant_setup.gripper.arm.lift_mm = 1.0;
        plant_setup.gripper.arm.carry_mm = 1.0;
        let error = sweep::sweep_with(plant_setup.plant(), &setup, &setup.settings())
            .expect_err("an object");
        let text = error.to_string();
        assert!(text.contains("Contact"), "{text}");
    }
}

#[test]
fn a_sweep_is_refused_where_the_pressure_cannot_be_believed() {
    let mut setup = setup(1);
    setup.gripped_mut().depth_m = 1.0;
    let fault: Injected = "regulator-stuck@9s".parse().expect("a fault");
    let plant = setup.plant().with_faults(&[fault]);
    let error = sweep::sweep_with(plant, &setup, &setup.settings()).expect_err("a stuck regulator");
    let text = error.to_string();
    assert!(
        text.contains("NotFollowing") || text.contains("Pressure"),
        "{text}"
    );
}

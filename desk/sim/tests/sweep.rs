//! The free-bend sweep on the simulated gripper: what it finds, and when it refuses.

use sim::fault::Injected;
use sim::setup::Setup;
use sim::sweep::{self, Swept};

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

#[test]
fn a_sweep_measures_lags_and_hysteresis_of_the_silicone() {
    let mut setup = setup(1);
    let hand = &mut setup.gripper.hand;
    (hand.inflation_lag_ms, hand.deflation_lag_ms) = (200.0, 400.0);
    (hand.hysteresis_percent, hand.creep_percent) = (4.0, 0.0);
    setup.gripper.gauge.creep_percent = 0.0;
    let swept = sweep(&setup).expect("a sweep");
    let found = swept.calibration;
    let [up_ms, down_ms] = found.lag_ms;
    assert!((up_ms - 200.0).abs() < 20.0, "{found:?}");
    assert!((down_ms - 400.0).abs() < 40.0, "{found:?}");
    // 4 % of 160 kPa.
    assert!((found.hysteresis_kpa - 6.4).abs() < 0.8, "{found:?}");
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

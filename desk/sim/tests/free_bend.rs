//! A finger that bends freely: what its silicone does to the curve of its recipe.

use std::path::Path;

use sim::gripper::FingerParameters;
use sim::setup::Setup;
use softgrip::frontend::FrontEnd;
use softgrip::units::Kilopascals;

/// Pressures of a full stroke, kPa apart.
const STAIR_KPA: f64 = 20.0;
/// Time at each, s: many time constants of air and finger.
const STAIR_S: f64 = 0.8;
/// The arm has come to its destination by then, s.
const STILL_S: f64 = 6.0;
/// A time constant of creep that does not take minutes, s.
const CREEP_S: f64 = 5.0;

/// Fingers with nothing in their way and perfect gauges and air; ideal but for what `change` turns on.
fn free(change: fn(&mut FingerParameters, &FingerParameters)) -> Setup {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(&path).expect("a recipe");
    let mut setup = Setup::of(&recipe).expect("a setup");
    setup.gripped_mut().depth_m = 1.0;
    setup.gripper.gauge.creep_percent = 0.0;
    setup.gripper.regulator.gain = 1.0;
    setup.gripper.regulator.offset_kpa = 0.0;
    let hand = &mut setup.gripper.hand;
    let all = hand.clone();
    hand.fingers_touch = false;
    hand.deflation_lag_ms = hand.inflation_lag_ms;
    hand.hysteresis_percent = 0.0;
    hand.creep_percent = 0.0;
    change(hand, &all);
    setup
}

/// Strain of the first finger at the end of each stretch of constant pressure (kPa, s), µε, with the arm at rest.
fn bend_ue(setup: &Setup, stretches: &[(f64, f64)]) -> Vec<f64> {
    let mut plant = setup.plant();
    let stretches = [&[(0.0, STILL_S)], stretches].concat();
    let ends = stretches.into_iter().map(|(kpa, time_s)| {
        let dac = FrontEnd::REFERENCE.command(Kilopascals(kpa as f32));
        let ticks = (1e3 * time_s) as usize;
        let strains = (0..ticks).map(|_| plant.step(dac).1.strain_ue[0]);
        strains.last().unwrap_or(0.0)
    });
    ends.skip(1).collect()
}

/// Widest distance between the ways up and down of a full stroke, in percent of the full bend.
fn loop_percent(setup: &Setup) -> f64 {
    let stairs = (setup.chain.max_pressure_kpa() / STAIR_KPA) as usize;
    let up = (1..=stairs).map(|n| STAIR_KPA * n as f64);
    let stroke: Vec<_> = up.clone().chain(up.rev()).map(|p| (p, STAIR_S)).collect();
    let bends = bend_ue(setup, &stroke);
    let (up, down) = bends.split_at(stairs);
    let apart = up.iter().zip(down.iter().rev()).map(|(up, down)| down - up);
    100.0 * apart.fold(0.0, f64::max) / up[stairs - 1]
}

#[test]
fn hysteresis_opens_a_loop_and_an_ideal_finger_has_none() {
    let ideal = loop_percent(&free(|_, _| ()));
    let real = loop_percent(&free(|hand, all| {
        hand.hysteresis_percent = all.hysteresis_percent;
    }));
    println!("loop: ideal {ideal:.2} %, hysteresis {real:.2} % of the full bend");
    assert!(ideal < 0.1, "{ideal}");
    // gripper.toml: 2-5 % of full scale is good silicone.
    assert!((2.0..5.0).contains(&real), "{real}");
}

#[test]
fn creep_bends_the_finger_on_and_leaves_after_a_release() {
    let held = [(140.0, 1.0), (140.0, 9.0), (0.0, 1.0), (0.0, 9.0)];
    let ideal = bend_ue(&free(|_, _| ()), &held);
    let real = bend_ue(
        &free(|hand, all| {
            hand.creep_percent = all.creep_percent;
            hand.creep_time_s = CREEP_S;
        }),
        &held,
    );
    let percent = |n: usize| 100.0 * (real[n] - ideal[n]) / ideal[0];
    println!(
        "creep at 140 kPa after 0.2 and 2 of its time constants: {:.2}, {:.2} %; after a release: {:.2}, {:.2} %",
        percent(0),
        percent(1),
        percent(2),
        percent(3)
    );
    // 1 − e⁻² of 2.5 %, and some more: the weight takes a part of the bend away, but not of its change.
    assert!((percent(1) / (2.5 * 0.865) - 1.0).abs() < 0.15);
    assert!(percent(0) < 0.5 * percent(1) && percent(3) < 0.5 * percent(2));
}

#[test]
fn a_finger_falls_behind_on_the_way_down_by_its_lag_of_deflation() {
    let fall = [(140.0, 3.0), (0.0, 0.2)];
    let ideal = bend_ue(&free(|_, _| ()), &fall);
    let real = bend_ue(
        &free(|hand, all| hand.deflation_lag_ms = all.deflation_lag_ms),
        &fall,
    );
    let left = |bends: &[f64]| 100.0 * bends[1] / bends[0];
    println!(
        "bend left 0.2 s after a release: {:.1} and {:.1} %",
        left(&ideal),
        left(&real)
    );
    assert!(left(&real) > left(&ideal) + 3.0);
    assert!(
        (real[0] / ideal[0] - 1.0).abs() < 1e-3,
        "the way up is the same"
    );
}

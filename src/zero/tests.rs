//! Zeros that drift, and tares.

use super::*;
use crate::condition::Gauge;
use crate::table::Range;
use crate::units::{Degrees, Kilopascals, Volts};

const CONTACT_UE: f32 = 500.0;

/// One tick at rest with these raw strains, µε.
fn tick(zero: &mut Zero, raw_ue: [f32; 3], kpa: f32, idle: bool) -> Option<TareResult> {
    step(zero, raw_ue, kpa, idle, false).tare
}

/// The same, with all that is told; `start`: a tare begins.
fn step(zero: &mut Zero, raw_ue: [f32; 3], kpa: f32, idle: bool, start: bool) -> ZeroReport {
    let offsets = zero.offsets_ue();
    let strain: [f32; 3] = core::array::from_fn(|i| raw_ue[i] - offsets[i]);
    let reading = Reading {
        gauges: strain.map(|ue| Gauge::Valid(Microstrain(ue))),
        monitor: Monitor::Valid(Kilopascals(kpa)),
        noise_variance: [400.0; 3],
        supply: Some(Volts(24.0)),
        rail_is_off: false,
        stale_ticks: 0,
        overrun: false,
    };
    let contact = Contact {
        residual: strain.map(|ue| Some(Microstrain(-ue))),
        touching: strain.map(|ue| -ue > CONTACT_UE),
        mean: None,
        free: Microstrain(0.0),
        bend: Degrees(0.0),
        range: Range::Inside,
        known: true,
    };
    zero.step(&reading, &contact, idle, start, CONTACT_UE)
}

fn rest(zero: &mut Zero, raw_ue: [f32; 3], ticks: u32) {
    for _ in 0..ticks {
        assert_eq!(tick(zero, raw_ue, 0.0, true), None);
    }
}

/// A tare with the strain, pressure and state of each tick.
fn tare(zero: &mut Zero, make: impl Fn(u16) -> ([f32; 3], f32, bool)) -> TareResult {
    (0..2 * TARE_TICKS)
        .find_map(|at| {
            let (raw, kpa, idle) = make(at);
            let report = step(zero, raw, kpa, idle, at == 0);
            assert_eq!(report.taring, report.tare.is_none());
            report.tare
        })
        .expect("a tare ends")
}

fn flicker(at: u16, ue: f32) -> f32 {
    if at.is_multiple_of(2) { ue } else { -ue }
}

#[test]
fn a_tare_takes_the_mean_away() {
    let mut zero = Zero::default();
    let result = tare(&mut zero, |at| {
        ([300.0 + flicker(at, 30.0), -200.0, 0.0], 0.0, true)
    });
    assert_eq!(result, Ok(()));
    for (offset, expected) in zero.offsets_ue().into_iter().zip([300.0, -200.0, 0.0]) {
        assert!((offset - expected).abs() < 0.1, "{offset}");
    }
}

#[test]
fn a_tare_is_refused_when_anything_makes_it_wrong_at_any_time_of_it() {
    let calm = [0.0; 3];
    type Make = fn(u16) -> ([f32; 3], f32, bool);
    let cases: [(TareFault, Make); 7] = [
        // A valve that opens in its last tick.
        (TareFault::Pressure, |at| {
            ([0.0; 3], if at < 199 { 0.0 } else { 60.0 }, true)
        }),
        (TareFault::Interrupted, |at| ([0.0; 3], 0.0, at < 150)),
        (TareFault::Noise, |at| {
            ([0.0, flicker(at, 500.0), 0.0], 0.0, true)
        }),
        (TareFault::Drift, |at| {
            ([0.0, 0.0, f32::from(at)], 0.0, true)
        }),
        (TareFault::Drift, |at| {
            ([0.0, 0.0, if at < 100 { 0.0 } else { -80.0 }], 0.0, true)
        }),
        (TareFault::OutOfRange, |_| ([2_100.0, 0.0, 0.0], 0.0, true)),
        (TareFault::Contact, |_| ([0.0, -700.0, 0.0], 0.0, true)),
    ];
    for (fault, make) in cases {
        let mut zero = Zero::default();
        rest(&mut zero, calm, 1_000);
        assert_eq!(tare(&mut zero, make), Err(fault));
        assert_eq!(zero.offsets_ue(), calm, "{fault:?}");
    }
}

#[test]
fn the_unbalance_of_a_bridge_is_no_contact() {
    let mut zero = Zero::default();
    let unbalanced = [-1_500.0, 900.0, 0.0];
    rest(&mut zero, unbalanced, 1_000);
    assert_eq!(tare(&mut zero, |_| (unbalanced, 0.0, true)), Ok(()));
}

#[test]
fn slow_drift_at_rest_is_followed_and_under_pressure_it_is_not() {
    for sign in [-1.0, 1.0] {
        let mut zero = Zero::default();
        for at in 0..40_000 {
            tick(&mut zero, [sign * 0.02 * at as f32; 3], 0.0, true);
        }
        for offset in zero.offsets_ue() {
            assert!((offset - sign * 800.0).abs() < 50.0, "{offset}");
        }
        assert!(!zero.tare_is_due());
    }
    let mut zero = Zero::default();
    for at in 0..40_000 {
        tick(&mut zero, [-0.02 * at as f32; 3], 100.0, false);
        tick(&mut zero, [-0.02 * at as f32; 3], 100.0, true);
    }
    assert_eq!(zero.offsets_ue(), [0.0; 3]);
}

#[test]
fn tracking_is_bounded_in_rate_and_total_and_then_asks_for_a_tare() {
    let mut zero = Zero::default();
    rest(&mut zero, [0.0; 3], 1_000);
    rest(&mut zero, [400.0; 3], 1_000);
    for drift in zero.drift() {
        assert!(drift.0 > 0.0 && drift.0 <= 100.0, "{drift:?}");
    }
    for at in 0..200_000 {
        tick(&mut zero, [0.02 * at as f32, 0.0, 0.0], 0.0, true);
    }
    assert!((zero.drift()[0].0 - TRACKED_UE).abs() < 1.0);
    assert!(zero.tare_is_due());
    let drifted = [1_900.0, 0.0, 0.0];
    assert_eq!(tare(&mut zero, |_| (drifted, 0.0, true)), Ok(()));
    assert!(!zero.tare_is_due());
    assert_eq!(zero.drift(), [Microstrain(0.0); 3]);
}

#[test]
fn a_finger_that_leans_is_not_followed_and_after_ten_seconds_a_tare_is_due() {
    let mut zero = Zero::default();
    rest(&mut zero, [0.0; 3], 1_000);
    rest(&mut zero, [-800.0, 0.0, 0.0], 9_000);
    assert_eq!(zero.offsets_ue(), [0.0; 3]);
    assert!(!zero.tare_is_due());
    rest(&mut zero, [-800.0, 0.0, 0.0], 1_500);
    assert!(zero.tare_is_due());
    rest(&mut zero, [0.0; 3], 1);
    assert!(!zero.tare_is_due());
}

#[test]
fn a_tare_takes_200_ticks_and_its_noise_is_accepted_up_to_400_ue() {
    for (ue, expected) in [(390.0, Ok(())), (410.0, Err(TareFault::Noise))] {
        let mut zero = Zero::default();
        let mut ticks = 0;
        let result = (0..1_000).find_map(|at| {
            ticks = at + 1;
            step(&mut zero, [flicker(at, ue), 0.0, 0.0], 0.0, true, at == 0).tare
        });
        assert_eq!((result, ticks), (Some(expected), 200), "{ue}");
    }
}

#[test]
fn the_halves_of_a_tare_may_differ_by_30_ue_and_by_four_deviations_of_their_noise() {
    // 300 µε of noise are 42 in the difference of two means of 100 ticks: 170 in four deviations.
    for (noise_ue, step_ue, expected) in [
        (0.0, 28.0, Ok(())),
        (0.0, 32.0, Err(TareFault::Drift)),
        (300.0, 190.0, Ok(())),
        (300.0, 210.0, Err(TareFault::Drift)),
        (300.0, -190.0, Ok(())),
        (300.0, -210.0, Err(TareFault::Drift)),
    ] {
        let mut zero = Zero::default();
        let result = tare(&mut zero, |at| {
            let late = if at < 100 { 0.0 } else { step_ue };
            ([0.0, flicker(at, noise_ue) + late, 0.0], 0.0, true)
        });
        assert_eq!(result, expected, "{noise_ue} {step_ue}");
    }
}

#[test]
fn a_second_tare_starts_from_the_first_and_what_has_been_tracked_since() {
    let mut zero = Zero::default();
    assert_eq!(tare(&mut zero, |_| ([300.0; 3], 0.0, true)), Ok(()));
    rest(&mut zero, [340.0; 3], 1_300);
    assert!(zero.drift()[0].0 > 20.0);
    assert_eq!(tare(&mut zero, |_| ([600.0; 3], 0.0, true)), Ok(()));
    for offset in zero.offsets_ue() {
        assert!((offset - 600.0).abs() < 0.1, "{offset}");
    }
}

#[test]
fn a_small_drift_is_followed_by_63_percent_in_a_second() {
    let mut zero = Zero::default();
    // Settled in the last of 300 ticks.
    rest(&mut zero, [10.0; 3], 299);
    assert_eq!(zero.drift(), [Microstrain(0.0); 3]);
    rest(&mut zero, [10.0; 3], 1_000);
    for drift in zero.drift() {
        assert!((drift.0 - 6.32).abs() < 0.02, "{drift:?}");
    }
}

#[test]
fn a_finger_counts_as_pressed_500_ue_below_the_mean_of_its_first_rest() {
    for (below_ue, expected) in [(494.0, Ok(())), (506.0, Err(TareFault::Contact))] {
        for sign in [-1.0, 1.0] {
            let mut zero = Zero::default();
            // 200 ticks after 300, in which the first zero moves by 20 µε; noise of either sign comes last.
            for at in 0..500 {
                tick(
                    &mut zero,
                    [1_480.0, flicker(at, sign * 390.0), 0.0],
                    0.0,
                    true,
                );
            }
            for pressed in [[below_ue, 0.0, 0.0], [0.0, below_ue, 0.0]] {
                let raw_ue = [1_480.0 - pressed[0], -pressed[1], 0.0];
                let result = tare(&mut zero.clone(), |_| (raw_ue, 0.0, true));
                assert_eq!(result, expected, "{pressed:?}");
            }
        }
    }
}

#[test]
fn a_zero_that_has_drifted_at_rest_is_no_contact_and_what_presses_on_it_is() {
    for (drifted_ue, pressed_ue) in [(-800.0, -1_400.0), (800.0, 200.0)] {
        let mut zero = Zero::default();
        rest(&mut zero, [0.0; 3], 1_000);
        for at in 0..40_000 {
            tick(&mut zero, [drifted_ue / 40_000.0 * at as f32; 3], 0.0, true);
        }
        let pressed = tare(&mut zero.clone(), |_| ([pressed_ue; 3], 0.0, true));
        assert_eq!(pressed, Err(TareFault::Contact), "{drifted_ue}");
        assert_eq!(tare(&mut zero, |_| ([drifted_ue; 3], 0.0, true)), Ok(()));
    }
}

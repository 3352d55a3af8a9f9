//! What the fingers feel, by what the gauges show.

use super::*;
use crate::table::{self, FINGER};
use crate::units::Volts;

fn reading(pressure: f32, strain: [f32; 3]) -> Reading {
    Reading {
        gauges: strain.map(|ue| Gauge::Valid(Microstrain(ue))),
        monitor: Monitor::Valid(Kilopascals(pressure)),
        noise_variance: [400.0; 3],
        supply: Some(Volts(24.0)),
        rail_is_off: false,
        stale_ticks: 0,
        overrun: false,
    }
}

fn active(settings: Settings) -> Active {
    settings.active(FINGER.max_pressure_kpa)
}

fn settle(estimator: &mut Estimator, active: &Active, reading: &Reading) -> Contact {
    let mut contact = estimator.step(reading, &FINGER, active);
    for _ in 0..2_000 {
        contact = estimator.step(reading, &FINGER, active);
    }
    contact
}

#[test]
fn a_free_finger_has_no_residual_and_a_blocked_one_has() {
    let active = active(Settings::default());
    let mut estimator = Estimator::new();
    let free = table::free_strain(&FINGER, Kilopascals(140.0)).0.0;
    let contact = settle(
        &mut estimator,
        &active,
        &reading(140.0, [free, free - 4_000.0, free - 4_000.0]),
    );
    assert_eq!(contact.touching, [false, true, true]);
    assert!(contact.residual[0].is_some_and(|r| r.0.abs() < 1.0));
    assert!(contact.residual[1].is_some_and(|r| (r.0 - 4_000.0).abs() < 1.0));
    assert_eq!(contact.range, Range::Inside);
}

#[test]
fn the_bend_of_a_free_finger_is_the_tables() {
    let active = active(Settings::default());
    let mut estimator = Estimator::new();
    let free = table::free_strain(&FINGER, Kilopascals(100.0)).0.0;
    let contact = settle(&mut estimator, &active, &reading(100.0, [free; 3]));
    let (bend, _) = table::bend(&FINGER, Kilopascals(100.0));
    assert!((contact.bend.0 - bend.0).abs() < 0.05);
}

#[test]
fn a_failed_gauge_leaves_a_gap_and_not_a_number() {
    let active = active(Settings::default());
    let mut estimator = Estimator::new();
    let mut reading = reading(0.0, [0.0; 3]);
    reading.gauges[1] = Gauge::Missing;
    let contact = estimator.step(&reading, &FINGER, &active);
    assert_eq!(contact.residual[1], None);
    assert_eq!(contact.usable_count(), 2);
}

#[test]
fn a_gauge_that_feels_contact_alone_is_its_own_residual() {
    let active = active(Settings {
        gauge_sense: GaugeSense::Contact,
        ..Settings::default()
    });
    let mut estimator = Estimator::new();
    let contact = settle(
        &mut estimator,
        &active,
        &reading(140.0, [3_000.0, 0.0, 0.0]),
    );
    assert_eq!(contact.touching, [true, false, false]);
    assert_eq!(contact.residual[0], Some(Microstrain(3_000.0)));
}

/// A finger without the lag of its air, so that its swing alone is left.
fn swing(settings: Settings) -> impl FnMut(f32) -> f32 {
    let active = active(Settings {
        silicone: SiliconeSettings {
            inflation_lag_ms: 1.0,
            ..settings.silicone
        },
        ..settings
    });
    let mut estimator = Estimator::new();
    move |kpa| {
        estimator.step(&reading(kpa, [0.0; 3]), &FINGER, &active);
        estimator.lagged_pressure().0
    }
}

#[test]
fn a_finger_swings_past_a_step_at_its_frequency_and_damping() {
    // Step response of ζ = 0.45: 20.5 % of overshoot, half a damped period of 5.9 Hz after it.
    let mut bent = swing(Settings::default());
    bent(50.0);
    let (mut peak_kpa, mut peak_ms) = (50.0, 0);
    for ms in 1..=2_000 {
        let kpa = bent(100.0);
        if kpa > peak_kpa {
            (peak_kpa, peak_ms) = (kpa, ms);
        }
    }
    assert!((peak_kpa - 110.25).abs() < 0.6, "{peak_kpa}");
    assert!((92..=98).contains(&peak_ms), "{peak_ms} ms");
    assert!((bent(100.0) - 100.0).abs() < 0.01);
}

#[test]
fn a_finger_inflates_with_its_lag_from_the_first_pressure_on() {
    let active = active(Settings {
        silicone: SiliconeSettings {
            inflation_lag_ms: 80.0,
            // A finger that is stiff enough to follow at once.
            bending_hz: 50.0,
            bending_damping: 1.0,
            ..SiliconeSettings::default()
        },
        ..Settings::default()
    });
    let mut estimator = Estimator::new();
    assert_eq!(estimator.free_strain(), None);
    estimator.step(&reading(20.0, [0.0; 3]), &FINGER, &active);
    assert_eq!(estimator.lagged_pressure(), Kilopascals(20.0));
    for _ in 0..80 {
        estimator.step(&reading(120.0, [0.0; 3]), &FINGER, &active);
    }
    // 63 % of the way, less the 6 ms of the swing.
    let kpa = estimator.lagged_pressure().0;
    assert!((79.0..84.0).contains(&kpa), "{kpa}");
    let (free, _) = table::free_strain(&FINGER, estimator.lagged_pressure());
    assert_eq!(estimator.free_strain(), Some(free));
}

#[test]
fn touch_is_made_above_500_ue_and_5_percent_and_kept_down_to_60_percent_of_that() {
    let active = active(Settings::default());
    let free = table::free_strain(&FINGER, Kilopascals(140.0)).0.0;
    let threshold = 500.0 + 0.05 * free;
    let at = |share: f32| reading(140.0, [free - share * threshold, free, free]);
    let mut estimator = Estimator::new();
    for (share, touches) in [
        (0.98, false),
        (1.02, true),
        (0.62, true),
        (0.58, false),
        (0.98, false),
    ] {
        let contact = settle(&mut estimator, &active, &at(share));
        assert_eq!(contact.touching, [touches, false, false], "{share}");
    }
}

#[test]
fn touch_comes_and_goes_in_the_fifth_tick_in_a_row() {
    let active = active(Settings::default());
    let (free, pressed) = (reading(0.0, [0.0; 3]), reading(0.0, [-2_000.0; 3]));
    let mut estimator = Estimator::new();
    settle(&mut estimator, &active, &free);
    let mut ticks_until = |reading: &Reading, touching: usize| {
        (1..=20).find(|_| {
            let contact = estimator.step(reading, &FINGER, &active);
            contact.touching_count() == touching
        })
    };
    // Four ticks are a spike, however often.
    for _ in 0..4 {
        for _ in 0..4 {
            assert_eq!(ticks_until(&pressed, 0), Some(1));
        }
        assert_eq!(ticks_until(&free, 0), Some(1));
    }
    assert_eq!(ticks_until(&pressed, 3), Some(5));
    for _ in 0..4 {
        assert_eq!(ticks_until(&free, 3), Some(1));
    }
    assert_eq!(ticks_until(&pressed, 3), Some(1));
    assert_eq!(ticks_until(&free, 0), Some(5));
}

#[test]
fn fingers_are_counted_one_by_one() {
    let active = active(Settings::default());
    let mut estimator = Estimator::new();
    let contact = settle(
        &mut estimator,
        &active,
        &reading(0.0, [-2_000.0, 0.0, -2_000.0]),
    );
    assert_eq!((contact.touching_count(), contact.usable_count()), (2, 3));
}

#[test]
fn a_failed_gauge_touches_nothing_and_one_that_misses_a_tick_touches_what_it_did() {
    let active = active(Settings::default());
    let mut estimator = Estimator::new();
    let mut pressed = reading(0.0, [-2_000.0; 3]);
    settle(&mut estimator, &active, &pressed);
    pressed.gauges[0] = Gauge::Missing;
    let contact = settle(&mut estimator, &active, &pressed);
    assert_eq!(contact.touching, [true; 3]);
    pressed.gauges[0] = Gauge::Failed(crate::fault::GaugeFault::Open);
    let contact = estimator.step(&pressed, &FINGER, &active);
    assert_eq!(contact.touching, [false, true, true]);
}

#[test]
fn a_calibrated_gauge_is_free_at_its_own_strain_and_bends_as_the_others_do() {
    let gains = [0.8, 1.0, 1.25];
    let active = active(Settings {
        free_bend_gain: gains,
        ..Settings::default()
    });
    let free = table::free_strain(&FINGER, Kilopascals(100.0)).0.0;
    let mut estimator = Estimator::new();
    let contact = settle(
        &mut estimator,
        &active,
        &reading(100.0, gains.map(|gain| gain * free)),
    );
    for residual in contact.residual {
        assert!(residual.is_some_and(|ue| ue.0.abs() < 1.0), "{residual:?}");
    }
    let (bend, _) = table::bend(&FINGER, Kilopascals(100.0));
    assert!((contact.bend.0 - bend.0).abs() < 0.05, "{:?}", contact.bend);
}

#[test]
fn the_bend_is_that_of_the_mean_strain_and_stays_while_no_gauge_tells_it() {
    let active = active(Settings::default());
    let at = |kpa: f32| table::free_strain(&FINGER, Kilopascals(kpa)).0.0;
    let mut estimator = Estimator::new();
    // Two of three gauges; the third tells nothing.
    let mut seen = reading(100.0, [at(60.0), at(100.0), 0.0]);
    seen.gauges[2] = Gauge::Missing;
    let bend = estimator.step(&seen, &FINGER, &active).bend;
    let mean = Microstrain(0.5 * (at(60.0) + at(100.0)));
    let (pressure, _) = table::pressure_for_strain(&FINGER, mean);
    assert!((bend.0 - table::bend(&FINGER, pressure).0.0).abs() < 0.01);
    seen.gauges = [Gauge::Missing; 3];
    let contact = settle(&mut estimator, &active, &seen);
    assert_eq!((contact.bend, contact.usable_count()), (bend, 0));
}

#[test]
fn a_gauge_that_feels_contact_alone_leaves_the_bend_to_the_table() {
    let active = active(Settings {
        gauge_sense: GaugeSense::Contact,
        ..Settings::default()
    });
    let mut estimator = Estimator::new();
    let contact = settle(&mut estimator, &active, &reading(100.0, [3_000.0; 3]));
    let (bend, _) = table::bend(&FINGER, Kilopascals(100.0));
    assert!((contact.bend.0 - bend.0).abs() < 0.05);
    assert_eq!(estimator.free_strain(), Some(Microstrain(0.0)));
}

#[test]
fn a_shape_is_known_until_the_pressure_has_been_unknown_for_20_ticks_and_six_lags_after_that() {
    let active = active(Settings::default());
    let seen = reading(100.0, [0.0; 3]);
    let blind = Reading {
        monitor: Monitor::Missing,
        ..seen
    };
    let mut estimator = Estimator::new();
    let mut known = |reading: &Reading| estimator.step(reading, &FINGER, &active).known;
    assert!(known(&seen));
    for _ in 0..2 {
        for _ in 0..19 {
            assert!(known(&blind));
        }
        assert!(known(&seen));
    }
    for _ in 0..19 {
        assert!(known(&blind));
    }
    assert!(!known(&blind));
    let unknown = (0..2_000).take_while(|_| !known(&seen)).count();
    assert_eq!(unknown, 6 * 80);
    assert!(known(&seen));
}

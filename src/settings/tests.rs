//! Defaults, ranges and numbers of the settings.

use super::*;
use crate::table::{self, FingerTable};
use crate::table::{FINGER, ROWS};
use crate::units::Kilopascals;
use std::string::ToString;

fn error(settings: Settings) -> std::string::String {
    settings
        .validate(&FINGER)
        .expect_err("a wrong setting")
        .to_string()
}

#[test]
fn the_defaults_are_valid() {
    assert!(Settings::default().validate(&FINGER).is_ok());
}

/// The default finger up to this pressure only.
fn shorter(max_pressure_kpa: f32) -> FingerTable {
    let row = |i: usize| {
        let share = i as f32 / (ROWS - 1) as f32;
        table::row(&FINGER, Kilopascals(share * max_pressure_kpa)).0
    };
    FingerTable {
        max_pressure_kpa,
        rows: core::array::from_fn(row),
        ..FINGER
    }
}

#[test]
fn the_default_finger_has_the_default_settings() {
    let settings = Settings::for_finger(&FINGER);
    assert_eq!(settings, Settings::default());
    let stronger = FingerTable {
        max_pressure_kpa: 500.0,
        ..FINGER
    };
    assert_eq!(
        Settings::for_finger(&stronger).regulator.max_pressure_kpa,
        160.0
    );
}

#[test]
fn the_defaults_stay_within_what_finger_and_regulator_reach() {
    for max in [1.0, 8.0, 30.0, 33.3, 75.0, 160.0, 400.0] {
        let settings = Settings::for_finger(&shorter(max));
        let active = settings.validate(&shorter(max));
        assert!(active.is_ok(), "{max}: {active:?}");
        assert!(settings.grip.grip_pressure_kpa <= settings.regulator.max_pressure_kpa);
        let regrip = settings.grip.grip_pressure_kpa + settings.grip.regrip_raise_kpa;
        assert!(max <= 1.0 || regrip <= settings.regulator.max_pressure_kpa);
    }
    let small = Settings::default().with(&[(630, 100.0)], &FINGER);
    let small = small.expect("a smaller regulator");
    assert_eq!(small.regulator.max_pressure_kpa, 100.0);
    assert!(small.validate(&FINGER).is_ok());
    // A setting that somebody makes is not bent to fit.
    let error = Settings::default()
        .validate(&shorter(30.0))
        .expect_err("too high");
    assert_eq!(
        error.to_string(),
        "regulator.max_pressure_kpa = 160: must lie within 1 and 30"
    );
}

#[test]
fn a_finger_that_strains_little_is_touched_by_less() {
    let table = shorter(30.0);
    let (free, _) = table::free_strain(&table, Kilopascals(30.0));
    let settings = Settings::for_finger(&table);
    assert!(settings.finger.contact_ue < 500.0 && settings.finger.contact_ue >= 100.0);
    assert!(settings.finger.contact_ue < 0.5 * free.0, "{free:?}");
}

#[test]
fn a_wrong_setting_is_named_with_its_range() {
    for (change, expected) in [
        (
            (|s| s.regulator.max_pressure_kpa = 170.0) as fn(&mut Settings),
            "regulator.max_pressure_kpa = 170: must lie within 1 and 160",
        ),
        (
            |s| s.grip.settle_ms = f32::NAN,
            "grip.settle_ms = NaN: must lie within 0 and 10000",
        ),
        (
            |s| {
                s.grip.grip_pressure_kpa = 150.0;
                s.regulator.max_pressure_kpa = 120.0;
            },
            "grip.grip_pressure_kpa = 150: must lie within 1 and 120",
        ),
    ] {
        let mut settings = Settings::default();
        change(&mut settings);
        assert_eq!(error(settings), expected);
    }
}

#[test]
fn every_problem_is_told_at_once() {
    let mut settings = Settings::default();
    settings.air.regulator_lag_ms = 0.0;
    settings.detection.slip_percent = f32::INFINITY;
    settings.regulator.max_pressure_kpa = 161.0;
    settings.gauge.gain[2] = f32::NAN;
    let problems: std::vec::Vec<_> = settings
        .problems(&FINGER)
        .map(|problem| problem.to_string())
        .collect();
    assert_eq!(
        problems,
        [
            "regulator.max_pressure_kpa = 161: must lie within 1 and 160",
            "air.regulator_lag_ms = 0: must lie within 1 and 1000",
            "detection.slip_percent = inf: must lie within 1 and 50",
            "gauge.gain[2] = NaN: must lie within 0.5 and 2",
        ]
    );
}

#[test]
fn the_factorys_settings_are_those_of_the_finger() {
    let factory = Settings::of(&FACTORY);
    assert_eq!(factory, Settings::for_finger(&FINGER));
    assert!(Active::of(&FACTORY, &FINGER).is_ok());
}

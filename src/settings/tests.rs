//! Defaults, ranges and numbers of the settings.

use super::*;
use crate::frontend::FrontEnd;
use crate::table::{self, FingerTable};
use crate::table::{FINGER, ROWS};
use crate::units::Kilopascals;
use softgrip_settings::{FIELDS, Field, Kind, LIMITS};
use std::string::ToString;

fn error(settings: Settings) -> std::string::String {
    settings
        .validate(&FrontEnd::REFERENCE, &FINGER)
        .expect_err("a wrong setting")
        .to_string()
}

#[test]
fn the_defaults_are_valid() {
    assert!(
        Settings::default()
            .validate(&FrontEnd::REFERENCE, &FINGER)
            .is_ok()
    );
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
    let settings = Settings::for_finger(&FrontEnd::REFERENCE, &FINGER);
    assert_eq!(settings, Settings::default());
    let stronger = FingerTable {
        max_pressure_kpa: 500.0,
        ..FINGER
    };
    assert_eq!(
        Settings::for_finger(&FrontEnd::REFERENCE, &stronger)
            .regulator
            .max_pressure_kpa,
        160.0
    );
}

#[test]
fn the_defaults_stay_within_what_finger_and_regulator_reach() {
    for max in [1.0, 8.0, 30.0, 33.3, 75.0, 160.0, 400.0] {
        let settings = Settings::for_finger(&FrontEnd::REFERENCE, &shorter(max));
        let active = settings.validate(&FrontEnd::REFERENCE, &shorter(max));
        assert!(active.is_ok(), "{max}: {active:?}");
        assert!(settings.grip.grip_pressure_kpa <= settings.regulator.max_pressure_kpa);
        let regrip = settings.grip.grip_pressure_kpa + settings.grip.regrip_raise_kpa;
        assert!(max <= 1.0 || regrip <= settings.regulator.max_pressure_kpa);
    }
    let small = FrontEnd {
        regulator_full_scale: Kilopascals(100.0),
        ..FrontEnd::REFERENCE
    };
    let settings = Settings::for_finger(&small, &FINGER);
    assert_eq!(settings.regulator.max_pressure_kpa, 100.0);
    assert_eq!(settings.grip.grip_pressure_kpa, 87.5);
    assert!(settings.validate(&small, &FINGER).is_ok());
    // A setting that somebody makes is not bent to fit.
    let error = Settings::default()
        .validate(&FrontEnd::REFERENCE, &shorter(30.0))
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
    let settings = Settings::for_finger(&FrontEnd::REFERENCE, &table);
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
fn every_number_is_one_leaf_and_its_default_is_the_default() {
    let default = Settings::default();
    let mut changed = std::vec![default];
    for field in &FIELDS {
        let number = field.number;
        assert_eq!(default.get(number), Some(field.default), "{}", field.name);
        let (min, max) = field.kind.range();
        for end in [min, max] {
            let mut settings = default;
            settings.set(number, end).expect("an end of its range");
            assert_eq!(settings.get(number), Some(end), "{}", field.name);
            if end == field.default {
                continue;
            }
            assert!(!changed.contains(&settings), "{}", field.name);
            settings.set(number, field.default).expect("its default");
            assert_eq!(settings, default, "{}", field.name);
            settings.set(number, end).expect("an end of its range");
            changed.push(settings);
        }
    }
    for unknown in [0, 1, 99, 223, u16::MAX] {
        assert_eq!(default.get(unknown), None);
        let mut settings = default;
        let error = settings.set(unknown, 1.0).expect_err("no such setting");
        assert_eq!(
            error.to_string(),
            std::format!("setting {unknown}: there is none of that number")
        );
    }
}

#[test]
fn the_ends_of_every_range_are_right_and_what_lies_beyond_is_named() {
    for limit in &LIMITS {
        let limit = limit.at(FINGER.max_pressure_kpa, FINGER.max_pressure_kpa);
        for end in [limit.min, limit.max] {
            let mut settings = Settings::default();
            settings
                .set(limit.number, end)
                .expect("an end of its range");
            settings.fit(&FrontEnd::REFERENCE, &FINGER);
            let problem = settings.problems(&FrontEnd::REFERENCE, &FINGER).next();
            assert_eq!(problem, None);
        }
        for wrong in [limit.min.next_down(), limit.max.next_up(), f32::NAN] {
            let mut settings = Settings::default();
            let number = limit.number;
            let refused = settings.set(number, wrong).err();
            // What the table alone forbids is a number that another finger may have.
            let problem = settings.problems(&FrontEnd::REFERENCE, &FINGER).next();
            assert_eq!(refused.is_some(), problem.is_none());
            assert_eq!(refused.or(problem).map(|error| error.number), Some(number));
        }
    }
}

#[test]
fn every_problem_is_told_at_once() {
    let mut settings = Settings::default();
    settings.air.regulator_lag_ms = 0.0;
    settings.detection.slip_percent = f32::INFINITY;
    settings.regulator.max_pressure_kpa = 161.0;
    settings.grip.grip_pressure_kpa = 162.0;
    let problems: std::vec::Vec<_> = settings
        .problems(&FrontEnd::REFERENCE, &FINGER)
        .map(|problem| problem.to_string())
        .collect();
    assert_eq!(
        problems,
        [
            "regulator.max_pressure_kpa = 161: must lie within 1 and 160",
            "air.regulator_lag_ms = 0: must lie within 1 and 1000",
            "detection.slip_percent = inf: must lie within 1 and 50",
            "grip.grip_pressure_kpa = 162: must lie within 1 and 161",
        ]
    );
}

#[test]
fn a_choice_is_a_place_in_the_list_of_its_words() {
    let words = |number: u16| match Field::of(number).map(|field| field.kind) {
        Some(Kind::Choice(words)) => words,
        other => panic!("{number}: {other:?}"),
    };
    let lower = |debug: std::string::String| debug.to_lowercase();
    let said = GaugeSense::ALL.map(|sense| lower(std::format!("{sense:?}")));
    assert_eq!(words(200), said);
    let said = OnFault::ALL.map(|on_fault| lower(std::format!("{on_fault:?}")));
    assert_eq!(words(406), said);
    let said = OnLoss::ALL.map(|on_loss| lower(std::format!("{on_loss:?}")));
    assert_eq!(words(407), said);
    let error = Settings::default().set(407, 0.5).expect_err("no place");
    assert_eq!(
        error.to_string(),
        "grip.on_loss = 0.5: must be a whole number from 0 to 2, 0 is hold, 1 is vent, 2 is regrip"
    );
}

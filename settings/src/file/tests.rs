//! Good files, and bad ones of many kinds.

use super::*;
use crate::page;
use std::vec;

const TABLE_KPA: f32 = 160.0;

fn entries(text: &str) -> Vec<(u16, f32)> {
    let entries = parse(Path::new("x.toml"), text, TABLE_KPA);
    entries.unwrap_or_else(|error| panic!("{error}"))
}

fn problems(text: &str) -> Vec<String> {
    match parse(Path::new("x.toml"), text, TABLE_KPA) {
        Ok(entries) => panic!("{entries:?}"),
        Err(error) => error.lines(),
    }
}

/// What is wrong with the second line of a file.
fn problem(line: &str) -> String {
    let mut problems = problems(&format!("version = 1\n{line}\n"));
    assert_eq!(problems.len(), 1, "{problems:?}");
    problems.remove(0)
}

#[test]
fn a_file_of_all_settings_is_read_back_bit_by_bit() {
    let odd = |field: &Field| match field.kind {
        Kind::Number { min, max } => min + (max.min(100.0) - min) * (1.0 / 3.0),
        Kind::Whole { max, .. } => max.into(),
        Kind::Choice(words) => (words.len() - 1) as f32,
    };
    let odd = Values::from_all(FIELDS.map(|field| odd(&field)));
    for values in [odd, Values::DEFAULT] {
        let text = page::toml(&values);
        let read = entries(&text);
        assert_eq!(read.len(), FIELDS.len());
        for (number, value) in read {
            assert_eq!(
                values.get(number).map(f32::to_bits),
                Some(value.to_bits()),
                "{text}"
            );
        }
    }
}

#[test]
fn a_file_need_not_state_every_setting_and_may_come_from_any_editor() {
    let none: [(u16, f32); 0] = [];
    assert_eq!(entries("version = 1\n"), none);
    let text = "\u{feff}version = 1\r\n[regulator]\r\nslew_kpa_per_s = 300\r\n[air]\r\nregulator_lag_ms = 0x50 # 80\r\n";
    assert_eq!(entries(text), [(110, 80.0), (101, 300.0)]);
    let text = "version = 1\nfinger.gauge_sense = 'contact'\nfinger.contact_ue = 1e3\nfinger.contact_percent = 0.1\n";
    assert_eq!(entries(text).len(), 3);
    assert!(entries(text).contains(&(202, 0.1)));
    assert!(entries("version = 1\nfinger.silicone.creep_time_s = 0.1\n").contains(&(254, 0.1)));
    assert_eq!(
        entries("version = 1\nfinger.free_bend_gain = [1, 1.05, 2]\n"),
        [(220, 1.0), (221, 1.05), (222, 2.0)]
    );
}

/// Second lines of a file, and what is wrong with them.
const WRONG: &[(&str, &str)] = &[
    (
        "regulator.slew_kpa_per_s = 0.5",
        "x.toml:2: regulator.slew_kpa_per_s = 0.5: must lie within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = nan",
        "x.toml:2: regulator.slew_kpa_per_s = nan: must lie within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = inf",
        "x.toml:2: regulator.slew_kpa_per_s = inf: must lie within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = 1e400",
        "x.toml:2: regulator.slew_kpa_per_s = 1e400: must lie within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = -1_000",
        "x.toml:2: regulator.slew_kpa_per_s = -1000: must lie within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = '400'",
        "x.toml:2: regulator.slew_kpa_per_s = \"400\": must be a number within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = true",
        "x.toml:2: regulator.slew_kpa_per_s = true: must be a number within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = [400.0]",
        "x.toml:2: regulator.slew_kpa_per_s = a list: must be a number within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = { value = 400 }",
        "x.toml:2: regulator.slew_kpa_per_s = a table: must be a number within 1 and 10000",
    ),
    (
        "regulator.slew_kpa_per_s = 2026-01-01",
        "x.toml:2: regulator.slew_kpa_per_s = 2026-01-01: must be a number within 1 and 10000",
    ),
    (
        "regulator.max_pressure_kpa = 170",
        "x.toml:2: regulator.max_pressure_kpa = 170: must lie within 1 and 160, what finger and regulator reach",
    ),
    (
        "grip.grip_pressure_kpa = 161",
        "x.toml:2: grip.grip_pressure_kpa = 161: must lie within 1 and 160, regulator.max_pressure_kpa",
    ),
    (
        "grip.on_loss = 'drop'",
        "x.toml:2: grip.on_loss = \"drop\": must be one of \"hold\", \"vent\", \"regrip\"",
    ),
    (
        "grip.on_loss = 1",
        "x.toml:2: grip.on_loss = 1: must be one of \"hold\", \"vent\", \"regrip\"",
    ),
    (
        "bus.id = 9.5",
        "x.toml:2: bus.id = 9.5: must be a whole number from 1 to 247",
    ),
    (
        "bus.id = 0",
        "x.toml:2: bus.id = 0: must be a whole number from 1 to 247",
    ),
    (
        "bus.baud = 115200",
        "x.toml:2: bus.baud = 115200: must be one of \"9600\", \"19200\", \"38400\", \"57600\", \"115200\", \"230400\"",
    ),
    (
        "regulator = 400.0",
        "x.toml:2: regulator = 400.0: must be a table, [regulator]",
    ),
    (
        "[[regulator]]",
        "x.toml:2: regulator = a list: must be a table, [regulator]",
    ),
    (
        "finger.free_bend_gain = [1.0, 1.0]",
        "x.toml:2: finger.free_bend_gain has 2 values: must have 3",
    ),
    (
        "finger.free_bend_gain = 1.0",
        "x.toml:2: finger.free_bend_gain = 1.0: must be a list of 3",
    ),
    (
        "finger.free_bend_gain = [1.0, 1.0, 3.0]",
        "x.toml:2: finger.free_bend_gain[2] = 3.0: must lie within 0.5 and 2",
    ),
    (
        "regulator.slew = 400.0",
        "x.toml:2: regulator.slew: there is no such setting",
    ),
    (
        "regulator.slew_kpa_pers = 400.0",
        "x.toml:2: regulator.slew_kpa_pers: there is no such setting; did you mean regulator.slew_kpa_per_s?",
    ),
    (
        "max_pressure_kpa = 100.0",
        "x.toml:2: max_pressure_kpa: there is no such setting; did you mean regulator.max_pressure_kpa?",
    ),
    (
        "[regulater]\nslew_kpa_per_s = 1.0",
        "x.toml:2: regulater: there is no such setting",
    ),
];

#[test]
fn a_value_that_no_setting_has_is_named_with_its_line_and_what_would_be_right() {
    for (line, expected) in WRONG {
        assert_eq!(problem(line), *expected);
    }
}

#[test]
fn a_grip_goes_no_higher_than_the_highest_pressure_of_the_same_file() {
    let text = "version = 1\ngrip.grip_pressure_kpa = 130\nregulator.max_pressure_kpa = 120\n";
    assert_eq!(
        problems(text),
        [
            "x.toml:2: grip.grip_pressure_kpa = 130: must lie within 1 and 120, regulator.max_pressure_kpa"
        ]
    );
}

#[test]
fn a_grip_that_no_highest_pressure_allows_is_told_together_with_it() {
    let text = "version = 1\ngrip.grip_pressure_kpa = 170\nregulator.max_pressure_kpa = 500\n";
    assert_eq!(
        problems(text),
        [
            "x.toml:2: grip.grip_pressure_kpa = 170: must lie within 1 and 160, regulator.max_pressure_kpa",
            "x.toml:3: regulator.max_pressure_kpa = 500: must lie within 1 and 160, what finger and regulator reach",
        ]
    );
}

#[test]
fn every_problem_is_listed_in_the_order_of_the_lines() {
    let text = "version = 2\n[grip]\nsettle_ms = -1\nslip_percent = 7\non_fault = 'hodl'\nsettle_ms = 5\n[detection\nslip_percent = 99\n[air]\nregulator_lag_ms = 0\n";
    let problems = problems(text);
    let expected = [
        "x.toml:1: version = 2: is newer than this release, which reads 1",
        "x.toml:3: grip.settle_ms = -1: must lie within 0 and 10000",
        "x.toml:4: grip.slip_percent: there is no such setting; did you mean detection.slip_percent?",
        "x.toml:5: grip.on_fault = \"hodl\": must be one of \"vent\", \"hold\"",
        "x.toml:6: duplicate key",
        "x.toml:7: ",
        "x.toml:10: air.regulator_lag_ms = 0: must lie within 1 and 1000",
    ];
    for expected in expected {
        let told = problems.iter().any(|problem| problem.starts_with(expected));
        assert!(told, "{expected}: {problems:#?}");
    }
}

#[test]
fn what_is_no_settings_file_is_refused() {
    assert_eq!(problems(""), ["x.toml: must begin with version = 1"]);
    assert_eq!(problems("\n\n"), ["x.toml: must begin with version = 1"]);
    for (version, expected) in [
        ("0", "x.toml:1: version = 0: must be 1"),
        ("'1'", "x.toml:1: version = \"1\": must be 1"),
        ("1.0", "x.toml:1: version = 1.0: must be 1"),
        (
            "99999999999999999999",
            "x.toml:1: version = 99999999999999999999: must be 1",
        ),
    ] {
        assert_eq!(problems(&format!("version = {version}\n")), [expected]);
    }
}

#[test]
fn a_file_that_was_cut_off_is_refused_wherever_a_line_is_cut() {
    let whole = page::toml(&Values::DEFAULT);
    for end in 0..whole.len() {
        let Some(cut) = whole.get(..end).filter(|cut| !cut.ends_with('\n')) else {
            continue;
        };
        let refused = parse(Path::new("x.toml"), cut, TABLE_KPA);
        assert!(refused.is_err(), "{cut}");
    }
}

#[test]
fn any_bytes_are_read_without_a_panic() {
    let mut seed = 1u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize
    };
    let whole = page::toml(&Values::DEFAULT);
    for _ in 0..300 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..1 + random() % 20 {
            let at = random() % bytes.len();
            bytes[at] = b"[]{}=.,'\"#\n\r\\ \x00\x7f1e-+_nx"[random() % 23];
        }
        // It may still be a good file; that there is an answer is what counts.
        if let Err(error) = parse(
            Path::new("x.toml"),
            &String::from_utf8_lossy(&bytes),
            TABLE_KPA,
        ) {
            assert!(!error.lines().is_empty());
        }
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let path = std::env::temp_dir().join(format!("softgrip-settings-{}.toml", std::process::id()));
    let lines = |path: &Path| read(path, TABLE_KPA).expect_err("no settings").lines();
    let missing = lines(&path);
    assert!(
        missing[0].starts_with(&format!("{}: ", path.display())),
        "{missing:?}"
    );
    std::fs::write(&path, b"version = 1\n\n\xff\xfe\x00").expect("a file");
    let binary = lines(&path);
    std::fs::remove_file(&path).expect("a file");
    let expected = vec![format!(
        "{}:3: is not text in UTF-8, so this is no settings file",
        path.display()
    )];
    assert_eq!(binary, expected);
}

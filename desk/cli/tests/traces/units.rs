//! Units and signs.

use super::bench::{
    HEADER, Row, csv, events_of, names, refused, replay, softgrip, temporary, thinned, understood,
};

#[test]
fn units_are_converted_where_they_are_named() {
    let scaled = |by: [f64; 6]| -> Vec<Row> {
        let rows = thinned(5, 0).into_iter();
        rows.map(|row| std::array::from_fn(|i| row[i] * by[i]))
            .collect()
    };
    let put = |header: &str, by: [f64; 6]| {
        let mut text = format!("{header}\n");
        for row in scaled(by) {
            text += &format!("{}\n", row.map(|value| value.to_string()).join(","));
        }
        text
    };
    let ms = put(
        &HEADER.replace("t_s", "t_ms"),
        [1e3, 1.0, 1.0, 1.0, 1.0, 1.0],
    );
    understood(ms.as_bytes(), &["t_ms: ms read as s"]);
    let bar = put(
        "time_us,strain1_me,strain2_me,strain3_me,pressure_bar,setpoint_psi",
        [1e6, 1e-3, 1e-3, 1e-3, 0.01, 1.0 / 6.894_757_293_168_361],
    );
    understood(
        bar.as_bytes(),
        &["mε read as µε", "bar read as kPa", "psi read as kPa"],
    );
    let mpa = put(
        "t,strain1,strain2,strain3,pressure,setpoint\ns,%,%,%,MPa,MPa",
        [1.0, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3],
    );
    understood(
        mpa.as_bytes(),
        &["line 2 taken for units", "MPa read as kPa"],
    );
}

#[test]
fn a_unit_or_a_sign_that_is_off_is_refused_by_column_and_never_a_hold() {
    let times = |by: [f64; 6]| -> String {
        let mut text = format!("{HEADER}\n");
        for row in thinned(5, 0) {
            let row: Row = std::array::from_fn(|i| row[i] * by[i]);
            text += &format!("{}\n", row.map(|value| value.to_string()).join(","));
        }
        text
    };
    for (pressure, setpoint, word) in [
        (0.01, 1.0, "bar"),
        (0.001, 1.0, "MPa"),
        (1.0 / 6.894_757, 1.0, "psi"),
        (1e3, 1.0, "not in kPa"),
        (1.0, 0.01, "setpoint_kpa looks like bar"),
        (1.0, 0.001, "setpoint_kpa stays near zero"),
        (0.01, 0.01, "bar"),
        (0.001, 0.001, "MPa"),
        (1.0 / 6.894_757, 1.0 / 6.894_757, "psi"),
        (1e3, 1e3, "not in kPa"),
    ] {
        refused(
            &times([1.0, 1.0, 1.0, 1.0, pressure, setpoint]),
            &["_kpa", word],
        );
    }
    for (strain, word) in [
        (1e-3, "mε"),
        (1e-6, "ε"),
        (1e-4, "%"),
        (1e3, "more than gauges"),
        (-1.0, "sign"),
    ] {
        refused(
            &times([1.0, strain, strain, strain, 1.0, 1.0]),
            &["strain1_ue", word],
        );
    }
    refused(
        &times([1.0, 1.0, -1.0, 1.0, 1.0, 1.0]),
        &["strain2_ue", "sign"],
    );
    refused(
        &times([1e3, 1.0, 1.0, 1.0, 1.0, 1.0]),
        &["t_s", "unit of time"],
    );
}

#[test]
fn legal_oddities_are_not_refused() {
    // Zeros that drift, a gauge that fails, and a cylinder that bends the fingers' bases backwards.
    let mut rows = thinned(5, 0);
    for row in &mut rows {
        row[1] -= 100.0 * row[0];
        row[3] += 400.0;
    }
    assert!(names(&events_of(&replay(csv(&rows).as_bytes(), &[]))).contains(&"holding"));
    let mut rows = thinned(5, 0);
    rows.iter_mut()
        .filter(|row| row[0] > 2.0)
        .for_each(|row| row[2] = -20_400.0);
    let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
    assert!(names(&events).contains(&"fault") && names(&events).contains(&"lost"));
    let dir = temporary();
    let out = dir.path().to_str().expect("a path in UTF-8");
    softgrip(&[
        "sim", "--object", "cylinder", "--mass", "0.08", "--noise", "100", "--out", out,
    ]);
    let text = std::fs::read(dir.path().join("trace.csv")).expect("a trace");
    assert_eq!(
        names(&events_of(&replay(&text, &[]))).last(),
        Some(&"released")
    );
}

#[test]
fn the_rule_for_contact_gauges_is_theirs() {
    let contact: Vec<Row> = thinned(5, 0)
        .into_iter()
        .map(|[t, _, _, _, p, s]| {
            let strain = 30.0 * (p - 60.0).max(0.0);
            [t, strain, strain + 1.0, strain - 1.0, p, s]
        })
        .collect();
    let more = ["--gauge", "contact"];
    assert!(names(&events_of(&replay(csv(&contact).as_bytes(), &more))).contains(&"holding"));
    let reversed: Vec<Row> = contact
        .iter()
        .map(|[t, a, b, c, p, s]| [*t, -a, -b, -c, *p, *s])
        .collect();
    let output = replay(csv(&reversed).as_bytes(), &more);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn a_finger_that_bends_more_than_the_recipe_says_is_no_unit() {
    // At 60 kPa three times the default finger's bend, which no other unit of pressure explains.
    let rows: Vec<Row> = thinned(5, 0)
        .into_iter()
        .map(|[t, _, _, _, p, s]| {
            let (p, s) = (p * 60.0 / 140.0, s * 60.0 / 140.0);
            [t, 110.0 * p, 110.0 * p + 1.0, 110.0 * p - 1.0, p, s]
        })
        .collect();
    assert!(names(&events_of(&replay(csv(&rows).as_bytes(), &[]))).contains(&"empty"));
}

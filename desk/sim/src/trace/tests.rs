use super::*;

const HEADER: &str = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa";

fn error(text: &str) -> String {
    format!("{:#}", parse(text.as_bytes()).expect_err("a bad trace"))
}

#[test]
fn columns_may_stand_in_any_order_among_others() {
    let trace = parse(
        "note,setpoint_kpa,pressure_kpa,strain3_ue,strain2_ue,strain1_ue,t_s\nx,6,5,4,3,2,0\ny,6,5,4,3,2,0.001\n"
            .as_bytes(),
    )
    .expect("a good trace");
    assert_eq!(
        trace.rows[1],
        Row {
            t_s: 0.001,
            strain_ue: [2.0, 3.0, 4.0],
            pressure_kpa: 5.0,
            setpoint_kpa: 6.0,
            measured: true,
        }
    );
}

#[test]
fn every_bad_trace_is_named_by_its_line_and_what_would_be_right() {
    for (text, expected) in [
        ("", "line 1: no column t_s"),
        ("PK\u{3}\u{4}", "save it as CSV"),
        (
            &HEADER.replace(',', "|"),
            "separated by commas, semicolons, tabs or blanks",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,0\n\0\0\0"),
            "line 3: a zero byte, so this is no text",
        ),
        (HEADER, "0 rows of data: a trace needs at least two"),
        (
            "t_s,strain1_ue,strain2_ue,pressure_kpa,setpoint_kpa\n",
            "line 1: no column strain3_ue",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,0\n0.001,0,NaN,0,0,0\n"),
            "line 3: strain2_ue = \"NaN\": must be a finite number, or empty where there is none",
        ),
        (
            &format!("{HEADER}\n0,0,,0,0,0\n0.001,0,,0,0,0\n"),
            "strain2_ue: every cell is empty: what is read over the bus has residuals",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,0\n,0,0,0,0,0\n"),
            "line 3: t_s is empty",
        ),
        (
            &format!("{HEADER}\n0.002,0,0,0,0,0\n0.001,0,0,0,0,0\n"),
            "line 3: t_s = 0.001: time must rise, and the row before is at 0.002",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,0\n1,0,0,0,0,0\n"),
            "line 3: t_s = 1: 1.000000 s after the row before, 1 Hz; the rate must lie within 10 Hz and 10 kHz",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,-3\n0.001,0,0,0,0,0\n"),
            "line 2: setpoint_kpa = -3: must not be negative",
        ),
        (
            &format!("{HEADER}\n0,0,0,0,0,0\n0.001,0,0\n0.002,0,0,0,0,0\n"),
            "line 3: 3 cells between commas, but the header has 6",
        ),
    ] {
        let message = error(text);
        assert!(message.contains(expected), "{message}");
    }
}

/// A command of 140 kPa that is read back behind its ramp and the controller's trim, and falls for 0.1 s at the end.
fn commanded(ms: u32) -> f64 {
    let t_s = 1e-3 * f64::from(ms);
    match t_s {
        ..0.3 => 0.0,
        0.3..0.647 => 400.0 * (t_s - 0.3),
        0.647..1.4 => 140.0 - 1.2 * (-8.0 * (t_s - 0.647)).exp(),
        _ => 140.0 - 400.0 * (t_s - 1.4),
    }
}

#[test]
fn a_command_that_a_trim_moves_is_left_where_its_ramp_begins() {
    let mut text = format!("{HEADER}\n");
    for ms in 0..1500 {
        let row = format!("{},0,0,0,0,{:.3}\n", 1e-3 * f64::from(ms), commanded(ms));
        text.push_str(&row);
    }
    let trace = parse(text.as_bytes()).expect("a good trace");
    let changes: Vec<f64> = trace
        .rows
        .windows(2)
        .filter(|pair| pair[0].setpoint_kpa != pair[1].setpoint_kpa)
        .map(|pair| pair[1].t_s)
        .collect();
    let [grip, fall] = changes[..] else {
        panic!("{changes:?}");
    };
    assert!(
        (grip - 0.3).abs() < 0.005 && (fall - 1.4).abs() < 0.005,
        "{changes:?}"
    );
}

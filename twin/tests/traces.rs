//! Traces as other people's loggers write them, made from one simulated run.

use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;
use tempfile::TempDir;

const HEADER: &str = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa";
type Row = [f64; 6];

/// A sphere that is held and released, and then one that is lost, at 1 kHz.
static RUN: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let dir = temporary();
    let out = dir.path().to_str().expect("a path in UTF-8");
    assert!(softgrip(&["sim", "--out", out]).status.success());
    let text = std::fs::read_to_string(dir.path().join("trace.csv")).expect("a trace");
    let row = |line: &str| {
        let mut cells = line.split(',').map(|cell| cell.parse().expect("a number"));
        std::array::from_fn(|_| cells.next().expect("six columns"))
    };
    text.lines().skip(1).map(row).collect()
});

fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

fn temporary() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Every so many rows of the run, from one of the first on.
fn thinned(every: usize, from: usize) -> Vec<Row> {
    RUN.iter().skip(from).step_by(every).copied().collect()
}

fn csv(rows: &[Row]) -> String {
    csv_with(HEADER, ",", rows)
}

fn csv_with(header: &str, separator: &str, rows: &[Row]) -> String {
    let mut text = format!("{header}\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(|value| format!("{value:.3}")).collect();
        text += &format!("{}\n", cells.join(separator));
    }
    text
}

fn replay(content: &[u8], more: &[&str]) -> Output {
    let dir = temporary();
    let path: PathBuf = dir.path().join("trace.csv");
    std::fs::write(&path, content).expect("a trace");
    let path = path.to_str().expect("a path in UTF-8");
    softgrip(&[&["replay", path, "--json"], more].concat())
}

fn events_of(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("every line is JSON"))
        .collect()
}

fn names(events: &[Value]) -> Vec<&str> {
    events.iter().filter_map(|e| e["event"].as_str()).collect()
}

fn time_of(events: &[Value], name: &str) -> f64 {
    let event = events.iter().find(|e| e["event"] == name);
    let event = event.unwrap_or_else(|| panic!("no {name} in {events:?}"));
    event["t_s"].as_f64().expect("a time")
}

/// Reads the trace, with all these words on standard error, and the events that the run has.
fn understood(content: &[u8], words: &[&str]) {
    let output = replay(content, &[]);
    let said = String::from_utf8_lossy(&output.stderr);
    for word in words {
        assert!(said.contains(word), "no {word:?} in {said}");
    }
    let events = events_of(&output);
    let plain = events_of(&replay(csv(&thinned(5, 0)).as_bytes(), &[]));
    assert_eq!(names(&events), names(&plain), "{words:?}");
    for (event, plain) in events.iter().zip(&plain) {
        let [a, b] = [event, plain].map(|e| e["t_s"].as_f64().expect("a time"));
        assert!((a - b).abs() < 0.012, "{event} and {plain}");
    }
}

fn refused(content: &str, words: &[&str]) {
    let output = replay(content.as_bytes(), &[]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for word in words {
        assert!(error.contains(word), "no {word:?} in {error}");
    }
}

#[test]
fn at_100_and_125_hz_a_loss_is_told_in_time_and_no_gauge_is_stuck_whatever_the_phase() {
    let live = time_of(&events_of(&replay(csv(&RUN).as_bytes(), &[])), "lost");
    for every in [10, 8] {
        for from in 0..every {
            let events = events_of(&replay(csv(&thinned(every, from)).as_bytes(), &[]));
            let told: Vec<&str> = names(&events);
            let told: Vec<&str> = told.into_iter().filter(|name| *name != "contact").collect();
            assert_eq!(
                told,
                ["holding", "released", "holding", "slip", "lost"],
                "one of {every} from {from}"
            );
            let late = time_of(&events, "lost") - live;
            assert!(
                (-0.002..0.015).contains(&late),
                "one of {every} from {from}: {late} s"
            );
        }
    }
}

#[test]
fn below_100_hz_a_loss_is_told_later_and_what_is_less_sure_is_said() {
    let live = time_of(&events_of(&replay(csv(&RUN).as_bytes(), &[])), "lost");
    for (every, limit_s) in [(20, 0.1), (50, 0.4), (100, 1.0)] {
        for from in [0, every / 2] {
            let output = replay(csv(&thinned(every, from)).as_bytes(), &[]);
            assert!(String::from_utf8_lossy(&output.stderr).contains("less than 100"));
            let events = events_of(&output);
            assert!(!names(&events).contains(&"fault"), "{every}: {events:?}");
            let late = time_of(&events, "lost") - live;
            assert!((0.0..limit_s).contains(&late), "{every}: {late} s");
        }
    }
}

#[test]
fn a_gauge_that_sticks_in_a_100_hz_trace_is_found() {
    let mut rows = thinned(10, 3);
    let stuck_from = rows.iter().position(|row| row[0] > 2.0).expect("a row");
    let stuck_at = rows[stuck_from][2];
    rows[stuck_from..]
        .iter_mut()
        .for_each(|row| row[2] = stuck_at);
    let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
    let fault = events
        .iter()
        .find(|e| e["event"] == "fault")
        .expect("a fault");
    assert_eq!(
        (&fault["fault"], &fault["finger"]),
        (&"GaugeStuck".into(), &2.into())
    );
    assert!(time_of(&events, "fault") < 2.2);
    assert!(time_of(&events, "lost") > 7.0);
}

#[test]
fn a_spike_of_one_row_in_a_100_hz_trace_is_nothing() {
    let mut rows = thinned(10, 0);
    let plain = events_of(&replay(csv(&rows).as_bytes(), &[]));
    let at = rows.iter().position(|row| row[0] > 2.5).expect("a row");
    rows[at][1] += 9_000.0;
    let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
    assert_eq!(names(&events), names(&plain));
}

/// The set-point as a ramp of so many kPa/s.
fn ramped(mut rows: Vec<Row>, slew: f64) -> Vec<Row> {
    let mut setpoint = 0.0;
    let mut before_s = rows[0][0];
    for row in &mut rows {
        let way = slew * (row[0] - before_s);
        before_s = row[0];
        setpoint += (row[5] - setpoint).clamp(-way, way);
        row[5] = setpoint;
    }
    rows
}

/// Numbers between −1 and 1 that look like noise.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(u32::MAX / 4) - 1.0
    }
}

#[test]
fn a_set_point_that_was_read_back_or_ramped_is_the_commands_behind_it() {
    let grip = "a grip to 140";
    for size in [0.05, 0.3, 0.8] {
        let mut noise = noise();
        let mut rows = thinned(5, 0);
        rows.iter_mut().for_each(|row| row[5] += size * noise());
        understood(
            csv(&rows).as_bytes(),
            &["read back with", grip, "a release at"],
        );
        let mut rows = ramped(rows, 400.0);
        rows.iter_mut().for_each(|row| row[5] += size * noise());
        understood(csv(&rows).as_bytes(), &["ramps of 4", grip]);
    }
    understood(
        csv(&ramped(thinned(5, 0), 400.0)).as_bytes(),
        &["ramps of 400 kPa/s: a grip"],
    );
    let mut rows = thinned(5, 0);
    rows.iter_mut()
        .filter(|row| row[5] == 0.0)
        .for_each(|row| row[5] = -0.02);
    understood(csv(&rows).as_bytes(), &["within 0.02 of zero"]);
}

#[test]
fn a_falling_ramp_acknowledges_no_loss_and_the_next_grip_does() {
    let twice = |rows: &[Row]| -> Vec<Row> {
        let end_s = rows[rows.len() - 1][0] + 0.005;
        let again = rows.iter().map(|row| {
            let mut row = *row;
            row[0] += end_s;
            row
        });
        rows.iter().copied().chain(again).collect()
    };
    let steps = twice(&thinned(5, 0));
    for rows in [ramped(steps.clone(), 400.0), steps] {
        let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
        let told = names(&events);
        let acknowledged = told.iter().filter(|name| **name == "acknowledged");
        assert_eq!(acknowledged.count(), 1, "{told:?}");
        let at_s = time_of(&events, "acknowledged");
        let grip = rows
            .iter()
            .find(|row| row[0] > 9.0 && row[5] > 0.0)
            .expect("a grip");
        assert!((at_s - grip[0]).abs() < 0.011, "{at_s} and {}", grip[0]);
        assert!(!told.contains(&"refused"), "{told:?}");
    }
}

#[test]
fn a_times_sign_is_kept_in_every_event_and_in_a_losss_onset() {
    let shifted = |by_s: f64| -> Vec<Value> {
        let mut rows = thinned(5, 0);
        rows.iter_mut().for_each(|row| row[0] += by_s);
        events_of(&replay(csv(&rows).as_bytes(), &[]))
    };
    let (plain, early) = (shifted(0.0), shifted(-20.0));
    assert_eq!(names(&early), names(&plain));
    for (early, plain) in early.iter().zip(&plain) {
        for field in ["t_s", "onset_s"] {
            let [a, b] = [early, plain].map(|event| event[field].as_f64());
            assert_eq!(a.is_some(), b.is_some());
            let apart = b.unwrap_or(20.0) - a.unwrap_or(0.0);
            assert!((apart - 20.0).abs() < 1e-6, "{early} and {plain}");
        }
    }
}

#[test]
fn a_clock_that_jitters_loses_rows_or_is_rounded_is_read() {
    let mut noise = noise();
    let jitter: Vec<Row> = (0..RUN.len() / 10 - 1)
        .map(|i| RUN[10 * i + 1 + (noise().abs() * 2.0) as usize])
        .collect();
    understood(csv(&jitter).as_bytes(), &[]);
    let mut rows = thinned(10, 0);
    rows.remove(150);
    rows.drain(400..403);
    understood(
        csv(&rows).as_bytes(),
        &["2 gaps, about 4 rows missing", "0.040 s"],
    );
    let mut rows = thinned(5, 0);
    rows.iter_mut()
        .for_each(|row| row[0] = (row[0] * 100.0).round() / 100.0);
    understood(
        csv(&rows).as_bytes(),
        &["rounded to 0.010 s", "spread evenly"],
    );
}

#[test]
fn what_cannot_be_judged_is_refused_by_line() {
    let mut rows = thinned(10, 0);
    rows.drain(300..360);
    refused(
        &csv(&rows),
        &["line 302", "0.61 s after the row before", "cut the trace"],
    );
    refused(
        &csv(&thinned(200, 0)),
        &["line 3", "5 Hz", "10 Hz and 10 kHz", "unit of time"],
    );
    let mut rows = thinned(10, 0);
    rows.swap(100, 101);
    refused(&csv(&rows), &["line 103", "time must rise"]);
    let mut rows = thinned(10, 0);
    rows.iter_mut().for_each(|row| row[0] = 1.0);
    refused(&csv(&rows), &["line 3", "the same in every row"]);
}

#[test]
fn dialects_are_read_and_said() {
    let rows = thinned(5, 0);
    let plain = csv(&rows);
    let german = csv_with(HEADER, ";", &rows).replace('.', ",");
    understood(
        german.as_bytes(),
        &["separated by semicolon", "decimal commas"],
    );
    let tabs = csv_with(&HEADER.replace(',', "\t"), "\t", &rows);
    understood(tabs.as_bytes(), &["separated by tab"]);
    understood(
        format!("\u{feff}{}", plain.replace('\n', "\r\n")).as_bytes(),
        &[],
    );
    let wide: Vec<u8> = "\u{feff}"
        .chars()
        .chain(plain.chars())
        .flat_map(|c| (c as u16).to_le_bytes())
        .collect();
    understood(&wide, &[]);
    understood(plain.replace('\n', ",\n").as_bytes(), &[]);
    let body = &plain[HEADER.len()..];
    understood(
        format!("{HEADER},{}", body.replace('\n', ",\n")).as_bytes(),
        &[],
    );
    understood(
        format!("# rig 3\n\n{HEADER}\n\n# begins{body}").as_bytes(),
        &[],
    );
    understood(
        format!("Logger 5\nOperator: me\n{HEADER}{body}").as_bytes(),
        &["2 lines before"],
    );
    understood(
        format!("{HEADER}\ns,µε,ue,microstrain,kPa,kPa{body}").as_bytes(),
        &["line 2 taken for units"],
    );
    let latin: Vec<u8> = format!("{HEADER}\ns,\u{b5}e,ue,ue,kPa,kPa{body}")
        .chars()
        .map(|c| c as u8)
        .collect();
    understood(&latin, &["line 2 taken for units"]);
    let named = "Time (s),Strain 1 [µε],STRAIN2_UE,strain_3_ue,Pressure / kPa,Set-Point (kPa)";
    understood(format!("{named}{body}").as_bytes(), &[]);
    let quoted = plain
        .lines()
        .map(|line| format!("\"{}\"\n", line.replace(',', "\",\"")));
    understood(quoted.collect::<String>().as_bytes(), &[]);
    understood(
        plain[..plain.len() - 9].as_bytes(),
        &["the last, is cut off"],
    );
}

#[test]
fn empty_cells_are_read_between_their_neighbours_and_counted() {
    let text = csv(&thinned(5, 0));
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    for (at, column) in [(180, 2), (181, 2), (500, 4)] {
        let mut cells: Vec<&str> = lines[at].split(',').collect();
        cells[column] = "";
        lines[at] = cells.join(",");
    }
    let text = lines.join("\n") + "\n";
    understood(
        text.as_bytes(),
        &[
            "strain2_ue: 2 empty, the first in line 181",
            "pressure_kpa: 1 empty",
        ],
    );
}

#[test]
fn a_gauge_that_gives_nothing_for_long_is_an_open_one() {
    let mut text = csv(&[]);
    for row in thinned(5, 0) {
        let [t, a, b, c, p, s] = row;
        let b = if t > 2.0 {
            String::new()
        } else {
            b.to_string()
        };
        text += &format!("{t},{a},{b},{c},{p},{s}\n");
    }
    let output = replay(text.as_bytes(), &[]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("taken for an open gauge"));
    let events = events_of(&output);
    let fault = events
        .iter()
        .find(|e| e["event"] == "fault")
        .expect("a fault");
    assert_eq!(
        (&fault["fault"], &fault["finger"]),
        (&"GaugeOpen".into(), &2.into())
    );
    assert!(time_of(&events, "lost") > 7.0);
}

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
fn what_is_ambiguous_is_refused_by_line_and_column() {
    let row = |line: &str| format!("{HEADER}\n0,0,0,0,0,0\n{line}\n0.2,0,0,0,0,0\n");
    refused(
        &row("0,1,0,0,0,0,0,0,0,0,0,0"),
        &["line 3: 12 cells", "decimal comma"],
    );
    refused(
        &row("0.1;0;0;0;0;0"),
        &["line 3: 1 cells", "separated as the header"],
    );
    refused(
        &row("0.1,0,\"1.234,5\",0,0,0"),
        &["line 3: strain2_ue", "thousands"],
    );
    let mixed = format!(
        "{}\n0,0;0;0;0;0;0\n0.1;0;0;0;0;0\n",
        HEADER.replace(',', ";")
    );
    refused(&mixed, &["line 3: t_s", "decimal ','"]);
    let rows = "\n0,0,0,0,0,0\n0.1,0,0,0,0,0\n";
    refused(
        &format!("{HEADER}\nms,ue,ue,ue,kPa,kPa{rows}"),
        &["t_s", "units row ms"],
    );
    refused(
        &format!("{HEADER}\ns,ue,ue,ue,kPa,atm{rows}"),
        &["line 2: setpoint_kpa", "\"atm\"", "psi"],
    );
    let bare = HEADER.replace("pressure_kpa", "pressure");
    refused(
        &format!("{bare}{rows}"),
        &["pressure: no unit", "pressure_kpa"],
    );
    let two = HEADER.replace("t_s", "time_s,t_ms");
    refused(
        &format!("{two}\n0,0,0,0,0,0,0\n"),
        &["line 1: time_s and t_ms", "t_s"],
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

//! One simulated run, written and replayed.

use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;
use tempfile::TempDir;

pub const HEADER: &str = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa";
pub type Row = [f64; 6];

/// A sphere that is held and released, and then one that is lost, at 1 kHz.
pub static RUN: LazyLock<Vec<Row>> = LazyLock::new(|| {
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

pub fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

pub fn temporary() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Every so many rows of the run, from one of the first on.
pub fn thinned(every: usize, from: usize) -> Vec<Row> {
    RUN.iter().skip(from).step_by(every).copied().collect()
}

pub fn csv(rows: &[Row]) -> String {
    csv_with(HEADER, ",", rows)
}

pub fn csv_with(header: &str, separator: &str, rows: &[Row]) -> String {
    let mut text = format!("{header}\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(|value| format!("{value:.3}")).collect();
        text += &format!("{}\n", cells.join(separator));
    }
    text
}

pub fn replay(content: &[u8], more: &[&str]) -> Output {
    let dir = temporary();
    let path: PathBuf = dir.path().join("trace.csv");
    std::fs::write(&path, content).expect("a trace");
    let path = path.to_str().expect("a path in UTF-8");
    softgrip(&[&["replay", path, "--json"], more].concat())
}

pub fn events_of(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("every line is JSON"))
        .collect()
}

pub fn names(events: &[Value]) -> Vec<&str> {
    events.iter().filter_map(|e| e["event"].as_str()).collect()
}

pub fn time_of(events: &[Value], name: &str) -> f64 {
    let event = events.iter().find(|e| e["event"] == name);
    let event = event.unwrap_or_else(|| panic!("no {name} in {events:?}"));
    event["t_s"].as_f64().expect("a time")
}

/// Reads the trace, with all these words on standard error, and the events that the run has.
pub fn understood(content: &[u8], words: &[&str]) {
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

pub fn refused(content: &str, words: &[&str]) {
    let output = replay(content.as_bytes(), &[]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for word in words {
        assert!(error.contains(word), "no {word:?} in {error}");
    }
}

/// Numbers between −1 and 1 that look like noise.
pub fn noise() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(u32::MAX / 4) - 1.0
    }
}

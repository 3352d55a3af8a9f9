//! `softgrip evaluate` as its users call it.

use std::process::{Command as Process, Output};

use serde_json::Value;

fn softgrip(args: &[&str]) -> Output {
    let mut process = Process::new(env!("CARGO_BIN_EXE_softgrip"));
    process.args(args).output().expect("the command runs")
}

#[test]
fn the_command_prints_json_and_writes_its_files_whatever_the_number_of_threads() {
    let dir = tempfile::tempdir().expect("a directory");
    let out = dir.path().to_str().expect("a name");
    let run = |jobs: &str| {
        softgrip(&[
            "evaluate", "--losses", "3", "--hours", "0.02", "--seed", "504", "--json", "--out",
            out, "--jobs", jobs,
        ])
    };
    let output = run("1");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(output.stdout, run("3").stdout);
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["seed"], 504);
    let latency = json["latency"].as_array().expect("a list");
    // Three levels of noise, dropped or pushed out, calibrated or not.
    assert_eq!(latency.len(), 12);
    let losses: u64 = latency
        .iter()
        .filter_map(|row| row["losses"].as_u64())
        .sum();
    assert_eq!(losses, 3 * 2 * 3);
    assert_eq!(json["false_alarms"].as_array().map(Vec::len), Some(3));
    assert_eq!(json["detectors"].as_array().map(Vec::len), Some(6));
    let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).expect(name);
    assert_eq!(read("losses.csv").lines().count(), 1 + 6 * 3);
    assert!(read("roc.svg").starts_with("<svg") && read("latency.svg").starts_with("<svg"));
    let page = read("report.html");
    assert!(page.contains("False reports") && page.ends_with("</html>\n"));
    let saved: Value = serde_json::from_str(&read("evaluation.json")).expect("JSON");
    assert_eq!(saved, json);
}

#[test]
fn a_wrong_argument_is_refused() {
    for args in [
        ["evaluate", "--hours", "-1"],
        ["evaluate", "--losses", "many"],
        ["evaluate", "--noise", "20"],
    ] {
        let output = softgrip(&args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(!output.stderr.is_empty(), "{args:?}");
    }
}

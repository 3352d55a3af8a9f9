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
    for field in ["version", "commit", "recipe_hash", "settings_hash"] {
        let text = json[field].as_str();
        assert!(text.is_some_and(|text| !text.is_empty()), "{field}");
    }
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

const SMALL: [&str; 7] = [
    "evaluate", "--losses", "3", "--hours", "0.02", "--seed", "505",
];

#[test]
fn the_parts_of_an_evaluation_join_to_the_whole_also_after_a_kill() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = |name: &str| dir.path().join(name);
    let text = |name: &str| path(name).display().to_string();
    let run = |more: &[&str]| {
        let output = softgrip(&[&SMALL, more].concat());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        String::from_utf8(output.stdout).expect("text")
    };
    let parts = text("parts");
    run(&["--out", &text("whole"), "--jobs", "2"]);
    run(&["--out", &parts, "--shard", "2/2", "--jobs", "3"]);
    let merge = || softgrip(&["evaluate", "merge", &parts]);
    let missing = merge();
    assert_eq!(missing.status.code(), Some(3));
    assert_eq!(missing.stdout, b"1\n");

    run(&["--out", &parts, "--shard", "1/2", "--jobs", "1"]);
    // As a kill leaves it: a unit and a half.
    let units = path("parts/part-1-of-2/units.jsonl");
    let finished = std::fs::read_to_string(&units).expect("units");
    let upto = finished.find('\n').expect("a unit") + 100;
    std::fs::write(&units, &finished[..upto]).expect("a file");
    let unfinished = merge();
    assert_eq!(unfinished.status.code(), Some(3));
    assert_eq!(unfinished.stdout, b"1\n");
    let error = String::from_utf8_lossy(&unfinished.stderr);
    assert!(
        error.contains("part-1-of-2: unfinished: 1 units"),
        "{error}"
    );
    assert!(!path("parts/evaluation.json").exists());

    run(&["--out", &parts, "--shard", "1/2", "--jobs", "2"]);
    assert_eq!(std::fs::read_to_string(&units).expect("units"), finished);
    assert!(run(&["--out", &parts, "--shard", "1/2"]).contains("finished before"));
    let merged = merge();
    assert_eq!(merged.status.code(), Some(0), "{merged:?}");
    for name in [
        "evaluation.json",
        "losses.csv",
        "roc.svg",
        "latency.svg",
        "report.html",
    ] {
        let content = |dir: &str| std::fs::read(path(dir).join(name)).expect(name);
        assert!(content("whole") == content("parts"), "{name}");
    }

    let other = softgrip(&[
        "evaluate", "--seed", "506", "--out", &parts, "--shard", "1/2",
    ]);
    let error = String::from_utf8_lossy(&other.stderr);
    assert_eq!(other.status.code(), Some(2), "{error}");
    assert!(error.contains("seed is 505, not 506"), "{error}");
}

#[test]
fn a_wrong_argument_is_refused() {
    for args in [
        &["evaluate", "--hours", "-1"][..],
        &["evaluate", "--losses", "many"],
        &["evaluate", "--noise", "20"],
        &["evaluate", "--shard", "3/2"],
        &["evaluate", "--shard", "1/2", "--json"],
        &["evaluate", "--hands", "2", "--silicone"],
        &["evaluate", "--hands", "0"],
        &["evaluate", "merge"],
    ] {
        let output = softgrip(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(!output.stderr.is_empty(), "{args:?}");
    }
}

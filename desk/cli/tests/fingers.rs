//! The command `softgrip` with recipes as users write them.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

fn json_lines(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("every line is JSON"))
        .collect()
}

fn count(run: &Value, event: &str) -> usize {
    let events = run["events"].as_array().expect("a list of events");
    events.iter().filter(|e| e["event"] == event).count()
}

/// A refusal: status 2, nothing on standard output, and all of these words on standard error.
fn refused(args: &[&str], words: &[&str]) {
    let output = softgrip(args);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
    assert!(output.stdout.is_empty(), "{args:?}");
    for word in words {
        assert!(error.contains(word), "{args:?}: no {word:?} in {error}");
    }
}

/// `recipes/rtv225.toml` with a piece replaced, and without its grasp if that is not wanted.
fn recipe(dir: &Path, from: &str, to: &str, grasp: bool) -> String {
    let text = include_str!("../../../recipes/rtv225.toml");
    assert!(text.contains(from), "{from} is not in the recipe");
    let text = text.replacen(from, to, 1);
    let (finger, _) = text.split_once("[grasp]").expect("a grasp at the end");
    let path = dir.join("finger.toml");
    std::fs::write(&path, if grasp { &text } else { finger }).expect("written");
    path.to_string_lossy().into_owned()
}

#[test]
fn a_recipe_without_a_grasp_has_a_table_and_replays_and_nothing_is_gripped() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let recipe = recipe(dir.path(), "rtv225", "mine", false);
    let table = &json_lines(&softgrip(&["table", "--recipe", &recipe, "--json"]))[0];
    assert_eq!(table["recipe"], "mine");
    assert_eq!(table["lift_n"][0], serde_json::json!([null, null]));
    assert!(table["tip_angle_deg"][0].as_f64().expect("an angle") > 5.0);

    let trace = dir.path().join("trace.csv");
    std::fs::write(
        &trace,
        "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n0,0,0,0,0,0\n0.01,0,0,0,0,200\n0.02,0,0,0,0,200\n",
    )
    .expect("written");
    let events = json_lines(&softgrip(&[
        "replay",
        &trace.to_string_lossy(),
        "--recipe",
        &recipe,
        "--json",
    ]));
    assert_eq!(events[0]["reason"], "PressureOutOfRange");

    let sweep = dir.path().join("sweep.toml");
    std::fs::write(&sweep, "kind = \"grid\"\n[vary]\nmass_kg = [0.1]\n").expect("written");
    let (sweep, out) = (sweep.to_string_lossy(), dir.path().to_string_lossy());
    for args in [
        vec!["sim"],
        vec!["study"],
        vec!["capability"],
        vec!["gauge"],
        vec!["evaluate"],
        vec!["sweep", &sweep],
    ] {
        let mut args = args.clone();
        args.extend(["--recipe", &recipe, "--out", &out]);
        refused(&args, &["the recipe mine has no [grasp]", "palm_radius_mm"]);
    }
}

#[test]
fn a_finger_of_thirty_kilopascals_is_gripped_with_and_not_pressed_further() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let recipe = recipe(
        dir.path(),
        "max_pressure_kpa = 160.0",
        "max_pressure_kpa = 30.0",
        true,
    );
    // Pressed so little the finger does not reach the object, and nobody says that it did.
    let output = softgrip(&["sim", "--object", "sphere", "--recipe", &recipe, "--json"]);
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(said["pressure_kpa"], 26.25);
    assert_eq!(count(&said, "empty"), 1);
    assert_eq!(count(&said, "refused"), 0);
    refused(
        &["sim", "--pressure", "40", "--recipe", &recipe, "--json"],
        &["pressure 40 kPa: must be at most 30"],
    );
    refused(
        &["evaluate", "--recipe", &recipe, "--json"],
        &["tells the lift up to 30 kPa only"],
    );
}

#[test]
fn round_sections_bend() {
    let section = |args: &[&str]| {
        let mut all = vec!["section", "--R", "10", "--r", "5", "--pressure", "60"];
        all.extend(args);
        all.extend(["--yeoh=0.11,0.02,0", "--json"]);
        let value = json_lines(&softgrip(&all)).remove(0);
        value["states"][0]["curvature_per_m"]
            .as_f64()
            .expect("a number")
    };
    assert!((section(&["--e", "2", "--alpha", "0"]) / 1.236 - 1.0).abs() < 5e-4);
    assert_eq!(section(&["--e", "0", "--alpha", "0"]).abs(), 0.0);
}

#[test]
fn rubbers_are_taken_as_they_are_published() {
    let curvature = |rubber: &[&str]| {
        let mut args = vec!["section", "--R", "10", "--r", "5", "--e", "2"];
        args.extend(["--alpha", "30", "--pressure", "40", "--json"]);
        args.extend(rubber);
        let value = json_lines(&softgrip(&args)).remove(0);
        value["states"][0]["curvature_per_m"]
            .as_f64()
            .expect("a number")
    };
    // Negative numbers in either spelling, and a last constant that says little.
    let whole = curvature(&["--yeoh=0.08656,0.0138,-0.001466"]);
    assert_eq!(whole, curvature(&["--yeoh", "0.08656,0.0138,-0.001466"]));
    let cut = curvature(&["--yeoh=0.08656,0.0138"]);
    assert_eq!(cut, curvature(&["--yeoh", "0.08656,0.0138,0"]));
    assert!((whole / cut - 1.0).abs() < 0.005 && whole > cut);
    // One energy, five names.
    let neo = curvature(&["--yeoh", "0.1"]);
    for same in [
        ["--youngs-modulus", "600"],
        ["--mooney-rivlin", "0.1,0"],
        ["--ogden", "0.2,2"],
        ["--ogden-abaqus", "0.2,2"],
    ] {
        assert_eq!(neo, curvature(&same), "{same:?}");
    }
    let mooney = curvature(&["--mooney-rivlin", "0.08,0.02"]);
    assert_eq!(mooney, curvature(&["--ogden", "0.16,2,-0.04,-2"]));
    assert_eq!(mooney, curvature(&["--ogden-abaqus", "0.16,2,0.04,-2"]));
}

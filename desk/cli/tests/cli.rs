//! The command `softgrip` as its users call it.

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

fn simulate(object: &str, mass: &str, accel: &str, more: &[&str]) -> Value {
    let mut args = vec![
        "sim", "--object", object, "--mass", mass, "--accel", accel, "--json",
    ];
    args.extend(more);
    let mut runs = json_lines(&softgrip(&args));
    assert_eq!(runs.len(), 1);
    runs.remove(0)
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
    assert!(!error.contains("panicked"), "{error}");
    for word in words {
        assert!(error.contains(word), "{args:?}: no {word:?} in {error}");
    }
}

fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

#[test]
fn objects_that_are_held_in_the_paper_are_held_in_silence() {
    for (object, mass, accel) in [
        ("sphere", "0.15", "2"),
        ("sphere", "0.15", "5"),
        ("cylinder", "0.08", "2"),
        ("cylinder", "0.08", "5"),
    ] {
        let run = simulate(object, mass, accel, &[]);
        assert_eq!(run["outcome"], "hold", "{run}");
        for field in ["slid_at_s", "collapse_at_s", "flagged_at_s", "latency_ms"] {
            assert!(run[field].is_null(), "{field} in {run}");
        }
        assert_eq!(count(&run, "holding"), 1);
        assert_eq!(count(&run, "slip"), 0, "{run}");
        assert_eq!(count(&run, "lost"), 0);
        assert_eq!(count(&run, "released"), 1);
    }
}

#[test]
fn objects_that_fall_in_the_paper_are_reported_lost_once_and_in_time() {
    for (object, mass, accel, outcome) in [
        ("sphere", "0.25", "5", "pick"),
        ("sphere", "0.25", "10", "pick"),
        ("cylinder", "0.15", "10", "pick"),
        ("sphere", "0.15", "10", "transfer"),
    ] {
        for noise in ["20", "100"] {
            let run = simulate(object, mass, accel, &["--noise", noise]);
            assert_eq!(run["outcome"], outcome, "{run}");
            assert_eq!(count(&run, "lost"), 1, "{run}");
            assert_eq!(count(&run, "released"), 0, "{run}");
            let latency = run["latency_ms"].as_f64().expect("a latency");
            assert!(latency <= 25.0, "{run}");
            // Not before the object moved at all.
            assert!(run["flagged_at_s"].as_f64() > run["slid_at_s"].as_f64());
        }
    }
}

#[test]
fn without_arguments_a_sphere_is_held_and_then_lost() {
    let runs = json_lines(&softgrip(&["sim", "--json"]));
    let outcomes: Vec<_> = runs.iter().map(|run| run["outcome"].clone()).collect();
    assert_eq!(outcomes, ["hold", "transfer"]);
}

#[test]
fn a_burst_tube_is_an_air_loss_and_never_a_lost_object() {
    for (at_s, accel) in [("1.6", "5"), ("2.3", "5"), ("1.6", "10")] {
        let fault = format!("tube-burst@{at_s}s");
        let run = simulate("sphere", "0.15", accel, &["--fault", &fault]);
        assert_eq!(run["faults"][0], fault);
        assert_ne!(run["outcome"], "hold", "{run}");
        assert_eq!(count(&run, "air_loss"), 1, "{run}");
        assert_eq!(count(&run, "lost"), 0, "{run}");
    }
    let dir = temporary();
    let out = dir.path().to_str().expect("a path in UTF-8");
    let output = softgrip(&[
        "sim",
        "--fault",
        "stop@2s..2.5s",
        "--fault",
        "leak@3s",
        "--out",
        out,
    ]);
    let text = String::from_utf8_lossy(&output.stdout);
    for line in ["stop begins", "stop ends", "leak begins"] {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn a_broken_gauge_is_named_within_20_ms_and_the_grip_goes_on() {
    for kind in ["open", "short", "stuck", "saturated"] {
        let fault = format!("gauge-{kind}:2@2.3s");
        let run = simulate("sphere", "0.15", "5", &["--fault", &fault]);
        let events = run["events"].as_array().expect("a list of events");
        let named = events.iter().find(|e| e["event"] == "fault");
        let named = named.unwrap_or_else(|| panic!("{kind}: {run}"));
        assert_eq!(named["finger"], 2, "{kind}");
        assert!(
            named["t_s"].as_f64().is_some_and(|t_s| t_s <= 2.32),
            "{run}"
        );
        assert_eq!(
            (count(&run, "lost"), count(&run, "released")),
            (0, 1),
            "{run}"
        );
    }
}

#[test]
fn a_seed_gives_the_same_files_to_the_bit_and_another_seed_others() {
    let files = |seed: &str| {
        let dir = temporary();
        let out = dir.path().to_str().expect("a path in UTF-8");
        let output = softgrip(&[
            "sim", "--accel", "10", "--seed", seed, "--out", out, "--json",
        ]);
        assert!(output.status.success());
        ["trace.csv", "trace.svg"].map(|name| std::fs::read(dir.path().join(name)).expect(name))
    };
    let first = files("7");
    assert!(first == files("7"), "two runs with one seed differ");
    assert!(first[0] != files("8")[0], "two seeds give one trace");
    assert!(first[1].starts_with(b"<svg"));
}

#[test]
fn a_replayed_simulation_reports_what_the_simulation_reported() {
    let dir = temporary();
    let out = dir.path().to_str().expect("a path in UTF-8");
    let run = simulate("sphere", "0.25", "5", &["--out", out]);
    let trace = dir.path().join("trace.csv");
    let trace = trace.to_str().expect("a path in UTF-8");
    let replayed = json_lines(&softgrip(&["replay", trace, "--json"]));
    let live = run["events"].as_array().expect("a list of events");
    assert_eq!(replayed.len(), live.len());
    for (replayed, live) in replayed.iter().zip(live) {
        assert_eq!(replayed["event"], live["event"]);
        let [a, b] = [replayed, live].map(|e| e["t_s"].as_f64().expect("a time"));
        // The decimals of the trace may move an event by a tick or two.
        assert!((a - b).abs() < 0.0025, "{replayed} and {live}");
    }
}

/// A trace by hand: a grip, a plateau, and what `end` says; strain as a contact-only gauge shows it.
fn hand_made(rate_hz: u32, lost: bool) -> String {
    let mut text = String::from("t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n");
    let (mut pressure, mut command) = (0.0f64, 0.0f64);
    let steps = 4 * rate_hz;
    for i in 0..=steps {
        let t = f64::from(i) / f64::from(rate_hz);
        let asked = if (0.2..3.2).contains(&t) { 140.0 } else { 0.0 };
        let dt = 1.0 / f64::from(rate_hz);
        command += (asked - command).clamp(-400.0 * dt, 400.0 * dt);
        pressure += (command - pressure) * (1.0 - (-dt / 0.07).exp());
        let full = 4_000.0 * ((pressure - 60.0) / 80.0).clamp(0.0, 1.0);
        let left = if lost {
            (1.0 - (t - 2.0) / 0.040).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let strain = full * left;
        text += &format!("{t:.4},{strain:.1},{strain:.1},{strain:.1},{pressure:.2},{asked}\n");
    }
    text
}

#[test]
fn a_hand_made_trace_at_any_rate_is_judged_the_same() {
    let dir = temporary();
    for rate in [100, 1_000, 10_000] {
        for lost in [false, true] {
            let path = dir.path().join(format!("{rate}-{lost}.csv"));
            std::fs::write(&path, hand_made(rate, lost)).expect("a trace");
            let path = path.to_str().expect("a path in UTF-8");
            let output = softgrip(&["replay", path, "--gauge", "contact", "--json"]);
            let events = json_lines(&output);
            let names: Vec<_> = events.iter().filter_map(|e| e["event"].as_str()).collect();
            let end = if lost { "lost" } else { "released" };
            assert_eq!(
                names,
                ["contact", "contact", "contact", "holding", end],
                "{rate} Hz"
            );
            if lost {
                let t = events[4]["t_s"].as_f64().expect("a time");
                assert!((2.0..2.025).contains(&t), "{rate} Hz: {t}");
            }
        }
    }
}

#[test]
fn the_table_shows_the_published_finger_and_its_error() {
    let recipe = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/paper.toml");
    let table = &json_lines(&softgrip(&["table", "--recipe", recipe, "--json"]))[0];
    let error = table["interpolation_error_percent"].as_f64();
    assert!(error.is_some_and(|e| e > 0.0 && e <= 0.1), "{error:?}");
    assert_eq!(table["tip_angle_deg"], table["published"]["tip_angle_deg"]);
    assert_eq!(table["torque_nmm"][4][0], 48.08);
    let text = String::from_utf8(softgrip(&["table", "--recipe", recipe]).stdout);
    assert!(text.is_ok_and(|text| text.contains("48.08") && text.contains("91.22")));
}

#[test]
fn wrong_options_are_refused_with_what_would_be_right() {
    refused(&["sim", "--colour", "red"], &["--colour"]);
    refused(&["sim", "--mass", "-1"], &["--mass", "within 0.001 and 5"]);
    refused(
        &["sim", "--accel", "NaN"],
        &["--accel", "within 0.1 and 50"],
    );
    refused(&["sim", "--pressure", "200"], &["within 1 and 160"]);
    refused(&["sim", "--object", "cube"], &["sphere", "cylinder"]);
    refused(
        &["sim", "--fault", "burst@1s"],
        &["--fault", "burst", "must be one of", "tube-burst"],
    );
    refused(
        &["sim", "--fault", "gauge-open@1s"],
        &["a finger from 1 to 3", "as in gauge-open:2"],
    );
    refused(
        &["sim", "--fault", "leak@100s"],
        &["leak@100s", "must begin before"],
    );
    refused(&["fly"], &["fly"]);
    #[cfg(unix)]
    for args in [
        ["serve", "--tcp", "localhost:5020"].as_slice(),
        &["panel", "--from", "virtual", "--listen", "8080"],
    ] {
        refused(args, &["an IP address and a port, as in 127.0.0.1:8080"]);
    }
    refused(
        &["table", "--pressure", "60,170"],
        &["--pressure 170", "within 0 and 160"],
    );
}

#[test]
fn a_directory_that_cannot_be_written_to_is_refused_before_any_work() {
    let dir = temporary();
    let file = dir.path().join("file");
    std::fs::write(&file, "in the way").expect("a file");
    let path = file.to_str().expect("a path in UTF-8");
    refused(&["sim", "--out", path], &[path, "not a directory"]);
}

#[test]
fn a_settings_file_that_cannot_be_written_is_refused_before_the_sweep() {
    let dir = temporary();
    let missing = dir.path().join("missing").join("swept.toml");
    for (path, words) in [
        (dir.path(), "not a file"),
        (missing.as_path(), "cannot write"),
    ] {
        let path = path.to_str().expect("a path in UTF-8");
        refused(&["calibrate", "--out", path], &[path, words]);
    }
    let mine = dir.path().join("mine.toml");
    std::fs::write(&mine, "version = 1 # mine\n").expect("a file");
    let path = mine.to_str().expect("a path in UTF-8");
    refused(&["calibrate", "--out", path], &[path, "is there already"]);
    let kept = std::fs::read_to_string(&mine).expect("a file");
    assert_eq!(kept, "version = 1 # mine\n");
}

#[test]
fn bad_traces_and_recipes_are_refused_by_file_and_line() {
    let dir = temporary();
    let put = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path.to_str().expect("a path in UTF-8").to_string()
    };
    let header = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n";
    let empty = put("empty.csv", "");
    refused(&["replay", &empty], &["empty.csv", "line 1", "t_s"]);
    let nan = put(
        "nan.csv",
        &format!("{header}0,0,0,0,0,0\n0.001,0,0,nan,0,0\n"),
    );
    refused(
        &["replay", &nan],
        &["nan.csv", "line 3", "strain3_ue", "finite"],
    );
    let back = put("back.csv", &format!("{header}1,0,0,0,0,0\n0.5,0,0,0,0,0\n"));
    refused(
        &["replay", &back],
        &["back.csv", "line 3", "time must rise"],
    );
    let fast = put(
        "fast.csv",
        &format!("{header}0,0,0,0,0,0\n0.00001,0,0,0,0,0\n"),
    );
    refused(
        &["replay", &fast],
        &["fast.csv", "line 3", "10 Hz and 10 kHz"],
    );
    refused(&["replay", "no-such-file.csv"], &["no-such-file.csv"]);

    let paper = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/paper.toml");
    let paper = std::fs::read_to_string(Path::new(paper)).expect("the recipe");
    let bad = put("bad.toml", &paper.replace("[3.94, 3.94", "[3.94, -3.94"));
    refused(
        &["table", "--recipe", &bad],
        &["bad.toml", "links.mass_g[1]", "-3.94", "must lie within"],
    );
    // Said once, not again as its own cause.
    let output = softgrip(&["table", "--recipe", "no-such-recipe.toml"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(error.matches("No such file").count(), 1, "{error}");
    let bad = put("less.toml", &paper.replace("distance_mm = 1.0", ""));
    refused(&["table", "--recipe", &bad], &["less.toml", "distance_mm"]);
}

#[test]
fn the_default_finger_is_described_by_its_geometry_and_judged_against_the_paper() {
    let table = &json_lines(&softgrip(&["table", "--json"]))[0];
    assert_eq!(table["recipe"], "rtv225");
    let rms = table["joint_angle_rms_error_deg"].as_f64();
    assert!(rms.is_some_and(|rms| rms <= 1.1), "{rms:?}");
    for (list, tolerance) in [
        ("link_mass_g", 0.003),
        ("joint_stiffness_nmm_per_deg", 0.05),
        ("tip_angle_deg", 0.06),
    ] {
        let [ours, theirs] =
            [&table[list], &table["published"][list]].map(|l| l.as_array().expect(list));
        assert_eq!(ours.len(), 6);
        for (ours, theirs) in ours.iter().zip(theirs) {
            let ratio = ours.as_f64().expect("a number") / theirs.as_f64().expect("a number");
            assert!(
                (ratio - 1.0).abs() <= tolerance,
                "{list}: {ours} for {theirs}"
            );
        }
    }
    let stretch = &table["axial_stretch"][4];
    let clamp = stretch[0].as_f64();
    assert!(clamp.is_some_and(|stretch| (1.1..1.5).contains(&stretch)));
    assert!(table["generation_s"].as_f64().is_some_and(|s| s > 0.0));
    // The paper counts on 5 %.
    for error in table["chain_tip_error_percent"].as_array().expect("a list") {
        assert!(error.as_f64().is_some_and(|error| error <= 0.3), "{error}");
    }
}

#[test]
fn the_tables_pictures_are_drawn() {
    let dir = temporary();
    let out = dir.path().to_str().expect("a path in UTF-8");
    let output = softgrip(&["table", "--out", out]);
    assert!(output.status.success());
    for name in [
        "deflection.svg",
        "capability.svg",
        "interpolation.svg",
        "sensitivity.svg",
    ] {
        let svg = std::fs::read_to_string(dir.path().join(name)).expect(name);
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
    }
}

#[test]
fn a_geometry_that_cannot_be_is_refused_by_field_or_by_place_and_pressure() {
    let dir = temporary();
    let rtv225 = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let rtv225 = std::fs::read_to_string(rtv225).expect("the recipe");
    let with = |from: &str, to: &str| {
        assert!(rtv225.contains(from), "{from} is not in the recipe");
        let path = dir.path().join("finger.toml");
        std::fs::write(&path, rtv225.replacen(from, to, 1)).expect("a file");
        path.to_str().expect("a path in UTF-8").to_string()
    };
    let refused_with = |from: &str, to: &str, words: &[&str]| {
        let path = with(from, to);
        refused(&["table", "--recipe", &path], words);
    };
    refused_with(
        "at_mm = 90.0",
        "at_mm = 0.0",
        &[
            "finger.toml",
            "station[1].at_mm",
            "beyond the station before it",
        ],
    );
    refused_with(
        "youngs_modulus_kpa = 550.0",
        "youngs_modulus_kpa = -550.0",
        &["rubber.youngs_modulus_kpa = -550", "must lie within"],
    );
    refused_with(
        "max_pressure_kpa = 160.0",
        "max_pressure_kpa = 400.0",
        &[
            "finger.toml",
            "mm from the clamp",
            "balloons at about",
            "kPa",
        ],
    );
    refused_with("yeoh_mpa = [0.1, 0.02, 0.0002]", "", &["balloons at about"]);
    refused_with("[bore]", "[boar]", &["finger.toml", "boar"]);
}

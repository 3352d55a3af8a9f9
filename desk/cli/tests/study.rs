//! `softgrip study`, `capability` and `sweep` as their users call them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

/// Standard output of a call that must succeed.
fn said(args: &[&str]) -> String {
    let output = softgrip(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    String::from_utf8(output.stdout).expect("text")
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
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

/// A temporary directory, and paths in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().expect("UTF-8").to_string()
    }

    fn put(&self, name: &str, content: &str) -> String {
        std::fs::write(self.path(name), content).expect("a file");
        self.text(name)
    }
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn lost(run: &Value) -> usize {
    let events = run["events"].as_array().expect("a list of events");
    events
        .iter()
        .filter(|event| event["event"] == "lost")
        .count()
}

#[test]
fn nine_of_the_ten_stated_outcomes_are_right_and_the_controller_is_never_wrong() {
    let text = said(&["study", "--json", "--jobs", "1"]);
    assert_eq!(
        text,
        said(&["study", "--json", "--jobs", "2"]),
        "threads matter"
    );
    let runs = json(&text);
    let runs = runs.as_array().expect("a list");
    let agrees: Vec<_> = runs.iter().map(|run| run["agrees"].as_bool()).collect();
    assert_eq!(agrees.len(), 12);
    assert_eq!(agrees.iter().filter(|a| **a == Some(true)).count(), 9);
    assert_eq!(agrees[9..11], [None, None], "not stated");
    // A robust disagreement, which no gripper that holds by friction can avoid.
    let differs = &runs[3];
    assert_eq!(
        (&differs["stated"], &differs["outcome"]),
        (&"transfer".into(), &"pick".into())
    );
    for run in runs {
        let held = run["outcome"] == "hold";
        assert_eq!(lost(run), usize::from(!held), "{run}");
        assert_eq!(run["flagged_at_s"].is_null(), held, "{run}");
        // None where the object jams and the residual does not collapse before the release.
        assert!(
            run["latency_ms"].as_f64().is_none_or(|ms| ms <= 25.0),
            "{run}"
        );
    }
}

#[test]
fn the_report_is_one_page_with_all_figures_and_tells_robust_outcomes_from_edge_cases() {
    let place = Place::new();
    let text = said(&["study", "--out", &place.text("study")]);
    assert!(text.contains("9 of 10 stated outcomes"), "{text}");
    let page = read(&place.path("study/report.html"));
    for figure in [
        "15",
        "19 and 20",
        "21",
        "22",
        "23",
        "24",
        "25",
        "26",
        "27",
        "28",
        "29",
    ] {
        assert!(
            page.contains(&format!("Figure {figure}"))
                || page.contains(&format!("Figures {figure}")),
            "{figure}"
        );
    }
    // Held and as without the change; lost where it was held; and never two classes that shut each other out.
    for cell in ["<td class=\"hold\" title", "<td class=\"pick other\" title"] {
        assert!(page.contains(cell), "{cell}");
    }
    let tags = page.split('<').filter_map(|tag| tag.split('>').next());
    for tag in tags {
        assert!(tag.matches(" class=").count() <= 1, "{tag}");
    }
    for outside in ["<script", "src=", "href=", "url(", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("@media print"));
    let sensitivity = json(&read(&place.path("study/sensitivity.json")));
    let robust = &sensitivity["robust"];
    for n in [0, 1, 4, 5, 6, 7, 11] {
        assert_eq!(robust[n], true, "{}", sensitivity["runs"][n]);
    }
    assert_eq!(robust[2], false, "{}", sensitivity["runs"][2]);
    let varied = sensitivity["varied"].as_array().expect("a list");
    for step in varied
        .iter()
        .filter(|v| v["change"].as_str().is_some_and(|c| c.starts_with("step")))
    {
        assert_eq!(
            step["outcomes"], sensitivity["outcomes"],
            "{}",
            step["change"]
        );
    }
    for varied in varied {
        let mistakes = varied["mistakes"].as_array().expect("a list");
        assert!(mistakes.iter().all(Value::is_null), "{varied}");
    }
    assert_eq!(
        json(&read(&place.path("study/study.json")))
            .as_array()
            .map(Vec::len),
        Some(12)
    );
}

#[test]
fn the_heaviest_object_falls_with_acceleration_and_is_near_what_statics_say() {
    let place = Place::new();
    let text = said(&[
        "capability",
        "--accel",
        "10,2",
        "--json",
        "--out",
        &place.text("c"),
    ]);
    let found = json(&text);
    let [slow, fast] = [0, 1].map(|n| found["limits"][n].clone());
    assert_eq!(
        (&slow["accel_m_s2"], &fast["accel_m_s2"]),
        (&2.0.into(), &10.0.into())
    );
    let mass = |limit: &Value| limit["mass_kg"].as_f64().expect("a mass");
    // The study's sphere: 150 g arrives at 2 and not at 10, 250 g do not arrive at 2.
    assert!(
        (0.15..0.25).contains(&mass(&slow)) && mass(&fast) < 0.15,
        "{found}"
    );
    for limit in [&slow, &fast] {
        let statics = limit["static_mass_kg"].as_f64().expect("a mass");
        assert!((mass(limit) / statics - 1.0).abs() < 0.15, "{found}");
    }
    assert_eq!(read(&place.path("c/capability.json")), text);
    assert!(read(&place.path("c/capability.svg")).starts_with("<svg"));
}

#[test]
fn a_simulation_shows_its_grasp_from_the_side() {
    let place = Place::new();
    said(&["sim", "--accel", "10", "--json", "--out", &place.text("s")]);
    let film = read(&place.path("s/grasp.svg"));
    for instant in [
        "first contact",
        "about to lift",
        "has slid 20 mm",
        "loss reported",
    ] {
        assert!(film.contains(instant), "{instant}");
    }
}

/// Short runs: nothing is far, and nothing waits long.
const GRID: &str = "kind = 'grid'
[fixed.arm]
approach_mm = 1
lift_mm = 20
carry_mm = 20
jerk_ramp_ms = 10
dwell_ms = 20
grip_ms = 400
[vary]
object = ['sphere', 'cylinder']
mass_kg = { from = 0.05, to = 0.25, steps = 5 }
";

#[test]
fn an_interrupted_sweep_goes_on_and_ends_as_if_nothing_had_been() {
    let place = Place::new();
    let spec = place.put("grid.toml", GRID);
    let (whole, torn) = (place.text("whole"), place.text("torn"));
    said(&["sweep", &spec, "--out", &whole, "--jobs", "1"]);
    let csv = read(&place.path("whole/results.csv"));
    assert_eq!(csv.lines().count(), 11);
    assert!(
        csv.lines()
            .nth(1)
            .is_some_and(|row| row.contains(",sphere,0.05,hold,")),
        "{csv}"
    );
    let parquet = std::fs::read(place.path("whole/results.parquet")).expect("a file");
    assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));

    said(&["sweep", &spec, "--out", &torn]);
    // As a kill leaves it: six rows and a half, and no Parquet.
    let upto = csv.match_indices('\n').nth(6).expect("rows").0 + 12;
    std::fs::write(place.path("torn/results.csv"), &csv[..upto]).expect("a file");
    std::fs::remove_file(place.path("torn/results.parquet")).expect("a file");
    let output = softgrip(&["sweep", &spec, "--out", &torn]);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("half a line"),
        "{output:?}"
    );
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("10 runs, 4 of them new"),
        "{output:?}"
    );
    assert_eq!(read(&place.path("torn/results.csv")), csv);
    assert_eq!(
        std::fs::read(place.path("torn/results.parquet")).expect("a file"),
        parquet
    );
    assert!(said(&["sweep", &spec, "--out", &torn]).contains("10 runs, 0 of them new"));
}

#[test]
fn the_parts_of_a_sweep_join_to_the_whole() {
    let place = Place::new();
    let spec = place.put("grid.toml", GRID);
    let (whole, parts, merged) = (place.text("whole"), place.text("parts"), place.text("m"));
    for (shard, jobs) in [("3/3", "1"), ("1/3", "2"), ("2/3", "3")] {
        said(&[
            "sweep", &spec, "--shard", shard, "--out", &parts, "--jobs", jobs,
        ]);
    }
    said(&["sweep", &spec, "--out", &whole]);
    said(&["sweep", "merge", &parts, "--out", &merged]);
    said(&["sweep", "merge", &parts]);
    for name in ["results.csv", "results.parquet", "sweep.json"] {
        let content = |dir: &str| std::fs::read(Path::new(dir).join(name)).expect(name);
        assert!(content(&whole) == content(&merged), "{name}");
        assert!(content(&whole) == content(&parts), "{name}");
    }
    let about = json(&read(&place.path("whole/sweep.json")));
    for field in ["version", "commit", "recipe_hash", "settings_hash"] {
        let text = about[field].as_str();
        assert!(text.is_some_and(|text| !text.is_empty()), "{about}");
    }
}

#[cfg(unix)]
#[test]
fn more_parts_join_than_files_may_be_open() {
    let place = Place::new();
    let spec = place.put("grid.toml", GRID);
    let parts = place.text("parts");
    for part in 1..=20 {
        let shard = format!("{part}/20");
        said(&["sweep", &spec, "--shard", &shard, "--out", &parts]);
    }
    let merge = format!("ulimit -n 16 && exec \"$0\" sweep merge {parts}");
    let output = Command::new("sh")
        .args(["-c", &merge, env!("CARGO_BIN_EXE_softgrip")])
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{output:?}");
    assert_eq!(read(&place.path("parts/results.csv")).lines().count(), 11);
}

#[test]
fn a_merge_names_every_part_that_is_missing_unfinished_or_of_something_else() {
    let place = Place::new();
    let spec = place.put("grid.toml", GRID);
    let other = place.put("other.toml", &GRID.replace("0.25", "0.24"));
    let dir = place.text("parts");
    let part = |spec: &str, shard: &str| {
        said(&["sweep", spec, "--shard", shard, "--out", &dir]);
    };
    part(&spec, "1/6");
    part(&spec, "3/6");
    part(&other, "4/6");
    part(&spec, "6/6");
    part(&spec, "1/5");
    let csv = read(&place.path("parts/part-3-of-6/results.csv"));
    let shorter = &csv[..csv.trim_end().rfind('\n').expect("rows") + 1];
    std::fs::write(place.path("parts/part-3-of-6/results.csv"), shorter).expect("a file");
    let about = place.path("parts/part-6-of-6/sweep.json");
    let commit = json(&read(&about))["commit"].to_string();
    let another_build = read(&about).replace(&commit, "\"0123456789ab\"");
    std::fs::write(&about, another_build).expect("a file");

    let output = softgrip(&["sweep", "merge", &dir]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "2-3,5\n");
    for words in [
        "part-2-of-6: missing",
        "part-3-of-6: unfinished: 1 of its 2 runs",
        "part-4-of-6: foreign: spec differs",
        "part-5-of-6: missing",
        &format!("part-6-of-6: foreign: commit is \"0123456789ab\", not {commit}"),
        "part-1-of-5: foreign: one of 5 parts",
    ] {
        assert!(error.contains(words), "no {words:?} in {error}");
    }
    assert!(!error.contains("part-1-of-6"), "{error}");

    for foreign in ["part-4-of-6", "part-6-of-6", "part-1-of-5"] {
        std::fs::remove_dir_all(place.path("parts").join(foreign)).expect("a folder");
    }
    let output = softgrip(&["sweep", "merge", &dir]);
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(String::from_utf8_lossy(&output.stdout), "2-6\n");
    assert!(!place.path("parts/results.csv").exists());
    let about = place.path("parts/part-1-of-6/sweep.json");
    let another_build = read(&about).replace(&commit, "\"0123456789ab\"");
    std::fs::write(&about, another_build).expect("a file");
    std::fs::remove_dir_all(place.path("parts/part-3-of-6")).expect("a folder");
    refused(
        &["sweep", "merge", &dir],
        &["another build", "0123456789ab", commit.trim_matches('"')],
    );
    refused(&["sweep", "merge", &place.text("none")], &["none"]);
    std::fs::create_dir(place.path("empty")).expect("a folder");
    refused(
        &["sweep", "merge", &place.text("empty")],
        &["empty", "no part-I-of-N", "--shard"],
    );
}

#[test]
fn results_of_something_else_are_left_alone() {
    let place = Place::new();
    let spec = place.put("grid.toml", GRID);
    let dir = place.text("sweep");
    said(&["sweep", &spec, "--out", &dir]);
    let csv = read(&place.path("sweep/results.csv"));
    let other = place.put("other.toml", &GRID.replace("0.25", "0.24"));
    refused(
        &["sweep", &other, "--out", &dir],
        &[&dir, "another study", "spec differs"],
    );
    let broken = csv.replacen("\n3,", "\n7,", 1);
    std::fs::write(place.path("sweep/results.csv"), &broken).expect("a file");
    refused(
        &["sweep", &spec, "--out", &dir],
        &["results.csv: line 5", "must be run 3"],
    );
    assert_eq!(read(&place.path("sweep/results.csv")), broken);
    std::fs::write(place.path("sweep/sweep.json"), "{").expect("a file");
    refused(
        &["sweep", &spec, "--out", &dir],
        &["sweep.json", "not what a study writes"],
    );
    std::fs::remove_file(place.path("sweep/sweep.json")).expect("a file");
    refused(
        &["sweep", &spec, "--out", &dir],
        &["results.csv", "no sweep.json"],
    );
}

#[test]
fn bad_specs_are_refused_by_file_and_name_before_anything_is_written() {
    let place = Place::new();
    let out = place.text("out");
    for (name, vary, words) in [
        (
            "unknown",
            "fricton = [0.8]",
            ["fricton", "there are object, mass_kg"],
        ),
        (
            "range",
            "mass_kg = [0.1, -0.1]",
            ["mass_kg = -0.1", "within 0.001 and 5"],
        ),
        ("empty", "mass_kg = []", ["mass_kg", "at least one value"]),
        ("toml", "mass_kg = [", ["line 3", "array"]),
        (
            "fit",
            "grasp.palm_radius_mm = [39]",
            ["run 0", "inside the object"],
        ),
    ] {
        let file = format!("{name}.toml");
        let spec = place.put(&file, &format!("kind = 'grid'\n[vary]\n{vary}\n"));
        refused(&["sweep", &spec, "--out", &out], &words);
        assert!(!place.path("out").exists(), "{name}");
    }
    let none = place.text("none.toml");
    refused(&["sweep", &none, "--out", &out], &["none.toml"]);
}

#[test]
fn bad_options_are_refused_with_what_would_be_right() {
    let place = Place::new();
    let file = place.put("file", "in the way");
    let spec = place.put("grid.toml", GRID);
    refused(&["study", "--out", &file], &[&file, "not a directory"]);
    refused(&["capability", "--out", &file], &[&file, "not a directory"]);
    refused(
        &["sweep", &spec, "--out", &file],
        &[&file, "not a directory"],
    );
    refused(&["study", "--jobs", "0"], &["--jobs"]);
    refused(&["study", "--recipe", "none.toml"], &["none.toml"]);
    refused(
        &["capability", "--pressure", "170"],
        &["--pressure", "within 1 and 160"],
    );
    refused(
        &["capability", "--accel", "0"],
        &["--accel", "within 0.1 and 50"],
    );
    for shard in ["0/2", "3/2", "1", "a/b"] {
        refused(&["sweep", &spec, "--shard", shard], &["--shard"]);
    }
}

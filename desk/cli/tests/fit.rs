//! `softgrip fit` and `softgrip section` as their users call them.

use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

const RECIPE: &str = include_str!("../../../recipes/rtv225.toml");

fn temporary() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn put(dir: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = dir.path().join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

#[test]
fn the_command_writes_a_recipe_with_its_comments_and_a_picture() {
    let dir = temporary();
    let csv = "pressure_kpa,tip_angle_deg\n60,13.0\n100,45.2\n140,83.5\n";
    let measured = put(&dir, "bench.csv", csv);
    let path = measured.to_str().expect("a path in UTF-8");
    let out = dir.path().join("new");
    let out_path = out.to_str().expect("a path in UTF-8");
    let output = softgrip(&["fit", "--measured", path, "--out", out_path]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    for words in ["bore-offset", "fitted", "singular values", "83.50"] {
        assert!(text.contains(words), "no {words:?} in {text}");
    }
    let toml = std::fs::read_to_string(out.join("fitted.toml")).expect("the recipe");
    assert!(toml.starts_with("# The recipe rtv225, fitted to bench.csv:\n#   bore-offset +0.0"));
    let kept = |line: &&str| line.starts_with('#') || line.ends_with("# table 1");
    for line in RECIPE.lines().filter(kept) {
        assert!(toml.contains(line), "no {line:?} in {toml}");
    }
    assert!(toml.contains("name = \"rtv225-fitted\""));
    let svg = std::fs::read(out.join("fit.svg")).expect("the picture");
    assert!(svg.starts_with(b"<svg"));
}

#[test]
fn bad_input_is_refused_and_leaves_nothing() {
    let dir = temporary();
    let out = dir.path().join("new");
    let out = out.to_str().expect("a path in UTF-8");
    let good = put(&dir, "good.csv", "pressure_kpa,tip_angle_deg\n100,45\n");
    let bad = put(&dir, "bad.csv", "pressure_kpa,tip_angle_deg\n100,-45\n");
    let weak = RECIPE.replace("yeoh_mpa = [0.1, 0.02, 0.0002]", "");
    assert_ne!(weak, RECIPE);
    let weak = put(&dir, "weak.toml", &weak);
    let [good, bad, weak] = [good, bad, weak].map(|path| path.display().to_string());
    let measured = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/paper.toml");
    for (args, expected) in [
        (
            &["--measured", &bad][..],
            &["bad.csv", "line 2", "tip_angle_deg = -45", "within 0"][..],
        ),
        (&["--measured", "no.csv"], &["no.csv"]),
        (
            &["--measured", &good, "--recipe", measured],
            &["paper.toml", "kind = \"measured\"", "\"geometry\""],
        ),
        (
            &["--measured", &good, "--recipe", &weak],
            &["weak.toml", "balloons at about"],
        ),
        (
            &["--measured", &good, "--known", "colour"],
            &["--known", "gauge-distance"],
        ),
        (&["--measured", &good, "--noise-deg", "0"], &["within 0.01"]),
    ] {
        let output = softgrip(&[&["fit", "--out", out], args].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
        for word in expected {
            assert!(error.contains(word), "{args:?}: no {word:?} in {error}");
        }
        let left = std::fs::read_dir(out).map_or(0, Iterator::count);
        assert_eq!(left, 0, "{args:?}");
    }
}

#[test]
fn a_section_is_solved_and_ballooning_is_named() {
    let section = |more: &[&str]| {
        let mut args = vec!["section", "--R", "9.6", "--r", "4.6", "--e", "2.7"];
        args.extend(["--alpha", "56"]);
        args.extend(more);
        softgrip(&args)
    };
    let output = section(&["--pressure", "100,60", "--mesh-study", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let at = |list: &str, i: usize| json[list][i]["curvature_per_m"].as_f64().expect("a number");
    assert_eq!(json["states"][0]["pressure_kpa"], 60.0);
    assert!(at("states", 0) > 0.0 && at("states", 0) < at("states", 1));
    assert!((at("mesh_study", 1) / at("mesh_study", 3) - 1.0).abs() < 0.005);
    assert_eq!(at("mesh_study", 1), at("states", 1));
    let text = String::from_utf8(section(&["--pressure", "60"]).stdout).expect("UTF-8");
    assert!(text.contains("area 175.70 mm²"), "{text}");
    for (more, expected) in [
        (
            &["--pressure", "120", "--youngs-modulus", "550"][..],
            "--pressure 120: the section balloons at about 7",
        ),
        (&["--pressure", "NaN"], "within 0 and 1000"),
        (
            &["--pressure", "60", "--yeoh", "0.1,x"],
            "\"x\": must be a number",
        ),
        (
            &["--pressure", "60", "--yeoh", "-0.1,0.02,0"],
            "--yeoh[0] = -0.1: must lie within 0.001 and 1",
        ),
        (
            &["--pressure", "160", "--yeoh", "0.0551,0.01521,-0.002194"],
            "--yeoh: the strain energy is unstable beyond a stretch of",
        ),
        (
            &["--pressure", "60", "--yeoh=0.1", "--ogden", "0.2,1.5"],
            "cannot be used with",
        ),
        (
            &["--pressure", "60", "--ogden", "0.2,1.5,3"],
            "--ogden: must be pairs of μ and α, not 3 numbers",
        ),
    ] {
        let output = section(more);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {error}");
        assert!(error.contains(expected), "{more:?}: {error}");
    }
}

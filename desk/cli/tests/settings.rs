//! Settings files as the users of the command meet them.

use std::path::Path;
use std::process::{Command, Output};

fn softgrip(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output()
        .expect("softgrip starts")
}

fn printed(args: &[&str]) -> String {
    let output = softgrip(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    String::from_utf8(output.stdout).expect("text")
}

/// Standard error of a command that refuses.
fn refused(args: &[&str]) -> String {
    let output = softgrip(args);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
    assert!(output.stdout.is_empty(), "{args:?}");
    assert!(!error.contains("panicked"), "{error}");
    error
}

fn put(dir: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

const BAD: &str = "version = 1
[regulator]
max_pressure_kpa = 170.0
slew_kpa_per_s = 'fast'
[grip]
setle_ms = 10
";

#[test]
fn the_page_of_the_manual_has_every_setting_as_it_is() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/settings.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let table = printed(&["settings", "registers"]);
    assert!(
        page.ends_with(&table),
        "docs/settings.md must end with what `softgrip settings registers` prints"
    );
}

#[test]
fn what_is_printed_is_a_good_file_and_changes_nothing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let text = printed(&["settings", "print"]);
    let file = put(dir.path(), "all.toml", &text);
    assert!(printed(&["settings", "check", &file]).contains("all right"));
    let again = printed(&["settings", "print", "--settings", &file]);
    assert_eq!(again, text);
    let small = put(
        dir.path(),
        "small.toml",
        "version = 1\nregulator.max_pressure_kpa = 100.0\n",
    );
    let text = printed(&["settings", "print", "--settings", &small]);
    assert!(text.contains("\nmax_pressure_kpa = 100.0\n"), "{text}");
    assert!(text.contains("\ngrip_pressure_kpa = 100.0\n"), "{text}");
}

#[test]
fn every_command_refuses_a_bad_file_with_all_its_problems() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let file = put(dir.path(), "bad.toml", BAD);
    let out = dir.path().join("out").display().to_string();
    let header = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n";
    let trace = put(
        dir.path(),
        "t.csv",
        format!("{header}0,0,0,0,0,0\n0.001,0,0,0,0,0\n"),
    );
    let spec = put(
        dir.path(),
        "spec.toml",
        "kind = 'grid'\n[vary]\nobject = ['sphere']\n",
    );
    for args in [
        &["settings", "check", &file][..],
        &["settings", "print", "--settings", &file],
        &["sim", "--settings", &file, "--out", &out],
        &["replay", &trace, "--settings", &file],
        &["study", "--settings", &file, "--out", &out],
        &["gauge", "--settings", &file, "--out", &out],
        &["evaluate", "--settings", &file, "--out", &out],
        &["sweep", &spec, "--settings", &file, "--out", &out],
    ] {
        let error = refused(args);
        for expected in [
            "bad.toml:3: regulator.max_pressure_kpa = 170: must lie within 1 and 160 with this finger\n",
            "bad.toml:4: regulator.slew_kpa_per_s = \"fast\": must be a number within 1 and 10000\n",
            "bad.toml:6: grip.setle_ms: there is no such setting; did you mean grip.settle_ms?\n",
        ] {
            assert!(error.contains(expected), "{args:?}: {error}");
        }
    }
    let binary = put(dir.path(), "binary.toml", [0xff, 0xfe, 0, 1]);
    assert!(refused(&["settings", "check", &binary]).contains("binary.toml:1: is not text"));
    let missing = dir.path().join("missing.toml").display().to_string();
    assert!(refused(&["sim", "--settings", &missing]).contains("missing.toml: "));
    assert!(refused(&["sim", "--settings", &out]).contains("out: "));
}

#[test]
fn a_pressure_above_that_of_the_settings_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let file = put(
        dir.path(),
        "low.toml",
        "version = 1\nregulator.max_pressure_kpa = 100\n",
    );
    let error = refused(&["sim", "--settings", &file, "--pressure", "120", "--json"]);
    assert!(
        error.contains("at most 100, the setting regulator.max_pressure_kpa"),
        "{error}"
    );
    let error = refused(&["evaluate", "--settings", &file, "--json"]);
    assert!(
        error.contains("the setting regulator.max_pressure_kpa is 100"),
        "{error}"
    );
}

#[test]
fn other_electronics_are_simulated_and_understood() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let text = "version = 1
[front_end]
gauge_zero_v = 1.0
gauge_full_scale_v = 0.8
gauge_full_scale_ue = 16000
supply_divider = 9
regulator_full_scale_kpa = 500
command_full_scale_v = 2.5
monitor_full_scale_v = 2.4
";
    let file = put(dir.path(), "other.toml", text);
    let run = |more: &[&str]| {
        let args = ["sim", "--accel", "5", "--json", "--object", "sphere"];
        printed(&[&args[..], more].concat())
    };
    let (usual, other) = (run(&[]), run(&["--settings", &file]));
    assert_ne!(usual, other);
    for text in [&usual, &other] {
        assert!(text.contains("\"holding\""), "{text}");
        assert!(!text.contains("\"fault\""), "{text}");
    }
    // The electronics are those that were meant: a controller that knows others is wrong about them.
    let gain = put(
        dir.path(),
        "gain.toml",
        "version = 1\ngauge.gain = [0.5, 0.5, 0.5]\n",
    );
    assert_ne!(run(&["--settings", &gain]), usual);
}

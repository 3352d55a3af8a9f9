//! `softgrip check`: arguments, exit status and reports.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

fn softgrip(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
    command.args(args).current_dir(dir).stdin(Stdio::null());
    command.output().expect("softgrip starts")
}

fn said(output: &Output) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|said| String::from_utf8_lossy(said));
    format!("{out}\n{error}")
}

/// A check of the virtual gripper as fast as it goes, with these options more.
fn check(dir: &Path, args: &[&str]) -> Output {
    let most = ["check", "--from", "virtual", "--speed", "50"];
    softgrip(dir, &[&most[..], args].concat())
}

#[test]
fn a_gripper_passes_and_its_report_is_kept() {
    let dir = tempfile::tempdir().expect("a directory");
    let passed = check(dir.path(), &["--yes", "--out", "board.md"]);
    assert_eq!(passed.status.code(), Some(0), "{}", said(&passed));
    let page = std::fs::read_to_string(dir.path().join("board.md")).expect("a report");
    assert!(page.contains("the gripper has passed"), "{page}");
    assert!(page.contains("## Settings that differ from the factory's\n\nNone."));

    let again = check(dir.path(), &["--yes", "--out", "board.md"]);
    assert_eq!(again.status.code(), Some(2), "{}", said(&again));
    assert!(
        said(&again).contains("is there already"),
        "{}",
        said(&again)
    );
    let kept = std::fs::read_to_string(dir.path().join("board.md")).expect("a report");
    assert_eq!(kept, page);
}

#[cfg(target_os = "linux")]
#[test]
fn a_report_that_does_not_fit_on_the_disk_keeps_nobody_from_the_result() {
    let dir = tempfile::tempdir().expect("a directory");
    let report = dir.path().join("board.md");
    std::os::unix::fs::symlink("/dev/full", &report).expect("a link");
    let full = check(dir.path(), &["--yes", "--out", "board.md", "--force"]);
    assert_eq!(full.status.code(), Some(2), "{}", said(&full));
    for expected in ["the gripper has passed", "board.md: cannot be written"] {
        assert!(said(&full).contains(expected), "{}", said(&full));
    }
    assert!(!report.exists());
}

#[test]
fn a_gripper_that_fails_ends_with_one_and_its_report_names_the_fault() {
    let dir = tempfile::tempdir().expect("a directory");
    let script = "[[step]]\nfault = 'gauge-open:2'\n";
    std::fs::write(dir.path().join("open.toml"), script).expect("a script");
    std::fs::write(
        dir.path().join("set.toml"),
        "version = 1\n[grip]\ngrip_pressure_kpa = 120\n",
    )
    .expect("settings");
    let args = [
        "--yes",
        "--script",
        "open.toml",
        "--settings",
        "set.toml",
        "--out",
        "board.json",
    ];
    let failed = check(dir.path(), &args);
    assert_eq!(failed.status.code(), Some(1), "{}", said(&failed));
    assert!(said(&failed).contains("docs/faults/16-gauge-open.md"));
    let json = std::fs::read_to_string(dir.path().join("board.json")).expect("a report");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["passed"], false);
    let setting = &json["settings_that_differ"][0];
    assert_eq!(setting["name"], "grip.grip_pressure_kpa");
    assert_eq!(
        (&setting["value"], &setting["factory"]),
        (&120.0.into(), &140.0.into())
    );
    let findings = json["findings"].as_array().expect("findings");
    assert!(
        findings.iter().any(|finding| finding["fault"] == 16),
        "{json:#}"
    );
}

#[test]
fn what_cannot_be_checked_is_refused_with_what_would_be_right() {
    let dir = tempfile::tempdir().expect("a directory");
    let refused = |args: &[&str], why: &str| {
        let output = softgrip(dir.path(), &[&["check"], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
        assert!(said(&output).contains(why), "{args:?}: {}", said(&output));
    };
    refused(&["--yes"], "--from");
    let right = "must be virtual, tty:/dev/ttyUSB0 or tcp:HOST:PORT";
    refused(&["--from", "defmt:-", "--yes"], right);
    refused(&["--from", "old.mcap", "--yes"], right);
    refused(&["--from", "virtual"], "--yes where the fingers may move");
    refused(&["--from", "tty:nowhere", "--yes"], "cannot open");
    let out = ["--from", "virtual", "--yes", "--out", "board.txt"];
    refused(&out, "must end with .md or .json");
    refused(
        &["--from", "virtual", "--yes", "--top", "10"],
        "within 20 and 200",
    );
    let top = [
        "--from", "virtual", "--yes", "--top", "170", "--out", "top.md",
    ];
    refused(&top, "at most 160 kPa");
    assert!(!dir.path().join("top.md").exists());
}

struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual gripper behind a TCP port, and its address.
fn serve() -> (Served, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
    command.args(["serve", "--object", "none", "--tcp", "127.0.0.1:0"]);
    command.stdout(Stdio::piped());
    let mut served = Served(command.spawn().expect("softgrip starts"));
    let log = served.0.stdout.take().expect("its output");
    let mut first = String::new();
    let mut log = BufReader::new(log);
    log.read_line(&mut first).expect("a line");
    let port = first.split("127.0.0.1:").nth(1);
    let port = port
        .and_then(|rest| rest.split(':').next())
        .expect("a port");
    (served, format!("127.0.0.1:{port}"))
}

#[test]
fn a_gripper_at_the_other_end_of_a_line_passes() {
    let dir = tempfile::tempdir().expect("a directory");
    let (_served, address) = serve();
    let from = format!("tcp:{address}");
    let passed = softgrip(dir.path(), &["check", "--from", &from, "--yes"]);
    assert_eq!(passed.status.code(), Some(0), "{}", said(&passed));
    assert!(
        said(&passed).contains("strain of finger 3"),
        "{}",
        said(&passed)
    );
}

#[test]
fn a_line_that_is_lost_under_pressure_is_sought_again_and_the_pressure_let_go() {
    let (_served, address) = serve();
    let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
    command.args(["check", "--from", &format!("tcp:{address}"), "--yes"]);
    // Steps enough for somebody who is slow to get in between.
    command.args(["--top", "160"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut checking = command.spawn().expect("softgrip starts");
    let lines = BufReader::new(checking.stdout.take().expect("its output")).lines();
    let mut lines = lines.map(|line| line.expect("a line"));
    assert!(lines.any(|line| line.contains("pressure at 20 kPa")));
    // Whoever comes later takes the place of the one before.
    drop(TcpStream::connect(&address).expect("the gripper listens"));
    lines.for_each(drop);
    let ended = checking.wait_with_output().expect("an end");
    let error = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{error}");
    assert!(error.contains("let go over a new connection"), "{error}");
    assert!(!error.contains("THERE MAY BE PRESSURE"), "{error}");
}

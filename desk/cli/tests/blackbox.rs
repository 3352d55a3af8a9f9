//! `softgrip blackbox` against the virtual gripper.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serve::master::Master;

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(60);
/// Registers of the own block: command, whether something stands in the black box.
const COMMAND: u16 = 0x1104;
const STANDS: u16 = 0x110A;

fn softgrip(args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(args)
        .output();
    output.expect("softgrip starts")
}

fn told(args: &[&str]) -> String {
    let output = softgrip(args);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

/// A virtual gripper whose object is pulled out once it is held, and its address.
fn serving(script: &str) -> (Child, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_softgrip"))
        .args(["serve", "--tcp", "127.0.0.1:0", "--script", script])
        .stdout(Stdio::piped())
        .spawn()
        .expect("softgrip starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let first = lines.next().expect("a line").expect("text");
    // What it says is read on, or it would end.
    std::thread::spawn(move || lines.for_each(drop));
    let address = first
        .split_whitespace()
        .find(|word| word.starts_with("127."));
    let address = address
        .expect("an address")
        .trim_end_matches([':', ';', ',']);
    (child, address.to_owned())
}

#[test]
fn a_loss_is_read_out_as_a_trace_that_replays_to_the_same_loss() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("text").to_owned();
    let (script, trace) = (path("script.toml"), path("loss.csv"));
    std::fs::write(
        &script,
        "[[step]]\nwhen = { event = \"holding\" }\nafter_s = 0.3\nobject = \"pull out\"\n",
    )
    .expect("a script");
    let (mut child, address) = serving(&script);
    let running = told(&["blackbox", "--tcp", &address]);
    assert!(
        running.contains("it runs") || running.contains("runs:"),
        "{running}"
    );

    let mut master = Master::connect(&address, 9).expect("a gripper");
    master.write(COMMAND, 1).expect("a grip");
    let end = Instant::now() + LONG;
    while master.read(STANDS, 1).expect("an answer") != [1] {
        assert!(Instant::now() < end, "no loss");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(master);
    let from = format!("tcp:{address}");
    let (recording, picture) = (path("loss.mcap"), path("loss.svg"));
    for out in [&recording, &picture] {
        told(&["blackbox", "--from", &from, "--out", out]);
    }
    let picture = std::fs::read_to_string(&picture).expect("a picture");
    assert!(picture.starts_with("<svg") && picture.contains("the object was lost"));
    let read = told(&["blackbox", "--tcp", &address, "--out", &trace, "--clear"]);
    for words in [
        "the object was lost",
        "ticks, in which it came at",
        "cleared",
    ] {
        assert!(read.contains(words), "{read}");
    }
    let rows = std::fs::read_to_string(&trace)
        .expect("a trace")
        .lines()
        .count();
    assert!(rows > 1_000, "{rows}");
    assert!(told(&["blackbox", "--tcp", &address]).contains("runs"));
    let other = softgrip(&["blackbox", "--tcp", &address, "--id", "17"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("no answer from id 17"));
    child.kill().expect("it runs");
    child.wait().expect("it ends");

    for trace in [&trace, &recording] {
        let replayed = softgrip(&["replay", trace, "--json"]);
        let text = String::from_utf8_lossy(&replayed.stdout);
        assert!(text.contains("lost"), "{trace}: {text}");
    }
    let again = softgrip(&["blackbox", "--from", "tcp:127.0.0.1:1", "--out", &trace]);
    assert_eq!(again.status.code(), Some(2));
}

#[test]
fn a_gripper_that_is_not_there_is_an_error_that_says_so() {
    for (args, words) in [
        (&["blackbox"][..], "--tty"),
        (
            &["blackbox", "--from", "virtual"],
            "must be tty:/dev/ttyUSB0 or tcp:HOST:PORT",
        ),
        (
            &["blackbox", "--tcp", "127.0.0.1:1", "--out", "a.png"],
            "must end with .csv, .mcap or .svg",
        ),
        (&["blackbox", "--tcp", "127.0.0.1:1"], "nobody serves there"),
        (&["blackbox", "--tty", "/nowhere/at/all"], "cannot open"),
        (&["blackbox", "--tty", "/dev/null"], "not a serial port"),
        (&["blackbox", "--tcp", "127.0.0.1:1", "--id", "300"], "300"),
    ] {
        let output = softgrip(args);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
        assert!(error.contains(words), "{args:?}: {error}");
    }
}

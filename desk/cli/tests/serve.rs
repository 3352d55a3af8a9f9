//! `softgrip serve` as its users call it: what it says, how it ends, and what it refuses.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(60);

fn softgrip(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
    command.arg("serve").args(args);
    command
}

/// A serving child, and the first line that it has said.
fn serving(args: &[&str]) -> (Child, String, BufReader<ChildStdout>) {
    let mut child = softgrip(args)
        .stdout(Stdio::piped())
        .spawn()
        .expect("softgrip starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut first = String::new();
    lines.read_line(&mut first).expect("a line");
    (child, first, lines)
}

/// Sends a signal by the system's command.
fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    let status = Command::new("kill").args([name, &id]).status();
    assert!(status.expect("kill is there").success());
}

fn status(child: &mut Child) -> Option<i32> {
    let end = Instant::now() + LONG;
    while Instant::now() < end {
        if let Some(status) = child.try_wait().expect("a child") {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("it does not end");
}

fn refused(args: &[&str], words: &[&str]) {
    let Output {
        status,
        stdout,
        stderr,
    } = softgrip(args).output().expect("softgrip starts");
    let error = String::from_utf8_lossy(&stderr);
    assert_eq!(status.code(), Some(2), "{args:?}: {error}");
    assert!(stdout.is_empty() && !error.contains("panicked"), "{error}");
    for word in words {
        assert!(error.contains(word), "{args:?}: no {word:?} in {error}");
    }
}

#[test]
fn it_says_what_to_open_and_ends_well_at_each_signal_without_its_link() {
    let dir = tempfile::tempdir().expect("a folder");
    let link = dir.path().join("gripper");
    let name = link.display().to_string();
    for by in ["-INT", "-TERM", "-HUP"] {
        let (mut child, first, mut rest) = serving(&["--tty", &name]);
        let expected = format!("serving on {name}: Modbus RTU, id 9; Ctrl-C ends it\n");
        assert_eq!(first, expected);
        assert!(link.exists());
        signal(&child, by);
        assert_eq!(status(&mut child), Some(0));
        assert!(link.symlink_metadata().is_err());
        let mut text = String::new();
        rest.read_to_string(&mut text).expect("text");
        assert!(text.contains(" ticks, "), "{text}");
    }
}

#[test]
fn without_a_path_it_says_the_systems_name_and_on_tcp_the_port() {
    for (args, expected) in [
        (&[][..], "serving on /dev/"),
        (&["--tcp", "127.0.0.1:0"], "serving on 127.0.0.1:"),
    ] {
        let (mut child, first, _rest) = serving(args);
        assert!(first.starts_with(expected), "{first}");
        assert!(!first.contains(":0:"), "{first}");
        signal(&child, "-INT");
        assert_eq!(status(&mut child), Some(0));
    }
}

#[test]
fn it_goes_on_when_nobody_reads_its_log_any_more() {
    let dir = tempfile::tempdir().expect("a folder");
    let script = dir.path().join("script.toml");
    std::fs::write(
        &script,
        "[[step]]\nfault = 'supply-sag'\n[[step]]\nafter_s = 0.5\nend = true\n",
    )
    .expect("a file");
    let (mut child, _, rest) = serving(&["--script", &script.display().to_string()]);
    drop(rest);
    assert_eq!(status(&mut child), Some(0));
}

#[test]
fn what_cannot_be_is_refused_with_what_would_be_right() {
    let dir = tempfile::tempdir().expect("a folder");
    let put = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path.display().to_string()
    };
    let script = put("script.toml", "[[step]]\n\n[[step]]\nobject = 'gone'\n");
    refused(
        &["--script", &script],
        &["script.toml: line 1: a step must do one thing"],
    );
    let register = put(
        "register.toml",
        "\n[[step]]\nwhen = { register = 0x4000, equals = 1 }\nend = true\n",
    );
    refused(
        &["--script", &register],
        &["register.toml: line 2: register = 0x4000: there is no such register"],
    );
    refused(&["--script", "nowhere.toml"], &["nowhere.toml"]);
    let file = put("file", "");
    refused(
        &["--tty", &file],
        &["file: there is something that is no link"],
    );
    refused(
        &["--tty", "/no/such/folder/gripper"],
        &[
            "/no/such/folder/gripper: cannot make the link",
            "you may write to",
        ],
    );
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    refused(&["--tcp", &address], &[&address, "another port"]);
    refused(&["--tcp", "nowhere"], &["nowhere"]);
    refused(
        &["--tcp", "127.0.0.1:0", "--tty", &file],
        &["cannot be used with"],
    );
    refused(&["--speed", "0"], &["must lie within 0.1 and 100"]);
    refused(&["--object", "cube"], &["sphere", "cylinder", "none"]);
    refused(&["--mass", "0"], &["must lie within 0.001 and 5"]);
    let settings = put("settings.toml", "version = 1\n[grip]\nnothing = 1\n");
    refused(&["--settings", &settings], &["settings.toml"]);
}

#[test]
fn the_script_of_the_manual_can_be_played() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/virtual-gripper.md");
    let page = std::fs::read_to_string(page).expect("the manual");
    let (_, section) = page.split_once("## Scripts\n").expect("its section");
    let lines = section.lines().skip(1);
    let code = lines.take_while(|line| line.is_empty() || line.starts_with("    "));
    let code: Vec<&str> = code
        .map(|line| line.strip_prefix("    ").unwrap_or(line))
        .collect();
    assert_eq!(code.iter().filter(|line| **line == "[[step]]").count(), 6);
    let dir = tempfile::tempdir().expect("a folder");
    let script = dir.path().join("script.toml");
    std::fs::write(&script, code.join("\n")).expect("a file");
    let args = ["--script", &script.display().to_string()];
    let (mut child, first, _rest) = serving(&args);
    assert!(first.starts_with("serving on"), "{first}");
    signal(&child, "-INT");
    assert_eq!(status(&mut child), Some(0));
}

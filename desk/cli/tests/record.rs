//! `softgrip record`, and what becomes of its files.
#![cfg(unix)]

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use watch::Told;
use watch::recorder::Recorder;
use watch::told::EventTold;

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(120);

/// A grasp and a loss, again and again.
const SCRIPT: &str = "
repeat = true

[[step]]
object = 'appear'

[[step]]
after_s = 0.3
input = 'grip'

[[step]]
when = { event = 'holding' }
after_s = 0.3
object = 'pull out'

[[step]]
when = { event = 'lost' }
input = 'acknowledge'

[[step]]
when = { event = 'acknowledged' }
input = 'release'

[[step]]
after_s = 0.7
input = 'acknowledge'
";

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        std::fs::write(dir.path().join("script.toml"), SCRIPT).expect("room");
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
        command.args(args).current_dir(self.dir.path());
        command
    }

    fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("softgrip starts")
    }

    /// Runs what is to end with this status, and gives what it says.
    fn says(&self, status: i32, args: &[&str]) -> String {
        let output = self.run(args);
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(text).expect("text");
        assert_eq!(output.status.code(), Some(status), "{args:?}: {text}");
        text
    }

    fn recording(&self, out: &str) -> Child {
        let args = [
            "record",
            "--from",
            "virtual",
            "--script",
            "script.toml",
            "--out",
            out,
        ];
        let mut command = self.command(&args);
        command
            .stdout(Stdio::piped())
            .spawn()
            .expect("softgrip starts")
    }
}

fn wait_for_bytes(path: &Path, bytes: u64) {
    let end = Instant::now() + LONG;
    while std::fs::metadata(path).map_or(0, |file| file.len()) < bytes {
        assert!(Instant::now() < end, "{} does not grow", path.display());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_recording_that_was_killed_is_read_up_to_its_last_chunk() {
    let bench = Bench::new();
    let mut recorder = bench.recording("killed.mcap");
    // Some chunks of a second with 10 kB each.
    wait_for_bytes(&bench.path("killed.mcap"), 45_000);
    recorder.kill().expect("it runs");
    recorder.wait().expect("it ends");

    let repeat = ["replay", "killed.mcap", "--from-hardware-frames"];
    let text = bench.says(0, &repeat);
    assert!(text.contains("killed.mcap: its end is missing"), "{text}");
    assert!(text.contains("the same, bit for bit"), "{text}");

    let text = bench.says(
        0,
        &["record", "--recover", "killed.mcap", "--out", "whole.mcap"],
    );
    assert!(text.contains("its end is missing"), "{text}");
    let text = bench.says(0, &["replay", "whole.mcap", "--from-hardware-frames"]);
    assert!(!text.contains("missing"), "{text}");
    assert!(text.contains("the same, bit for bit"), "{text}");
    assert!(
        bench
            .says(0, &["diff", "killed.mcap", "whole.mcap"])
            .contains("the same")
    );
}

#[test]
fn ctrl_c_ends_a_recording_and_other_settings_show_what_would_have_been() {
    let bench = Bench::new();
    let mut recorder = bench.recording("grasps.mcap");
    wait_for_bytes(&bench.path("grasps.mcap"), 45_000);
    let pid = recorder.id().to_string();
    let kill = Command::new("kill").args(["-INT", &pid]).status();
    assert!(kill.expect("kill runs").success());
    assert!(recorder.wait().expect("it ends").success());
    let mut said = String::new();
    let stdout = recorder.stdout.as_mut().expect("a pipe");
    stdout.read_to_string(&mut said).expect("text");
    assert!(
        said.contains("LOST") && said.contains(" ticks and "),
        "{said}"
    );

    let replayed = bench.says(0, &["replay", "grasps.mcap", "--json"]);
    std::fs::write(bench.path("replayed.jsonl"), &replayed).expect("room");
    assert!(
        bench
            .says(0, &["diff", "grasps.mcap", "replayed.jsonl"])
            .contains("the same")
    );

    let softer = "version = 1\n[grip]\ngrip_pressure_kpa = 60\n";
    std::fs::write(bench.path("softer.toml"), softer).expect("room");
    let other = [
        "replay",
        "grasps.mcap",
        "--settings",
        "softer.toml",
        "--json",
    ];
    std::fs::write(bench.path("other.jsonl"), bench.says(0, &other)).expect("room");
    let text = bench.says(1, &["diff", "replayed.jsonl", "other.jsonl"]);
    assert!(
        text.contains("differences; - in replayed.jsonl alone"),
        "{text}"
    );

    // At 50 Hz a loss may be missed, and that is said.
    let text = bench.says(
        0,
        &["record", "--from", "grasps.mcap", "--out", "grasps.csv"],
    );
    assert!(
        text.contains("ticks were left out: a CSV file has snapshots alone"),
        "{text}"
    );
    let text = bench.says(0, &["replay", "grasps.csv"]);
    assert!(
        text.contains("50 Hz, less than 100") && text.contains("holding"),
        "{text}"
    );
}

#[test]
fn what_cannot_be_recorded_is_refused_with_what_would_be_right() {
    let bench = Bench::new();
    std::fs::write(bench.path("there.mcap"), "").expect("room");
    let refused = |args: &[&str], expected: &str| {
        let text = bench.says(2, &[&["record"], args].concat());
        assert!(text.contains(expected), "{args:?}: {text}");
    };
    for (args, expected) in [
        (
            &["--from", "virtual", "--out", "there.mcap"][..],
            "there.mcap: is there already",
        ),
        (
            &["--from", "virtual", "--out", "a.bag"],
            "a.bag: must end with .mcap or .csv",
        ),
        (
            &["--from", "can0", "--out", "a.csv"],
            "must be one of virtual, tty:",
        ),
        (
            &["--from", "virtual", "--out", "a.csv", "--for", "60"],
            "as in 500ms, 60s",
        ),
        (
            &["--from", "gone.mcap", "--out", "a.csv"],
            "gone.mcap: there is no such file",
        ),
        (
            &["--from", "tcp:localhost:1", "--out", "a.csv"],
            "nobody serves there",
        ),
        (&["--out", "a.csv"], "--from"),
        (&["--from", "virtual"], "--out"),
        (&["--from", "virtual", "--live", "8765"], "--live"),
        (
            &["--from", "there.mcap", "--out", "a.csv", "--rate", "100"],
            "--rate: is for a gripper that tells something now",
        ),
        (
            &["--from", "there.mcap", "--out", "a.csv", "--for", "1s"],
            "--for: is for a gripper that tells something now",
        ),
        (
            &["--recover", "there.mcap", "--out", "a.csv"],
            "a.csv: what is whole of an MCAP file is one, too: must end with .mcap",
        ),
        (
            &["--recover", "there.mcap", "--out", "b.mcap"],
            "not an MCAP file",
        ),
    ] {
        refused(args, expected);
    }
    #[cfg(not(any(feature = "live", feature = "probe")))]
    for (args, expected) in [
        (
            &["--from", "virtual", "--live", "--out", "a.csv"][..],
            "127.0.0.1:8765: this program serves nothing live: build it with `cargo build --release -p softgrip-cli --features live`",
        ),
        (
            &["--from", "virtual", "--live=[::1]:9000"],
            "[::1]:9000: this program serves nothing live",
        ),
        (
            &["--from", "probe", "--out", "a.csv"],
            "build it with `cargo build --release -p softgrip-cli --features probe`, or have",
        ),
        (
            &["--from", "probe:STM32G474RETx@066A", "--out", "a.csv"],
            "name defmt:localhost:9090 with --elf",
        ),
    ] {
        refused(args, expected);
    }
    assert!(!bench.path("a.csv").exists());
    let text = bench.says(2, &["replay", "there.mcap", "--from-hardware-frames"]);
    assert!(text.contains("not an MCAP file"), "{text}");
    std::fs::write(bench.path("no.jsonl"), "nonsense\n").expect("room");
    let text = bench.says(2, &["diff", "no.jsonl", "no.jsonl"]);
    assert!(
        text.contains("no.jsonl: line 1: must be an event"),
        "{text}"
    );
}

/// Three rows of a recording.
const ROWS: &str =
    "t_s,strain1_ue,pressure_kpa,events\n0.001,1,0,\n0.002,2,0,contact\n0.003,3,0,\n";

#[test]
fn a_recording_is_never_written_over_while_it_is_read() {
    let bench = Bench::new();
    std::fs::write(bench.path("only.csv"), ROWS).expect("room");
    bench.says(0, &["record", "--from", "only.csv", "--out", "only.mcap"]);
    let mcap = std::fs::read(bench.path("only.mcap")).expect("a recording");
    for args in [
        ["--from", "only.csv", "--out", "./only.csv"],
        ["--from", "only.mcap", "--out", "./only.mcap"],
        ["--recover", "only.mcap", "--out", "./only.mcap"],
    ] {
        let text = bench.says(2, &[&["record", "--force"][..], &args].concat());
        assert!(text.contains("--out must name another file"), "{text}");
    }
    let csv = std::fs::read_to_string(bench.path("only.csv")).expect("a recording");
    assert_eq!(csv, ROWS);
    assert_eq!(std::fs::read(bench.path("only.mcap")).expect("one"), mcap);
}

#[test]
fn a_recording_that_cannot_be_converted_leaves_no_part_of_one() {
    let bench = Bench::new();
    let wrong = format!("{ROWS}0.004,x,0,\n0.005,5,0,\n");
    for (content, expected) in [
        (
            wrong.as_str(),
            "line 5: strain1_ue = \"x\": must be a number",
        ),
        ("t_s,strain1_ue\n", "it has no rows: nothing was recorded"),
        ("time,foo\n1,2\n", "no column t_s"),
    ] {
        std::fs::write(bench.path("bad.csv"), content).expect("room");
        let text = bench.says(2, &["record", "--from", "bad.csv", "--out", "out.mcap"]);
        assert!(text.contains(expected), "{text}");
        assert!(!bench.path("out.mcap").exists(), "{text}");
    }
    let mut recorder = Recorder::new(&bench.path("events.mcap"), false).expect("a file");
    let event = EventTold {
        t_s: 1.0,
        name: "holding".into(),
        text: "holding".into(),
    };
    recorder.add(&Told::Event(event)).expect("room");
    recorder.finish().expect("room");
    let text = bench.says(2, &["record", "--from", "events.mcap", "--out", "out.csv"]);
    assert!(text.contains("events.mcap: has no snapshots"), "{text}");
    assert!(!bench.path("out.csv").exists(), "{text}");
}

#[test]
fn a_csv_recording_with_a_torn_last_line_is_read_up_to_it() {
    let bench = Bench::new();
    std::fs::write(bench.path("torn.csv"), format!("{ROWS}0.004,4")).expect("room");
    let text = bench.says(0, &["record", "--from", "torn.csv", "--out", "whole.mcap"]);
    for expected in [
        "torn.csv: the last line has no end",
        "3 snapshots",
        "contact",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}

#[test]
fn a_name_in_capitals_is_the_same_format() {
    let bench = Bench::new();
    std::fs::write(bench.path("LOG.CSV"), ROWS).expect("room");
    let text = bench.says(0, &["record", "--from", "LOG.CSV", "--out", "LOG.MCAP"]);
    assert!(text.contains("3 snapshots, 0 ticks and 1 events"), "{text}");
    let text = bench.says(2, &["replay", "LOG.MCAP", "--from-hardware-frames"]);
    assert!(text.contains("LOG.MCAP: has no ticks"), "{text}");
    let text = bench.says(0, &["diff", "LOG.MCAP", "LOG.MCAP"]);
    assert!(text.contains("the same: 1 events"), "{text}");
}

/// A file that takes nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_with_the_file_that_does_not_fit() {
    let bench = Bench::new();
    std::fs::write(bench.path("rows.csv"), ROWS).expect("room");
    for name in ["full.csv", "full.mcap"] {
        std::os::unix::fs::symlink("/dev/full", bench.path(name)).expect("a link");
        let args = ["record", "--from", "rows.csv", "--force", "--out", name];
        let text = bench.says(2, &args);
        let expected = format!("{name}: cannot be written");
        assert!(
            text.contains(&expected) && text.contains("No space"),
            "{text}"
        );
    }
}

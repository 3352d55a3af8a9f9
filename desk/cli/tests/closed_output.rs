//! Every command ends quietly when its output is closed.

use std::process::{Command, Stdio};

#[test]
fn no_command_complains_of_an_output_that_was_closed() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| dir.path().join(name).display().to_string();
    let put = |name: &str, text: &str| {
        std::fs::write(dir.path().join(name), text).expect("a file");
        path(name)
    };
    let header = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa\n";
    let trace = put(
        "trace.csv",
        &format!("{header}0,0,0,0,0,0\n0.005,0,0,0,0,200\n0.01,0,0,0,0,200\n"),
    );
    let measured = put("bench.csv", "pressure_kpa,tip_angle_deg\n60,11.5\n140,75\n");
    let spec = put(
        "spec.toml",
        "kind = 'grid'\n[fixed.arm]\nlift_mm = 20\ncarry_mm = 20\n[vary]\nobject = ['sphere']\n",
    );
    let settings = put("settings.toml", "version = 1\n");
    let end = put("end.toml", "[[step]]\nend = true\n");
    let (out, joined, swept) = (path("out"), path("joined"), path("swept.toml"));
    let recording = path("recording.mcap");
    let section = [
        "section",
        "--R",
        "9.6",
        "--r",
        "4.6",
        "--e",
        "2.7",
        "--alpha",
        "56",
        "--pressure",
        "60",
    ];
    for args in [
        &["--help"][..],
        &["sim", "--accel", "5", "--out", &out],
        &["serve", "--script", &end],
        &[
            "record", "--from", "virtual", "--script", &end, "--force", "--out", &recording,
        ],
        &["check", "--from", "virtual", "--yes", "--speed", "50"],
        &["replay", &recording],
        &["diff", &recording, &recording],
        &["replay", &trace],
        &["replay", &trace, "--json"],
        &["table"],
        &["table", "--json"],
        &section,
        &["fit", "--measured", &measured, "--out", &out],
        &["calibrate", "--out", &swept],
        &["calibrate", "--hands", "1", "--grips", "1"],
        &["settings", "print"],
        &["settings", "registers"],
        &["registers"],
        &["telemetry"],
        &["settings", "check", &settings],
        // To a directory it varies everything that there is, which takes long.
        &["study", "--json"],
        &["capability", "--accel", "5", "--out", &out],
        &["gauge", "--runs", "5", "--out", &out],
        &["sweep", &spec, "--out", &out],
        &["sweep", &spec, "--shard", "1/1", "--out", &joined],
        &["sweep", "merge", &joined],
        &["evaluate", "--losses", "1", "--hours", "0", "--out", &out],
    ] {
        let run = |stdout: Stdio| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_softgrip"));
            command.args(args).stdout(stdout);
            command.output().expect("softgrip starts")
        };
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let closed = run(writer.into());
        let error = String::from_utf8_lossy(&closed.stderr);
        assert_eq!(closed.status.code(), Some(0), "{args:?}: {error}");
        assert!(error.is_empty(), "{args:?}: {error}");
    }
}

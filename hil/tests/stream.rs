//! What the image sends, through the command `softgrip`: recorded, and every tick of it done again.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The directory of everything that is built.
fn target() -> &'static Path {
    let program = Path::new(env!("CARGO_BIN_EXE_softgrip-hil"));
    program.ancestors().nth(2).expect("the target directory")
}

/// An empty directory.
fn dir() -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stream");
    // What an earlier run has left.
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).expect("a directory");
    dir
}

/// Runs what is to end with this status, and gives what it says.
fn says(status: i32, command: &mut Command) -> String {
    let output = command.output().expect("it runs");
    let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert_eq!(output.status.code(), Some(status), "{command:?}: {text}");
    text
}

/// The same ELF file with another build's id: one bit of it is another.
fn of_another_build(elf: &Path) -> Vec<u8> {
    let mut bytes = std::fs::read(elf).expect("an image");
    // A note of eight bytes by the name of GNU, of the kind that names a build (elf.h, NT_GNU_BUILD_ID).
    let head = b"\x04\0\0\0\x08\0\0\0\x03\0\0\0GNU\0";
    let places = bytes.windows(head.len()).enumerate();
    let mut notes = places.filter(|(_, bytes)| *bytes == head);
    let (at, _) = notes.next().expect("a build id");
    assert!(notes.next().is_none());
    bytes[at + head.len()] ^= 1;
    bytes
}

#[test]
fn a_grasp_that_the_image_tells_is_recorded_and_repeated_bit_for_bit() {
    let elf = target().join("thumbv7em-none-eabihf/firmware/softgrip-fw");
    let softgrip = target().join("debug/softgrip");
    for (file, by) in [(&elf, "fw-build"), (&softgrip, "build")] {
        let name = file.display();
        assert!(file.exists(), "{name}: run `cargo {by}` before this test");
    }

    let dir = dir();
    let mut hil = Command::new(env!("CARGO_BIN_EXE_softgrip-hil"));
    hil.args(["run", "--accel", "10", "--json", "--rtt"]);
    hil.arg(dir.join("grasp.rtt")).arg("--image").arg(&elf);
    says(0, &mut hil);

    let run = |args: &[&str]| {
        let mut command = Command::new(&softgrip);
        command.args(args).current_dir(&dir);
        command
    };
    let record = |elf: &Path, out: &str| {
        let stream = File::open(dir.join("grasp.rtt")).expect("a stream");
        let every_tick = ["--from", "defmt:-", "--rate", "1000", "--out", out];
        let mut command = run(&["record"]);
        command.args(every_tick).arg("--elf").arg(elf).stdin(stream);
        command
    };
    let told = says(0, &mut record(&elf, "grasp.mcap"));
    assert!(told.contains("Holding") && told.contains("Lost("), "{told}");
    assert!(
        !told.contains("dropped") && !told.contains("could not be read"),
        "{told}"
    );
    let again = says(
        0,
        &mut run(&["replay", "grasp.mcap", "--from-hardware-frames"]),
    );
    assert!(again.contains("the same, bit for bit"), "{again}");

    let other = dir.join("other-build");
    std::fs::write(&other, of_another_build(&elf)).expect("room");
    let refused = says(2, &mut record(&other, "other.mcap"));
    let why = "the ELF file is not that of the running image: build ";
    assert!(refused.contains(why), "{refused}");
}

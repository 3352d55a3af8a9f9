//! The command line, as a user meets it: what is wrong is named, with what would be right, and status 2.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

fn hil(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_softgrip-hil"))
        .args(args)
        .output()
        .expect("the program runs")
}

/// Runs it, and checks that it refuses with these words.
fn refuses(args: &[&str], words: &[&str]) {
    let output = hil(args);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
    for word in words {
        assert!(error.contains(word), "{args:?}: {word:?} is not in {error}");
    }
}

/// An ELF of 32 bits for ARM with one section `.vector_table` of so many entries, and no symbols.
fn elf(vectors: u32) -> Vec<u8> {
    let names = b"\0.vector_table\0.shstrtab\0";
    let table_at = 52u32;
    let names_at = table_at + 4 * vectors;
    let headers_at = (names_at + names.len() as u32).next_multiple_of(4);
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let half = |file: &mut Vec<u8>, value: u16| file.extend(value.to_le_bytes());
    let word = |file: &mut Vec<u8>, value: u32| file.extend(value.to_le_bytes());
    half(&mut file, 2); // executable
    half(&mut file, 40); // ARM
    for value in [1, 0x0800_0401, 0, headers_at, 0x0500_0000] {
        word(&mut file, value);
    }
    for value in [52, 32, 0, 40, 3, 2] {
        half(&mut file, value);
    }
    word(&mut file, 0x2000_2000);
    file.resize(names_at as usize, 0);
    file.extend(names);
    file.resize(headers_at as usize, 0);
    let sections = [
        [0; 10],
        [1, 1, 2, 0x0800_0000, table_at, 4 * vectors, 0, 0, 4, 0],
        [15, 3, 0, 0, names_at, names.len() as u32, 0, 0, 1, 0],
    ];
    for value in sections.into_iter().flatten() {
        word(&mut file, value);
    }
    file
}

/// An empty directory; no crate for it, which would change the features of all the others.
fn dir(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // What an earlier run has left.
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).expect("a directory");
    dir
}

fn write(dir: &Path, name: &str, content: &[u8]) -> String {
    let path = dir.join(name);
    std::fs::write(&path, content).expect("a temporary file");
    path.display().to_string()
}

#[test]
fn an_image_that_cannot_be_run_is_refused_with_the_command_that_makes_one() {
    let dir = dir("bad");
    let text = write(&dir, "text", b"not an ELF file");
    let other = write(&dir, "other-chip", &elf(16 + 102));
    let stripped = write(&dir, "stripped", &elf(16 + 91));
    let host = std::env::current_exe().expect("this test");
    let host = host.display().to_string();
    for (image, words) in [
        ("nowhere/softgrip-fw", "no image"),
        (&text, "no ELF file"),
        (&host, "not for ARM"),
        (&other, "another chip: 118 vectors"),
        (&stripped, "no symbols"),
    ] {
        refuses(&["--image", image], &[image, words, "run `cargo fw-build`"]);
        refuses(&["run", "--image", image, "--json"], &[image, words]);
    }
}

#[test]
fn an_image_older_than_its_sources_is_refused() {
    let target = Path::new(env!("CARGO_BIN_EXE_softgrip-hil"))
        .ancestors()
        .nth(2)
        .expect("the target directory");
    let built = target.join("thumbv7em-none-eabihf/firmware/softgrip-fw");
    let Ok(image) = std::fs::read(&built) else {
        panic!("{}: run `cargo fw-build` before this test", built.display());
    };
    let dir = dir("old");
    let copy = write(&dir, "softgrip-fw", &image);
    refuses(
        &["--image", &copy],
        &["list of sources", "run `cargo fw-build`"],
    );

    let source = write(&dir, "main.rs", b"");
    let list = format!("{copy}: {source}\n");
    write(&dir, "softgrip-fw.d", list.as_bytes());
    let hour_ago = SystemTime::now() - Duration::from_secs(3600);
    std::fs::File::options()
        .append(true)
        .open(&copy)
        .and_then(|file| file.set_modified(hour_ago))
        .expect("a time stamp");
    refuses(
        &["--image", &copy],
        &["older than its source", &source, "run `cargo fw-build`"],
    );
}

#[test]
fn wrong_options_are_refused_with_what_would_be_right() {
    for (args, words) in [
        (["run", "--mass", "-1"], "within 0.001 and 5"),
        (["run", "--accel", "fast"], "must be a number"),
        (["run", "--until", "6"], "as in 6s or 1500ms"),
        (["run", "--object", "cube"], "sphere, cylinder"),
        (["run", "--pressure", "140"], "unexpected argument"),
    ] {
        refuses(&args, &[args[1], words]);
    }
    refuses(&["--hours", "0"], &["--hours", "within 0.02 and 1000"]);
}

//! Random and mutated frames for as long as one likes:
//! `cargo bench -p softgrip-bus --bench frames -- [--frames N] [--seed S] [--threads N]`.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/hostile.rs"]
mod hostile;
#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/line.rs"]
mod line;
#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../../tests/host/mock.rs"]
mod mock;

use std::process::ExitCode;
use std::time::Instant;

use fastrand::Rng;
use hostile::{Hostile, Tally};

const USAGE: &str =
    "usage: cargo bench -p softgrip-bus --bench frames -- [--frames N] [--seed S] [--threads N]";
/// Frames that one gripper lives through.
const LIFE: u64 = 100_000;

struct Options {
    frames: u64,
    seed: u64,
    threads: u64,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            frames: 1_000_000,
            seed: 1,
            threads: 2,
        };
        while let Some(name) = arguments.next() {
            // Cargo says that this is a bench.
            if name == "--bench" {
                continue;
            }
            let value = arguments
                .next()
                .ok_or(format!("{name}: a number is missing\n{USAGE}"))?;
            let number: u64 = value
                .parse()
                .map_err(|_| format!("{name} {value}: must be a whole number\n{USAGE}"))?;
            match name.as_str() {
                "--frames" => options.frames = number,
                "--seed" => options.seed = number,
                "--threads" => options.threads = number.max(1),
                _ => return Err(format!("{name}: no such option\n{USAGE}")),
            }
        }
        Ok(options)
    }
}

fn add(all: &mut Tally, more: &Tally) {
    all.frames += more.frames;
    all.answered += more.answered;
    all.exceptions += more.exceptions;
    all.broadcasts += more.broadcasts;
    all.written += more.written;
    all.settings += more.settings;
}

/// The lives of one thread; the first frame that broke a rule ends them.
fn live(options: &Options, thread: u64) -> Result<Tally, String> {
    let mut all = Tally::default();
    let lives = options.frames.div_ceil(LIFE);
    for life in (thread..lives).step_by(options.threads as usize) {
        let mut rng = Rng::with_seed(options.seed.wrapping_mul(1_000_003).wrapping_add(life));
        let mut hostile = Hostile::new();
        for _ in 0..LIFE.min(options.frames - life * LIFE) {
            let bytes = hostile.frame(&mut rng);
            let told = hostile.feed(&bytes);
            told.map_err(|what| format!("--seed {}, life {life}: {what}", options.seed))?;
        }
        add(&mut all, &hostile.tally);
    }
    Ok(all)
}

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    let begun = Instant::now();
    let options = &options;
    let results: Vec<Result<Tally, String>> = std::thread::scope(|scope| {
        let threads = 0..options.threads;
        let running: Vec<_> = threads
            .map(|thread| scope.spawn(move || live(options, thread)))
            .collect();
        let joined = running.into_iter().map(|thread| thread.join());
        joined
            .map(|result| result.unwrap_or_else(|_| Err("a panic".into())))
            .collect()
    });
    let mut all = Tally::default();
    for result in results {
        match result {
            Ok(tally) => add(&mut all, &tally),
            Err(what) => {
                eprintln!("BROKEN: {what}");
                return ExitCode::FAILURE;
            }
        }
    }
    println!("{all:?} in {:.0} s", begun.elapsed().as_secs_f32());
    ExitCode::SUCCESS
}

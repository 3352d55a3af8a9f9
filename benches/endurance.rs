//! Random sequences and hostile inputs for as long as one likes:
//! `cargo bench --bench endurance -- [--sequences N] [--ticks N] [--seed S] [--threads N] [--examples N]`.
//!
//! For each rule that was broken the first sequences are printed with their number, made as small as they
//! get; `--sequence I` plays that one alone, and `--life I` lives that one hostile life.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/mock.rs"]
mod mock;
#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/host/torture/mod.rs"]
mod torture;

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use fastrand::Rng;
use torture::generate;
use torture::hostile::{Census, Hostile, seed_of};
use torture::promises::Tally;
use torture::season::Season;
use torture::sequence::Sequence;

/// Sequences that share settings and starts.
const PER_SEASON: u64 = 200;
/// Lives between two looks at the number of ticks.
const LIVES: u64 = 64;

const USAGE: &str = "usage: cargo bench --bench endurance -- [--sequences N] [--ticks N] [--seed S] \
                     [--threads N] [--examples N] [--sequence I] [--life I]";

struct Options {
    sequences: u64,
    /// Hostile ones.
    ticks: u64,
    seed: u64,
    threads: u64,
    /// Stories for each rule.
    examples: usize,
    /// These alone.
    sequence: Option<u64>,
    life: Option<u64>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            sequences: 20_000,
            ticks: 5_000_000,
            seed: 1,
            threads: 2,
            examples: 1,
            sequence: None,
            life: None,
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
                "--sequences" => options.sequences = number,
                "--ticks" => options.ticks = number,
                "--seed" => options.seed = number,
                "--threads" => options.threads = number.max(1),
                "--examples" => options.examples = number as usize,
                "--sequence" => options.sequence = Some(number),
                "--life" => options.life = Some(number),
                _ => return Err(format!("{name}: no such option\n{USAGE}")),
            }
        }
        Ok(options)
    }
}

/// How often a rule was broken, and the first numbers with their stories.
#[derive(Default)]
struct Broken {
    count: u64,
    examples: Vec<(u64, String)>,
}

type Failures = BTreeMap<&'static str, Broken>;

/// Counts a failure and tells its story if it is one of the first.
fn note(
    failures: &mut Failures,
    most: usize,
    rule: &'static str,
    number: u64,
    story: impl FnOnce() -> String,
) {
    let broken = failures.entry(rule).or_default();
    broken.count += 1;
    if broken.examples.len() < most {
        broken.examples.push((number, story()));
    }
}

fn merge(all: &mut Failures, most: usize, more: Failures) {
    for (rule, more) in more {
        let broken = all.entry(rule).or_default();
        broken.count += more.count;
        broken.examples.extend(more.examples);
        broken.examples.sort();
        broken.examples.truncate(most);
    }
}

fn add(census: &mut Census, more: &Census) {
    census.ticks += more.ticks;
    for (count, more) in census.states.iter_mut().zip(more.states) {
        *count += more;
    }
    for (count, more) in census.faults.iter_mut().zip(more.faults) {
        *count += more;
    }
}

fn season_of(seed: u64, number: u64) -> Season {
    Season::new(seed_of(seed, u64::MAX - number))
}

fn sequence_of(seed: u64, index: u64, season: &Season) -> Sequence {
    generate::sequence(&mut Rng::with_seed(seed_of(seed, index)), season)
}

/// Plays the seasons that no other thread has taken.
fn play(options: &Options, next: &AtomicU64) -> (u64, Tally, Failures) {
    let (mut ticks, mut tally, mut failures) = (0, Tally::default(), Failures::new());
    loop {
        let number = next.fetch_add(1, Ordering::Relaxed);
        let first = number * PER_SEASON;
        if first >= options.sequences {
            return (ticks, tally, failures);
        }
        let season = season_of(options.seed, number);
        for index in first..options.sequences.min(first + PER_SEASON) {
            let sequence = sequence_of(options.seed, index, &season);
            match sequence.play(&season) {
                Ok((played, seen)) => {
                    ticks += u64::from(played);
                    tally.add(&seen);
                }
                Err(failure) => {
                    ticks += u64::from(failure.tick);
                    note(
                        &mut failures,
                        options.examples,
                        failure.breach.rule,
                        index,
                        || {
                            let (smallest, _) = sequence.minimised(&season, &failure);
                            smallest.story(&season)
                        },
                    );
                }
            }
        }
    }
}

/// Lives until all threads together have had enough ticks.
fn live(options: &Options, next: &AtomicU64, ticks: &AtomicU64) -> (Census, Failures) {
    let mut hostile = Hostile::new(options.seed);
    let mut failures = Failures::new();
    while ticks.load(Ordering::Relaxed) < options.ticks {
        let before = hostile.census.ticks;
        let first = next.fetch_add(LIVES, Ordering::Relaxed);
        for life in first..first + LIVES {
            if let Err(failure) = hostile.live(life) {
                note(
                    &mut failures,
                    options.examples,
                    failure.breach.rule,
                    life,
                    || format!("{failure}\n"),
                );
            }
        }
        ticks.fetch_add(hostile.census.ticks - before, Ordering::Relaxed);
    }
    (hostile.census, failures)
}

/// Runs the same on every thread and gives what each found.
fn on_threads<T: Send>(threads: u64, work: impl Fn() -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(&work)).collect();
        running
            .into_iter()
            .map(|thread| {
                thread
                    .join()
                    .expect("panics are caught where they are checked")
            })
            .collect()
    })
}

fn print_failures(kind: &str, seed: u64, failures: &Failures) {
    for (rule, broken) in failures {
        println!("\nBROKEN {} times: {rule}", broken.count);
        for (number, story) in &broken.examples {
            println!("by --seed {seed} --{kind} {number}:\n{story}");
        }
    }
}

/// All sequences; whether every one kept every promise.
fn run_sequences(options: &Options) -> bool {
    let begun = Instant::now();
    let next = AtomicU64::new(0);
    let (mut ticks, mut tally, mut failures) = (0, Tally::default(), Failures::new());
    for (played, seen, found) in on_threads(options.threads, || play(options, &next)) {
        ticks += played;
        tally.add(&seen);
        merge(&mut failures, options.examples, found);
    }
    println!(
        "{} sequences, {ticks} ticks in {:.0} s, seed {}: {tally:?}",
        options.sequences,
        begun.elapsed().as_secs_f32(),
        options.seed,
    );
    print_failures("sequence", options.seed, &failures);
    failures.is_empty()
}

/// All hostile ticks; whether none broke a limit and every state and fault was seen.
fn run_hostile(options: &Options) -> bool {
    let begun = Instant::now();
    let (next, ticks) = (AtomicU64::new(0), AtomicU64::new(0));
    let (mut census, mut failures) = (Census::default(), Failures::new());
    for (seen, found) in on_threads(options.threads, || live(options, &next, &ticks)) {
        add(&mut census, &seen);
        merge(&mut failures, options.examples, found);
    }
    println!(
        "\n{} hostile ticks in {:.0} s, seed {}; ticks in each state, reports of each fault:",
        census.ticks,
        begun.elapsed().as_secs_f32(),
        options.seed,
    );
    for (name, count) in census.rows() {
        println!("{count:>12}  {name}");
    }
    print_failures("life", options.seed, &failures);
    let missing = census.missing();
    if !missing.is_empty() {
        println!("BROKEN: never seen: {missing:?}");
    }
    failures.is_empty() && missing.is_empty()
}

/// One sequence, made as small as it gets.
fn show_sequence(options: &Options, index: u64) -> bool {
    let season = season_of(options.seed, index / PER_SEASON);
    let sequence = sequence_of(options.seed, index, &season);
    match sequence.play(&season) {
        Ok(_) => {
            println!("{}", sequence.story(&season));
            true
        }
        Err(failure) => {
            let (smallest, failure) = sequence.minimised(&season, &failure);
            println!("BROKEN: {failure}\n{}", smallest.story(&season));
            false
        }
    }
}

fn show_life(options: &Options, life: u64) -> bool {
    match Hostile::new(options.seed).live(life) {
        Ok(()) => true,
        Err(failure) => {
            println!("BROKEN: {failure}");
            false
        }
    }
}

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    let good = match (options.sequence, options.life) {
        (Some(index), _) => show_sequence(&options, index),
        (None, Some(life)) => show_life(&options, life),
        (None, None) => {
            let promises = run_sequences(&options);
            run_hostile(&options) && promises
        }
    };
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

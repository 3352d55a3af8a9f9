//! What is proven about the image, test by test.

mod blackbox;
mod boot;
mod budget;
mod bus;
mod failsafe;
mod grasp;
mod incident;
mod storage;
mod test;
mod timing;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

use serde_json::{Value, json};

use test::{Number, Outcome, Test};

pub use test::Context;

/// The test that runs nothing.
pub const CODE: &str = budget::CODE;

/// Slow ones first, so that the processors are done at the same time.
fn tests() -> Vec<Test> {
    let mut tests = timing::TESTS.to_vec();
    tests.extend(storage::TESTS);
    tests.extend(blackbox::TESTS);
    tests.extend(bus::TESTS);
    tests.extend(grasp::TESTS);
    tests.extend(failsafe::TESTS);
    tests.extend(boot::TESTS);
    tests.extend(budget::TESTS);
    tests
}

/// What is left of a test.
struct Finished {
    test: Test,
    outcome: Outcome,
    seconds: f64,
}

/// Runs every test whose name contains `only`. Says whether all have passed.
pub fn run(context: &Context<'_>, only: Option<&str>, as_json: bool) -> anyhow::Result<bool> {
    let began = Instant::now();
    let tests: Vec<Test> = tests()
        .into_iter()
        .filter(|test| only.is_none_or(|only| test.name.contains(only)))
        .collect();
    anyhow::ensure!(
        !tests.is_empty(),
        "--only {}: no test has this in its name",
        only.unwrap_or_default()
    );
    let next = AtomicUsize::new(0);
    let finished = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(tests.len()) {
            scope.spawn(|| {
                while let Some(&test) = tests.get(next.fetch_add(1, Relaxed)) {
                    let done = finish(test, context);
                    if !as_json {
                        print!("{}", text(&done));
                    }
                    if let Ok(mut finished) = finished.lock() {
                        finished.push(done);
                    }
                }
            });
        }
    });
    let finished = finished.into_inner().unwrap_or_default();
    let failed = finished
        .iter()
        .filter(|done| !done.outcome.failures.is_empty())
        .count();
    let passed = failed == 0 && finished.len() == tests.len();
    let seconds = began.elapsed().as_secs_f64();
    if as_json {
        println!("{}", json_of(context, &finished, passed, seconds));
    } else {
        println!(
            "{} of {} passed in {seconds:.0} s",
            finished.len() - failed,
            tests.len()
        );
    }
    Ok(passed)
}

fn finish(test: Test, context: &Context<'_>) -> Finished {
    let began = Instant::now();
    let outcome = (test.run)(context).unwrap_or_else(|error| Outcome {
        failures: vec![format!("{error:#}")],
        ..Outcome::default()
    });
    Finished {
        test,
        outcome,
        seconds: began.elapsed().as_secs_f64(),
    }
}

/// A few lines about a test.
fn text(done: &Finished) -> String {
    let outcome = &done.outcome;
    let word = if outcome.failures.is_empty() {
        "ok  "
    } else {
        "FAIL"
    };
    let mut text = format!(
        "{word}  {}: {} ({:.0} s)\n",
        done.test.name, done.test.about, done.seconds
    );
    for Number {
        name,
        value,
        unit,
        limit,
    } in &outcome.numbers
    {
        let value = format!("{value:.3}");
        let value = value.trim_end_matches('0').trim_end_matches('.');
        let limit = limit.map_or(String::new(), |limit| format!(", at most {limit}"));
        text += &format!("      {name:<46} {value:>10} {unit}{limit}\n");
    }
    for note in &outcome.notes {
        text += &format!("      {note}\n");
    }
    for failure in &outcome.failures {
        text += &format!("      WRONG: {failure}\n");
    }
    text
}

fn json_of(context: &Context<'_>, finished: &[Finished], passed: bool, seconds: f64) -> Value {
    let tests: Vec<Value> = finished
        .iter()
        .map(|done| {
            let numbers: Vec<Value> = done
                .outcome
                .numbers
                .iter()
                .map(|number| {
                    json!({
                        "name": number.name,
                        "value": number.value,
                        "unit": number.unit,
                        "limit": number.limit,
                    })
                })
                .collect();
            json!({
                "name": done.test.name,
                "about": done.test.about,
                "passed": done.outcome.failures.is_empty(),
                "numbers": numbers,
                "notes": done.outcome.notes,
                "failures": done.outcome.failures,
                "seconds": done.seconds,
            })
        })
        .collect();
    json!({
        "image": context.image.path.display().to_string(),
        "passed": passed,
        "seconds": seconds,
        "tests": tests,
    })
}

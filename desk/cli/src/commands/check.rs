//! `softgrip check`: whether a gripper that has just been wired is whole.

use std::fs::File;
use std::io::{IsTerminal, Write as _, stdin};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use ::check::{Ended, Finding, Options, Person, Report, Step, Verdict, let_go, run as check};
use ::serve::stop_on_signals;
use anyhow::{Context, bail, ensure};
use clap::Args;
use watch::create::{create, ending};
use watch::{Connection, Source};

use super::output::{self, outln};
use super::source::SourceArgs;
use super::within;

#[derive(Args)]
// What the virtual gripper holds would be in the way.
#[command(mut_arg("object", |object| object.default_value("none")))]
pub struct CheckArgs {
    /// The gripper: virtual, tty:/dev/ttyUSB0 or tcp:HOST:PORT.
    #[arg(long, value_name = "SOURCE")]
    from: Source,
    /// The fingers may move, and nobody is asked: for machines. Nothing may be in the grip, and no hands.
    #[arg(long)]
    yes: bool,
    /// Highest pressure, kPa.
    #[arg(long, value_name = "KPA", default_value = "60", allow_negative_numbers = true, value_parser = within(20.0, 200.0))]
    top: f64,
    /// File for the report, FILE.md or FILE.json.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace a file that is there.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// Looks at a gripper in a second.
const LOOKS_HZ: f64 = 50.0;
/// Ctrl-C is looked at so often.
const PATIENCE: Duration = Duration::from_millis(100);
/// How often a gripper that is gone is sought, with a second in between.
const TRIES: u32 = 5;

/// How a report is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Markdown,
    Json,
}

impl Format {
    fn of(path: &Path) -> anyhow::Result<Self> {
        match ending(path).as_str() {
            "md" => Ok(Self::Markdown),
            "json" => Ok(Self::Json),
            _ => bail!("{}: must end with .md or .json", path.display()),
        }
    }
}

pub fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    ensure!(
        matches!(args.from, Source::Virtual | Source::Tty(_) | Source::Tcp(_)),
        "nothing can be wished of this source: must be virtual, tty:/dev/ttyUSB0 or tcp:HOST:PORT"
    );
    ensure!(
        args.yes || stdin().is_terminal(),
        "there is no terminal to ask for consent: run it in one, or say --yes where the fingers may move"
    );
    let format = args.out.as_deref().map(Format::of).transpose()?;
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let connection = connect(args)?;
    let file = args
        .out
        .as_deref()
        .map(|path| create(path, args.force))
        .transpose()?;
    let mut step = None;
    let mut unsaid = Ok(());
    // A terminal that is gone must not keep the pressure from being let go.
    let mut say = |finding: &Finding| {
        let is_new = step.replace(finding.step) != Some(finding.step);
        unsaid = std::mem::replace(&mut unsaid, Ok(())).and_then(|()| tell(finding, is_new));
    };
    let options = Options {
        top_kpa: args.top as f32,
    };
    let done = if args.yes {
        check(&connection, options, Person::Nobody, &stop, &mut say)
    } else {
        let mut ask = asker(Arc::clone(&stop));
        check(
            &connection,
            options,
            Person::There(&mut ask),
            &stop,
            &mut say,
        )
    };
    drop(connection);
    let mut report = match (done, &args.out) {
        (Ok(report), _) => report,
        (Err(error), path) => {
            // Nothing stands in it.
            path.as_deref().map(std::fs::remove_file).transpose()?;
            return Err(error);
        }
    };
    if report.is_under_pressure && matches!(report.ended, Ended::Gone(_)) {
        report.is_under_pressure = !seek(args);
    }
    if report.is_under_pressure {
        output::note(format_args!(
            "THERE MAY BE PRESSURE: shut the air off, and vent it, before anybody reaches in"
        ));
    }
    let saved = match (file, format, &args.out) {
        (Some(file), Some(format), Some(path)) => save(&report, format, file, path),
        _ => Ok(()),
    };
    unsaid?;
    conclude(args, &report, saved)
}

/// Writes the report; none is left where it cannot be written whole.
fn save(report: &Report, format: Format, mut file: File, path: &Path) -> anyhow::Result<()> {
    let text = match format {
        Format::Markdown => report.markdown(),
        Format::Json => format!("{:#}\n", report.json()),
    };
    let written = file.write_all(text.as_bytes());
    if written.is_err() {
        std::fs::remove_file(path).with_context(|| format!("{}: is cut off", path.display()))?;
    }
    written.with_context(|| format!("{}: cannot be written", path.display()))
}

fn connect(args: &CheckArgs) -> anyhow::Result<Connection> {
    args.source.open(&args.from, LOOKS_HZ, false, true)
}

/// Says what was found.
fn tell(finding: &Finding, is_new: bool) -> anyhow::Result<()> {
    let Finding {
        step,
        what,
        expected,
        seen,
        verdict,
        look_at,
        ..
    } = finding;
    if is_new {
        outln!("{}", Step::name(*step));
    }
    outln!(
        "  {:<9}  {what}: {seen} (expected: {expected})",
        verdict.word()
    );
    if matches!(verdict, Verdict::Failed | Verdict::Warned) && !look_at.is_empty() {
        outln!("             advice: {look_at}");
    }
    Ok(())
}

/// Asks at the terminal; Ctrl-C is heard meanwhile.
fn asker(stop: Arc<AtomicBool>) -> impl FnMut(&str) -> Option<String> {
    let (sender, lines) = mpsc::channel();
    thread::spawn(move || {
        for line in stdin().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    move |question| {
        // What was typed before is no answer.
        while lines.try_recv().is_ok() {}
        output::print(format_args!("{question}")).ok()?;
        while !stop.load(Relaxed) {
            match lines.recv_timeout(PATIENCE) {
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        None
    }
}

/// Seeks a gripper that is gone, to let its pressure go; says whether that was seen to leave.
fn seek(args: &CheckArgs) -> bool {
    if args.from == Source::Virtual {
        return false;
    }
    for _ in 0..TRIES {
        let released = connect(args).and_then(|connection| let_go(&connection));
        match released {
            Ok(true) => {
                output::note(format_args!(
                    "the pressure was let go over a new connection"
                ));
                return true;
            }
            Ok(false) => {}
            Err(error) => output::note(format_args!("the gripper is sought: {error:#}")),
        }
        thread::sleep(Duration::from_secs(1));
    }
    false
}

/// How it has ended, also where the report could not be saved.
fn conclude(
    args: &CheckArgs,
    report: &Report,
    saved: anyhow::Result<()>,
) -> anyhow::Result<ExitCode> {
    outln!("{}", report.summary());
    saved?;
    if let Some(path) = &args.out {
        outln!("the report is in {}", path.display());
    }
    Ok(match &report.ended {
        Ended::Gone(_) => ExitCode::from(2),
        _ if report.has_passed() => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    })
}

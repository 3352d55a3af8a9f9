//! `softgrip record`: what a gripper tells, into a file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use ::serve::stop_on_signals;
use anyhow::{Context, bail, ensure};
use clap::Args;
use watch::mcap_file;
use watch::recorder::{Format, Recorder};
use watch::{Connection, Source, Told};

use super::output::outln;
use super::source::SourceArgs;
use super::within;

#[derive(Args)]
pub struct RecordArgs {
    /// What is recorded: virtual, tty:/dev/ttyUSB0, tcp:HOST:PORT, defmt:- or defmt:HOST:PORT (with --elf), or the path
    /// of a recording, which is converted.
    #[arg(long, value_name = "SOURCE", required_unless_present = "recover")]
    from: Option<Source>,
    /// The recording, FILE.mcap or FILE.csv.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// How long, as 500ms, 60s, 10min or 1h [default: until Ctrl-C].
    #[arg(long = "for", value_name = "TIME", allow_hyphen_values = true, value_parser = duration)]
    length: Option<Duration>,
    /// Snapshots in a second [default: 50; 1000 for CSV, where the source has them].
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = within(0.1, 1000.0))]
    rate: Option<f64>,
    /// Replace a file that is there.
    #[arg(long)]
    force: bool,
    /// Write what is whole of a recording that was cut off, in place of recording.
    #[arg(long, value_name = "BROKEN.mcap", conflicts_with = "from")]
    recover: Option<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
}

/// Snapshots in a second, for eyes.
const EYES_HZ: f64 = 50.0;
/// Every tick's, for a trace.
const TRACE_HZ: f64 = 1000.0;
/// Ctrl-C is looked at so often.
const PATIENCE: Duration = Duration::from_millis(100);

/// Parses a time with its unit.
fn duration(text: &str) -> anyhow::Result<Duration> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit_s = match &text[digits.len()..] {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => bail!("must have a unit, as in 500ms, 60s, 10min or 1h"),
    };
    let number: f64 = digits.parse().context("must begin with a number")?;
    let length = Duration::try_from_secs_f64(number * unit_s);
    length
        .ok()
        .filter(|length| !length.is_zero())
        .context("must be a time above 0")
}

pub fn run(args: &RecordArgs) -> anyhow::Result<ExitCode> {
    match (&args.recover, &args.from) {
        (Some(broken), _) => recover(args, broken),
        (None, Some(source)) => record(args, source),
        (None, None) => bail!("say what is to be recorded: --from"),
    }
}

fn recover(args: &RecordArgs, broken: &Path) -> anyhow::Result<ExitCode> {
    let name = args.out.display();
    ensure!(
        Format::of(&args.out)? == Format::Mcap,
        "{name}: what is whole of an MCAP file is one, too: must end with .mcap"
    );
    ensure_apart(broken, &args.out)?;
    let read = mcap_file::recover(broken, &args.out, args.force)?;
    let missing = read.missing.unwrap_or("nothing is missing".into());
    outln!(
        "{} messages of {} are in {name}; {missing}",
        read.messages,
        broken.display(),
    );
    Ok(ExitCode::SUCCESS)
}

/// Whoever writes a file empties it first, so it cannot be the one that is read.
fn ensure_apart(read: &Path, written: &Path) -> anyhow::Result<()> {
    let is_same = match (read.canonicalize(), written.canonicalize()) {
        (Ok(read), Ok(written)) => read == written,
        _ => false,
    };
    ensure!(
        !is_same,
        "{}: is what is to be read: --out must name another file",
        written.display()
    );
    Ok(())
}

/// Whether a recording can be converted with these options.
fn ensure_convertible(args: &RecordArgs, path: &Path) -> anyhow::Result<()> {
    for (option, is_there) in [
        ("--rate", args.rate.is_some()),
        ("--for", args.length.is_some()),
    ] {
        ensure!(
            !is_there,
            "{option}: is for a gripper that tells something now; the recording {} is converted as it is",
            path.display()
        );
    }
    ensure_apart(path, &args.out)
}

/// What has been recorded.
#[derive(Default)]
struct Count {
    snapshots: u64,
    ticks: u64,
    events: u64,
}

/// Why nothing more is recorded.
enum End {
    /// The source has nothing more.
    Ended,
    /// The time is over, or the user has ended it.
    Enough,
    /// Something is wrong.
    Failed(String),
}

fn record(args: &RecordArgs, source: &Source) -> anyhow::Result<ExitCode> {
    let format = Format::of(&args.out)?;
    let is_conversion = matches!(source, Source::File(_));
    if let Source::File(path) = source {
        ensure_convertible(args, path)?;
    }
    let is_line = matches!(source, Source::Tty(_) | Source::Tcp(_));
    let rate_hz = args.rate.unwrap_or(match format {
        Format::Csv if !is_line => TRACE_HZ,
        Format::Csv | Format::Mcap => EYES_HZ,
    });
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let connection = args
        .source
        .open(source, rate_hz, format == Format::Mcap, false)?;
    let mut recorder = Recorder::new(&args.out, args.force)?;
    let name = args.out.display();
    let began = Instant::now();
    let mut count = Count::default();
    let end = take(args, &connection, &mut recorder, &mut count, &stop);
    // Also where nobody could be told of it.
    let finished = recorder.finish();
    let finished = finished.with_context(|| format!("{name}: cannot be written"));
    let end = end.and_then(|end| finished.map(|()| end));
    let has_all = format == Format::Mcap || count.snapshots > 0;
    if is_conversion && !(has_all && matches!(end, Ok(End::Ended))) {
        // A part would look like the whole.
        std::fs::remove_file(&args.out).with_context(|| format!("{name}: cannot be removed"))?;
        match end? {
            End::Failed(why) => bail!("{why}"),
            End::Ended => bail!(
                "{}: has no snapshots, and a CSV file nothing else",
                connection.name
            ),
            End::Enough => bail!("{name}: ended before it was whole, and removed"),
        }
    }
    let end = end?;
    tell(args, format, &count, began.elapsed())?;
    match end {
        End::Failed(why) => bail!("{why}"),
        End::Ended | End::Enough => Ok(ExitCode::SUCCESS),
    }
}

/// Records until nothing more is to come.
fn take(
    args: &RecordArgs,
    connection: &Connection,
    recorder: &mut Recorder,
    count: &mut Count,
    stop: &AtomicBool,
) -> anyhow::Result<End> {
    let name = args.out.display();
    outln!("recording {} to {name}; Ctrl-C ends it", connection.name);
    let began = Instant::now();
    loop {
        let is_long_enough = args.length.is_some_and(|length| began.elapsed() >= length);
        if stop.load(Relaxed) || is_long_enough {
            return Ok(End::Enough);
        }
        let told = match connection.told.recv_timeout(PATIENCE) {
            Ok(told) => told,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => {
                let why = "the source has stopped at an error of this program";
                return Ok(End::Failed(why.into()));
            }
        };
        recorder
            .add(&told)
            .with_context(|| format!("{name}: cannot be written"))?;
        match told {
            Told::Observation(_) => count.snapshots += 1,
            Told::Tick(_) => count.ticks += 1,
            Told::Event(event) => {
                count.events += 1;
                outln!("{:9.3} s  {}", event.t_s, event.text);
            }
            Told::Note(text) => outln!("{text}"),
            Told::Failed(why) => return Ok(End::Failed(why)),
            Told::Ended(_) => return Ok(End::Ended),
            Told::Provenance(_) | Told::Settings(_) => {}
        }
    }
}

/// What has been recorded, and how large it is.
fn tell(args: &RecordArgs, format: Format, count: &Count, length: Duration) -> anyhow::Result<()> {
    let name = args.out.display();
    let megabytes = 1e-6 * std::fs::metadata(&args.out)?.len() as f64;
    let Count {
        snapshots,
        ticks,
        events,
    } = count;
    let ticks_kept = match format {
        Format::Mcap => format!(", {ticks} ticks"),
        Format::Csv => String::new(),
    };
    outln!(
        "{name}: {snapshots} snapshots{ticks_kept} and {events} events in {:.1} s; {megabytes:.3} MB",
        length.as_secs_f64(),
    );
    if format == Format::Csv && *ticks > 0 {
        outln!("{ticks} ticks were left out: a CSV file has snapshots alone");
    }
    Ok(())
}

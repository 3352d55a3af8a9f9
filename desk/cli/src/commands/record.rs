//! `softgrip record`: what a gripper tells, into a file, or to Foxglove while it comes.

use std::net::SocketAddr;
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

use super::output::{note, outln};
use super::source::SourceArgs;
use super::{address, within};

#[derive(Args)]
pub struct RecordArgs {
    /// What is recorded: virtual, tty:/dev/ttyUSB0, tcp:HOST:PORT, defmt:-, defmt:HOST:PORT, probe or probe:CHIP (with
    /// --elf), or the path of a recording, which is converted.
    #[arg(long, value_name = "SOURCE", required_unless_present = "recover")]
    from: Option<Source>,
    /// The recording, FILE.mcap or FILE.csv.
    #[arg(long, value_name = "FILE", required_unless_present = "live")]
    out: Option<PathBuf>,
    /// Serve the same to Foxglove while it comes (ws://…), with or without a file; port 0 is any that is free. Needs a program
    /// that is built with --features live.
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8765", value_parser = address)]
    live: Option<SocketAddr>,
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
    #[arg(long, value_name = "BROKEN.mcap", conflicts_with_all = ["from", "live"])]
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
    match (&args.recover, &args.out, &args.from) {
        (Some(broken), Some(out), _) => recover(args, broken, out),
        (Some(_), None, _) => bail!("say where it is to be written: --out"),
        (None, _, Some(source)) => record(args, source),
        (None, _, None) => bail!("say what is to be recorded: --from"),
    }
}

fn recover(args: &RecordArgs, broken: &Path, out: &Path) -> anyhow::Result<ExitCode> {
    let name = out.display();
    ensure!(
        Format::of(out)? == Format::Mcap,
        "{name}: what is whole of an MCAP file is one, too: must end with .mcap"
    );
    ensure_apart(broken, out)?;
    let read = mcap_file::recover(broken, out, args.force)?;
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

/// Whether a recording can be read with these options.
fn ensure_readable(args: &RecordArgs, path: &Path) -> anyhow::Result<()> {
    for (option, is_there) in [
        ("--rate", args.rate.is_some()),
        ("--for", args.length.is_some() && args.live.is_none()),
    ] {
        ensure!(
            !is_there,
            "{option}: is for a gripper that tells something now; the recording {} is converted as it is",
            path.display()
        );
    }
    let out = args.out.as_deref();
    out.map_or(Ok(()), |out| ensure_apart(path, out))
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
    let format = args.out.as_deref().map(Format::of).transpose()?;
    if let Source::File(path) = source {
        ensure_readable(args, path)?;
    }
    let is_line = matches!(source, Source::Tty(_) | Source::Tcp(_));
    let rate_hz = args.rate.unwrap_or(match format {
        Some(Format::Csv) if !is_line => TRACE_HZ,
        Some(Format::Csv | Format::Mcap) | None => EYES_HZ,
    });
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let mut recorders = Vec::new();
    if let Some(address) = args.live {
        recorders.push(live(address)?);
    }
    let with_ticks = format == Some(Format::Mcap) || args.live.is_some();
    // Nobody can watch a recording as fast as it is read.
    let in_real_time = args.live.is_some();
    let connection = args
        .source
        .open(source, rate_hz, with_ticks, in_real_time)?;
    if let Some(out) = &args.out {
        recorders.push(Recorder::new(out, args.force)?);
    }
    let began = Instant::now();
    let mut count = Count::default();
    let end = take(args, &connection, &mut recorders, &mut count, &stop);
    // All of them, also where nobody could be told of it.
    let finished = recorders.into_iter().map(Recorder::finish);
    let finished = finished.fold(Ok(()), anyhow::Result::and);
    let end = end.and_then(|end| written(args, finished).map(|()| end));
    let is_conversion = matches!(source, Source::File(_)) && args.live.is_none();
    let has_all = format != Some(Format::Csv) || count.snapshots > 0;
    let is_whole = has_all && matches!(end, Ok(End::Ended));
    if let (true, false, Some(out)) = (is_conversion, is_whole, &args.out) {
        // A part would look like the whole.
        let name = out.display();
        std::fs::remove_file(out).with_context(|| format!("{name}: cannot be removed"))?;
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

/// Names the file of what went wrong in writing it.
fn written(args: &RecordArgs, result: anyhow::Result<()>) -> anyhow::Result<()> {
    let out = args.out.as_deref().unwrap_or(Path::new("")).display();
    result.with_context(|| format!("{out}: cannot be written"))
}

/// Records until nothing more is to come.
fn take(
    args: &RecordArgs,
    connection: &Connection,
    recorders: &mut [Recorder],
    count: &mut Count,
    stop: &AtomicBool,
) -> anyhow::Result<End> {
    if let Some(out) = &args.out {
        let (from, to) = (&connection.name, out.display());
        outln!("recording {from} to {to}; Ctrl-C ends it");
    }
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
        for recorder in &mut *recorders {
            written(args, recorder.add(&told))?;
        }
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

/// Serves at an address, and says how it is reached.
fn live(address: SocketAddr) -> anyhow::Result<Recorder> {
    let (live, address) = Recorder::live(address)?;
    outln!(
        "live at ws://{address}, for Foxglove's connection \"Foxglove WebSocket\"; Ctrl-C ends it"
    );
    if !address.ip().is_loopback() {
        note(format_args!(
            "{address}: whoever reaches this address can watch"
        ));
    }
    Ok(live)
}

/// What has been recorded, and how large it is.
fn tell(
    args: &RecordArgs,
    format: Option<Format>,
    count: &Count,
    length: Duration,
) -> anyhow::Result<()> {
    let Count {
        snapshots,
        ticks,
        events,
    } = count;
    let length_s = length.as_secs_f64();
    let has_ticks = format != Some(Format::Csv);
    let told = match has_ticks {
        true => {
            format!("{snapshots} snapshots, {ticks} ticks and {events} events in {length_s:.1} s")
        }
        false => format!("{snapshots} snapshots and {events} events in {length_s:.1} s"),
    };
    match &args.out {
        Some(out) => {
            let megabytes = 1e-6 * std::fs::metadata(out)?.len() as f64;
            outln!("{}: {told}; {megabytes:.3} MB", out.display());
        }
        None => outln!("{told}"),
    }
    if !has_ticks && *ticks > 0 {
        outln!("{ticks} ticks were left out: a CSV file has snapshots alone");
    }
    Ok(())
}

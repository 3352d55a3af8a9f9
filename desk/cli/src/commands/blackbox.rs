//! `softgrip blackbox`: what a gripper has kept of the last seconds before its first loss or fault.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::serve::master::Master;
use ::serve::readout::{self, Readout};
use anyhow::{Context, bail};
use clap::Args;
use report::recent;
use sim::trace::COLUMNS;
use watch::create::{create, ending};
use watch::recorder::Recorder;
use watch::told::EventTold;
use watch::{Observation, Source, Told};

use super::output::outln;

#[derive(Args)]
#[command(group = clap::ArgGroup::new("gripper").required(true))]
pub struct BlackboxArgs {
    /// The gripper: tty:/dev/ttyUSB0 or tcp:HOST:PORT.
    #[arg(long, value_name = "SOURCE", group = "gripper")]
    from: Option<Source>,
    /// Serial port of the gripper.
    #[arg(long, value_name = "PATH", group = "gripper")]
    tty: Option<PathBuf>,
    /// RTU frames over TCP, as `softgrip serve --tcp` has them.
    #[arg(long, value_name = "ADDRESS:PORT", group = "gripper")]
    tcp: Option<String>,
    /// Baud rate of the serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200)]
    baud: u32,
    /// The gripper's id on the bus.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u8).range(1..=247))]
    id: u8,
    /// File for the trace: FILE.csv or FILE.mcap, which `softgrip replay` takes, or a picture, FILE.svg.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace a file that is there.
    #[arg(long)]
    force: bool,
    /// Clear the black box once it has been read, so that it runs again.
    #[arg(long)]
    clear: bool,
}

pub fn run(args: &BlackboxArgs) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.out {
        kind_of(path)?;
    }
    let mut master = match (&args.from, &args.tty, &args.tcp) {
        (Some(Source::Tty(path)), ..) | (_, Some(path), _) => {
            Master::open(path, args.baud, args.id)?
        }
        (Some(Source::Tcp(address)), ..) | (.., Some(address)) => {
            Master::connect(address, args.id)?
        }
        _ => bail!(
            "--from: a black box is read over the bus: must be tty:/dev/ttyUSB0 or tcp:HOST:PORT"
        ),
    };
    let Some(readout) = readout::read(&mut master)? else {
        outln!("the black box runs: no loss and no fault since it was cleared");
        return Ok(ExitCode::SUCCESS);
    };
    let when = readout
        .at_s
        .map_or("before its last restart".into(), |at_s| {
            format!("{at_s:.3} s after its start")
        });
    outln!("{}, {when}", readout.what);
    if let Some(came_s) = readout.came_s {
        outln!(
            "{} ticks, in which it came at {came_s:.3} s",
            readout.rows.len()
        );
    } else {
        outln!("{} ticks up to it", readout.rows.len());
    }
    if let Some(path) = &args.out {
        write(path, &readout, args.force)?;
        outln!("trace: {}", path.display());
    }
    if args.clear {
        readout::clear(&mut master)?;
        outln!("cleared: it runs again");
    }
    Ok(ExitCode::SUCCESS)
}

/// What a file is to be.
enum Kind {
    Csv,
    Mcap,
    Svg,
}

/// By the end of its name.
fn kind_of(path: &Path) -> anyhow::Result<Kind> {
    match ending(path).as_str() {
        "csv" => Ok(Kind::Csv),
        "mcap" => Ok(Kind::Mcap),
        "svg" => Ok(Kind::Svg),
        _ => bail!("{}: must end with .csv, .mcap or .svg", path.display()),
    }
}

fn write(path: &Path, readout: &Readout, may_replace: bool) -> anyhow::Result<()> {
    let cannot = || format!("{}: cannot be written", path.display());
    let put = |text: &str| {
        let written = create(path, may_replace)?.write_all(text.as_bytes());
        written.with_context(cannot)
    };
    match kind_of(path)? {
        Kind::Csv => put(&csv(readout)),
        Kind::Svg => put(&svg(readout)?),
        Kind::Mcap => {
            let mut recorder = Recorder::new(path, may_replace)?;
            let mut all = told(readout).into_iter();
            let added = all.try_for_each(|told| recorder.add(&told));
            added.and_then(|()| recorder.finish()).with_context(cannot)
        }
    }
}

/// As a picture.
fn svg(readout: &Readout) -> anyhow::Result<String> {
    let ticks = readout.rows.iter().map(|row| recent::Tick {
        t_s: row.t_s,
        strain_ue: row.strain_ue.map(f64::from),
        pressure_kpa: row.pressure_kpa.into(),
        commanded_kpa: row.commanded_kpa.into(),
    });
    let ticks: Vec<_> = ticks.collect();
    recent::svg(&readout.what, &ticks, readout.came_s)
}

/// As what is told of a gripper.
fn told(readout: &Readout) -> Vec<Told> {
    let rows = readout.rows.iter().map(|row| {
        Told::Observation(Box::new(Observation {
            t_s: Some(row.t_s),
            strain_ue: row.strain_ue.map(Some),
            pressure_kpa: Some(row.pressure_kpa),
            // What was asked for is not kept; the regulator was told nearly that.
            setpoint_kpa: Some(row.commanded_kpa),
            commanded_kpa: Some(row.commanded_kpa),
            ..Observation::default()
        }))
    });
    let end_s = readout.rows.last().map_or(0.0, |row| row.t_s);
    let what = Told::Event(EventTold {
        t_s: readout.came_s.unwrap_or(end_s),
        name: "black_box".into(),
        text: readout.what.clone(),
    });
    rows.chain([what]).collect()
}

/// As a trace.
fn csv(readout: &Readout) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for row in &readout.rows {
        let strains: String = row.strain_ue.iter().map(|ue| format!("{ue:.1},")).collect();
        let (t_s, pressure, command) = (row.t_s, row.pressure_kpa, row.commanded_kpa);
        writeln!(text, "{t_s:.3},{strains}{pressure:.3},{command:.3}")
            .expect("a string takes anything");
    }
    text
}

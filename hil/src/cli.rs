//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use report::{files, json, plot, side_view, words};
use sim::run::Run;
use sim::scenario::{ObjectKind, Scenario};
use sim::trace;
use softgrip::settings::{FACTORY, Settings};

use crate::bench;
use crate::closed_loop::{self, Closed};
use crate::image::{self, Image};
use crate::suite;

/// Runs the firmware's image on an emulated microcontroller. Without a command: everything that is to be
/// proven about it.
///
/// Exits with 1 if something does not hold.
#[derive(Parser)]
#[command(name = "cargo hil --", version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    suite: SuiteArgs,
}

#[derive(Subcommand)]
enum Action {
    /// One pick-and-place: the same trace, pictures and verdicts as `softgrip sim`, from the image.
    Run(RunArgs),
    /// Reads the machine code of an image for any board, and runs nothing: no panic in reach of the control tick, and a
    /// step that is not longer or shorter than that of the emulated board.
    Code(ImageArgs),
}

#[derive(Args)]
struct ImageArgs {
    /// An image that is built already [default: builds it].
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
}

#[derive(Args)]
struct SuiteArgs {
    #[command(flatten)]
    image: ImageArgs,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Only the tests whose names contain this.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Virtual time of the endurance test; it passes the end of a 32-bit clock after half a minute.
    #[arg(long, value_name = "H", default_value_t = 0.1, allow_negative_numbers = true, value_parser = within(0.02, 1_000.0))]
    hours: f64,
    /// Take what is measured into hil/budgets.toml.
    #[arg(long)]
    write_budgets: bool,
}

#[derive(Args)]
struct RunArgs {
    #[command(flatten)]
    image: ImageArgs,
    /// What to pick up.
    #[arg(long, default_value = "sphere", value_parser = object())]
    object: ObjectKind,
    /// Its mass.
    #[arg(long, value_name = "KG", default_value_t = 0.15, allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: f64,
    /// Greatest acceleration of the arm.
    #[arg(long, value_name = "M_S2", default_value_t = 5.0, allow_negative_numbers = true, value_parser = within(0.1, 50.0))]
    accel: f64,
    /// Friction coefficient between fingers and object.
    #[arg(long, value_name = "MU", default_value_t = 0.8, allow_negative_numbers = true, value_parser = within(0.0, 2.0))]
    friction: f64,
    /// Noise of the gauges, rms at the control tick.
    #[arg(long, value_name = "UE", default_value_t = 20.0, allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: f64,
    /// Seed of all noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// When to stop, as in `6s` or `1500ms` [default: when the arm is done].
    #[arg(long, value_name = "TIME", value_parser = milliseconds)]
    until: Option<u64>,
    /// Directory for the files [default: out, or none with --json].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// A file for the bytes that came over RTT, as `softgrip record --from defmt:-` takes them.
    #[arg(long, value_name = "FILE")]
    rtt: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Parses the kind of an object.
fn object() -> impl TypedValueParser<Value = ObjectKind> {
    PossibleValuesParser::new(ObjectKind::ALL.map(ObjectKind::name)).try_map(|name| name.parse())
}

/// Parses a number and refuses one outside its range.
fn within(min: f64, max: f64) -> impl Fn(&str) -> anyhow::Result<f64> + Clone {
    move |text| {
        let value: f64 = text.parse().context("must be a number")?;
        anyhow::ensure!(
            (min..=max).contains(&value),
            "must lie within {min} and {max}"
        );
        Ok(value)
    }
}

/// Parses a time with its unit.
fn milliseconds(text: &str) -> anyhow::Result<u64> {
    let (number, unit_ms) = match text.strip_suffix("ms") {
        Some(number) => (number, 1.0),
        None => (
            text.strip_suffix('s')
                .context("must be a time with its unit, as in 6s or 1500ms")?,
            1e3,
        ),
    };
    let time: f64 = number.parse().context("must be a number with s or ms")?;
    let ms = time * unit_ms;
    anyhow::ensure!((1.0..=3.6e6).contains(&ms), "must lie within 1ms and 3600s");
    Ok(ms as u64)
}

impl ImageArgs {
    /// The image's path.
    fn path(&self) -> anyhow::Result<PathBuf> {
        match &self.image {
            Some(path) => Ok(path.clone()),
            None => image::build(),
        }
    }

    /// One for the chip that is emulated.
    fn read(&self) -> anyhow::Result<Image> {
        let image = Image::read(&self.path()?)?;
        bench::find_tick(&image)?;
        Ok(image)
    }
}

/// Does what was asked for.
pub fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    match &cli.action {
        Some(Action::Run(args)) => one(args),
        Some(Action::Code(args)) => {
            let image = Image::read_for_any_board(&args.path()?)?;
            let context = suite::Context {
                image: &image,
                hours: 0.0,
                write_budgets: false,
            };
            let passed = suite::run(&context, Some(suite::CODE), false)?;
            Ok(ExitCode::from(u8::from(!passed)))
        }
        None => {
            let args = &cli.suite;
            let image = args.image.read()?;
            let context = suite::Context {
                image: &image,
                hours: args.hours,
                write_budgets: args.write_budgets,
            };
            let passed = suite::run(&context, args.only.as_deref(), args.json)?;
            Ok(ExitCode::from(u8::from(!passed)))
        }
    }
}

fn one(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let dir = match (&args.out, args.json) {
        (Some(dir), _) => Some(dir.clone()),
        (None, false) => Some("out".into()),
        (None, true) => None,
    };
    if let Some(dir) = &dir {
        files::prepare(dir)?;
    }
    let image = args.image.read()?;
    let scenario = Scenario {
        object: args.object,
        mass_kg: args.mass,
        accel_m_s2: args.accel,
        friction: args.friction,
        noise_ue: args.noise,
        seed: args.seed,
        // The digital input knows no other.
        pressure_kpa: Settings::of(&FACTORY).grip.grip_pressure_kpa.into(),
    };
    let closed = closed_loop::run(&image, &scenario, args.until)?;
    if let Some(path) = &args.rtt {
        std::fs::write(path, &closed.record.rtt).with_context(|| path.display().to_string())?;
    }
    let Closed { run, replay, .. } = closed;
    if args.json {
        println!("{}", json::run(&run));
    } else {
        println!("{}", words::timeline(&run));
    }
    let runs = [run];
    if let Some(dir) = &dir {
        files::write(dir, "trace.csv", &trace::of_runs(&runs)?)?;
        files::write(dir, "trace.svg", plot::grasp(&runs)?.as_bytes())?;
        let (_, grasp) = closed_loop::fingers()?;
        let film = side_view::film(grasp, &runs);
        files::write(dir, "grasp.svg", film.as_bytes())?;
        if !args.json {
            println!(
                "pictures and trace: {0}/trace.svg, {0}/grasp.svg, {0}/trace.csv",
                dir.display()
            );
        }
    }
    let mistakes: Vec<String> = runs
        .iter()
        .filter_map(Run::mistake)
        .chain(replay.differences)
        .collect();
    for mistake in &mistakes {
        eprintln!("softgrip-hil: {mistake}");
    }
    Ok(ExitCode::from(u8::from(!mistakes.is_empty())))
}

//! The subcommands: their arguments, progress and exit status.

#[cfg(unix)]
pub mod blackbox;
pub mod calibrate;
pub mod capability;
#[cfg(unix)]
pub mod check;
pub mod diff;
pub mod evaluate;
pub mod fit;
pub mod gauge;
pub mod output;
#[cfg(unix)]
pub mod panel;
#[cfg(unix)]
pub mod record;
pub mod registers;
pub mod replay;
pub mod section;
#[cfg(unix)]
pub mod serve;
pub mod settings;
pub mod sim;
#[cfg(unix)]
pub mod source;
pub mod study;
pub mod sweep;
pub mod table;
pub mod telemetry;

#[cfg(unix)]
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::sim::run;
use ::sim::scenario::ObjectKind;
use ::sim::setup::Setup;
use anyhow::{Context, ensure};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use finger::recipe::{self, Recipe};
use indicatif::{ProgressBar, ProgressStyle};
use report::files;
use report::parts::Parts;
use report::provenance::Build;
use softgrip::FINGERS;
use softgrip::table::{FINGER, FingerTable};

/// The options `--out` and `--json` that commands share.
#[derive(Args, Default)]
struct Output {
    /// Directory for the files [default: out, or none with --json].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Output {
    /// The directory for the files, once it is sure that they can be written there.
    fn directory(&self) -> anyhow::Result<Option<&Path>> {
        let dir = match (&self.out, self.json) {
            (Some(dir), _) => dir.as_path(),
            (None, false) => Path::new("out"),
            (None, true) => return Ok(None),
        };
        files::prepare(dir)?;
        Ok(Some(dir))
    }
}

/// The option `--finger-seed` of commands that simulate the gripper.
#[derive(Args, Default)]
struct Castings {
    /// Seed of the fingers' tolerances: dimensions, rubber and gauge of each finger are a little off, and the
    /// controller keeps the recipe's table. 0: all are the recipe's.
    #[arg(long, value_name = "N", default_value = "0")]
    finger_seed: u64,
}

/// The option `--settings` of commands that run the controller.
#[derive(Args, Default)]
struct Controls {
    /// The controller's settings (TOML, as `softgrip settings print` writes it); what it does not state is the
    /// fingers' default.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

impl Controls {
    /// What the file states, by number; nothing without a file.
    fn stated(&self, table: &FingerTable) -> anyhow::Result<Vec<(u16, f32)>> {
        match &self.settings {
            Some(path) => Ok(::settings::file::read(path, table.max_pressure_kpa)?),
            None => Ok(Vec::new()),
        }
    }

    /// Tells a setup what the file states.
    fn apply(&self, setup: &mut Setup) -> anyhow::Result<()> {
        setup.state(self.stated(setup.table())?)
    }
}

/// This program, in the results that it writes.
const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: env!("SOFTGRIP_COMMIT"),
};

/// What every merge of parts takes.
#[derive(Args)]
struct Merge {
    /// The common directory of all parts: the --out that they had.
    dir: PathBuf,
    /// Directory for the merged files [default: DIR].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Merge {
    /// Where the merged files go, ready to be written to.
    fn prepare_out(&self) -> anyhow::Result<&Path> {
        let out = self.out.as_ref().unwrap_or(&self.dir);
        files::prepare(out)?;
        Ok(out)
    }
}

/// Says on standard error which parts of a study are missing, unfinished or of another study, and on standard output
/// which are to be run; none if all are there.
///
/// The status is 3 if running those is enough, and 2 if there are parts of something else.
fn incomplete(dir: &Path, parts: &Parts) -> anyhow::Result<Option<ExitCode>> {
    let problems = &parts.problems;
    if problems.lines.is_empty() {
        return Ok(None);
    }
    for line in &problems.lines {
        output::note(format_args!("{line}"));
    }
    if !problems.to_run.is_empty() {
        output::outln!("{}", problems.array());
    }
    let dir = dir.display();
    Ok(Some(match problems.foreign {
        true => {
            output::note(format_args!("{dir}: remove the foreign parts"));
            ExitCode::from(2)
        }
        false => {
            output::note(format_args!(
                "{dir}: run the parts above again, and merge then"
            ));
            ExitCode::from(3)
        }
    }))
}

/// The finger of a file, or the one that everything is about.
fn load_recipe(path: Option<&Path>) -> anyhow::Result<Recipe> {
    let name = path.unwrap_or(Path::new("recipes/rtv225.toml"));
    let recipe = match path {
        Some(path) => recipe::load(path)?,
        None => recipe::parse(name, include_str!("../../../../recipes/rtv225.toml"))?,
    };
    let fingers = recipe.grasp.map_or(3, |grasp| grasp.fingers);
    ensure!(
        fingers == FINGERS,
        "{}: {fingers} fingers, and this program is built for {FINGERS}: build it with SOFTGRIP_RECIPE={0}, or name another \
         recipe",
        name.display()
    );
    Ok(recipe)
}

/// The controller's table of the finger of a file, or the one that is built in.
fn load_table(path: Option<&Path>) -> anyhow::Result<&'static FingerTable> {
    match path {
        Some(path) => run::table_of(&load_recipe(Some(path))?),
        None => Ok(&FINGER),
    }
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

/// Parses where a port is served.
#[cfg(unix)]
fn address(text: &str) -> anyhow::Result<SocketAddr> {
    let address = text.parse().ok();
    address.context("must be an IP address and a port, as in 127.0.0.1:8080")
}

/// Does something that is parallel with so many threads, or as many as there are processors.
fn in_parallel<T: Send>(jobs: Option<u16>, work: impl FnOnce() -> T + Send) -> anyhow::Result<T> {
    let threads = jobs.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    Ok(pool.install(work))
}

/// A bar on standard error, if that is a terminal.
fn progress_bar(length: u64, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template("{pos} of {len} {msg} {wide_bar} {eta}") {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar
}

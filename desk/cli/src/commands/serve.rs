//! `softgrip serve`: a virtual gripper for robots' programs.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc;
use std::thread;

use ::serve::play::Play;
use ::serve::port::Port;
use ::serve::run::{self, Line, Options, Summary};
use ::serve::twin::Twin;
use ::serve::{script, stop_on_signals};
use anyhow::Context;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use sim::scenario::ObjectKind;
use sim::setup::Setup;

use super::output::{self, outln};
use super::{Castings, Controls, load_recipe, within};

/// Lines of the log that wait for a terminal that does not take them.
const LINES: usize = 1000;

#[derive(Args)]
pub struct ServeArgs {
    /// Link to the pseudo-terminal, which has another name at each start [default: no link; its name is printed].
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    tty: Option<PathBuf>,
    /// Serve RTU frames over TCP at this address in place of a pseudo-terminal; port 0 is any that is free.
    #[arg(long, value_name = "ADDRESS:PORT")]
    tcp: Option<SocketAddr>,
    /// Object between the fingers.
    #[arg(long, default_value = "sphere", value_parser = object_or_none())]
    object: Chosen,
    /// Mass of the object.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: Option<f64>,
    /// What happens, and when (TOML, docs/virtual-gripper.md) [default: nothing but what the robot asks for].
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// How much faster than real time it runs.
    #[arg(long, value_name = "X", default_value = "1", allow_negative_numbers = true, value_parser = within(0.1, 100.0))]
    speed: f64,
    /// Noise of the gauges, µε rms at the control tick.
    #[arg(long, value_name = "UE", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: Option<f64>,
    /// Seed of all noise.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
}

/// An object, or none.
#[derive(Clone, Copy)]
pub(super) struct Chosen(pub(super) Option<ObjectKind>);

/// Parses the kind of an object, or none.
pub(super) fn object_or_none() -> impl TypedValueParser<Value = Chosen> {
    let names = ObjectKind::ALL.map(ObjectKind::name).into_iter();
    PossibleValuesParser::new(names.chain(["none"])).try_map(|name| match name.as_str() {
        "none" => Ok(Chosen(None)),
        name => name.parse().map(|kind| Chosen(Some(kind))),
    })
}

pub fn run(args: &ServeArgs) -> anyhow::Result<ExitCode> {
    let setup = setup(args)?;
    let twin = Twin::new(&setup, args.object.0.is_some())?;
    let play = match &args.script {
        Some(path) => {
            let script = script::read(path)?;
            let checked = twin.check(&script);
            checked.with_context(|| path.display().to_string())?;
            Some(Play::new(script, &setup.gripper))
        }
        None => None,
    };
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let port = match args.tcp {
        Some(address) => Port::tcp(address)?,
        None => Port::tty(args.tty.as_deref())?,
    };
    outln!(
        "serving on {}: Modbus RTU, id {}; Ctrl-C ends it",
        port.name(),
        twin.id()
    );
    let options = Options {
        speed: args.speed,
        play,
        orders: None,
    };
    let (sender, lines) = mpsc::sync_channel(LINES);
    let gripper = thread::spawn(move || {
        let mut unsaid = 0_u64;
        // It waits for nobody who reads the log.
        let mut log = |line| unsaid += u64::from(sender.try_send(line).is_err());
        let summary = run::run(port, twin, options, &stop, &mut log, &mut |_| {});
        (summary, unsaid)
    });
    for Line { t_s, text } in lines {
        outln!("{t_s:9.3} s  {text}");
    }
    let Ok((summary, unsaid)) = gripper.join() else {
        anyhow::bail!("the virtual gripper has stopped at an error of this program");
    };
    tell(&summary, unsaid)?;
    Ok(ExitCode::SUCCESS)
}

/// All parameters of the gripper.
fn setup(args: &ServeArgs) -> anyhow::Result<Setup> {
    let recipe = load_recipe(args.recipe.as_deref())?;
    let mut setup = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    args.controls.apply(&mut setup)?;
    let scenario = &mut setup.scenario;
    scenario.object = args.object.0.unwrap_or(scenario.object);
    scenario.mass_kg = args.mass.unwrap_or(scenario.mass_kg);
    scenario.noise_ue = args.noise.unwrap_or(scenario.noise_ue);
    scenario.seed = args.seed.unwrap_or(scenario.seed);
    Ok(setup)
}

/// How it went.
fn tell(summary: &Summary, unsaid: u64) -> anyhow::Result<()> {
    outln!(
        "{} ticks, {} of them late, the worst by {:.1} ms; {} answers",
        summary.ticks,
        summary.late,
        1e3 * summary.worst.as_secs_f64(),
        summary.answers
    );
    if !summary.lost.is_zero() {
        outln!(
            "the gripper's clock stood still for {:.1} s: this machine was too slow",
            summary.lost.as_secs_f64()
        );
    }
    if unsaid > 0 {
        output::note(format_args!(
            "{unsaid} lines of the log were not read in time"
        ));
    }
    Ok(())
}

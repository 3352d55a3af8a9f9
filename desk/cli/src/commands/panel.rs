//! `softgrip panel`: a gripper on a page in the browser.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use ::panel::hand::Hand;
use ::panel::server::Server;
use ::serve::stop_on_signals;
use anyhow::Context;
use clap::Args;
use sim::setup::Setup;
use watch::source::Virtual;
use watch::{Options, Source};

use super::output::{note, outln};
use super::serve::{Chosen, object_or_none};
use super::{Castings, Controls, load_recipe, within};

/// Observations in a second: as many as a page shows.
const RATE_HZ: f64 = 50.0;

#[derive(Args)]
pub struct PanelArgs {
    /// Where the gripper is: virtual, tty:/dev/ttyUSB0, tcp:HOST:PORT.
    #[arg(long, value_name = "SOURCE", default_value = "virtual")]
    from: Source,
    /// Address and port of the page; port 0 is any that is free. Others than this machine reach it only at another
    /// address than the loopback one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Baud rate of a serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200)]
    baud: u32,
    /// The gripper's id on the bus.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u8).range(1..=247))]
    id: u8,
    /// Object between the fingers of the virtual gripper.
    #[arg(long, default_value = "sphere", value_parser = object_or_none())]
    object: Chosen,
    /// Mass of the object.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: Option<f64>,
    /// Noise of the virtual gauges, µε rms at the control tick.
    #[arg(long, value_name = "UE", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: Option<f64>,
    /// The gripper's fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
}

pub fn run(args: &PanelArgs) -> anyhow::Result<ExitCode> {
    let recipe = load_recipe(args.recipe.as_deref())?;
    let hand = Hand::of(&recipe)?;
    let mut setup = Setup::with_castings(&recipe, args.castings.finger_seed)?;
    args.controls.apply(&mut setup)?;
    let scenario = &mut setup.scenario;
    scenario.object = args.object.0.unwrap_or(scenario.object);
    scenario.mass_kg = args.mass.unwrap_or(scenario.mass_kg);
    scenario.noise_ue = args.noise.unwrap_or(scenario.noise_ue);
    // First what a second panel would find taken.
    let server = Server::open(args.listen)?;
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let options = Options {
        rate_hz: RATE_HZ,
        with_ticks: false,
        baud: args.baud,
        id: args.id,
        gripper: Virtual {
            setup,
            has_object: args.object.0.is_some(),
            script: None,
        },
    };
    let connection = watch::open(&args.from, &options)?;
    outln!("{}: the page is at", connection.name);
    outln!("    {}", server.address_with_token());
    outln!(
        "Without what follows the # it only watches, as at {}; Ctrl-C ends it",
        server.address()
    );
    if !server.is_local() {
        note(format_args!(
            "{}: whoever reaches this address can watch, and the token crosses the network in the clear",
            args.listen
        ));
    }
    let world = args.from == Source::Virtual;
    let mut has_ended = false;
    let summary = server.run(connection, hand, world, &stop, &mut |why| {
        note(format_args!(
            "the source has ended: {why}; the page stays as it is until Ctrl-C"
        ));
        has_ended = true;
    });
    outln!("{} pages", summary.pages);
    if summary.malformed > 0 {
        note(format_args!(
            "{} messages of pages could not be read",
            summary.malformed
        ));
    }
    Ok(match has_ended {
        true => ExitCode::from(1),
        false => ExitCode::SUCCESS,
    })
}

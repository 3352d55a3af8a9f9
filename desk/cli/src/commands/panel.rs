//! `softgrip panel`: a gripper on a page in the browser.

use std::net::SocketAddr;
use std::process::ExitCode;

use ::panel::hand::Hand;
use ::panel::server::{End, Server};
use ::serve::stop_on_signals;
use anyhow::{Context, bail, ensure};
use clap::Args;
use softgrip::FINGERS;
use watch::Source;

use super::address;
use super::output::{note, outln};
use super::source::SourceArgs;

/// Observations in a second: as many as a page shows.
const RATE_HZ: f64 = 50.0;

#[derive(Args)]
pub struct PanelArgs {
    /// Which gripper is shown: virtual, tty:/dev/ttyUSB0, tcp:HOST:PORT, defmt:-, defmt:HOST:PORT, probe or probe:CHIP
    /// (with --elf), or the path of a recording.
    #[arg(long, value_name = "SOURCE")]
    from: Source,
    /// Where the page is served; port 0 is any that is free. Other machines reach it at another address than the
    /// loopback one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080", value_parser = address)]
    listen: SocketAddr,
    #[command(flatten)]
    source: SourceArgs,
}

pub fn run(args: &PanelArgs) -> anyhow::Result<ExitCode> {
    ensure!(
        FINGERS == 3,
        "the page shows grippers with three fingers, and this program is built for {FINGERS}"
    );
    let hand = Hand::of(&args.source.gripper()?.setup);
    let server = Server::open(args.listen)?;
    let stop = stop_on_signals().context("cannot listen to Ctrl-C")?;
    let connection = args.source.open(&args.from, RATE_HZ, false, true)?;
    outln!("{}: the page is at", connection.name);
    outln!("    {}", server.address_with_token());
    outln!("At {} it only watches. Ctrl-C ends it", server.address());
    if !server.is_local() {
        note(format_args!(
            "{}: whoever reaches this address can watch, and the token crosses the network in the clear",
            args.listen
        ));
    }
    let world = args.from == Source::Virtual;
    let mut failed = None;
    let summary = server.run(connection, hand, world, &stop, &mut |end| {
        let (End::Ended(why) | End::Failed(why)) = &end;
        note(format_args!(
            "the source has ended: {why}; the page shows what was last, until Ctrl-C"
        ));
        if let End::Failed(why) = end {
            failed = Some(why);
        }
    });
    if summary.malformed > 0 {
        note(format_args!(
            "{} messages of pages could not be read",
            summary.malformed
        ));
    }
    match failed {
        Some(why) => bail!("{why}"),
        None => Ok(ExitCode::SUCCESS),
    }
}

//! `softgrip serve`: a virtual gripper for robots' programs.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc;
use std::thread;

use ::serve::play::Play;
use ::serve::port::Port;
use ::serve::run::{self, Line, Options, Summary};
use ::serve::stop_on_signals;
use ::serve::twin::Twin;
use anyhow::Context;
use clap::Args;

use super::address;
use super::output::{self, outln};
use super::source::VirtualArgs;

/// Lines of the log that wait for a terminal that does not take them.
const LINES: usize = 1000;

#[derive(Args)]
pub struct ServeArgs {
    /// Link to the pseudo-terminal, which has another name at each start [default: no link; its name is printed].
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    tty: Option<PathBuf>,
    /// Serve RTU frames over TCP at this address in place of a pseudo-terminal; port 0 is any that is free.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = address)]
    tcp: Option<SocketAddr>,
    #[command(flatten)]
    gripper: VirtualArgs,
}

pub fn run(args: &ServeArgs) -> anyhow::Result<ExitCode> {
    let gripper = args.gripper.gripper()?;
    let twin = Twin::new(&gripper.setup, gripper.has_object)?;
    let play = match &gripper.script {
        Some(script) => {
            twin.check(script)
                .with_context(|| args.gripper.script_name())?;
            Some(Play::new(script.clone(), &gripper.setup.gripper))
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
        speed: gripper.speed,
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

//! The steps, one after the other, and what is done when one goes wrong.

use std::sync::atomic::AtomicBool;

use anyhow::ensure;
use softgrip::settings::Settings;
use watch::Connection;

use crate::finding::{Finding, Step, Verdict};
use crate::limits::{REST_S, WINDOW_S};
use crate::motion;
use crate::person;
use crate::report::{Ended, Report, now};
use crate::rest;
use crate::session::{Halt, Session};

pub use crate::person::Person;

/// How a gripper is checked.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// The highest pressure, kPa.
    pub top_kpa: f32,
}

/// Checks a gripper. `say` hears each finding as it is made. Whatever happens, the pressure is let go first; where that
/// could not be seen, the report says so.
///
/// # Errors
/// If nothing can be wished of the gripper, it tells nothing, or the top is above its settings' highest pressure. Nothing
/// has moved then.
pub fn run(
    connection: &Connection,
    options: Options,
    mut person: Person,
    stop: &AtomicBool,
    say: &mut dyn FnMut(&Finding),
) -> anyhow::Result<Report> {
    let date = now()?;
    let mut session = Session::begin(connection, stop)?;
    let most = Settings::of(&session.found).regulator.max_pressure_kpa;
    ensure!(
        options.top_kpa <= most,
        "the top, {} kPa: must be at most {most} kPa, the setting regulator.max_pressure_kpa",
        options.top_kpa
    );
    let mut findings = Vec::new();
    let done = steps(&mut session, options, &mut person, &mut |finding| {
        say(&finding);
        findings.push(finding);
    });
    let mut tell = |finding: Finding| {
        say(&finding);
        findings.push(finding);
    };
    let ended = match done {
        Ok(()) => Ended::Whole,
        Err(halt) => {
            session.is_ending = true;
            if session.is_pressed {
                // If the gripper is gone, this fails, too, and the report says that there may be pressure.
                let _ = motion::release(&mut session, &mut tell);
            }
            match halt {
                Halt::Interrupted => Ended::Interrupted,
                Halt::Gone(why) => Ended::Gone(why),
            }
        }
    };
    Ok(Report {
        date,
        source: connection.name.clone(),
        about: session.about.clone(),
        differing: rest::differing(&session),
        findings,
        ended,
        is_under_pressure: session.is_pressed,
    })
}

fn steps(
    session: &mut Session,
    options: Options,
    person: &mut Person,
    tell: &mut dyn FnMut(Finding),
) -> Result<(), Halt> {
    let mut has_failed = false;
    let mut judge = |finding: Finding| {
        has_failed |= finding.verdict == Verdict::Failed;
        tell(finding);
    };
    // First: what is wrong may take some milliseconds of a gripper that has just started.
    let looks = session.watch(REST_S)?;
    rest::identity(session, &mut judge);
    rest::rest(session, &looks, &mut judge);
    let step = Step::Pressure;
    let (what, expected) = ("movement", "by consent, after all above");
    if has_failed {
        let why = "something above has failed: put it right, and check again";
        tell(Finding::new(step, what, expected, why, Verdict::NotTried));
    } else if !person.consents(options.top_kpa)? {
        let finding = Finding::judged(step, what, expected, "no consent", false);
        tell(finding.look_at("without it nothing is known of air and fingers"));
    } else {
        let is_known = rest::is_table_known(session);
        motion::pressure(session, options.top_kpa, &looks, is_known, tell)?;
        motion::release(session, tell)?;
    }
    if session.is_pressed {
        // Hands and lamps are for a gripper without pressure.
        return Ok(());
    }
    person::fingers(session, person, tell)?;
    person::outputs(session, person, tell)?;
    left(session, tell)
}

/// The gripper is as it was found.
fn left(session: &mut Session, tell: &mut dyn FnMut(Finding)) -> Result<(), Halt> {
    let step = Step::Left;
    session.watch(WINDOW_S)?;
    let expected = "0 kPa, nothing latched";
    let set = session.latest.setpoint_kpa;
    match session.failed(step, expected) {
        Some(finding) => tell(finding),
        None => {
            let seen = set.map_or("not known".into(), |kpa| {
                format!("{kpa:.1} kPa, {}", rest::state(&session.latest))
            });
            tell(Finding::judged(
                step,
                "gripper",
                expected,
                seen,
                set == Some(0.0),
            ));
        }
    }
    let is_same = session.settings == session.found;
    let seen = match is_same {
        true => "none was changed",
        false => "others than before",
    };
    tell(
        Finding::judged(step, "settings", "none is changed", seen, is_same)
            .look_at("who else is connected; this check changes none"),
    );
    Ok(())
}

/// Lets the pressure of a gripper go whose connection was lost, and says whether it has gone.
///
/// # Errors
/// If the gripper tells nothing, or is lost again.
pub fn let_go(connection: &Connection) -> anyhow::Result<bool> {
    let stop = AtomicBool::new(false);
    let mut session = Session::begin(connection, &stop)?;
    session.is_pressed = true;
    match motion::release(&mut session, &mut |_| {}) {
        Ok(()) => Ok(!session.is_pressed),
        Err(Halt::Gone(why)) => anyhow::bail!("{why}"),
        Err(Halt::Interrupted) => Ok(false),
    }
}

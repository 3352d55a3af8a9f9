//! What a person must look at, and what goes on without one.

use softgrip::fault::Fault;
use softgrip::units::FINGERS;
use watch::{Answer, Observation, Wish};

use crate::finding::{Finding, Step, Verdict};
use crate::limits::{ANSWER_S, BENT_UE, WINDOW_S};
use crate::session::{Halt, Session, mean};

/// Who answers questions.
pub enum Person<'a> {
    /// Nobody does: what takes a person is not tried, and the fingers may move.
    Nobody,
    /// Puts a question, and gives the answer; none where there will be no more.
    There(&'a mut dyn FnMut(&str) -> Option<String>),
}

/// Why something was not tried.
const NOBODY: &str = "nobody was asked";

impl Person<'_> {
    /// Whether the fingers may move.
    pub fn consents(&mut self, top_kpa: f32) -> Result<bool, Halt> {
        let Self::There(ask) = self else {
            return Ok(true);
        };
        let question = format!(
            "The fingers will move, with {top_kpa} kPa at most. Nothing in the grip, no hands. Type yes: "
        );
        let answer = ask(&question).ok_or(Halt::Interrupted)?;
        Ok(answer.trim() == "yes")
    }
}

fn is_yes(answer: &str) -> bool {
    matches!(answer.trim().to_lowercase().as_str(), "yes" | "y")
}

/// Which plug is which finger's.
pub fn fingers(
    session: &mut Session,
    person: &mut Person,
    tell: &mut dyn FnMut(Finding),
) -> Result<(), Halt> {
    for finger in 0..FINGERS {
        let what = format!("finger {} bent by hand", finger + 1);
        let expected = format!("gauge {} rises by {BENT_UE} µε or more", finger + 1);
        let Person::There(ask) = person else {
            let not_tried = Verdict::NotTried;
            tell(Finding::new(
                Step::Fingers,
                what,
                expected,
                NOBODY,
                not_tried,
            ));
            continue;
        };
        let straight = session.watch(WINDOW_S)?;
        let question = format!(
            "Bend finger {} to where an object would be, hold it there, and press Enter: ",
            finger + 1
        );
        ask(&question).ok_or(Halt::Interrupted)?;
        let bent = session.watch(WINDOW_S)?;
        tell(judge(finger, what, expected, rises(&straight, &bent)));
        ask("Let it go, and press Enter: ").ok_or(Halt::Interrupted)?;
    }
    Ok(())
}

/// By how much the strain of each finger has risen, µε; nothing of one that is not known.
fn rises(straight: &[Observation], bent: &[Observation]) -> [f32; FINGERS] {
    std::array::from_fn(|finger| {
        let lacks = |looks| mean(looks, |seen: &Observation| seen.residual_ue[finger]);
        let rise = lacks(straight).zip(lacks(bent));
        rise.map_or(0.0, |(straight, bent)| straight - bent)
    })
}

fn judge(finger: usize, what: String, expected: String, rises: [f32; FINGERS]) -> Finding {
    let texts: Vec<String> = rises.iter().map(|ue| format!("{ue:.0}")).collect();
    let seen = format!("{} µε", texts.join(", "));
    let largest = (0..FINGERS).max_by(|a, b| rises[*a].abs().total_cmp(&rises[*b].abs()));
    let is_it = largest == Some(finger) && rises[finger] >= BENT_UE;
    let advice = match largest.filter(|largest| rises[*largest].abs() >= BENT_UE) {
        Some(other) if other != finger => {
            format!("gauge {} moves: plugs are swapped", other + 1)
        }
        Some(_) => "it falls: EXC and GND are swapped at this finger's plug".into(),
        None => "bend it further; if nothing moves, this finger's plug and bond".into(),
    };
    Finding::judged(Step::Fingers, what, expected, seen, is_it).look_at(&advice)
}

/// A stop and its acknowledgement, and what the robot sees of them.
pub fn outputs(
    session: &mut Session,
    person: &mut Person,
    tell: &mut dyn FnMut(Finding),
) -> Result<(), Halt> {
    let step = Step::Outputs;
    session.catch_up()?;
    if let Some(number) = session.latest.fault.filter(|number| *number != 0) {
        let why = format!("fault {number} is latched");
        tell(Finding::new(
            step,
            "stop",
            "fault 48",
            why,
            Verdict::NotTried,
        ));
        return Ok(());
    }
    lamps(person, "READY on, HOLDING, LOST and FAULT off", tell)?;
    let stopped = u16::from(Fault::Stopped.code());
    let shows = told(session, Wish::Stop, stopped)?;
    tell(Finding::judged(
        step,
        "stop",
        "fault 48, Stopped",
        shows.1,
        shows.0,
    ));
    lamps(person, "FAULT on, READY off", tell)?;
    let shows = told(session, Wish::Acknowledge, 0)?;
    tell(
        Finding::judged(step, "acknowledgement", "no fault", shows.1, shows.0)
            .look_at("the stop circuit, and who else commands"),
    );
    lamps(person, "READY on, FAULT off", tell)?;
    tell(Finding::new(
        step,
        "HOLDING and LOST on",
        "with something that is held, and lost",
        "takes an object (docs/commissioning.md)",
        Verdict::NotTried,
    ));
    Ok(())
}

/// Wishes something, and whether the fault of this number shows, and what does.
fn told(session: &mut Session, wish: Wish, number: u16) -> Result<(bool, String), Halt> {
    if let Answer::Refused(why) = session.wish(wish)? {
        return Ok((false, format!("refused: {why}")));
    }
    let is_shown = session.until(ANSWER_S, |seen| seen.fault == Some(number))?;
    let seen = match session.latest.fault {
        None => "not told".into(),
        Some(0) => "no fault".into(),
        Some(number) => format!("fault {number}"),
    };
    Ok((is_shown, seen))
}

/// What lamps and the robot's inputs show.
fn lamps(person: &mut Person, expected: &str, tell: &mut dyn FnMut(Finding)) -> Result<(), Halt> {
    let what = "lamps and the robot's inputs";
    let Person::There(ask) = person else {
        let not_tried = Verdict::NotTried;
        tell(Finding::new(
            Step::Outputs,
            what,
            expected,
            NOBODY,
            not_tried,
        ));
        return Ok(());
    };
    let question =
        format!("Look at the lamps and at the robot's inputs: {expected}? Type yes or no: ");
    let answer = ask(&question).ok_or(Halt::Interrupted)?;
    let seen = format!("a person says {:?}", answer.trim());
    tell(
        Finding::judged(Step::Outputs, what, expected, seen, is_yes(&answer))
            .look_at("the wires at J7, and the settings of [io]"),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advice(rises: [f32; FINGERS]) -> String {
        let finding = judge(1, String::new(), String::new(), rises);
        match finding.verdict {
            Verdict::Passed => "passed".into(),
            _ => finding.look_at,
        }
    }

    #[test]
    fn the_finger_that_is_bent_must_be_the_one_that_rises() {
        let mut only = [0.0; FINGERS];
        only[1] = 3_000.0;
        assert_eq!(advice(only), "passed");
        only[0] = 5_000.0;
        assert_eq!(advice(only), "gauge 1 moves: plugs are swapped");
        only[0] = 0.0;
        only[1] = -3_000.0;
        assert!(advice(only).starts_with("it falls"));
        only[1] = 100.0;
        assert!(advice(only).starts_with("bend it further"));
    }
}

//! What is to happen to the virtual gripper, and when, from a TOML file.

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use serde::Deserialize;
use sim::arm::Move;
use sim::events;
use sim::fault::{self, FaultKind};
use softgrip::{Command, FINGERS, Grip};
use toml::Spanned;

/// Steps, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// After the last step comes the first.
    pub repeat: bool,
    /// The steps in their order; each waits for its moment once the one before is done.
    pub steps: Vec<Step>,
}

/// One thing that happens.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Line of the file.
    pub line: usize,
    /// What it waits for.
    pub when: When,
    /// How long it waits after that, s.
    pub after_s: f64,
    /// What it does.
    pub action: Action,
}

/// What a step waits for.
#[derive(Debug, Clone, PartialEq)]
pub enum When {
    /// The step before.
    Before,
    /// This time from the start, s.
    At(f64),
    /// A register that shows this under a mask.
    Register {
        /// Its address.
        address: u16,
        /// The bits that count.
        mask: u16,
        /// What they are to be.
        equals: u16,
    },
    /// An event of the controller, by its name.
    Event(String),
}

/// What a step does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// The object stands between the fingers, once these are open.
    Appear,
    /// Somebody takes the object out of the fingers, downwards.
    PullOut,
    /// The arm makes a move, with this acceleration, m/s².
    Arm(Move, f64),
    /// A force on the object, N, for so long, s.
    Push([f64; 3], f64),
    /// Something breaks: what, which finger's gauge from 0, and for how long, s.
    Fault(FaultKind, Option<usize>, f64),
    /// All that is broken is whole again.
    Repair,
    /// The supply has this voltage, V.
    Supply(f64),
    /// A digital input comes on, and means this.
    Input(Command),
    /// The virtual gripper ends.
    End,
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    repeat: bool,
    step: Vec<Spanned<Written>>,
}

/// A step as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    at_s: Option<f64>,
    when: Option<WrittenWhen>,
    after_s: Option<f64>,
    object: Option<String>,
    arm: Option<String>,
    accel_m_s2: Option<f64>,
    push_n: Option<[f64; 3]>,
    fault: Option<String>,
    for_s: Option<f64>,
    supply_v: Option<f64>,
    input: Option<String>,
    end: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenWhen {
    register: Option<u16>,
    mask: Option<u16>,
    equals: Option<u16>,
    event: Option<String>,
}

/// Nobody waits longer, s: a week.
const LONGEST_S: f64 = 604_800.0;

/// Reads a script.
///
/// # Errors
/// If the file cannot be read, or says what cannot be done; the message names its line, and what would be right.
pub fn read(path: &Path) -> anyhow::Result<Script> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| name.clone())?;
    parse(&text).with_context(|| name)
}

/// Reads the text of a script.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str) -> anyhow::Result<Script> {
    let file: File = toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| line_of(text, &span));
        anyhow::anyhow!("line {line}: {}", error.message())
    })?;
    ensure!(
        !file.step.is_empty(),
        "line 1: there must be at least one [[step]]"
    );
    let mut steps = Vec::new();
    for written in &file.step {
        let line = line_of(text, &written.span());
        let step = written.get_ref().step(line);
        steps.push(step.with_context(|| format!("line {line}"))?);
    }
    let waits = |step: &Step| step.when != When::Before || step.after_s > 0.0;
    ensure!(
        !file.repeat || steps.iter().any(waits),
        "line 1: a script that repeats must have a step with when or after_s, or it never rests"
    );
    if let Some(step) = steps
        .iter()
        .find(|step| file.repeat && matches!(step.when, When::At(_)))
    {
        bail!(
            "line {}: at_s comes once only: in a script that repeats it must be when or after_s",
            step.line
        );
    }
    Ok(Script {
        repeat: file.repeat,
        steps,
    })
}

/// The line in which a part of the text begins, from 1.
fn line_of(text: &str, span: &Range<usize>) -> usize {
    1 + text
        .bytes()
        .take(span.start)
        .filter(|b| *b == b'\n')
        .count()
}

impl Written {
    fn step(&self, line: usize) -> anyhow::Result<Step> {
        let after_s = self.after_s.unwrap_or(0.0);
        within("after_s", after_s, 0.0, LONGEST_S)?;
        let when = match (self.at_s, &self.when) {
            (None, None) => When::Before,
            (Some(at_s), None) => {
                within("at_s", at_s, 0.0, LONGEST_S)?;
                When::At(at_s)
            }
            (None, Some(when)) => when.moment()?,
            (Some(_), Some(_)) => bail!("a step has at_s or when, not both"),
        };
        Ok(Step {
            line,
            when,
            after_s,
            action: self.action()?,
        })
    }

    fn action(&self) -> anyhow::Result<Action> {
        let found = [
            self.object.as_deref().map(object),
            self.arm.as_deref().map(|name| self.movement(name)),
            self.push_n.map(|push_n| self.push(push_n)),
            self.fault.as_deref().map(|name| self.fault(name)),
            self.supply_v.map(supply),
            self.input.as_deref().map(input),
            self.end.map(end),
        ];
        let mut found = found.into_iter().flatten();
        let one = "a step must do one thing: object, arm, push_n, fault, supply_v, input or end";
        let action = found.next().context(one)??;
        ensure!(found.next().is_none(), one);
        ensure!(
            self.accel_m_s2.is_none() || matches!(action, Action::Arm(..)),
            "accel_m_s2 belongs to arm"
        );
        ensure!(
            self.for_s.is_none() || matches!(action, Action::Push(..) | Action::Fault(..)),
            "for_s belongs to push_n or to a fault"
        );
        Ok(action)
    }

    fn movement(&self, name: &str) -> anyhow::Result<Action> {
        let wanted = match name {
            "lift" => Move::Lift,
            "carry" => Move::Carry,
            "lower" => Move::Lower,
            _ => bail!("arm = {name:?}: must be \"lift\", \"carry\" or \"lower\""),
        };
        let acceleration = self
            .accel_m_s2
            .context("arm needs accel_m_s2, as in accel_m_s2 = 5.0")?;
        within("accel_m_s2", acceleration, 0.1, 50.0)?;
        Ok(Action::Arm(wanted, acceleration))
    }

    fn push(&self, push_n: [f64; 3]) -> anyhow::Result<Action> {
        for newtons in push_n {
            within("push_n", newtons, -100.0, 100.0)?;
        }
        let for_s = self
            .for_s
            .context("push_n needs for_s, as in for_s = 0.5")?;
        within("for_s", for_s, 0.001, LONGEST_S)?;
        Ok(Action::Push(push_n, for_s))
    }

    fn fault(&self, name: &str) -> anyhow::Result<Action> {
        if name == "none" {
            return Ok(Action::Repair);
        }
        let (kind, finger) =
            fault::named(name).with_context(|| format!("fault = {name:?}, if not \"none\""))?;
        ensure!(
            kind != FaultKind::HostSilent,
            "fault = {name:?}: the host is whoever is connected: let it be silent"
        );
        let for_s = self.for_s.unwrap_or(f64::INFINITY);
        ensure!(for_s > 0.0, "for_s = {for_s}: must be a time above 0");
        Ok(Action::Fault(kind, finger, for_s))
    }
}

fn object(name: &str) -> anyhow::Result<Action> {
    match name {
        "appear" => Ok(Action::Appear),
        "pull out" => Ok(Action::PullOut),
        _ => bail!("object = {name:?}: must be \"appear\" or \"pull out\""),
    }
}

fn supply(supply_v: f64) -> anyhow::Result<Action> {
    within("supply_v", supply_v, 0.0, 36.0)?;
    Ok(Action::Supply(supply_v))
}

fn input(name: &str) -> anyhow::Result<Action> {
    let command = match name {
        "grip" => Command::Grip(Grip::Default),
        "release" => Command::Release,
        "acknowledge" => Command::Acknowledge,
        _ => bail!("input = {name:?}: must be \"grip\", \"release\" or \"acknowledge\""),
    };
    Ok(Action::Input(command))
}

fn end(is_end: bool) -> anyhow::Result<Action> {
    ensure!(is_end, "end must be true, or be left out");
    Ok(Action::End)
}

impl WrittenWhen {
    fn moment(&self) -> anyhow::Result<When> {
        const ONE: &str =
            "when must be { register = …, mask = …, equals = … } or { event = \"…\" }";
        match (self.register, self.equals, &self.event) {
            (Some(address), Some(equals), None) => {
                let mask = self.mask.unwrap_or(u16::MAX);
                ensure!(
                    equals & !mask == 0,
                    "equals = {equals:#06x} has bits that mask = {mask:#06x} leaves out, so it is never met"
                );
                Ok(When::Register {
                    address,
                    mask,
                    equals,
                })
            }
            (None, None, Some(event)) if self.mask.is_none() => {
                ensure!(
                    events::NAMES.contains(&event.as_str()),
                    "event = {event:?}: must be one of {}",
                    events::NAMES.join(", ")
                );
                Ok(When::Event(event.clone()))
            }
            _ => bail!(ONE),
        }
    }
}

/// Refuses a number outside its range, and what is no number.
fn within(name: &str, value: f64, low: f64, high: f64) -> anyhow::Result<()> {
    ensure!(
        (low..=high).contains(&value),
        "{name} = {value}: must lie within {low} and {high}"
    );
    Ok(())
}

impl std::fmt::Display for Action {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Appear => write!(f, "an object appears"),
            Self::PullOut => write!(f, "the object is pulled out"),
            Self::Arm(wanted, acceleration) => {
                let name = match wanted {
                    Move::Lift => "is lifted",
                    Move::Carry => "goes sideways",
                    Move::Lower => "is lowered",
                };
                write!(f, "the arm {name} at {acceleration} m/s²")
            }
            Self::Push(push_n, for_s) => {
                write!(f, "the object is pushed with {push_n:?} N for {for_s} s")
            }
            Self::Fault(kind, finger, for_s) => {
                write!(f, "breaks: {kind}")?;
                if let Some(finger) = finger {
                    debug_assert!(*finger < FINGERS);
                    write!(f, ", finger {}", finger + 1)?;
                }
                match for_s.is_finite() {
                    true => write!(f, ", for {for_s} s"),
                    false => Ok(()),
                }
            }
            Self::Repair => write!(f, "all that was broken is whole again"),
            Self::Supply(supply_v) => write!(f, "the supply has {supply_v} V"),
            Self::Input(Command::Release) => write!(f, "the input RELEASE comes on"),
            Self::Input(Command::Acknowledge) => write!(f, "the input ACK comes on"),
            Self::Input(_) => write!(f, "the input GRIP comes on"),
            Self::End => write!(f, "the end"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_is_read_with_its_lines() {
        let text = "\
# A comment.
repeat = true

[[step]]
when = { event = \"holding\" }
after_s = 0.5
object = \"pull out\"

[[step]]
when = { register = 0x07D0, mask = 0x00C0, equals = 0x0040 }
fault = \"gauge-open:2\"
for_s = 0.25
";
        let script = parse(text).expect("a script");
        assert!(script.repeat);
        assert_eq!(
            script.steps,
            [
                Step {
                    line: 4,
                    when: When::Event("holding".into()),
                    after_s: 0.5,
                    action: Action::PullOut,
                },
                Step {
                    line: 9,
                    when: When::Register {
                        address: 0x07D0,
                        mask: 0x00C0,
                        equals: 0x0040,
                    },
                    after_s: 0.0,
                    action: Action::Fault(FaultKind::GaugeOpen, Some(1), 0.25),
                },
            ]
        );
    }

    #[test]
    fn what_cannot_be_done_is_refused_with_its_line_and_what_would_be_right() {
        for (step, expected) in [
            ("", "a step must do one thing: object, arm"),
            ("end = true\nsupply_v = 24.0", "a step must do one thing"),
            ("end = false", "end must be true"),
            ("object = 'explode'", "must be \"appear\" or \"pull out\""),
            ("arm = 'up'", "must be \"lift\", \"carry\" or \"lower\""),
            ("arm = 'lift'", "accel_m_s2 = 5.0"),
            (
                "arm = 'lift'\naccel_m_s2 = 0.0",
                "must lie within 0.1 and 50",
            ),
            ("push_n = [0.0, 0.0, -5.0]", "for_s = 0.5"),
            (
                "push_n = [0.0, nan, -5.0]\nfor_s = 1.0",
                "push_n = NaN: must lie within -100 and 100",
            ),
            ("fault = 'gauge-open'", "a finger from 1 to 3"),
            ("fault = 'gremlins'", "must be one of regulator-stuck"),
            ("fault = 'host-silent'", "whoever is connected"),
            ("fault = 'leak'\nfor_s = 0.0", "a time above 0"),
            ("supply_v = 230.0", "must lie within 0 and 36"),
            ("supply_v = 24.0\nfor_s = 1.0", "for_s belongs to"),
            ("end = true\naccel_m_s2 = 1.0", "accel_m_s2 belongs to arm"),
            ("input = 'open'", "\"grip\", \"release\" or \"acknowledge\""),
            ("end = true\nat_s = -1.0", "must lie within 0 and"),
            (
                "end = true\nat_s = 1.0\nwhen = { event = 'lost' }",
                "at_s or when, not both",
            ),
            (
                "end = true\nwhen = { event = 'gone' }",
                "one of contact, holding",
            ),
            ("end = true\nwhen = { register = 1 }", "when must be {"),
            (
                "end = true\nwhen = { register = 1, mask = 1, equals = 2 }",
                "is never met",
            ),
        ] {
            let text = format!("# First.\n[[step]]\n{step}\n");
            let error = format!("{:#}", parse(&text).expect_err(step));
            assert!(error.starts_with("line 2: "), "{step}: {error}");
            assert!(error.contains(expected), "{step}: {error}");
        }
        for (text, expected) in [
            ("", "line 1: missing field `step`"),
            ("step = []", "line 1: there must be at least one"),
            ("\n\n[[step]]\nwhat = 1\n", "line 4: unknown field `what`"),
            ("[[step]]\nend = 1\n", "line 2: invalid type: integer"),
            ("[[step]]\nend = true\n\n[[step\n", "line 4: "),
            (
                "repeat = true\n[[step]]\nsupply_v = 24.0\n",
                "line 1: a script that repeats must",
            ),
            (
                "repeat = true\n[[step]]\nat_s = 1.0\nsupply_v = 24.0\n",
                "line 2: at_s comes once only",
            ),
        ] {
            let error = format!("{:#}", parse(text).expect_err(text));
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }
}

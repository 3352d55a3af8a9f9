//! What a page sends: JSON, checked field by field.

use serde::Deserialize;
use serve::script::Action;
use settings::{FIELDS, Field, Kind};
use sim::arm::Move;
use sim::fault;
use softgrip::table::ObjectKind;
use watch::Wish;

/// Names of the faults that can be given to the virtual gripper.
pub const WORLD_FAULTS: [&str; 13] = [
    "gauge-open:1",
    "gauge-open:2",
    "gauge-open:3",
    "gauge-noisy:1",
    "gauge-stuck:1",
    "tube-burst",
    "leak",
    "supply-closed",
    "regulator-stuck",
    "monitor-off",
    "over-pressure",
    "supply-sag",
    "stop",
];

/// Somebody shakes the object so hard: what 150 g feel of 10 m/s², N …
const SHAKE_N: f64 = 1.5;
/// … to one side and the other, so long each time, s …
const SHAKE_S: f64 = 0.08;
/// … and so often.
const SHAKES: usize = 8;

/// A message as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    token: Option<String>,
    seen: Option<u64>,
    id: Option<u64>,
    #[serde(rename = "do")]
    what: Option<String>,
    kpa: Option<f64>,
    mass_g: Option<f64>,
    accel_m_s2: Option<f64>,
    shape: Option<String>,
    number: Option<u16>,
    value: Option<f64>,
    fault: Option<String>,
}

/// A message from a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// It has this token.
    Token(String),
    /// It has seen so many frames.
    Seen(u64),
    /// It wants something, and awaits the answer under its number.
    Order(u64, Result<Order, Problem>),
}

/// What a page wants.
#[derive(Debug, Clone, PartialEq)]
pub enum Order {
    /// To command from now on.
    TakeOver,
    /// The gripper is to stop.
    Stop,
    /// These wishes, one after the other.
    Wishes(Vec<Wish>),
}

/// What is wrong with an order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The field, if it is one.
    pub field: Option<&'static str>,
    /// What is wrong, and what would be right.
    pub text: String,
}

/// Reads a message.
///
/// # Errors
/// With what is wrong, if it is none.
pub fn read(text: &str) -> Result<Message, String> {
    let written: Written =
        serde_json::from_str(text).map_err(|error| format!("not a message: {error}"))?;
    match (&written.token, written.seen, written.id, &written.what) {
        (Some(token), None, None, None) => Ok(Message::Token(token.clone())),
        (None, Some(count), None, None) => Ok(Message::Seen(count)),
        (None, None, Some(id), Some(what)) => Ok(Message::Order(id, order(&written, what))),
        _ => Err("not a message: it must have token, or seen, or id and do".into()),
    }
}

fn order(written: &Written, what: &str) -> Result<Order, Problem> {
    let wish = match what {
        "take_over" => return Ok(Order::TakeOver),
        "stop" => return Ok(Order::Stop),
        "shake" => return Ok(Order::Wishes(shake())),
        "grip" => Wish::Grip,
        "grip_at" => Wish::GripAt(within("kpa", written.kpa, 0.0, 1_000.0)? as f32),
        "grip_payload" => Wish::GripPayload {
            kind: shape(written.shape.as_deref())?,
            // What the registers of a real gripper hold.
            mass_kg: 1e-3 * within("mass_g", written.mass_g, 1.0, 65_535.0)? as f32,
            acceleration_m_s2: within("accel_m_s2", written.accel_m_s2, 0.0, 65.535)? as f32,
        },
        "release" => Wish::Release,
        "acknowledge" => Wish::Acknowledge,
        "tare" => Wish::Tare,
        "sweep" => Wish::Sweep,
        "save" => Wish::Save,
        "set" => set(written.number, written.value)?,
        "lift" => Wish::World(movement(Move::Lift, written)?),
        "carry" => Wish::World(movement(Move::Carry, written)?),
        "lower" => Wish::World(movement(Move::Lower, written)?),
        "pull_out" => Wish::World(Action::PullOut),
        "appear" => Wish::World(Action::Appear),
        "break" => Wish::World(broken(written.fault.as_deref())?),
        "repair" => Wish::World(Action::Repair),
        _ => return Err(problem(None, format!("do: there is no {what:?}"))),
    };
    Ok(Order::Wishes(vec![wish]))
}

fn problem(field: Option<&'static str>, text: impl Into<String>) -> Problem {
    Problem {
        field,
        text: text.into(),
    }
}

/// A number of a field that must be there.
fn within(name: &'static str, value: Option<f64>, low: f64, high: f64) -> Result<f64, Problem> {
    match value {
        Some(value) if (low..=high).contains(&value) => Ok(value),
        _ => {
            let text = format!("{name} must lie within {low} and {high}");
            Err(problem(Some(name), text))
        }
    }
}

fn shape(name: Option<&str>) -> Result<ObjectKind, Problem> {
    match name {
        Some("sphere") => Ok(ObjectKind::Sphere),
        Some("cylinder") => Ok(ObjectKind::Cylinder),
        _ => Err(problem(Some("shape"), "shape must be sphere or cylinder")),
    }
}

fn movement(wanted: Move, written: &Written) -> Result<Action, Problem> {
    let acceleration = within("accel_m_s2", written.accel_m_s2, 0.1, 50.0)?;
    Ok(Action::Arm(wanted, acceleration))
}

fn broken(name: Option<&str>) -> Result<Action, Problem> {
    let name = name.filter(|name| WORLD_FAULTS.contains(name));
    match name.map(fault::named) {
        Some(Ok((kind, finger))) => Ok(Action::Fault(kind, finger, f64::INFINITY)),
        _ => {
            let names = WORLD_FAULTS.join(", ");
            Err(problem(
                Some("fault"),
                format!("fault must be one of {names}"),
            ))
        }
    }
}

fn shake() -> Vec<Wish> {
    let push = |n| match n % 2 {
        0 => SHAKE_N,
        _ => -SHAKE_N,
    };
    let pushes = (0..SHAKES).map(|n| Wish::World(Action::Push([push(n), 0.0, 0.0], SHAKE_S)));
    pushes.collect()
}

fn set(number: Option<u16>, value: Option<f64>) -> Result<Wish, Problem> {
    let field = FIELDS.iter().find(|field| Some(field.number) == number);
    let Some(field) = field else {
        return Err(problem(
            Some("number"),
            "there is no setting of this number",
        ));
    };
    match value {
        Some(value) if field.limit().allows(value as f32) => {
            Ok(Wish::Set(field.number, value as f32))
        }
        _ => {
            let text = format!("{} must be {}", field.name, range(field));
            Err(problem(Some("value"), text))
        }
    }
}

fn range(field: &Field) -> String {
    match field.kind {
        Kind::Number { min, max } => format!("within {min} and {max} {}", field.unit),
        Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
        Kind::Choice(words) => format!("one of 0 to {}: {}", words.len() - 1, words.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wishes(text: &str) -> Vec<Wish> {
        match read(text) {
            Ok(Message::Order(7, Ok(Order::Wishes(wishes)))) => wishes,
            other => panic!("{text}: {other:?}"),
        }
    }

    fn wrong(text: &str) -> Problem {
        match read(text) {
            Ok(Message::Order(_, Err(problem))) => problem,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn messages_are_what_they_say() {
        assert_eq!(read(r#"{"token":"ab"}"#), Ok(Message::Token("ab".into())));
        assert_eq!(read(r#"{"seen":3}"#), Ok(Message::Seen(3)));
        assert_eq!(
            read(r#"{"id":7,"do":"stop"}"#),
            Ok(Message::Order(7, Ok(Order::Stop)))
        );
        assert_eq!(
            wishes(r#"{"id":7,"do":"grip_at","kpa":120}"#),
            [Wish::GripAt(120.0)]
        );
        assert_eq!(
            wishes(
                r#"{"id":7,"do":"grip_payload","mass_g":150,"accel_m_s2":2,"shape":"cylinder"}"#
            ),
            [Wish::GripPayload {
                kind: ObjectKind::Cylinder,
                mass_kg: 0.15,
                acceleration_m_s2: 2.0
            }]
        );
        assert_eq!(
            wishes(r#"{"id":7,"do":"set","number":406,"value":1}"#),
            [Wish::Set(406, 1.0)]
        );
    }

    #[test]
    fn a_message_that_is_none_is_refused_with_what_would_be_right() {
        for text in [
            "",
            "nonsense",
            "[]",
            "{}",
            "{\"id\":1}",
            "{\"do\":\"grip\"}",
            "{\"id\":-1,\"do\":\"grip\"}",
            "{\"id\":1,\"do\":\"grip\",\"kPa\":3}",
            "{\"seen\":1,\"token\":\"x\"}",
        ] {
            let error = read(text).expect_err(text);
            assert!(error.starts_with("not a message: "), "{text}: {error}");
        }
        let deep = "[".repeat(100_000);
        assert!(read(&deep).is_err());
    }

    #[test]
    fn an_order_is_refused_by_its_field() {
        for (text, field) in [
            (r#"{"id":1,"do":"fly"}"#, None),
            (r#"{"id":1,"do":"grip_at"}"#, Some("kpa")),
            (r#"{"id":1,"do":"grip_at","kpa":-1}"#, Some("kpa")),
            (
                r#"{"id":1,"do":"grip_payload","mass_g":0,"accel_m_s2":2,"shape":"sphere"}"#,
                Some("mass_g"),
            ),
            (
                r#"{"id":1,"do":"grip_payload","mass_g":5,"accel_m_s2":99,"shape":"sphere"}"#,
                Some("accel_m_s2"),
            ),
            (
                r#"{"id":1,"do":"grip_payload","mass_g":5,"accel_m_s2":9,"shape":"cube"}"#,
                Some("shape"),
            ),
            (r#"{"id":1,"do":"lift"}"#, Some("accel_m_s2")),
            (
                r#"{"id":1,"do":"break","fault":"host-silent"}"#,
                Some("fault"),
            ),
            (
                r#"{"id":1,"do":"set","number":1,"value":1}"#,
                Some("number"),
            ),
            (
                r#"{"id":1,"do":"set","number":406,"value":0.5}"#,
                Some("value"),
            ),
            (r#"{"id":1,"do":"set","number":100}"#, Some("value")),
            (r#"{"id":1,"do":"set","number":100,"value":1e999}"#, None),
        ] {
            match read(text) {
                Ok(_) => assert_eq!(wrong(text).field, field, "{text}"),
                Err(error) => assert!(text.contains("e999"), "{error}"),
            }
        }
        let range = wrong(r#"{"id":1,"do":"set","number":101,"value":0}"#).text;
        assert!(range.contains("slew_kpa_per_s"), "{range}");
        assert!(range.contains("within 1 and 10000 kPa/s"), "{range}");
    }

    #[test]
    fn every_fault_of_the_page_can_be_given_to_the_virtual_gripper() {
        for name in WORLD_FAULTS {
            let text = format!(r#"{{"id":7,"do":"break","fault":"{name}"}}"#);
            let [wish] = wishes(&text)[..] else {
                panic!("{name}");
            };
            assert!(matches!(wish, Wish::World(Action::Fault(..))), "{wish:?}");
        }
    }
}

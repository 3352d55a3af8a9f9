//! Texts about the settings: the file with all of them, and the manual's page.

use std::format;
use std::string::String;
use std::vec::Vec;

use crate::VERSION;
use crate::field::{Field, Kind};
use crate::fields::FIELDS;
use crate::file::{named, places};
use crate::values::Values;

/// The settings file of these values, with what is to be known of each; [`crate::file::read`] reads the same bits back.
pub fn toml(values: &Values) -> String {
    let mut text = format!("version = {VERSION}\n");
    let mut table = "";
    for field in &FIELDS {
        let (inside, key) = field.name.rsplit_once('.').unwrap_or(("", field.name));
        let (key, place) = key.split_once('[').unwrap_or((key, ""));
        // A list stands where its first place does.
        if !place.chars().all(|c| "0[]".contains(c)) {
            continue;
        }
        if inside != table {
            text += &format!("\n[{inside}]\n");
            table = inside;
        }
        let value = value_of(&format!("{inside}.{key}"), values);
        text += &format!("# {}. {}.\n{key} = {value}\n", field.sentence, range(field));
    }
    text
}

/// The value with this name, or the list of them.
fn value_of(name: &str, values: &Values) -> String {
    let Some(field) = named(name) else {
        let places = (0..places(name)).map(|n| value_of(&format!("{name}[{n}]"), values));
        return format!("[{}]", places.collect::<Vec<_>>().join(", "));
    };
    let value = values.get(field.number).unwrap_or(field.default);
    match field.kind {
        // The shortest number that is the same in 32 bits.
        Kind::Number { .. } => format!("{value:?}"),
        Kind::Whole { .. } => format!("{value}"),
        Kind::Choice(words) => {
            let word = words.get(value as usize).copied().unwrap_or_default();
            format!("{word:?}")
        }
    }
}

/// What a setting may be, in words.
fn range(field: &Field) -> String {
    match field.kind {
        Kind::Number { min, max } if field.unit.is_empty() => format!("{min} to {max}"),
        Kind::Number { min, max } => format!("{min} to {max} {}", field.unit),
        Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
        Kind::Choice(words) => words.join(", "),
    }
}

/// The default of a setting, in words.
fn default(field: &Field) -> String {
    match field.kind {
        Kind::Number { .. } | Kind::Whole { .. } => format!("{}", field.default),
        Kind::Choice(words) => words
            .get(field.default as usize)
            .copied()
            .unwrap_or_default()
            .into(),
    }
}

/// Every setting as a table of Markdown.
pub fn registers() -> String {
    let mut text = String::from(
        "| number | name | unit | range | default | meaning |\n| ---: | --- | --- | --- | ---: | --- |\n",
    );
    for field in &FIELDS {
        let unit = if field.unit.is_empty() {
            "–"
        } else {
            field.unit
        };
        let range = match field.kind {
            Kind::Number { min, max } => format!("{min} … {max}"),
            Kind::Whole { min, max } => format!("{min} … {max}, whole"),
            Kind::Choice(words) => words.join(", "),
        };
        text += &format!(
            "| {} | `{}` | {unit} | {range} | {} | {} |\n",
            field.number,
            field.name,
            default(field),
            field.sentence,
        );
    }
    text
}

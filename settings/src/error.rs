//! The error of a setting that lies outside its range.

use crate::field::{Kind, Limit};
use crate::fields::FIELDS;

/// A setting out of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SettingsError {
    /// Number of the setting.
    pub number: u16,
    /// Its value.
    pub value: f32,
    /// The lowest value that would be right.
    pub min: f32,
    /// The highest value that would be right.
    pub max: f32,
}

impl SettingsError {
    /// That `value` is outside this range.
    pub(crate) const fn of(limit: &Limit, value: f32) -> Self {
        Self {
            number: limit.number,
            value,
            min: limit.min,
            max: limit.max,
        }
    }
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            number,
            value,
            min,
            max,
        } = self;
        let field = const { &FIELDS }
            .iter()
            .find(|field| field.number == *number);
        let Some(field) = field else {
            return write!(f, "setting {number}: there is none of that number");
        };
        let name = field.name;
        match field.kind {
            Kind::Number { .. } => write!(f, "{name} = {value}: must lie within {min} and {max}"),
            Kind::Whole { .. } => {
                write!(
                    f,
                    "{name} = {value}: must be a whole number from {min} to {max}"
                )
            }
            Kind::Choice(words) => {
                write!(
                    f,
                    "{name} = {value}: must be a whole number from {min} to {max}"
                )?;
                let mut numbered = words.iter().enumerate();
                numbered.try_for_each(|(n, word)| write!(f, ", {n} is {word}"))
            }
        }
    }
}

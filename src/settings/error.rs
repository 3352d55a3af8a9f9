//! The error of a setting that lies outside its range.

use softgrip_settings::{Field, Kind, Limit};

/// A setting out of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SettingsError {
    /// Number of the setting. On the target a name would only take room.
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
    pub(super) fn of(limit: &Limit, value: f32) -> Self {
        Self {
            number: limit.number,
            value,
            min: limit.min,
            max: limit.max,
        }
    }

    /// Name of the setting, as in the settings file.
    pub fn name(&self) -> &'static str {
        Field::of(self.number).map_or("a setting that does not exist", |field| field.name)
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
        let name = self.name();
        match Field::of(*number).map(|field| field.kind) {
            None => write!(f, "setting {number}: there is none of that number"),
            Some(Kind::Number { .. }) => {
                write!(f, "{name} = {value}: must lie within {min} and {max}")
            }
            Some(Kind::Choice(words)) => {
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

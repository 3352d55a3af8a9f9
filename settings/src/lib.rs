//! The settings of the controller: data only.
//!
//! One row of [`FIELDS`] is all there is to say about a setting. The controller takes the ranges from it, the
//! command `softgrip` and the build script the TOML file, and the manual its page. `softgrip::settings` has the
//! settings as typed fields.
#![no_std]
#![forbid(unsafe_code)]

mod fields;

pub use fields::FIELDS;

/// What is to be known about one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Its name in storage and on a bus. It never changes, and never means something else.
    pub number: u16,
    /// Its name in the settings file: tables, key, and places in a list, as in `gauge.gain[0]`.
    pub name: &'static str,
    /// Its unit; empty for one without.
    pub unit: &'static str,
    /// What it may be.
    pub kind: Kind,
    /// Its value for the default finger; a choice's place in the list of its words.
    pub default: f32,
    /// What it is, in one sentence.
    pub sentence: &'static str,
}

/// What a setting may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A number.
    Number {
        /// The lowest.
        min: f32,
        /// The highest.
        max: f32,
    },
    /// One of these words. As a number it is the place in the list.
    Choice(&'static [&'static str]),
}

/// The range of a setting, by number: all that the controller needs of a [`Field`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The setting's number.
    pub number: u16,
    /// The lowest value.
    pub min: f32,
    /// The highest value. Finger and regulator may allow less; see [`Limit::at`].
    pub max: f32,
}

/// Numbers of the settings whose range depends on others.
pub mod number {
    /// No command and no grip goes above.
    pub const MAX_PRESSURE: u16 = 100;
    /// Pressure of a grip that names none.
    pub const GRIP_PRESSURE: u16 = 400;
    /// How much harder a second attempt closes.
    pub const REGRIP_RAISE: u16 = 408;
}

/// The range of every setting, in the order of their numbers. Names, units and sentences are not in it, so
/// that an image does not carry them.
pub static LIMITS: [Limit; FIELDS.len()] = limits();

/// The same, for the target: the compiler would unroll every loop over an array that it knows, each a kilobyte.
pub fn all_limits() -> &'static [Limit] {
    core::hint::black_box(&LIMITS)
}

const fn limits() -> [Limit; FIELDS.len()] {
    let mut limits = [Limit {
        number: 0,
        min: 0.0,
        max: 0.0,
    }; FIELDS.len()];
    let mut i = 0;
    while i < FIELDS.len() {
        let (min, max) = FIELDS[i].kind.range();
        limits[i] = Limit {
            number: FIELDS[i].number,
            min,
            max,
        };
        i += 1;
    }
    limits
}

impl Kind {
    /// The lowest and the highest value.
    pub const fn range(&self) -> (f32, f32) {
        match self {
            Self::Number { min, max } => (*min, *max),
            Self::Choice(words) => (0.0, (words.len() - 1) as f32),
        }
    }
}

impl Field {
    /// The setting with this number.
    pub fn of(number: u16) -> Option<&'static Self> {
        const { &FIELDS }
            .iter()
            .find(|field| field.number == number)
    }

    /// The setting with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        const { &FIELDS }.iter().find(|field| field.name == name)
    }
}

impl Limit {
    /// The range where finger and regulator reach `ceiling_kpa`, and no command goes above `max_pressure_kpa`.
    pub fn at(self, ceiling_kpa: f32, max_pressure_kpa: f32) -> Self {
        let most = match self.number {
            number::MAX_PRESSURE | number::REGRIP_RAISE => ceiling_kpa,
            number::GRIP_PRESSURE => max_pressure_kpa,
            _ => return self,
        };
        // Not `f32::min`: on the target that is a call.
        let max = if most < self.max { most } else { self.max };
        Self { max, ..self }
    }

    /// Whether a value lies in the range. A NaN lies in none.
    pub fn allows(&self, value: f32) -> bool {
        (self.min..=self.max).contains(&value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_rise_names_differ_and_defaults_are_in_their_ranges() {
        for pair in FIELDS.windows(2) {
            assert!(pair[0].number < pair[1].number, "{}", pair[1].name);
        }
        for (field, limit) in FIELDS.iter().zip(&LIMITS) {
            assert!(limit.min < limit.max, "{}", field.name);
            assert!(limit.allows(field.default), "{}", field.name);
            assert_eq!(Field::named(field.name), Some(field));
            assert_eq!(Field::of(field.number), Some(field));
            assert!(!field.sentence.ends_with('.'), "{}", field.name);
        }
    }
}

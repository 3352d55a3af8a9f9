//! What is to be known about a setting.

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
    /// A whole number of 0 to 255.
    Whole {
        /// The lowest.
        min: u8,
        /// The highest.
        max: u8,
    },
    /// One of these words. As a number it is the place in the list.
    Choice(&'static [&'static str]),
}

impl Field {
    /// Its range alone.
    pub const fn limit(&self) -> Limit {
        let (min, max, whole) = match self.kind {
            Kind::Number { min, max } => (min, max, false),
            Kind::Whole { min, max } => (min as f32, max as f32, true),
            Kind::Choice(words) => (0.0, (words.len() - 1) as f32, true),
        };
        Limit {
            number: self.number,
            whole,
            min,
            max,
        }
    }
}

/// The range of a setting: all that an image has of a [`Field`] beside its default. Names, units and sentences
/// would only take room there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The setting's number.
    pub number: u16,
    /// The value must be whole: a choice, or a number of 0 to 255.
    pub whole: bool,
    /// The lowest value.
    pub min: f32,
    /// The highest value.
    pub max: f32,
}

impl Limit {
    /// Whether a value is in the range. A NaN is in none.
    pub const fn allows(&self, value: f32) -> bool {
        let in_range = value >= self.min && value <= self.max;
        in_range && (!self.whole || value as u8 as f32 == value)
    }

    /// The same up to `most` at the highest.
    pub(crate) const fn up_to(self, most: f32) -> Self {
        Self {
            max: smaller(most, self.max),
            ..self
        }
    }
}

/// The smaller of two numbers. `f32::min` is a call into the runtime on a Cortex-M4.
pub(crate) const fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

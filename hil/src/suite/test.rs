//! What a test is, what it may use and what comes out of it.

use crate::image::Image;

/// What a test may use.
pub struct Context<'a> {
    /// The image under test.
    pub image: &'a Image,
    /// Virtual time of the endurance test, h.
    pub hours: f64,
    /// Whether the budgets' file is written anew.
    pub write_budgets: bool,
}

/// A measured number.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// What it is.
    pub name: String,
    /// How much.
    pub value: f64,
    /// In what.
    pub unit: &'static str,
    /// The most that it may be.
    pub limit: Option<f64>,
}

/// What came out of a test.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// What was measured.
    pub numbers: Vec<Number>,
    /// What is wrong; nothing if the test has passed.
    pub failures: Vec<String>,
    /// What to know about it.
    pub notes: Vec<String>,
}

impl Outcome {
    /// A number without a limit.
    pub fn number(&mut self, name: impl Into<String>, value: f64, unit: &'static str) {
        self.numbers.push(Number {
            name: name.into(),
            value,
            unit,
            limit: None,
        });
    }

    /// A number that must not be greater than its limit.
    pub fn at_most(&mut self, name: impl Into<String>, value: f64, unit: &'static str, limit: f64) {
        let name = name.into();
        if value.is_nan() || value > limit {
            self.failures
                .push(format!("{name}: {value} {unit}, at most {limit} {unit}"));
        }
        self.numbers.push(Number {
            name,
            value,
            unit,
            limit: Some(limit),
        });
    }

    /// Something that must hold.
    pub fn must(&mut self, holds: bool, failure: impl Into<String>) {
        if !holds {
            self.failures.push(failure.into());
        }
    }
}

/// A named test.
#[derive(Clone, Copy)]
pub struct Test {
    /// What `--only` looks for.
    pub name: &'static str,
    /// What must hold.
    pub about: &'static str,
    /// Runs it.
    pub run: fn(&Context<'_>) -> anyhow::Result<Outcome>,
}

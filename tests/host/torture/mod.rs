//! Random commands on a random plant, and inputs that no plant would give: what generates them, what
//! the plant does, and what must hold in each tick. `cargo bench --bench endurance` runs the same for
//! longer than a test may.

pub mod generate;
pub mod hostile;
pub mod limits;
pub mod plant;
pub mod promises;
pub mod season;
pub mod sequence;

/// A rule that did not hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Breach {
    /// Which one; the same words for the same rule.
    pub rule: &'static str,
    /// What was found instead.
    pub found: String,
}

impl Breach {
    pub fn of(rule: &'static str, found: impl std::fmt::Debug) -> Self {
        Self {
            rule,
            found: format!("{found:?}"),
        }
    }
}

/// Passes, or names the rule and what was found.
pub fn must<T: std::fmt::Debug>(
    holds: bool,
    rule: &'static str,
    found: impl FnOnce() -> T,
) -> Result<(), Breach> {
    if holds {
        Ok(())
    } else {
        Err(Breach::of(rule, found()))
    }
}

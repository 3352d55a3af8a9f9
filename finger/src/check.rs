//! Checks of a recipe's values, and their words.

/// A value that no finger can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field} = {value}: {expected}")]
pub struct FieldError {
    /// The field, as a path in the recipe such as `station[1].at_mm`.
    pub field: String,
    /// Its value, in the recipe's unit.
    pub value: f64,
    /// What would be right, as the rest of the message.
    pub expected: String,
}

/// The error of a wrong `value`.
pub(crate) fn wrong(field: &str, value: f64, expected: String) -> FieldError {
    FieldError {
        field: field.to_string(),
        value,
        expected,
    }
}

/// Refuses a value outside `low..=high`.
pub(crate) fn within(field: &str, value: f64, low: f64, high: f64) -> Result<(), FieldError> {
    // A NaN is in no range, so it fails here too.
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(wrong(
        field,
        value,
        format!("must lie within {low} and {high}"),
    ))
}

/// Refuses a list with a value outside `low..=high`.
pub(crate) fn each_within(
    field: &str,
    values: &[f64],
    low: f64,
    high: f64,
) -> Result<(), FieldError> {
    values
        .iter()
        .enumerate()
        .try_for_each(|(i, &value)| within(&format!("{field}[{i}]"), value, low, high))
}

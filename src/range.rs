//! The range of a setting, and the error of one that lies outside.

/// A setting out of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SettingsError {
    /// Name of the setting, with its unit.
    pub field: &'static str,
    /// Its value.
    pub value: f32,
    /// The lowest value that would be right.
    pub min: f32,
    /// The highest value that would be right.
    pub max: f32,
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            field,
            value,
            min,
            max,
        } = self;
        write!(f, "{field} = {value}: must lie within {min} and {max}")
    }
}

/// The value, if it lies in its range. A NaN is in no range.
pub(crate) fn within(
    field: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> Result<f32, SettingsError> {
    match (min..=max).contains(&value) {
        true => Ok(value),
        false => Err(SettingsError {
            field,
            value,
            min,
            max,
        }),
    }
}

/// Milliseconds of a valid setting, in µs.
pub(crate) fn micros(ms: f32) -> u64 {
    (1e3 * ms) as u64
}

//! What a free-bend sweep has found of the mounted fingers, and what becomes of it in the settings.

use super::Settings;
use crate::math::larger;
use crate::units::{FINGERS, Kilopascals};

/// What a sweep has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Strain of each gauge over the table's at the same bend.
    pub gain: [f32; FINGERS],
    /// Stiffness of each finger over the recipe's.
    pub stiffness: [f32; FINGERS],
    /// Pressure at which the recipe's finger is bent as these are where they meet; none if they do not.
    pub meeting: Option<Kilopascals>,
    /// Pressures at which a finger has the same shape on its way up and down are so far apart, kPa.
    pub hysteresis_kpa: f32,
    /// Lags of the fingers behind the pressure, rising and falling, with their swing, ms.
    pub lag_ms: [f32; 2],
    /// Largest difference between the free fingers and what is now expected of them, percent of full scale.
    pub error_percent: f32,
}

impl Settings {
    /// These, with what a sweep has found, for a table that ends at `max_kpa`. A curve that is known less well than the
    /// defaults take for granted makes contact of a larger residual.
    #[must_use]
    pub(crate) fn calibrated(mut self, found: &Calibration, max_kpa: f32) -> Self {
        self.free_bend_gain = found.gain;
        self.stiffness = found.stiffness;
        self.meeting_kpa = found.meeting.map_or(0.0, |pressure| pressure.0);
        self.silicone = self
            .silicone
            .measured(found.lag_ms, 100.0 * found.hysteresis_kpa / max_kpa);
        let least = Self::default().contact_percent;
        self.contact_percent = larger(least, 2.0 * found.error_percent);
        self
    }
}

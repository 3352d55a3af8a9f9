//! Options of an evaluation.

use std::path::PathBuf;

use softgrip::settings::Settings;

/// Noise of the gauges, µε rms.
pub const NOISE_UE: [f64; 3] = [20.0, 100.0, 400.0];

/// Fraction of the hours at the highest level of noise, which a usable gripper does not have.
const FEWER_HOURS: f64 = 0.1;

/// Options of an evaluation.
#[derive(Debug, Clone)]
pub struct Options {
    /// Seed of everything. The detector's parameters were chosen on seeds below 1000.
    pub seed: u64,
    /// Number of true losses for each class of calibration.
    pub losses: usize,
    /// Hours of operation at each level of noise, h; see [`hours_at`].
    pub hours: f64,
    /// Directory of simulated losses that are kept, for work on the detector.
    pub recordings: Option<PathBuf>,
    /// The slowest reports to keep in detail, at each level of noise.
    pub slowest: usize,
    /// The controller's settings, but for each case's calibration.
    pub settings: Settings,
}

/// Of so many hours, those at a level of noise.
pub fn hours_at(hours: f64, noise_ue: f64) -> f64 {
    hours * if noise_ue > 100.0 { FEWER_HOURS } else { 1.0 }
}

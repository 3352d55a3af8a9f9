//! What the controller is worth: how soon it reports a loss, and how often it cries wolf.

pub mod alarms;
pub mod case;
pub mod hand;
pub mod latency;
pub mod meter;
pub mod record;
pub mod report;
pub mod response;
pub mod routine;
pub mod statistics;
mod store;

use std::path::PathBuf;

use softgrip::settings::Settings;

/// Noise of the gauges, µε rms.
pub const NOISE_UE: [f64; 3] = [20.0, 100.0, 400.0];

/// What is to be evaluated.
#[derive(Debug, Clone)]
pub struct Options {
    /// Seed of everything. The detector's parameters were chosen on seeds below 1000.
    pub seed: u64,
    /// True losses to be found for each class of knowledge.
    pub losses: usize,
    /// Hours of holding and moving at each level of noise.
    pub hours: f64,
    /// Directory of simulated losses that are kept, for work on the detector.
    pub recordings: Option<PathBuf>,
    /// The controller's settings, but for each case's calibration.
    pub settings: Settings,
}

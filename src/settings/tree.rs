//! The settings as a tree of typed fields.

use crate::{air, detect, estimate, frontend, grasp, io, regulate};

/// The controller's settings in the units that people use. The defaults are for a finger that is good for
/// 160 kPa, as the default one is; [`Settings::for_finger`] takes any.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// The regulator's response.
    pub air: air::Settings,
    /// The fingers, and what counts as contact.
    pub finger: estimate::Settings,
    /// What counts as a slip and as a loss, of the object or of air.
    pub detection: detect::Settings,
    /// Grips, and what is done when one fails.
    pub grip: grasp::Settings,
    /// Limits of the commanded pressure.
    pub regulator: regulate::Settings,
    /// Gain and zero of each gauge.
    pub gauge: frontend::GaugeSettings,
    /// What the converters' volts mean.
    pub front_end: frontend::Settings,
    /// At which level each digital signal is on.
    pub io: io::Settings,
    /// How the program reports.
    pub telemetry: io::TelemetrySettings,
    /// The line to the robot.
    pub bus: io::BusSettings,
}

//! The parsed rows of a trace, with the assumptions that were made.

use softgrip::FINGERS;

/// A value that is missing for longer than this, s, or a row, is not made up: from the command to holding
/// a grip takes as long (140 kPa at 400 kPa/s, and 150 ms to settle), so that nothing longer hides a whole one.
pub const GAP_S: f64 = 0.5;

/// One row of a trace, in the order of [`COLUMNS`](super::COLUMNS).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time by the clock of the trace, s.
    pub t_s: f64,
    /// Gauge strain of each finger, µε; infinite where it has been missing for long, like an open gauge's.
    pub strain_ue: [f64; FINGERS],
    /// Pressure of the monitor, kPa.
    pub pressure_kpa: f64,
    /// Pressure that the robot asked for, kPa: a step where it asked for another.
    pub setpoint_kpa: f64,
    /// All gauges were measured; else a strain lies between its neighbours'.
    pub measured: bool,
}

/// A trace as it was understood.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The rows, in time.
    pub rows: Vec<Row>,
    /// The set-point column stated the commands as steps; else they were recovered from what it showed.
    pub stepped: bool,
    /// Steepness of the set-point's ramps, kPa/s, if it shows any and the pressure follows them.
    pub slew_kpa_per_s: Option<f64>,
    /// Usual time from row to row, s.
    pub interval_s: f64,
    /// Assumptions made while reading, for the user.
    pub notes: Vec<String>,
}

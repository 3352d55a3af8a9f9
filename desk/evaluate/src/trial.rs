//! The controller's response to one recording at one level of noise, and how it counts.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use sim::setup::Setup;
use softgrip::TICK_US;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;

use crate::case::Case;
use crate::record::{ObjectOutcome, Recording};

/// A loss that is not reported this long after its onset is missed, ms.
pub const MISSED_MS: f64 = 500.0;
/// A report while the object has moved less than this is not of the loss that may come later, mm.
pub const UNMOVED_MM: f32 = 1.0;
/// The object slides for good from the last moment when it had slid less than this, mm.
const SLIDE_MM: f32 = 0.5;

/// The controller's response to one recording at one level of noise.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Parameters of the run.
    pub case: Case,
    /// What happened to the object.
    pub outcome: ObjectOutcome,
    /// Noise of the gauges, µε rms.
    pub noise_ue: f64,
    /// When the controller reported *holding*, s since the start; none if never.
    pub holding_s: Option<f64>,
    /// The controller's first report that ends a hold.
    pub report: ControllerReport,
    /// The loss, if the object was lost.
    pub loss: Option<Loss>,
}

/// The first report of the controller that ends a hold.
#[derive(Debug, Clone, PartialEq)]
pub enum ControllerReport {
    /// No report that ends a hold.
    Nothing,
    /// The object is lost.
    Lost {
        /// Time of the report since the start of the run, s.
        t_s: f64,
        /// Displacement of the object at the report, mm.
        moved_mm: f32,
    },
    /// Something else that ended the hold.
    Other {
        /// Time of the report since the start of the run, s.
        t_s: f64,
        /// The reported event.
        event: Event,
    },
}

/// One true loss. Times count from the start of the run, s.
#[derive(Debug, Clone, Copy)]
pub struct Loss {
    /// The collapse: the true residual sum left 90 % of its plateau for good.
    pub onset_s: f64,
    /// Start of the slide.
    pub slide_s: f64,
    /// Displacement relative to the palm at the onset, mm.
    pub moved_onset_mm: f32,
    /// First warning of a slip before the report (s), and the displacement by then (mm).
    pub warning: Option<(f64, f32)>,
}

/// How a trial counts in the statistics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Classification {
    /// Held, and nothing said.
    Quiet,
    /// Lost and reported, so many ms after the onset.
    Reported(f64),
    /// Lost and not reported in time.
    Missed,
    /// Reported lost while it was held.
    FalseAlarm,
    /// The grip was not recognised before the lift.
    NotRecognised,
    /// Something else was reported instead.
    Misnamed,
    /// The object was moved out of place, but the fingers still press on it: neither is wrong.
    Displaced,
}

impl Classification {
    /// Whether the controller was wrong.
    pub fn is_wrong(self) -> bool {
        !matches!(self, Self::Quiet | Self::Reported(_) | Self::Displaced)
    }
}

impl Trial {
    /// Compares the report with what happened to the object.
    pub fn classification(&self) -> Classification {
        if self.holding_s.is_none() {
            return Classification::NotRecognised;
        }
        match (&self.loss, &self.report) {
            (_, ControllerReport::Other { .. }) => Classification::Misnamed,
            (_, ControllerReport::Lost { moved_mm, .. }) if *moved_mm < UNMOVED_MM => {
                Classification::FalseAlarm
            }
            (None, _) if self.outcome == ObjectOutcome::Displaced => Classification::Displaced,
            (None, ControllerReport::Lost { .. }) => Classification::FalseAlarm,
            (None, ControllerReport::Nothing) => Classification::Quiet,
            (Some(_), ControllerReport::Nothing) => Classification::Missed,
            (Some(loss), ControllerReport::Lost { t_s, .. }) => match 1e3 * (t_s - loss.onset_s) {
                ms if ms > MISSED_MS => Classification::Missed,
                ms => Classification::Reported(ms),
            },
        }
    }
}

/// Runs the controller over a recording, measured at `noise_ue` (µε rms), up to its first report that ends a hold.
///
/// # Errors
/// If the settings are not valid for the case's fingers.
pub fn judge(
    case: &Case,
    recording: &Recording,
    noise_ue: f64,
    settings: &Settings,
    base: &Setup,
) -> anyhow::Result<Trial> {
    let controller = case.controller(base.table(), settings)?;
    let (mut holding, mut slip, mut ended) = (None, None, None);
    recording.replay(case, noise_ue, controller, |tick, _, outputs| {
        for event in outputs.events.iter() {
            match event {
                Event::Holding { .. } => {
                    holding.get_or_insert(tick);
                }
                Event::Slip { .. } if tick >= recording.lift => {
                    slip.get_or_insert(tick);
                }
                Event::Lost { .. } | Event::AirLoss | Event::Fault { .. } | Event::Empty => {
                    ended.get_or_insert((tick, *event));
                }
                _ => {}
            }
        }
        match ended {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    });
    let report = match ended {
        None => ControllerReport::Nothing,
        Some((tick, Event::Lost { .. })) => ControllerReport::Lost {
            t_s: seconds(tick),
            moved_mm: recording.at(tick).moved_mm,
        },
        Some((tick, event)) => ControllerReport::Other {
            t_s: seconds(tick),
            event,
        },
    };
    let outcome = recording.outcome();
    let loss = match outcome {
        ObjectOutcome::Held | ObjectOutcome::Displaced => None,
        ObjectOutcome::Lost { onset } => Some(Loss {
            onset_s: seconds(onset),
            slide_s: seconds(slide(recording)),
            moved_onset_mm: recording.at(onset).moved_mm,
            warning: slip.map(|tick| (seconds(tick), recording.at(tick).moved_mm)),
        }),
    };
    Ok(Trial {
        case: case.clone(),
        outcome,
        noise_ue,
        holding_s: holding.filter(|&tick| tick <= recording.lift).map(seconds),
        report,
        loss,
    })
}

/// The first tick at which the object has slid.
fn slide(recording: &Recording) -> usize {
    let mut carried = recording.carried();
    carried
        .find(|&tick| recording.at(tick).slid_mm > SLIDE_MM)
        .unwrap_or(recording.lift)
}

/// Time of a tick, s.
pub fn seconds(tick: usize) -> f64 {
    tick as f64 * TICK_US as f64 * 1e-6
}

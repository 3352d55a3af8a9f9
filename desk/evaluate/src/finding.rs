//! What the statistics need of one case, small enough to be kept and joined.

use serde::{Deserialize, Deserializer, Serialize};
use sim::scenario::ObjectKind;

use crate::case::{Case, Origin};
use crate::roc::Race;
use crate::trial::{Classification, ControllerReport, Trial};
use crate::{details, losses};

/// What one case gave.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Finding {
    /// Kind of object.
    #[serde(deserialize_with = "object")]
    pub object: ObjectKind,
    /// What made the object fall, or might have.
    pub origin: Origin,
    /// At each of [`crate::options::NOISE_UE`].
    pub trials: Vec<Response>,
    /// As the controller at other settings, and the rules of others, saw it; none if nothing was lost.
    pub race: Option<Race>,
}

/// The controller's response at one level of noise.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Response {
    /// How it counts.
    pub classification: Classification,
    /// Whether the controller said that the object was lost.
    pub said_lost: bool,
    /// Of a loss that was reported.
    pub slide: Option<Slide>,
    /// Row of the table of losses, if it is a loss.
    pub row: Option<String>,
    /// The trial in words, if somebody is to read it.
    pub line: Option<String>,
}

/// How far an object had gone before its loss was reported.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Slide {
    /// Time from the start of the slide to the report, ms.
    pub lost_ms: f64,
    /// Displacement relative to the palm at the report, mm.
    pub lost_mm: f64,
    /// Displacement at the warning of a slip, mm; none if there was no warning.
    pub warned_mm: Option<f64>,
}

impl Finding {
    /// What is kept of a case. With `in_words` every trial is, and not only those that went wrong.
    pub fn of(case: &Case, trials: &[Trial], race: Option<Race>, in_words: bool) -> Self {
        let trials = trials.iter().map(|trial| Response::of(trial, in_words));
        Self {
            object: case.setup.scenario.object,
            origin: case.origin(),
            trials: trials.collect(),
            race,
        }
    }

    /// Whether the object was lost.
    pub fn is_loss(&self) -> bool {
        self.race.is_some()
    }
}

impl Response {
    /// What is kept of a trial; in words always if they are asked for, else if it went wrong.
    pub fn of(trial: &Trial, in_words: bool) -> Self {
        let classification = trial.classification();
        let slide = match (classification, &trial.report, trial.loss) {
            (Classification::Reported(_), ControllerReport::Lost { t_s, moved_mm }, Some(loss)) => {
                Some(Slide {
                    lost_ms: 1e3 * (t_s - loss.slide_s),
                    lost_mm: (*moved_mm).into(),
                    warned_mm: loss.warning.map(|(_, mm)| mm.into()),
                })
            }
            _ => None,
        };
        let shown = in_words || classification.is_wrong();
        Self {
            classification,
            said_lost: matches!(trial.report, ControllerReport::Lost { .. }),
            slide,
            row: losses::row(trial),
            line: shown.then(|| details::line(trial)),
        }
    }
}

fn object<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ObjectKind, D::Error> {
    let name = String::deserialize(deserializer)?;
    name.parse().map_err(serde::de::Error::custom)
}

//! What the paper states: its finger, and its experiments with four objects at three accelerations.

use finger::recipe::Recipe;
use sim::run::Outcome;
use sim::scenario::ObjectKind;

/// The paper's own finger.
///
/// # Errors
/// If `recipes/paper.toml` is not valid.
pub fn recipe() -> anyhow::Result<Recipe> {
    let name = std::path::Path::new("recipes/paper.toml");
    Ok(finger::recipe::parse(
        name,
        include_str!("../../../recipes/paper.toml"),
    )?)
}

/// Accelerations of the arm, m/s².
pub const ACCELERATIONS: [f64; 3] = [2.0, 5.0, 10.0];

/// The outcome of a run as the paper states it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stated {
    /// The object arrives at its destination.
    Hold,
    /// It falls while being picked.
    Pick,
    /// It falls while being transferred.
    Transfer,
    /// It falls; when is not said.
    Fall,
    /// The paper says nothing.
    Unstated,
}

impl Stated {
    /// Name in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Pick => "pick",
            Self::Transfer => "transfer",
            Self::Fall => "fall",
            Self::Unstated => "unstated",
        }
    }

    /// Whether a simulated outcome agrees; none if the paper states nothing.
    pub fn agrees(self, outcome: Outcome) -> Option<bool> {
        match self {
            Self::Unstated => None,
            Self::Fall => Some(outcome != Outcome::Hold),
            Self::Hold => Some(outcome == Outcome::Hold),
            Self::Pick => Some(outcome == Outcome::Pick),
            Self::Transfer => Some(outcome == Outcome::Transfer),
        }
    }
}

/// An object of the paper, with the figures that show it and what the text says about them.
pub struct Experiment {
    /// Shape of the object.
    pub object: ObjectKind,
    /// Mass of the object, kg.
    pub mass_kg: f64,
    /// Figure with the object's displacement, and figure with the gauges' strain.
    pub figures: [u8; 2],
    /// The outcome at each of [`ACCELERATIONS`].
    pub stated: [Stated; 3],
    /// The paper's own words.
    pub words: &'static str,
}

/// All of them (paper, sections 4.2 and 4.4).
pub const EXPERIMENTS: [Experiment; 4] = [
    Experiment {
        object: ObjectKind::Sphere,
        mass_kg: 0.150,
        figures: [21, 25],
        stated: [Stated::Hold, Stated::Hold, Stated::Transfer],
        words: "can complete the grasping manipulation […] 2 m/s², 5 m/s², but with the higher acceleration of 10 m/s² the grasping manipulation is failed in the transferring step",
    },
    Experiment {
        object: ObjectKind::Sphere,
        mass_kg: 0.250,
        figures: [22, 26],
        // At 2 m/s² the phase is implied: "even in the picking step" is said of 5 and 10 alone.
        stated: [Stated::Transfer, Stated::Pick, Stated::Pick],
        words: "the falling phenomenon occurs with all conditions of the accelerations. The object falls immediately in the picking step for accelerations of 5 m/s² and 10 m/s²",
    },
    Experiment {
        object: ObjectKind::Cylinder,
        mass_kg: 0.080,
        figures: [23, 27],
        stated: [Stated::Hold, Stated::Hold, Stated::Fall],
        words: "the ability of the grasping manipulation with cylindrical objects is similar to that of spherical objects",
    },
    Experiment {
        object: ObjectKind::Cylinder,
        mass_kg: 0.150,
        figures: [24, 28],
        stated: [Stated::Unstated, Stated::Unstated, Stated::Pick],
        words: "the gripper cannot pick the cylindrical object with masses of 150 grams and the acceleration of 10 m/s²",
    },
];

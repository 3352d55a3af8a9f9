//! The paper's programme of experiments: four objects at three accelerations, what it says about each,
//! what the twin does, and how much of that hangs on a millimetre.

use anyhow::Context;
use finger::recipe::Recipe;
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::scenario::ObjectKind;
use crate::setup::Setup;
use crate::sim::{Outcome, Run};

/// Pressure of every grasp (paper, section 4.2), kPa.
const PRESSURE_KPA: f64 = 140.0;
/// Accelerations of the arm, m/s².
pub const ACCELERATIONS: [f64; 3] = [2.0, 5.0, 10.0];

/// What the paper says about a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stated {
    /// The object arrives.
    Hold,
    /// It falls while being picked.
    Pick,
    /// It falls while being transferred.
    Transfer,
    /// It falls; when is not said.
    Fall,
    /// Nothing.
    Unstated,
}

impl Stated {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Pick => "pick",
            Self::Transfer => "transfer",
            Self::Fall => "fall",
            Self::Unstated => "unstated",
        }
    }

    /// Whether the physics did that, if anything is stated.
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
    /// Kind of object.
    pub object: ObjectKind,
    /// Its mass, kg.
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

/// A run of the programme beside what the paper says about it.
pub struct Case {
    /// The run.
    pub run: Run,
    /// What the paper says.
    pub stated: Stated,
    /// About which object.
    pub experiment: &'static Experiment,
}

impl Case {
    /// Whether the physics agrees with the paper, where it says anything.
    pub fn agrees(&self) -> Option<bool> {
        self.stated.agrees(self.run.outcome)
    }

    /// As `sim --json`, with the paper's word, its sentence, and whether the physics agrees. Without
    /// the speed of the simulation, which is no two times the same.
    pub fn json(&self) -> Value {
        let mut value = self.run.json();
        if let Some(fields) = value.as_object_mut() {
            fields.shift_remove("realtime_factor");
        }
        value["stated"] = json!(self.stated.name());
        value["paper"] = json!(self.experiment.words);
        value["agrees"] = json!(self.agrees());
        value
    }
}

/// The setups of the programme, in the order of the paper.
fn setups(base: &Setup) -> Vec<(&'static Experiment, Stated, Setup)> {
    let each = |experiment: &'static Experiment| {
        (0..ACCELERATIONS.len()).map(move |i| {
            let mut setup = base.clone();
            setup.scenario.object = experiment.object;
            setup.scenario.mass_kg = experiment.mass_kg;
            setup.scenario.accel_m_s2 = ACCELERATIONS[i];
            setup.scenario.pressure_kpa = PRESSURE_KPA;
            (experiment, experiment.stated[i], setup)
        })
    };
    EXPERIMENTS.iter().flat_map(each).collect()
}

/// Runs the programme in parallel; the result does not depend on how many threads there are.
pub fn run(recipe: &Recipe, bar: &ProgressBar) -> anyhow::Result<Vec<Case>> {
    let setups = setups(&Setup::of(recipe)?);
    setups
        .into_par_iter()
        .map(|(experiment, stated, setup)| {
            let run = setup.run(|_| ())?;
            bar.inc(1);
            Ok(Case {
                run,
                stated,
                experiment,
            })
        })
        .collect()
}

/// A change to every run of the programme.
struct Variation {
    name: &'static str,
    /// Whether it is about the gripper; otherwise about the simulation.
    physical: bool,
    apply: fn(&mut Setup),
}

const fn physical(name: &'static str, apply: fn(&mut Setup)) -> Variation {
    Variation {
        name,
        physical: true,
        apply,
    }
}

const fn numerical(name: &'static str, apply: fn(&mut Setup)) -> Variation {
    Variation {
        name,
        physical: false,
        apply,
    }
}

#[rustfmt::skip]
const VARIATIONS: [Variation; 13] = [
    physical("grasped 1 mm nearer to the palm", |s| s.gripped_mut().depth_m -= 1e-3),
    physical("grasped 1 mm nearer to the tips", |s| s.gripped_mut().depth_m += 1e-3),
    // A millimetre less, and the open fingers would stand inside the object.
    physical("palm radius −0.4 mm", |s| s.grasp.palm_radius_m -= 0.4e-3),
    physical("palm radius +1 mm", |s| s.grasp.palm_radius_m += 1e-3),
    physical("friction −0.02", |s| s.scenario.friction -= 0.02),
    physical("friction +0.02", |s| s.scenario.friction += 0.02),
    // The paper's two coefficients, 0.8 and 0.75.
    physical("friction 0.75 while sliding", |s| s.gripper.hand.sliding_friction = 0.9375),
    physical("jerk ramp −10 ms", |s| s.gripper.arm.jerk_ramp_ms -= 10.0),
    physical("jerk ramp +10 ms", |s| s.gripper.arm.jerk_ramp_ms += 10.0),
    physical("joint stiffness −10 %", |s| s.stiffness_factor = 0.9),
    physical("joint stiffness +10 %", |s| s.stiffness_factor = 1.1),
    numerical("step 0.5 ms", |s| s.gripper.world.step_ms = 0.5),
    numerical("step 2 ms", |s| s.gripper.world.step_ms = 2.0),
];

/// The programme under one change.
pub struct Varied {
    /// What was changed.
    pub name: &'static str,
    /// Whether it is about the gripper; otherwise about the simulation.
    pub physical: bool,
    /// Outcomes, in the order of the programme.
    pub outcomes: Vec<Outcome>,
    /// What the controller got wrong, in the same order.
    pub mistakes: Vec<Option<String>>,
}

/// Runs that [`sensitivity`] makes, for a progress bar.
pub const SENSITIVITY_RUNS: u64 =
    (VARIATIONS.len() * EXPERIMENTS.len() * ACCELERATIONS.len()) as u64;

/// The programme again and again, each time with one change.
pub fn sensitivity(recipe: &Recipe, bar: &ProgressBar) -> anyhow::Result<Vec<Varied>> {
    let base = setups(&Setup::of(recipe)?);
    let runs: Vec<(Outcome, Option<String>)> = VARIATIONS
        .par_iter()
        .flat_map_iter(|variation| base.iter().map(move |(_, _, setup)| (variation, setup)))
        .map(|(variation, setup)| {
            let mut setup = setup.clone();
            (variation.apply)(&mut setup);
            let run = setup.run(|_| ()).with_context(|| variation.name)?;
            bar.inc(1);
            Ok((run.outcome, run.mistake()))
        })
        .collect::<anyhow::Result<_>>()?;
    let varied = VARIATIONS.iter().zip(runs.chunks(base.len()));
    Ok(varied
        .map(|(variation, runs)| Varied {
            name: variation.name,
            physical: variation.physical,
            outcomes: runs.iter().map(|run| run.0).collect(),
            mistakes: runs.iter().map(|run| run.1.clone()).collect(),
        })
        .collect())
}

/// Whether the outcome of a case stays the same under every change of the gripper.
pub fn robust(cases: &[Case], varied: &[Varied], case: usize) -> bool {
    let same = |varied: &Varied| varied.outcomes[case] == cases[case].run.outcome;
    varied.iter().filter(|v| v.physical).all(same)
}

/// One parameter of an edge case over a range.
pub struct Band {
    /// What is varied.
    pub name: &'static str,
    /// Its values.
    pub values: Vec<f64>,
    /// The outcome at each.
    pub outcomes: Vec<Outcome>,
}

type Scan = (&'static str, [f64; 9], fn(&mut Setup, f64));

#[rustfmt::skip]
const SCANS: [Scan; 4] = [
    ("friction", [0.72, 0.74, 0.76, 0.78, 0.80, 0.82, 0.84, 0.86, 0.88], |s, x| s.scenario.friction = x),
    ("further from the palm, mm", [-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0], |s, x| s.gripped_mut().depth_m += 1e-3 * x),
    ("jerk ramp, ms", [7.0, 17.0, 27.0, 37.0, 47.0, 57.0, 67.0, 77.0, 87.0], |s, x| s.gripper.arm.jerk_ramp_ms = x),
    ("pressure, kPa", [132.0, 134.0, 136.0, 138.0, 140.0, 142.0, 144.0, 146.0, 148.0], |s, x| s.scenario.pressure_kpa = x),
];

/// The outcomes of case number `case` over ranges of four parameters.
pub fn bands(recipe: &Recipe, case: usize) -> anyhow::Result<Vec<Band>> {
    let (_, _, base) = &setups(&Setup::of(recipe)?)[case];
    SCANS
        .par_iter()
        .map(|(name, values, apply)| {
            let outcome = |&value: &f64| {
                let mut setup = base.clone();
                apply(&mut setup, value);
                Ok(setup.run(|_| ())?.outcome)
            };
            Ok(Band {
                name,
                values: values.to_vec(),
                outcomes: values
                    .par_iter()
                    .map(outcome)
                    .collect::<anyhow::Result<_>>()?,
            })
        })
        .collect()
}

/// What the sensitivity says, for a program.
pub fn sensitivity_json(cases: &[Case], varied: &[Varied]) -> Value {
    let name = |outcomes: &[Outcome]| -> Vec<_> { outcomes.iter().map(|o| o.name()).collect() };
    let outcomes: Vec<Outcome> = cases.iter().map(|case| case.run.outcome).collect();
    json!({
        "runs": cases.iter().map(|case| crate::report::title(&case.run.scenario)).collect::<Vec<_>>(),
        "outcomes": name(&outcomes),
        "robust": (0..cases.len()).map(|i| robust(cases, varied, i)).collect::<Vec<_>>(),
        "varied": varied.iter().map(|v| json!({
            "change": v.name,
            "outcomes": name(&v.outcomes),
            "mistakes": v.mistakes,
        })).collect::<Vec<_>>(),
    })
}

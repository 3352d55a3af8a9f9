//! The paper's experiments on the simulated gripper, and the sensitivity of their outcomes.

pub mod figures;
pub mod page;

use anyhow::Context;
use rayon::prelude::*;
use serde_json::{Value, json};
use sim::run::{Outcome, Run};
use sim::setup::Setup;

use crate::paper::{ACCELERATIONS, EXPERIMENTS, Experiment, Stated};

/// Pressure of every grasp (paper, section 4.2), kPa.
const PRESSURE_KPA: f64 = 140.0;

/// A simulated run with what the paper says about it.
pub struct Case {
    /// The simulated run.
    pub run: Run,
    /// The outcome that the paper states.
    pub stated: Stated,
    /// The experiment it belongs to.
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
        let mut value = report::json::run(&self.run);
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
///
/// # Errors
/// If a setup is impossible.
pub fn run(base: &Setup, done: impl Fn() + Sync) -> anyhow::Result<Vec<Case>> {
    setups(base)
        .into_par_iter()
        .map(|(experiment, stated, setup)| {
            let run = setup.run(|_| ())?;
            done();
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
    /// Whether it changes the gripper; otherwise it changes the simulation.
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

/// The twelve runs under one change.
pub struct Varied {
    /// Name of the change.
    pub name: &'static str,
    /// Whether it changes the gripper; otherwise it changes the simulation.
    pub physical: bool,
    /// Outcomes, in the order of the programme.
    pub outcomes: Vec<Outcome>,
    /// The controller's mistakes, in the same order; none if it made none.
    pub mistakes: Vec<Option<String>>,
}

/// Runs that [`sensitivity`] makes, for a progress bar.
pub const SENSITIVITY_RUNS: u64 =
    (VARIATIONS.len() * EXPERIMENTS.len() * ACCELERATIONS.len()) as u64;

/// The programme again and again, each time with one change.
///
/// # Errors
/// If a setup is impossible.
pub fn sensitivity(base: &Setup, done: impl Fn() + Sync) -> anyhow::Result<Vec<Varied>> {
    let base = setups(base);
    let runs: Vec<(Outcome, Option<String>)> = VARIATIONS
        .par_iter()
        .flat_map_iter(|variation| base.iter().map(move |(_, _, setup)| (variation, setup)))
        .map(|(variation, setup)| {
            let mut setup = setup.clone();
            (variation.apply)(&mut setup);
            let run = setup.run(|_| ()).with_context(|| variation.name)?;
            done();
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
    /// Name of the parameter, with its unit.
    pub name: &'static str,
    /// Values of the parameter.
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
///
/// # Errors
/// If a setup is impossible.
pub fn bands(base: &Setup, case: usize) -> anyhow::Result<Vec<Band>> {
    let (_, _, base) = &setups(base)[case];
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

/// The sensitivity study as JSON.
pub fn sensitivity_json(cases: &[Case], varied: &[Varied]) -> Value {
    let name = |outcomes: &[Outcome]| -> Vec<_> { outcomes.iter().map(|o| o.name()).collect() };
    let outcomes: Vec<Outcome> = cases.iter().map(|case| case.run.outcome).collect();
    json!({
        "runs": cases.iter().map(|case| report::words::title(&case.run.scenario)).collect::<Vec<_>>(),
        "outcomes": name(&outcomes),
        "robust": (0..cases.len()).map(|i| robust(cases, varied, i)).collect::<Vec<_>>(),
        "varied": varied.iter().map(|v| json!({
            "change": v.name,
            "outcomes": name(&v.outcomes),
            "mistakes": v.mistakes,
        })).collect::<Vec<_>>(),
    })
}

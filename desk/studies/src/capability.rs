//! The heaviest object that the simulated gripper carries to its destination, over the arm's acceleration.

use finger::capability::GRAVITY_M_S2;
use rayon::prelude::*;
use serde_json::{Value, json};

use plotters::prelude::SeriesLabelPosition;

use report::charts::{self, Look, Panel, Series};
use report::json::round;
use sim::run::Outcome;
use sim::setup::Setup;

/// Range of masses that are tried, kg.
const MASS_KG: (f64, f64) = (0.005, 5.0);
/// The limit is found to this, kg.
const RESOLUTION_KG: f64 = 0.001;

/// The limit at one acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// Greatest acceleration of the arm, m/s².
    pub accel_m_s2: f64,
    /// Heaviest object that arrives in the simulation, kg; none if even 5 g fall.
    pub simulated_kg: Option<f64>,
    /// What the finger model's statics predict for the lift, kg; none where it finds no equilibrium.
    pub static_kg: Option<f64>,
}

/// Limits at several accelerations, found side by side; `done` is called after each.
///
/// # Errors
/// If a setup is impossible.
pub fn limits(
    setup: &Setup,
    accels_m_s2: &[f64],
    done: impl Fn() + Sync,
) -> anyhow::Result<Vec<Limit>> {
    setup.check()?;
    let lift_n = static_lift_n(setup);
    accels_m_s2
        .par_iter()
        .map(|&accel_m_s2| {
            let simulated_kg = heaviest(setup, accel_m_s2)?;
            done();
            Ok(Limit {
                accel_m_s2,
                simulated_kg,
                static_kg: lift_n.map(|lift| lift / (GRAVITY_M_S2 + accel_m_s2)),
            })
        })
        .collect()
}

/// Greatest force against gravity that the finger model finds, on the way from the grasp to the tips.
pub fn static_lift_n(setup: &Setup) -> Option<f64> {
    let gripped = setup.gripped();
    let mut grip = setup.grasp.grip(&setup.chain, setup.scenario.pressure_kpa);
    grip.friction = setup.scenario.friction;
    let strongest = grip.strongest(gripped.object, gripped.depth_m);
    strongest.ok().map(|hold| hold.lift_n)
}

/// By bisection. A lighter object is taken to be held where a heavier one is.
fn heaviest(setup: &Setup, accel_m_s2: f64) -> anyhow::Result<Option<f64>> {
    let held = |mass_kg: f64| -> anyhow::Result<bool> {
        let mut setup = setup.clone();
        setup.scenario.mass_kg = mass_kg;
        setup.scenario.accel_m_s2 = accel_m_s2;
        Ok(setup.run(|_| ())?.outcome == Outcome::Hold)
    };
    let (mut light, most) = MASS_KG;
    if !held(light)? {
        return Ok(None);
    }
    // Up by doubling, so that heavy objects, which fly about, are not tried without need.
    let mut heavy = 0.08;
    while held(heavy)? {
        light = heavy;
        if heavy >= most {
            return Ok(Some(most));
        }
        heavy = (2.0 * heavy).min(most);
    }
    while heavy - light > RESOLUTION_KG {
        let middle = (light + heavy) / 2.0;
        if held(middle)? {
            light = middle;
        } else {
            heavy = middle;
        }
    }
    Ok(Some(light))
}

/// The limits as JSON, with the setup they hold for.
pub fn json(setup: &Setup, limits: &[Limit]) -> Value {
    json!({
        "object": setup.scenario.object,
        "pressure_kpa": setup.scenario.pressure_kpa,
        "friction": setup.scenario.friction,
        "limits": limits.iter().map(|limit| json!({
            "accel_m_s2": limit.accel_m_s2,
            "mass_kg": limit.simulated_kg.map(|kg| round(kg, 4)),
            "static_mass_kg": limit.static_kg.map(|kg| round(kg, 4)),
        })).collect::<Vec<_>>(),
    })
}

/// Lines of a chart, in grams.
pub fn series(limits: &[Limit]) -> [Series; 2] {
    let line = |name: &str, look, n, kg: fn(&Limit) -> Option<f64>| Series {
        name: name.into(),
        look,
        color: charts::color(n),
        points: limits
            .iter()
            .filter_map(|limit| Some((limit.accel_m_s2, 1e3 * kg(limit)?)))
            .collect(),
    };
    [
        line("simulation, whole cycle", Look::Line, 0, |limit| {
            limit.simulated_kg
        }),
        line(
            "statics of the finger model, lift",
            Look::Dashed,
            1,
            |limit| limit.static_kg,
        ),
    ]
}

/// Mass limit over the arm's acceleration as an SVG chart.
///
/// # Errors
/// If the drawing library fails.
pub fn chart(setup: &Setup, limits: &[Limit]) -> anyhow::Result<String> {
    let series = series(limits);
    let most = series
        .iter()
        .flat_map(|series| &series.points)
        .fold((1.0, 1.0), |most: (f64, f64), at| {
            (most.0.max(at.0), most.1.max(at.1))
        });
    let scenario = &setup.scenario;
    let panel = Panel {
        title: format!(
            "Heaviest {} at {} kPa, friction {}",
            scenario.object, scenario.pressure_kpa, scenario.friction
        ),
        x_label: "greatest acceleration, m/s²",
        y_label: "mass, g",
        x: 0.0..1.05 * most.0,
        y: 0.0..1.15 * most.1,
        stages: Vec::new(),
        series: series.into(),
        legend: Some(SeriesLabelPosition::LowerLeft),
    };
    Ok(charts::standalone(&charts::draw(&[panel], 1, (720, 460))?))
}

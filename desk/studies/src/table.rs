//! The table of a finger, compared with the published numbers.

mod plots;
mod text;

use std::time::Instant;

use finger::cartesian;
use finger::chain::{Chain, LINKS};
use finger::geometry::Geometry;
use finger::model::{ModelError, Solved};
use finger::recipe::Recipe;
use serde_json::{Value, json};

use report::json::round;
use softgrip::table::FingerTable;

use crate::paper;

/// Pressures of the paper's table 3, kPa.
const PUBLISHED_KPA: [f64; 6] = [60.0, 80.0, 100.0, 120.0, 140.0, 160.0];

/// Change of the tip angle when one thing about the finger changes.
struct Sensitivity {
    /// Description of the change.
    change: &'static str,
    /// Change of the tip angle at each of the pressures, percent; none where a section has no stable state.
    tip_angle_percent: Option<Vec<f64>>,
}

/// A finger, its table, and the paper's finger to compare with.
pub struct TableReport {
    recipe: Recipe,
    table: FingerTable,
    /// Time to get from the recipe's text to the table, s.
    generation_s: f64,
    published: Chain,
    pressures_kpa: Vec<f64>,
    /// The continuum at these pressures, of a finger that is described by its geometry.
    solved: Option<Solved>,
    sensitivity: Vec<Sensitivity>,
}

impl TableReport {
    /// Tabulates the recipe that `load` reads. Pressures that are not asked for are the published ones, or
    /// the highest of a finger that ends below them.
    ///
    /// # Errors
    /// If the recipe cannot be read or tabulated, or a pressure is beyond it.
    pub fn new(
        load: impl FnOnce() -> anyhow::Result<Recipe>,
        pressures_kpa: &[f64],
    ) -> anyhow::Result<Self> {
        let start = Instant::now();
        let recipe = load()?;
        let table = finger::table::of(&recipe)?;
        let generation_s = start.elapsed().as_secs_f64();

        let max = recipe.chain.max_pressure_kpa();
        for &pressure in pressures_kpa {
            anyhow::ensure!(
                (0.0..=max).contains(&pressure),
                "--pressure {pressure}: must lie within 0 and {max} kPa, the range of the recipe"
            );
        }
        let mut pressures_kpa = match pressures_kpa {
            [] => published_up_to(max),
            asked => asked.to_vec(),
        };
        pressures_kpa.sort_by(f64::total_cmp);
        pressures_kpa.dedup();
        let (solved, sensitivity) = match &recipe.geometry {
            Some(geometry) => (
                Some(geometry.solve(&pressures_kpa)?),
                sensitivity(geometry, &pressures_kpa)?,
            ),
            None => (None, Vec::new()),
        };
        Ok(Self {
            table,
            generation_s,
            published: paper::recipe()?.chain,
            recipe,
            pressures_kpa,
            solved,
            sensitivity,
        })
    }

    /// The report as JSON. Lists run over pressures, inner lists over joints or positions.
    pub fn json(&self) -> Value {
        let (table, chain) = (&self.table, &self.recipe.chain);
        let asked = &self.pressures_kpa;
        let solved = self.solved.as_ref();
        let places = |value: fn(&finger::model::Bend) -> &Vec<f64>| {
            solved.map(|solved| -> Vec<Vec<f64>> {
                let numbers = |bend| value(bend).iter().map(|&x| number(x)).collect();
                solved.bends.iter().map(numbers).collect()
            })
        };
        json!({
            "recipe": table.recipe,
            "inputs_hash": format!("{:016x}", table.inputs_hash),
            "generation_s": round(self.generation_s, 3),
            "max_pressure_kpa": table.max_pressure_kpa,
            "rows": table.rows.len(),
            "bytes": size_of::<FingerTable>(),
            "interpolation_error_percent": number(table.error_bound_percent.into()),
            "lift_error_percent": number(table.lift_error_percent.into()),
            "link_mass_g": masses(chain).map(number),
            "joint_stiffness_nmm_per_deg": stiffness(chain).map(number),
            "pressure_kpa": asked,
            "free_strain_ue": over(asked, |p| number(chain.free_strain_ue(p))),
            "tip_angle_deg": over(asked, |p| number(chain.tip_angle_rad(p).to_degrees())),
            "tip_mm": over(asked, |p| chain.tip_position_m(p).map(|m| number(1e3 * m))),
            "joint_angle_deg": over(asked, |p| angles(chain, p).map(number)),
            "torque_nmm": over(asked, |p| torques(chain, p).map(number)),
            "lift_n": over(asked, |p| self.lift_n(p).map(|lift| lift.map(number))),
            "place_mm": solved.map(|solved| -> Vec<f64> {
                solved.arc_m.iter().map(|m| number(1e3 * m)).collect()
            }),
            "curvature_per_m": places(|bend| &bend.curvature_per_m),
            "axial_stretch": places(|bend| &bend.stretch),
            "chain_tip_error_percent": solved.map(|solved| -> Vec<f64> {
                let error = |bend| number(100.0 * solved.chain_tip_error(bend));
                solved.bends.iter().map(error).collect()
            }),
            "sensitivity": self.sensitivity.iter().map(|s| json!({
                "change": s.change,
                "tip_angle_percent": s.tip_angle_percent.as_ref().map(|list| {
                    list.iter().map(|&x| number(x)).collect::<Vec<_>>()
                }),
            })).collect::<Vec<_>>(),
            "published": {
                "joint_stiffness_nmm_per_deg": stiffness(&self.published).map(number),
                "link_mass_g": masses(&self.published).map(number),
                "pressure_kpa": PUBLISHED_KPA,
                "tip_angle_deg": over(&PUBLISHED_KPA, |p| number(self.published.tip_angle_rad(p).to_degrees())),
                "joint_angle_deg": over(&PUBLISHED_KPA, |p| angles(&self.published, p).map(number)),
                "torque_nmm": over(&PUBLISHED_KPA, |p| torques(&self.published, p).map(number)),
            },
            "joint_angle_rms_error_deg": number(self.joint_angle_rms_deg()),
        })
    }

    /// Root mean square of the differences of joint angles to the published `T_i / k_i` (tables 2 and 3).
    fn joint_angle_rms_deg(&self) -> f64 {
        let max = self.recipe.chain.max_pressure_kpa();
        let differences: Vec<f64> = PUBLISHED_KPA
            .into_iter()
            .filter(|&p| p <= max)
            .flat_map(|p| {
                let (ours, theirs) = (angles(&self.recipe.chain, p), angles(&self.published, p));
                std::array::from_fn::<f64, LINKS, _>(|i| ours[i] - theirs[i])
            })
            .collect();
        let squares: f64 = differences.iter().map(|d| d * d).sum();
        (squares / differences.len().max(1) as f64).sqrt()
    }

    /// Lift on sphere and cylinder, N, as the controller looks it up; none where it is not known.
    fn lift_n(&self, pressure_kpa: f64) -> [Option<f64>; 2] {
        let last = self.table.rows.len() - 1;
        let position = pressure_kpa / f64::from(self.table.max_pressure_kpa) * last as f64;
        let i = (position as usize).min(last - 1);
        let t = position - i as f64;
        let [low, high] = [i, i + 1].map(|i| self.table.rows[i].lift_n.map(f64::from));
        // The upper of two rows counts only if it has a share beyond rounding.
        let needed = i + 1 + usize::from(t > 1e-3);
        std::array::from_fn(|k| {
            let known = needed <= usize::from(self.table.lift_rows[k]);
            known.then(|| low[k] + t * (high[k] - low[k]))
        })
    }

    /// The tip angle of the paper's own formulation (eqs. 1–16), degrees, or why there is none.
    fn paper_tip_angle_deg(&self, pressure_kpa: f64) -> Option<Result<f64, String>> {
        let geometry = self.recipe.geometry.as_ref()?;
        Some(
            cartesian::paper_shape(geometry, pressure_kpa)
                .map(|shape| shape.tip_angle_rad.to_degrees())
                .map_err(|error| error.to_string()),
        )
    }
}

/// The published pressures that a finger reaches, or its highest if it reaches none, kPa.
fn published_up_to(max_kpa: f64) -> Vec<f64> {
    match max_kpa < PUBLISHED_KPA[0] {
        true => vec![max_kpa],
        false => PUBLISHED_KPA
            .into_iter()
            .filter(|&p| p <= max_kpa)
            .collect(),
    }
}

/// Sensitivity of the tip angle to 0.1 mm and 10 %.
fn sensitivity(geometry: &Geometry, pressures_kpa: &[f64]) -> anyhow::Result<Vec<Sensitivity>> {
    type Change = fn(&mut Geometry);
    const TENTH_M: f64 = 1e-4;
    let changes: [(&'static str, Change); 8] = [
        ("outer radius +0.1 mm", |g| {
            sections(g, |s| s.outer_radius_m += TENTH_M)
        }),
        ("outer radius -0.1 mm", |g| {
            sections(g, |s| s.outer_radius_m -= TENTH_M)
        }),
        ("bore radius +0.1 mm", |g| {
            sections(g, |s| s.bore_radius_m += TENTH_M)
        }),
        ("bore radius -0.1 mm", |g| {
            sections(g, |s| s.bore_radius_m -= TENTH_M)
        }),
        ("bore offset +0.1 mm", |g| {
            sections(g, |s| s.bore_offset_m += TENTH_M)
        }),
        ("bore offset -0.1 mm", |g| {
            sections(g, |s| s.bore_offset_m -= TENTH_M)
        }),
        ("rubber 10 % stiffer", |g| stiffen(g, 1.1)),
        ("rubber 10 % softer", |g| stiffen(g, 0.9)),
    ];
    let tip_angles = |geometry: &Geometry| -> Result<Vec<f64>, ModelError> {
        let solved = geometry.solve(pressures_kpa)?;
        Ok(solved
            .bends
            .iter()
            .map(|bend| bend.curve.tip_angle_rad())
            .collect())
    };
    let nominal = tip_angles(geometry)?;
    Ok(changes
        .into_iter()
        .map(|(change, apply)| {
            let mut changed = geometry.clone();
            apply(&mut changed);
            let percent = |changed: Vec<f64>| {
                let pairs = changed.iter().zip(&nominal);
                pairs
                    // Without pressure there is no angle to change.
                    .map(|(c, n)| if *n > 0.0 { 100.0 * (c / n - 1.0) } else { 0.0 })
                    .collect()
            };
            Sensitivity {
                change,
                tip_angle_percent: tip_angles(&changed).ok().map(percent),
            }
        })
        .collect())
}

fn sections(geometry: &mut Geometry, change: impl Fn(&mut finger::section::Section)) {
    for (_, section) in &mut geometry.stations {
        change(section);
    }
}

fn stiffen(geometry: &mut Geometry, factor: f64) {
    geometry.youngs_modulus_pa *= factor;
    geometry.rubber = geometry.rubber.scaled(factor);
}

fn number(x: f64) -> f64 {
    round(x, 6)
}

fn over<T>(pressures_kpa: &[f64], value: impl Fn(f64) -> T) -> Vec<T> {
    pressures_kpa.iter().map(|&p| value(p)).collect()
}

fn stiffness(chain: &Chain) -> [f64; LINKS] {
    chain
        .joint_stiffness_nm_per_rad
        .map(|k| 1e3 * k * 1f64.to_radians())
}

fn masses(chain: &Chain) -> [f64; LINKS] {
    chain.link_mass_kg.map(|kg| 1e3 * kg)
}

fn torques(chain: &Chain, pressure_kpa: f64) -> [f64; LINKS] {
    chain.joint_torques_nm(pressure_kpa).map(|nm| 1e3 * nm)
}

fn angles(chain: &Chain, pressure_kpa: f64) -> [f64; LINKS] {
    chain.joint_angles_rad(pressure_kpa).map(f64::to_degrees)
}

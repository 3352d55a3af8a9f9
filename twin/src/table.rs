//! `softgrip table`: a finger's table, its error bound, and the published numbers beside it.

use std::fmt::Write;
use std::path::Path;

use finger::chain::{Chain, LINKS};
use finger::recipe::{self, Recipe};
use finger::table::Table;
use serde_json::{Value, json};

/// Pressures of the paper's table 3, kPa.
const PUBLISHED_KPA: [f64; 6] = [60.0, 80.0, 100.0, 120.0, 140.0, 160.0];

/// A finger, its table, and the paper's finger to compare with.
pub struct Report {
    recipe: Recipe,
    table: Table,
    published: Chain,
    pressures_kpa: Vec<f64>,
}

impl Report {
    /// Tabulates a recipe. Pressures that are not asked for are the published ones.
    pub fn new(recipe: Recipe, pressures_kpa: &[f64]) -> anyhow::Result<Self> {
        let max = recipe.chain.max_pressure_kpa();
        for &pressure in pressures_kpa {
            anyhow::ensure!(
                (0.0..=max).contains(&pressure),
                "--pressure {pressure}: must lie within 0 and {max} kPa, the range of the recipe"
            );
        }
        let pressures_kpa = if pressures_kpa.is_empty() {
            PUBLISHED_KPA.into_iter().filter(|&p| p <= max).collect()
        } else {
            pressures_kpa.to_vec()
        };
        Ok(Self {
            table: Table::of(&recipe),
            published: paper()?.chain,
            recipe,
            pressures_kpa,
        })
    }

    /// For a person.
    pub fn text(&self) -> String {
        let chain = &self.recipe.chain;
        let table = &self.table;
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "recipe {}, inputs {:016x}\n{} rows to {} kPa, {} bytes of flash; interpolation error at most {:.3} % of full scale\n",
            table.recipe,
            table.inputs_hash,
            table.rows.len(),
            table.max_pressure_kpa,
            size_of::<softgrip::table::FingerTable>(),
            table.error_bound_percent,
        );
        let stiffness = |chain: &Chain| {
            chain
                .joint_stiffness_nm_per_rad
                .map(|k| 1e3 * k * 1f64.to_radians())
        };
        let _ = writeln!(
            out,
            "joint                     {}",
            columns(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 0)
        );
        let _ = writeln!(
            out,
            "stiffness, N·mm/deg       {}",
            columns(&stiffness(chain), 2)
        );
        let _ = writeln!(
            out,
            "          published       {}",
            columns(&stiffness(&self.published), 2)
        );
        let _ = writeln!(
            out,
            "link mass, g              {}",
            columns(&chain.link_mass_kg.map(|m| 1e3 * m), 2)
        );
        let _ = writeln!(
            out,
            "          published       {}\n",
            columns(&self.published.link_mass_kg.map(|m| 1e3 * m), 2)
        );
        let _ = writeln!(
            out,
            " kPa  strain, µε  tip, deg  tip x, y, mm      joint torque, N·mm"
        );
        for &pressure in &self.pressures_kpa {
            let tip = chain.tip_position_m(pressure);
            let _ = writeln!(
                out,
                "{pressure:4.0}  {:10.0}  {:8.2}  {:6.1} {:6.1}    {}",
                chain.free_strain_ue(pressure),
                chain.tip_angle_rad(pressure).to_degrees(),
                1e3 * tip[0],
                1e3 * tip[1],
                columns(&torques(chain, pressure), 2),
            );
            if PUBLISHED_KPA.contains(&pressure) {
                let _ = writeln!(
                    out,
                    "      published   {:8.2}                    {}",
                    self.published.tip_angle_rad(pressure).to_degrees(),
                    columns(&torques(&self.published, pressure), 2),
                );
            }
        }
        out
    }

    /// For a program. Lists run over pressures, inner lists over joints.
    pub fn json(&self) -> Value {
        let chain = &self.recipe.chain;
        let table = &self.table;
        let over = |value: &dyn Fn(f64) -> Value| -> Vec<Value> {
            self.pressures_kpa.iter().map(|&p| value(p)).collect()
        };
        json!({
            "recipe": table.recipe,
            "inputs_hash": format!("{:016x}", table.inputs_hash),
            "max_pressure_kpa": table.max_pressure_kpa,
            "rows": table.rows.len(),
            "bytes": size_of::<softgrip::table::FingerTable>(),
            "interpolation_error_percent": table.error_bound_percent,
            "link_mass_g": chain.link_mass_kg.map(|m| 1e3 * m),
            "joint_stiffness_nmm_per_deg": chain.joint_stiffness_nm_per_rad.map(|k| 1e3 * k * 1f64.to_radians()),
            "pressure_kpa": self.pressures_kpa,
            "free_strain_ue": over(&|p| json!(chain.free_strain_ue(p))),
            "tip_angle_deg": over(&|p| json!(chain.tip_angle_rad(p).to_degrees())),
            "tip_mm": over(&|p| json!(chain.tip_position_m(p).map(|m| 1e3 * m))),
            "joint_angle_deg": over(&|p| json!(chain.joint_angles_rad(p).map(f64::to_degrees))),
            "torque_nmm": over(&|p| json!(torques(chain, p))),
            "published": {
                "joint_stiffness_nmm_per_deg": self.published.joint_stiffness_nm_per_rad.map(|k| 1e3 * k * 1f64.to_radians()),
                "link_mass_g": self.published.link_mass_kg.map(|m| 1e3 * m),
                "pressure_kpa": PUBLISHED_KPA,
                "tip_angle_deg": PUBLISHED_KPA.map(|p| self.published.tip_angle_rad(p).to_degrees()),
                "torque_nmm": PUBLISHED_KPA.map(|p| torques(&self.published, p)),
            },
        })
    }
}

/// The paper's own finger.
pub fn paper() -> anyhow::Result<Recipe> {
    let name = Path::new("recipes/paper.toml");
    Ok(recipe::parse(
        name,
        include_str!("../../recipes/paper.toml"),
    )?)
}

fn torques(chain: &Chain, pressure_kpa: f64) -> [f64; LINKS] {
    chain.joint_torques_nm(pressure_kpa).map(|nm| 1e3 * nm)
}

fn columns(values: &[f64; LINKS], decimals: usize) -> String {
    values.map(|value| format!("{value:8.decimals$}")).concat()
}

//! `softgrip table`: a finger's table, its error bound, and the published numbers beside it.

use std::fmt::Write;
use std::path::Path;

use finger::chain::{Chain, LINKS};
use finger::recipe::{self, Recipe};
use finger::table::Table;
use serde_json::{Value, json};

use crate::json::round;

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
            table: Table::of(&recipe)?,
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
        for (name, values) in [
            ("joint", std::array::from_fn(|i| format!("{}", i + 1))),
            ("stiffness, N·mm/deg", stiffness(chain).map(two_decimals)),
            (
                "        published",
                stiffness(&self.published).map(two_decimals),
            ),
            ("link mass, g", masses(chain).map(two_decimals)),
            (
                "        published",
                masses(&self.published).map(two_decimals),
            ),
        ] {
            let _ = writeln!(out, "{name:<24}  {}", columns(&values));
        }
        let _ = writeln!(
            out,
            "\n kPa  strain, µε  tip, deg  tip x, y, mm      joint torque, N·mm"
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
                columns(&torques(chain, pressure).map(two_decimals)),
            );
            if PUBLISHED_KPA.contains(&pressure) {
                let _ = writeln!(
                    out,
                    "      published   {:8.2}                    {}",
                    self.published.tip_angle_rad(pressure).to_degrees(),
                    columns(&torques(&self.published, pressure).map(two_decimals)),
                );
            }
        }
        out
    }

    /// For a program. Lists run over pressures, inner lists over joints.
    pub fn json(&self) -> Value {
        let (table, chain) = (&self.table, &self.recipe.chain);
        let asked = &self.pressures_kpa;
        json!({
            "recipe": table.recipe,
            "inputs_hash": format!("{:016x}", table.inputs_hash),
            "max_pressure_kpa": table.max_pressure_kpa,
            "rows": table.rows.len(),
            "bytes": size_of::<softgrip::table::FingerTable>(),
            "interpolation_error_percent": number(table.error_bound_percent.into()),
            "link_mass_g": masses(chain).map(number),
            "joint_stiffness_nmm_per_deg": stiffness(chain).map(number),
            "pressure_kpa": asked,
            "free_strain_ue": over(asked, |p| number(chain.free_strain_ue(p))),
            "tip_angle_deg": over(asked, |p| number(chain.tip_angle_rad(p).to_degrees())),
            "tip_mm": over(asked, |p| chain.tip_position_m(p).map(|m| number(1e3 * m))),
            "joint_angle_deg": over(asked, |p| chain.joint_angles_rad(p).map(|a| number(a.to_degrees()))),
            "torque_nmm": over(asked, |p| torques(chain, p).map(number)),
            "published": {
                "joint_stiffness_nmm_per_deg": stiffness(&self.published).map(number),
                "link_mass_g": masses(&self.published).map(number),
                "pressure_kpa": PUBLISHED_KPA,
                "tip_angle_deg": over(&PUBLISHED_KPA, |p| number(self.published.tip_angle_rad(p).to_degrees())),
                "torque_nmm": over(&PUBLISHED_KPA, |p| torques(&self.published, p).map(number)),
            },
        })
    }
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

fn two_decimals(value: f64) -> String {
    format!("{value:.2}")
}

fn columns(values: &[String; LINKS]) -> String {
    values.iter().map(|value| format!("{value:>8}")).collect()
}

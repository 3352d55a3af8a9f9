//! The table that the controller carries: the model on a uniform pressure grid.

use std::fmt::Write;

use crate::capability::GripError;
use crate::chain::{Chain, Grasp, Gripped, LINKS};
use crate::recipe::Recipe;

/// Rows of the table: 2 kPa apart for a finger up to 160 kPa. That keeps linear interpolation within
/// 0.1 % of full scale and the table within 4 KiB.
pub const ROWS: usize = 81;

/// Steps between two rows in which the interpolation is compared with the model: sixteen find the largest
/// deviation of a smooth column to better than 1 %.
const BETWEEN: usize = 16;

/// Least full scale of a column, in its unit: a finger that does not bend has none.
const LEAST_SCALE: f64 = 1e-3;

/// One pressure of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Gauge strain of the free finger, µε.
    pub free_strain_ue: f32,
    /// Angle of the last link, degrees.
    pub tip_angle_deg: f32,
    /// Tip along the unbent finger and towards the inside of the bend, mm.
    pub tip_mm: [f32; 2],
    /// Joint torques, N·mm.
    pub torque_nmm: [f32; LINKS],
    /// Force of three fingers against gravity on the sphere and on the cylinder, N; zero where it is
    /// not known.
    pub lift_n: [f32; 2],
}

/// The table and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the recipe.
    pub recipe: String,
    /// First eight bytes of the SHA-256 of the recipe.
    pub inputs_hash: u64,
    /// Largest deviation of the interpolated table from the model, in percent of each column's full
    /// scale; lift apart.
    pub error_bound_percent: f32,
    /// The same for the lift half-way between rows. It sets in with a kink where fingers first touch.
    pub lift_error_percent: f32,
    /// Rows, from the first on, whose lift of the sphere and of the cylinder is known: none without a
    /// grasp in the recipe, not all where fingers and object find no equilibrium.
    pub lift_rows: [u8; 2],
    /// Pressure of the last row, kPa; the first is at zero.
    pub max_pressure_kpa: f32,
    /// Joint stiffness, N·mm/deg.
    pub stiffness_nmm_per_deg: [f32; LINKS],
    /// The model at evenly spaced pressures.
    pub rows: [Row; ROWS],
}

impl Table {
    /// Tabulates the finger of `recipe`.
    ///
    /// # Errors
    /// [`GripError`], if a dimension of the grasp is wrong.
    pub fn of(recipe: &Recipe) -> Result<Self, GripError> {
        let chain = &recipe.chain;
        let max = chain.max_pressure_kpa();
        let step = max / (ROWS - 1) as f64;
        let mut rows: [Row; ROWS] = std::array::from_fn(|i| row(chain, step * i as f64));
        let (mut lift_error, mut full_lift) = (0.0, f32::MIN_POSITIVE);
        let mut lift_rows = [0; 2];
        if let Some(grasp) = &recipe.grasp {
            for (k, gripped) in [grasp.sphere, grasp.cylinder].into_iter().enumerate() {
                let (lift_n, error) = lift(chain, grasp, gripped)?;
                for (row, lift) in rows.iter_mut().zip(&lift_n) {
                    row.lift_n[k] = *lift;
                    full_lift = full_lift.max(*lift);
                }
                lift_rows[k] = lift_n.len() as u8;
                lift_error = f64::max(lift_error, error);
            }
        }
        let mut table = Self {
            recipe: recipe.name.clone(),
            inputs_hash: recipe.inputs_hash,
            error_bound_percent: 0.0,
            lift_error_percent: 100.0 * lift_error as f32 / full_lift,
            lift_rows,
            max_pressure_kpa: max as f32,
            stiffness_nmm_per_deg: chain
                .joint_stiffness_nm_per_rad
                .map(|k| (1e3 * k * 1f64.to_radians()) as f32),
            rows,
        };
        let worst = table
            .interpolation_error_percent(chain)
            .into_iter()
            .fold(0.0, |worst: f64, (_, error)| worst.max(error));
        table.error_bound_percent = worst as f32;
        Ok(table)
    }

    /// Largest error over all columns but the lift at pressures on and between the rows:
    /// `(pressure kPa, percent of full scale)`.
    pub fn interpolation_error_percent(&self, chain: &Chain) -> Vec<(f64, f64)> {
        // The tip moves on a circle of about the finger's length: along the finger its full scale is
        // that length, which the first row holds.
        let (first, last) = (columns(&self.rows[0]), columns(&self.rows[ROWS - 1]));
        let points = BETWEEN * (ROWS - 1);
        (0..=points)
            .map(|k| {
                let position = k as f64 / BETWEEN as f64;
                let pressure = f64::from(self.max_pressure_kpa) * position / (ROWS - 1) as f64;
                let i = (position as usize).min(ROWS - 2);
                let t = position - i as f64;
                let (low, high) = (columns(&self.rows[i]), columns(&self.rows[i + 1]));
                let model = columns(&row(chain, pressure));
                let worst = (0..model.len())
                    .map(|c| {
                        let table = low[c] + t * (high[c] - low[c]);
                        let scale = last[c].abs().max(first[c].abs());
                        100.0 * (table - model[c]).abs() / scale.max(LEAST_SCALE)
                    })
                    .fold(0.0, f64::max);
                (pressure, worst)
            })
            .collect()
    }

    /// The highest pressure at which the lift of the sphere and of the cylinder is known, kPa; none
    /// without a grasp in the recipe.
    pub fn lift_known_to_kpa(&self) -> [Option<f32>; 2] {
        let step = self.max_pressure_kpa / (ROWS - 1) as f32;
        self.lift_rows
            .map(|rows| rows.checked_sub(1).map(|last| step * f32::from(last)))
    }

    /// The table as a Rust expression of the type `FingerTable` in the controller's library.
    pub fn to_rust(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "FingerTable {{\n    recipe: {:?},\n    inputs_hash: {:#018x},\n    error_bound_percent: {:?},\n    lift_error_percent: {:?},\n    lift_rows: {:?},\n    max_pressure_kpa: {:?},\n    stiffness_nmm_per_deg: {:?},\n    rows: [",
            self.recipe,
            self.inputs_hash,
            self.error_bound_percent,
            self.lift_error_percent,
            self.lift_rows,
            self.max_pressure_kpa,
            self.stiffness_nmm_per_deg,
        );
        for row in &self.rows {
            let _ = writeln!(out, "        {row:?},");
        }
        out.push_str("    ],\n}\n");
        out
    }
}

/// Lift in each row, N, up to the last before fingers and object find no equilibrium, with the largest
/// deviation of the interpolation half-way between rows, N.
fn lift(chain: &Chain, grasp: &Grasp, gripped: Gripped) -> Result<(Vec<f32>, f64), GripError> {
    let step = chain.max_pressure_kpa() / (ROWS - 1) as f64;
    let mut rows: Vec<f32> = Vec::with_capacity(ROWS);
    let mut largest: f64 = 0.0;
    for i in 0..ROWS {
        let pressure = step * i as f64;
        let Some(lift) = grasp.lift_n(gripped, chain, pressure)? else {
            break;
        };
        let lift = lift as f32;
        if let Some(before) = rows.last() {
            let Some(model) = grasp.lift_n(gripped, chain, pressure - step / 2.0)? else {
                break;
            };
            largest = largest.max((f64::from(before + lift) / 2.0 - model).abs());
        }
        rows.push(lift);
    }
    Ok((rows, largest))
}

/// Everything but the lift.
fn row(chain: &Chain, pressure_kpa: f64) -> Row {
    Row {
        free_strain_ue: chain.free_strain_ue(pressure_kpa) as f32,
        tip_angle_deg: chain.tip_angle_rad(pressure_kpa).to_degrees() as f32,
        tip_mm: chain.tip_position_m(pressure_kpa).map(|m| (1e3 * m) as f32),
        torque_nmm: chain
            .joint_torques_nm(pressure_kpa)
            .map(|nm| (1e3 * nm) as f32),
        lift_n: [0.0; 2],
    }
}

/// Everything but the lift.
fn columns(row: &Row) -> [f64; 4 + LINKS] {
    let mut columns = [0.0; 4 + LINKS];
    columns[..4].copy_from_slice(
        &[
            row.free_strain_ue,
            row.tip_angle_deg,
            row.tip_mm[0],
            row.tip_mm[1],
        ]
        .map(f64::from),
    );
    columns[4..].copy_from_slice(&row.torque_nmm.map(f64::from));
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn paper() -> Recipe {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recipes/paper.toml");
        crate::recipe::load(&path).expect("the paper's recipe is good")
    }

    #[test]
    fn interpolates_within_a_thousandth_of_full_scale() {
        let table = Table::of(&paper()).expect("the paper's fingers can grip");
        assert!(
            table.error_bound_percent > 0.0 && table.error_bound_percent <= 0.1,
            "{} %",
            table.error_bound_percent
        );
    }

    #[test]
    fn without_a_grasp_everything_but_the_lift_is_known() {
        let with = paper();
        let without = Recipe {
            grasp: None,
            ..with.clone()
        };
        let [with, without] = [with, without].map(|recipe| Table::of(&recipe).expect("a table"));
        assert_eq!(with.lift_rows, [ROWS as u8; 2]);
        assert_eq!(without.lift_rows, [0; 2]);
        assert_eq!(without.lift_known_to_kpa(), [None; 2]);
        assert_eq!(without.error_bound_percent, with.error_bound_percent);
        for (with, without) in with.rows.into_iter().zip(without.rows) {
            let lift_n = [0.0; 2];
            assert_eq!(without, Row { lift_n, ..with });
        }
    }

    #[test]
    fn lift_ends_where_friction_locks_the_fingers() {
        let mut recipe = paper();
        // Glue rather than rubber: the last links hook behind the sphere.
        if let Some(grasp) = &mut recipe.grasp {
            grasp.friction = 5.0;
        }
        let table = Table::of(&recipe).expect("a table");
        let [sphere, _] = table.lift_rows.map(usize::from);
        assert!((2..ROWS).contains(&sphere), "{sphere}");
        assert!(table.rows[sphere - 1].lift_n[0] > 0.0);
        assert!(table.rows[sphere..].iter().all(|row| row.lift_n[0] == 0.0));
        let end = table.max_pressure_kpa * (sphere - 1) as f32 / (ROWS - 1) as f32;
        assert_eq!(table.lift_known_to_kpa()[0], Some(end));
    }

    #[test]
    fn rises_monotonically_from_zero() {
        let table = Table::of(&paper()).expect("the paper's fingers can grip");
        assert_eq!(table.rows[0].free_strain_ue, 0.0);
        for pair in table.rows.windows(2) {
            assert!(pair[1].free_strain_ue > pair[0].free_strain_ue);
            assert!(pair[1].tip_angle_deg > pair[0].tip_angle_deg);
            for i in 0..LINKS {
                assert!(pair[1].torque_nmm[i] >= pair[0].torque_nmm[i]);
            }
            for k in 0..2 {
                assert!(pair[1].lift_n[k] >= pair[0].lift_n[k]);
            }
        }
    }
}

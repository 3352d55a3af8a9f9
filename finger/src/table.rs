//! The model of a finger on the pressure grid of the controller's table.

use softgrip_table::{FingerTable, LINKS, LinkRow, LinkTable, OBJECTS, ROWS, Row};

use crate::capability::GripError;
use crate::chain::Chain;
use crate::grasp::{Grasp, Gripped};
use crate::recipe::Recipe;

/// Steps between two rows in which the interpolation is compared with the model: sixteen find the largest
/// deviation of a smooth column to better than 1 %.
const BETWEEN: usize = 16;

/// Least full scale of a column, in its unit: a finger that does not bend has none.
const LEAST_SCALE: f64 = 1e-3;

/// Tabulates the finger of `recipe`.
///
/// The recipe's name is never freed: it is for a table that lives as long as the program, or becomes a
/// constant of another one.
///
/// # Errors
/// [`GripError`], if a dimension of the grasp is wrong.
pub fn of(recipe: &Recipe) -> Result<FingerTable, GripError> {
    let chain = &recipe.chain;
    let max = chain.max_pressure_kpa();
    let step = max / (ROWS - 1) as f64;
    let mut rows: [Row; ROWS] = std::array::from_fn(|i| row(chain, step * i as f64));
    let (mut lift_error, mut full_lift) = (0.0, f32::MIN_POSITIVE);
    let mut lift_rows = [0; OBJECTS];
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
    let mut table = FingerTable {
        recipe: recipe.name.clone().leak(),
        inputs_hash: recipe.inputs_hash,
        error_bound_percent: 0.0,
        lift_error_percent: 100.0 * lift_error as f32 / full_lift,
        lift_rows,
        max_pressure_kpa: max as f32,
        meeting_kpa: recipe
            .grasp
            .as_ref()
            .and_then(|grasp| grasp.meeting_kpa(chain))
            .map(|kpa| kpa as f32),
        rows,
    };
    let worst = interpolation_error_percent(&table, &links(chain), chain)
        .into_iter()
        .fold(0.0, |worst: f64, (_, error)| worst.max(error));
    table.error_bound_percent = worst as f32;
    Ok(table)
}

/// Tabulates the links of a finger.
pub fn links(chain: &Chain) -> LinkTable {
    let max = chain.max_pressure_kpa();
    let step = max / (ROWS - 1) as f64;
    LinkTable {
        max_pressure_kpa: max as f32,
        stiffness_nmm_per_deg: chain
            .joint_stiffness_nm_per_rad
            .map(|k| (1e3 * k * 1f64.to_radians()) as f32),
        rows: std::array::from_fn(|i| link_row(chain, step * i as f64)),
    }
}

/// Largest error over all columns but the lift at pressures on and between the rows, in rising order:
/// `(pressure kPa, percent of full scale)`, of tables that were made from this `chain`.
pub fn interpolation_error_percent(
    table: &FingerTable,
    links: &LinkTable,
    chain: &Chain,
) -> Vec<(f64, f64)> {
    let tabulated = |i: usize| columns(&table.rows[i], &links.rows[i]);
    // The tip moves on a circle of about the finger's length: along the finger its full scale is
    // that length, which the first row holds.
    let (first, last) = (tabulated(0), tabulated(ROWS - 1));
    let points = BETWEEN * (ROWS - 1);
    (0..=points)
        .map(|k| {
            let position = k as f64 / BETWEEN as f64;
            let pressure = f64::from(table.max_pressure_kpa) * position / (ROWS - 1) as f64;
            let i = (position as usize).min(ROWS - 2);
            let t = position - i as f64;
            let (low, high) = (tabulated(i), tabulated(i + 1));
            let model = columns(&row(chain, pressure), &link_row(chain, pressure));
            let worst = (0..model.len())
                .map(|c| {
                    let value = low[c] + t * (high[c] - low[c]);
                    let scale = last[c].abs().max(first[c].abs());
                    100.0 * (value - model[c]).abs() / scale.max(LEAST_SCALE)
                })
                .fold(0.0, f64::max);
            (pressure, worst)
        })
        .collect()
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
        lift_n: [0.0; OBJECTS],
    }
}

fn link_row(chain: &Chain, pressure_kpa: f64) -> LinkRow {
    LinkRow {
        tip_mm: chain.tip_position_m(pressure_kpa).map(|m| (1e3 * m) as f32),
        torque_nmm: chain
            .joint_torques_nm(pressure_kpa)
            .map(|nm| (1e3 * nm) as f32),
    }
}

/// Everything but the lift.
fn columns(row: &Row, links: &LinkRow) -> [f64; 4 + LINKS] {
    let mut columns = [0.0; 4 + LINKS];
    columns[..4].copy_from_slice(
        &[
            row.free_strain_ue,
            row.tip_angle_deg,
            links.tip_mm[0],
            links.tip_mm[1],
        ]
        .map(f64::from),
    );
    columns[4..].copy_from_slice(&links.torque_nmm.map(f64::from));
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
        let table = of(&paper()).expect("the paper's fingers can grip");
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
        let [with, without] = [with, without].map(|recipe| of(&recipe).expect("a table"));
        assert_eq!(with.lift_rows, [ROWS as u8; 2]);
        assert_eq!(without.lift_rows, [0; 2]);
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
        let table = of(&recipe).expect("a table");
        let [sphere, _] = table.lift_rows.map(usize::from);
        assert!((2..ROWS).contains(&sphere), "{sphere}");
        assert!(table.rows[sphere - 1].lift_n[0] > 0.0);
        assert!(table.rows[sphere..].iter().all(|row| row.lift_n[0] == 0.0));
    }

    #[test]
    fn rises_monotonically_from_zero() {
        let table = of(&paper()).expect("the paper's fingers can grip");
        assert_eq!(table.rows[0].free_strain_ue, 0.0);
        for pair in table.rows.windows(2) {
            assert!(pair[1].free_strain_ue > pair[0].free_strain_ue);
            assert!(pair[1].tip_angle_deg > pair[0].tip_angle_deg);
            for k in 0..2 {
                assert!(pair[1].lift_n[k] >= pair[0].lift_n[k]);
            }
        }
        for pair in links(&paper().chain).rows.windows(2) {
            for i in 0..LINKS {
                assert!(pair[1].torque_nmm[i] >= pair[0].torque_nmm[i]);
            }
        }
    }
}

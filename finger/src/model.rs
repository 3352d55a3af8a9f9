//! From a finger's geometry to its equivalent chain at given pressures.

use softgrip_table::{LINKS, ROWS};

use crate::chain::Chain;
use crate::cubic::MonotoneCubic;
use crate::curve::{self, Curve, CurveError};
use crate::geometry::Geometry;
use crate::links;
use crate::mesh::MeshSize;
use crate::stiffness::{self, VIRTUAL_FORCE_N};
use crate::yeoh::{Inflated, InflationError, SectionModel};

/// Sections are solved at most this far apart, m, and curvature is linear between them: on the tapers of
/// `recipes/rtv225.toml` that is good for 0.1 % of the tip angle.
const SPACING_M: f64 = 11.5e-3;

/// Pressures at which a chain's torques are solved: twice as fine as the table, so that the table's
/// interpolation error is measured against solved pressures between its rows.
const KNOTS: usize = 2 * (ROWS - 1);

/// Why a finger has no chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A section cannot be inflated as far as asked.
    #[error("at {:.1} mm from the clamp: {source}", 1e3 * arc_m)]
    Inflation {
        /// Where, m from the clamp.
        arc_m: f64,
        /// What the section's solver says.
        source: InflationError,
    },
    /// The rubber's strain energy describes no material at the stretches that a section reaches.
    #[error(
        "{field}: {reason}, {:.1} mm from the clamp: lower max_pressure_kpa, or take constants that were \
         fitted up to larger stretches", 1e3 * arc_m
    )]
    Unstable {
        /// The recipe's field with the constants.
        field: &'static str,
        /// Where, m from the clamp.
        arc_m: f64,
        /// [`InflationError::Unstable`], with stretches and pressure.
        reason: InflationError,
    },
    /// The virtual load gives no shape.
    #[error("virtual loading: {0}")]
    Stiffness(#[from] CurveError),
}

impl ModelError {
    /// The pressure up to which there is an answer, Pa.
    fn reached_pa(&self) -> f64 {
        match self {
            Self::Inflation { source, .. } | Self::Unstable { reason: source, .. } => {
                match source {
                    InflationError::Balloons { last_pa: pressure }
                    | InflationError::Unstable {
                        pressure_pa: pressure,
                        ..
                    } => *pressure,
                    _ => 0.0,
                }
            }
            Self::Stiffness(_) => 0.0,
        }
    }
}

/// The free finger at one pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Bend {
    /// Inner pressure, kPa.
    pub pressure_kpa: f64,
    /// Curvature `κ` at each of [`Solved::arc_m`], rad per undeformed metre.
    pub curvature_per_m: Vec<f64>,
    /// Mean stretch along the finger there.
    pub stretch: Vec<f64>,
    /// The centreline. Like the links, and like the paper's beam, it keeps its length.
    pub curve: Curve,
    /// Angle `φ_i` of each joint, rad; its torque is `T_i = k_i φ_i` (eq. 24).
    pub joint_angle_rad: [f64; LINKS],
}

/// A finger as an equivalent chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Length of each link, m.
    pub link_length_m: [f64; LINKS],
    /// Mass of each link, kg (table 1).
    pub link_mass_kg: [f64; LINKS],
    /// Stiffness `k_i` of each joint, N·m/rad, by virtual loading (table 2).
    pub joint_stiffness_nm_per_rad: [f64; LINKS],
    /// Arc lengths of the sections that were solved, from the clamp to the end of the bore, m.
    pub arc_m: Vec<f64>,
    /// The free finger at each pressure asked for, in their order.
    pub bends: Vec<Bend>,
}

impl Solved {
    /// Distance between the tips of chain and centreline in one of these bends, as a share of the length.
    pub fn chain_tip_error(&self, bend: &Bend) -> f64 {
        let link_angle = links::link_angles_rad(&bend.curve, &self.link_length_m);
        let [x, y] = links::joints_m(&self.link_length_m, &link_angle)[LINKS];
        let tip = bend.curve.tip_m();
        (x - tip[0]).hypot(y - tip[1]) / self.link_length_m.iter().sum::<f64>()
    }
}

impl Geometry {
    /// Solves the free finger at `pressures_kpa`, kPa, in rising order: curvature from its sections, centreline
    /// from the curvature, link angles from the centreline, stiffness by virtual loading.
    ///
    /// # Errors
    /// [`ModelError`]: a section balloons below the highest pressure, pressures do not rise, or the
    /// stiffness along the finger is not positive.
    pub fn solve(&self, pressures_kpa: &[f64]) -> Result<Solved, ModelError> {
        let arc_m = self.solved_sections_m();
        let sections = self.inflate(&arc_m, pressures_kpa)?;
        let grid = curve::grid(&self.breaks_m());
        let joint_stiffness_nm_per_rad =
            stiffness::virtual_loading(grid.clone(), &self.link_length_m, VIRTUAL_FORCE_N, |s| {
                self.bending_stiffness_nm2(s)
            })?;
        let bend = |(k, &pressure_kpa): (usize, &f64)| {
            let of = |value: fn(&Inflated) -> f64| -> Vec<f64> {
                sections.iter().map(|states| value(&states[k])).collect()
            };
            let curvature_per_m = of(|state| state.curvature_per_m);
            let clamp_angle = curvature_per_m[0] * self.root_free_length_m;
            let curve = Curve::from_curvature(grid.clone(), clamp_angle, |s| {
                linear(&arc_m, &curvature_per_m, s)
            });
            let link_angle = links::link_angles_rad(&curve, &self.link_length_m);
            Bend {
                pressure_kpa,
                stretch: of(|state| state.stretch),
                joint_angle_rad: links::joint_angles_rad(&link_angle),
                curvature_per_m,
                curve,
            }
        };
        Ok(Solved {
            link_length_m: self.link_length_m,
            link_mass_kg: self.link_masses_kg(),
            joint_stiffness_nm_per_rad,
            bends: pressures_kpa.iter().enumerate().map(bend).collect(),
            arc_m,
        })
    }

    /// The chain of the finger up to `max_pressure_kpa`, kPa, solved on the grid of the controller's table and
    /// half-way between its rows.
    ///
    /// # Errors
    /// As [`Geometry::solve`].
    pub fn chain(&self, max_pressure_kpa: f64) -> Result<Chain, ModelError> {
        let pressures: Vec<f64> = (1..=KNOTS)
            .map(|k| max_pressure_kpa * k as f64 / KNOTS as f64)
            .collect();
        self.chain_through(&pressures)
    }

    /// The chain that is solved at these pressures only, positive and rising, and good at these only.
    ///
    /// # Errors
    /// As [`Geometry::solve`].
    ///
    /// # Panics
    /// Without any pressure.
    pub fn chain_through(&self, pressures_kpa: &[f64]) -> Result<Chain, ModelError> {
        let solved = self.solve(pressures_kpa)?;
        let torque = |i: usize| {
            let k = solved.joint_stiffness_nm_per_rad[i];
            let mut points = vec![(0.0, 0.0)];
            points.extend(
                solved
                    .bends
                    .iter()
                    .map(|bend| (bend.pressure_kpa, k * bend.joint_angle_rad[i])),
            );
            MonotoneCubic::starting_flat(&points)
        };
        Ok(Chain {
            link_length_m: solved.link_length_m,
            link_mass_kg: solved.link_mass_kg,
            root_free_length_m: self.root_free_length_m,
            joint_stiffness_nm_per_rad: solved.joint_stiffness_nm_per_rad,
            joint_torque_nm: std::array::from_fn(torque),
            gauge: self.gauge,
        })
    }

    fn solved_sections_m(&self) -> Vec<f64> {
        let mut arc = vec![0.0];
        let mut from = 0.0;
        for to in self.breaks_m() {
            let to = f64::min(to, self.bore_end_m);
            let n = ((to - from) / SPACING_M).ceil();
            arc.extend((1..=n as usize).map(|i| from + (to - from) * i as f64 / n));
            from = to;
        }
        arc
    }

    /// Inflates the sections at `arc_m`, side by side.
    fn inflate(
        &self,
        arc_m: &[f64],
        pressures_kpa: &[f64],
    ) -> Result<Vec<Vec<Inflated>>, ModelError> {
        let pressures_pa: Vec<f64> = pressures_kpa.iter().map(|kpa| 1e3 * kpa).collect();
        let inflate = |arc_m: f64| {
            SectionModel::new(&self.section(arc_m), self.rubber, MeshSize::STANDARD)
                .and_then(|model| model.inflate(&pressures_pa))
                .map_err(|reason| match reason {
                    InflationError::Unstable { .. } => ModelError::Unstable {
                        field: self.rubber_field,
                        arc_m,
                        reason,
                    },
                    source => ModelError::Inflation { arc_m, source },
                })
        };
        let solved: Vec<_> = std::thread::scope(|scope| {
            let threads: Vec<_> = arc_m
                .iter()
                .map(|&s| scope.spawn(move || inflate(s)))
                .collect();
            threads
                .into_iter()
                .map(|thread| match thread.join() {
                    Ok(states) => states,
                    Err(panic) => std::panic::resume_unwind(panic),
                })
                .collect()
        });
        let (mut sections, mut errors) = (Vec::with_capacity(arc_m.len()), Vec::new());
        for section in solved {
            match section {
                Ok(states) => sections.push(states),
                Err(error) => errors.push(error),
            }
        }
        // Of several the one that comes first as the pressure rises.
        let first = |a: &ModelError, b: &ModelError| a.reached_pa().total_cmp(&b.reached_pa());
        errors.into_iter().min_by(first).map_or(Ok(sections), Err)
    }
}

/// Linear interpolation of `y` over `x`, and zero beyond: past the bore nothing bends.
fn linear(x: &[f64], y: &[f64], at: f64) -> f64 {
    let after = x.partition_point(|&x| x <= at);
    if after == 0 || after == x.len() {
        return 0.0;
    }
    let t = (at - x[after - 1]) / (x[after] - x[after - 1]);
    y[after - 1] + t * (y[after] - y[after - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Description;

    const RECIPE: &str = include_str!("../../recipes/rtv225.toml");

    fn geometry() -> Geometry {
        let description: Description = toml::from_str(RECIPE).expect("a good recipe");
        description.check().expect("a good finger")
    }

    #[test]
    fn the_whole_table_rises_from_zero() {
        let pressures: Vec<f64> = (0..65).map(|k| 2.5 * f64::from(k)).collect();
        let solved = geometry().solve(&pressures).expect("solves");
        assert_eq!(solved.bends.len(), 65);
        assert!(solved.bends[0].curve.tip_angle_rad().abs() < 1e-9);
        for pair in solved.bends.windows(2) {
            for i in 0..LINKS {
                assert!(pair[1].joint_angle_rad[i] > pair[0].joint_angle_rad[i]);
            }
            for i in 0..solved.arc_m.len() {
                assert!(pair[1].stretch[i] > pair[0].stretch[i]);
            }
        }
    }

    #[test]
    fn sections_are_close_enough_along_the_finger() {
        let geometry = geometry();
        let solved = geometry.solve(&[160.0]).expect("solves");
        let mut between = 0.0f64;
        for pair in solved.arc_m.windows(2) {
            let middle = (pair[0] + pair[1]) / 2.0;
            let states = geometry.inflate(&[middle], &[160.0]).expect("solves");
            let linear = linear(&solved.arc_m, &solved.bends[0].curvature_per_m, middle);
            between = between.max((linear / states[0][0].curvature_per_m - 1.0).abs());
        }
        assert!(between < 1e-3, "{between}");
    }

    #[test]
    fn an_error_says_where_and_at_which_pressure() {
        let stiff = RECIPE.replacen("yeoh_mpa = [0.1, 0.02, 0.0002]", "", 1);
        let description: Description = toml::from_str(&stiff).expect("a good recipe");
        let linear = description.check().expect("a good finger");
        let error = linear
            .solve(&[20.0, 160.0])
            .expect_err("neo-Hookean balloons");
        let message = error.to_string();
        assert!(
            message.contains("mm from the clamp: the section balloons at about"),
            "{message}"
        );
        assert!(linear.solve(&[20.0]).is_ok());
        assert!(geometry().solve(&[20.0, 10.0]).is_err());
        assert!(
            geometry()
                .solve(&[])
                .expect("nothing to solve")
                .bends
                .is_empty()
        );
    }
}

//! Bending of a section under inner pressure: the finite-element solution that replaces eqs. 1–4.
//!
//! The paper puts `M = e F*`, proportional to pressure. That cannot be: to first order a closed tube of
//! constant volume does not bend under inner pressure at all, and Table 3 is nearly flat below 50 kPa.
//! Curvature comes from the bore's growth. So the section is solved as it is, in plane finite elements
//! with the stretch along the finger linear over the *deformed* section: the stationary point of
//!
//! ```text
//! Π(x, λ, κ) = ∫ W(F) dA − p ∫ (λ + κ y) da,    F₃₃ = λ + κ y
//!               wall           deformed bore
//! ```
//!
//! in the positions `x` of the nodes, the stretch `λ` at `y = 0` and the curvature `κ`. The second
//! integral is the bore's volume per undeformed length, so it holds the thrust on the closed end too.

use std::ops::AddAssign;

use nalgebra::{DVector, Matrix2, SMatrix, SVector};

use crate::bordered::{Bordered, Step};
use crate::hyperelastic::{Gradient, Rubber};
use crate::mesh::{Mesh, MeshSize};
use crate::section::{Section, SectionError};

/// Shortest pressure step before a section counts as ballooning, Pa.
const SHORTEST_STEP_PA: f64 = 100.0;
/// Newton's method has converged when no node moves more than this share of the outer radius.
const CONVERGED: f64 = 1e-6;
/// A node that moves this share of the outer radius in one iteration is on its way to another branch.
const TOO_FAR: f64 = 0.3;
/// Newton's method converges in two to four iterations or not at all.
const ITERATIONS: usize = 10;

/// A section in equilibrium under pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inflated {
    /// Inner pressure, Pa.
    pub pressure_pa: f64,
    /// Rotation per undeformed length `κ`, rad/m, positive towards the flat.
    pub curvature_per_m: f64,
    /// Mean stretch of the wall along the finger.
    pub stretch: f64,
    /// Slope of bending moment against curvature at constant pressure, with no axial force, N·m².
    pub bending_stiffness_nm2: f64,
}

/// Why a section has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InflationError {
    /// The section is not closed.
    #[error(transparent)]
    Section(#[from] SectionError),
    /// There is nothing to inflate.
    #[error("the section has no bore")]
    Solid,
    /// A material constant that no rubber has.
    #[error("{name} = {value} Pa: must be finite and {expected}")]
    Material {
        /// The constant.
        name: &'static str,
        /// Its value, Pa.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Pressures must be given in rising order from zero.
    #[error(
        "pressure {pressure_pa} Pa: must be finite, not negative and not below the one before it"
    )]
    Pressure {
        /// The offending pressure, Pa.
        pressure_pa: f64,
    },
    /// No stable equilibrium continues the solution: the limit point of a rubber tube.
    #[error(
        "the section balloons at about {:.1} kPa; ask for lower pressures, or for a thicker wall or a \
         stiffer rubber", 1e-3 * last_pa
    )]
    Balloons {
        /// The highest pressure at which equilibrium was found, Pa.
        last_pa: f64,
    },
}

/// A meshed section of rubber.
pub struct SectionModel {
    mesh: Mesh,
    rubber: Rubber,
    /// Scale of length, m.
    radius: f64,
    /// Unknowns held by symmetry, and one to stop the section from sliding along `y`.
    held: Vec<bool>,
}

/// Positions of the nodes, then `λ` and `κ`.
type Unknowns = DVector<f64>;

impl SectionModel {
    /// Meshes a section.
    ///
    /// # Errors
    /// If the section is open or solid, or the rubber's constants are out of range.
    pub fn new(section: &Section, rubber: Rubber, size: MeshSize) -> Result<Self, InflationError> {
        section.check()?;
        if section.bore_radius_m == 0.0 {
            return Err(InflationError::Solid);
        }
        let [c1, c2, c3] = rubber.yeoh_pa;
        let bulk = rubber.bulk_modulus_pa;
        for (name, value, ok, expected) in [
            ("C1", c1, c1 > 0.0, "positive"),
            ("C2", c2, true, "in pascals"),
            ("C3", c3, c3 >= 0.0, "not negative"),
            ("bulk modulus", bulk, bulk > 10.0 * c1, "above ten times C1"),
        ] {
            if !(value.is_finite() && ok) {
                return Err(InflationError::Material {
                    name,
                    value,
                    expected,
                });
            }
        }
        let mesh = Mesh::of(section, size);
        let mut held = vec![false; 2 * mesh.nodes.len()];
        for &node in &mesh.axis {
            held[2 * node] = true;
        }
        held[2 * mesh.nodes.len() - 1] = true;
        Ok(Self {
            mesh,
            rubber,
            radius: section.outer_radius_m,
            held,
        })
    }

    /// Inflates the section from rest through `pressures_pa`, in rising order.
    ///
    /// # Errors
    /// [`InflationError::Balloons`] if a pressure lies beyond the limit point, with the highest
    /// pressure that was reached; [`InflationError::Pressure`] if they do not rise.
    pub fn inflate(&self, pressures_pa: &[f64]) -> Result<Vec<Inflated>, InflationError> {
        let mut path = Path::from_rest(self.rest());
        let mut inflated = Vec::with_capacity(pressures_pa.len());
        for &target in pressures_pa {
            let pressure_pa = target;
            if !(target.is_finite() && target >= path.pressure()) {
                return Err(InflationError::Pressure { pressure_pa });
            }
            let mut step = target - path.pressure();
            let condensed = loop {
                let next = path.pressure() + step;
                match self.newton(path.predict(next), next) {
                    Some((unknowns, condensed)) => {
                        path.push(next, unknowns);
                        if next >= target {
                            break condensed;
                        }
                        step = (2.0 * step).min(target - next);
                    }
                    None if step > SHORTEST_STEP_PA => step /= 2.0,
                    None => {
                        return Err(InflationError::Balloons {
                            last_pa: path.pressure(),
                        });
                    }
                }
            };
            let unknowns = path.last();
            let [_, curvature_per_m] = self.axial(unknowns);
            inflated.push(Inflated {
                pressure_pa,
                curvature_per_m,
                stretch: self.mean_stretch(unknowns),
                // Twice, for the other half; the stretch follows without axial force.
                bending_stiffness_nm2: 2.0 * condensed.determinant() / condensed[(0, 0)],
            });
        }
        Ok(inflated)
    }

    fn rest(&self) -> Unknowns {
        let mut rest: Vec<f64> = self.mesh.nodes.iter().flatten().copied().collect();
        rest.extend([1.0, 0.0]);
        DVector::from_vec(rest)
    }

    fn axial(&self, unknowns: &Unknowns) -> [f64; 2] {
        let n = self.held.len();
        [unknowns[n], unknowns[n + 1]]
    }

    fn mean_stretch(&self, unknowns: &Unknowns) -> f64 {
        let [stretch, curvature] = self.axial(unknowns);
        let (mut area, mut moment) = (0.0, 0.0);
        for (nodes, points) in &self.mesh.elements {
            for point in points {
                let y: f64 = (0..8)
                    .map(|a| point.shape[a] * unknowns[2 * nodes[a] + 1])
                    .sum();
                area += point.area;
                moment += point.area * y;
            }
        }
        stretch + curvature * moment / area
    }

    /// The equilibrium at `pressure` near `unknowns`, with the stiffness of `λ` and `κ` there.
    fn newton(&self, mut unknowns: Unknowns, pressure: f64) -> Option<(Unknowns, Matrix2<f64>)> {
        let n = self.held.len();
        for _ in 0..ITERATIONS {
            let mut equations = Bordered::new(n, 2 * self.mesh.column);
            self.add_wall(&mut equations, &unknowns)?;
            self.add_bore(&mut equations, &unknowns, pressure);
            for (i, _) in self.held.iter().enumerate().filter(|(_, held)| **held) {
                equations.add(i, i, 1.0);
            }
            let Step {
                inner,
                border,
                condensed,
            } = equations.solve()?;
            unknowns.rows_mut(0, n).add_assign(&inner);
            unknowns.fixed_rows_mut::<2>(n).add_assign(&border);
            let change = (inner.amax() / self.radius)
                .max(border[0].abs())
                .max(border[1].abs() * self.radius);
            if change < CONVERGED {
                return Some((unknowns, condensed));
            }
            if !(change < TOO_FAR) {
                return None;
            }
        }
        None
    }

    /// Adds the wall's energy; `None` if an element is turned inside out.
    fn add_wall(&self, equations: &mut Bordered, unknowns: &Unknowns) -> Option<()> {
        let [stretch, curvature] = self.axial(unknowns);
        for (nodes, points) in &self.mesh.elements {
            let position = SMatrix::<f64, 2, 8>::from_fn(|axis, a| unknowns[2 * nodes[a] + axis]);
            let mut gradient = SVector::<f64, 18>::zeros();
            let mut hessian = SMatrix::<f64, 18, 18>::zeros();
            for point in points {
                let plane = position * point.gradient;
                let y = position.row(1).dot(&point.shape.transpose());
                let f = Gradient::new(
                    plane[(0, 0)],
                    plane[(0, 1)],
                    plane[(1, 0)],
                    plane[(1, 1)],
                    stretch + curvature * y,
                );
                let (stress, tangent) = self.rubber.derivatives(&f)?;
                // Slopes of F against the element's sixteen coordinates, λ and κ.
                let mut slope = SMatrix::<f64, 5, 18>::zeros();
                for a in 0..8 {
                    for axis in 0..2 {
                        slope[(2 * axis, 2 * a + axis)] = point.gradient[(a, 0)];
                        slope[(2 * axis + 1, 2 * a + axis)] = point.gradient[(a, 1)];
                    }
                    slope[(4, 2 * a + 1)] = curvature * point.shape[a];
                    let mixed = point.area * stress[4] * point.shape[a];
                    hessian[(2 * a + 1, 17)] += mixed;
                    hessian[(17, 2 * a + 1)] += mixed;
                }
                slope[(4, 16)] = 1.0;
                slope[(4, 17)] = y;
                gradient += slope.tr_mul(&stress) * point.area;
                hessian += slope.tr_mul(&(tangent * slope)) * point.area;
            }
            self.scatter(equations, nodes, gradient.as_slice(), |r, c| {
                hessian[(r, c)]
            });
        }
        Some(())
    }

    /// Takes away the work of the pressure: the bore's volume per length is `∮ x (λ + κy) dy`.
    fn add_bore(&self, equations: &mut Bordered, unknowns: &Unknowns, pressure: f64) {
        let [stretch, curvature] = self.axial(unknowns);
        for nodes in &self.mesh.bore {
            let mut gradient = SVector::<f64, 8>::zeros();
            let mut hessian = SMatrix::<f64, 8, 8>::zeros();
            for (shape, slope, weight) in side_points() {
                let at = |values: &[f64; 3], axis: usize| -> f64 {
                    (0..3)
                        .map(|a| values[a] * unknowns[2 * nodes[a] + axis])
                        .sum()
                };
                let (x, y, dy) = (at(&shape, 0), at(&shape, 1), at(&slope, 1));
                let axial = stretch + curvature * y;
                // The sides run down the half-section, clockwise: the volume has the other sign, and
                // the work, which is taken away, this one.
                let w = weight * pressure;
                gradient[6] += w * x * dy;
                gradient[7] += w * x * y * dy;
                for a in 0..3 {
                    let (n, dn) = (shape[a], slope[a]);
                    gradient[2 * a] += w * n * axial * dy;
                    gradient[2 * a + 1] += w * x * (curvature * n * dy + axial * dn);
                    let mut mixed = |r: usize, c: usize, value: f64| {
                        hessian[(r, c)] += w * value;
                        hessian[(c, r)] += w * value;
                    };
                    mixed(2 * a, 6, n * dy);
                    mixed(2 * a, 7, n * y * dy);
                    mixed(2 * a + 1, 6, x * dn);
                    mixed(2 * a + 1, 7, x * (n * dy + y * dn));
                    for b in 0..3 {
                        let (m, dm) = (shape[b], slope[b]);
                        mixed(2 * a, 2 * b + 1, n * (curvature * m * dy + axial * dm));
                        // Both orders of a and b come by, so one of the two products is added here.
                        mixed(2 * a + 1, 2 * b + 1, x * curvature * n * dm);
                    }
                }
            }
            self.scatter(equations, nodes, gradient.as_slice(), |r, c| {
                hessian[(r, c)]
            });
        }
    }

    /// Adds an element's derivatives; its last two unknowns are `λ` and `κ`.
    fn scatter(
        &self,
        equations: &mut Bordered,
        nodes: &[usize],
        gradient: &[f64],
        hessian: impl Fn(usize, usize) -> f64,
    ) {
        let n = 2 * nodes.len();
        let unknown = |i: usize| 2 * nodes[i / 2] + i % 2;
        for r in (0..n).filter(|&r| !self.held[unknown(r)]) {
            for c in (0..n).filter(|&c| !self.held[unknown(c)]) {
                equations.add(unknown(r), unknown(c), hessian(r, c));
            }
            equations.add_right(unknown(r), [gradient[r], hessian(r, n), hessian(r, n + 1)]);
        }
        for i in 0..2 {
            equations.corner_gradient[i] += gradient[n + i];
            for j in 0..2 {
                equations.corner[(i, j)] += hessian(n + i, n + j);
            }
        }
    }
}

/// Three-point rule on a quadratic side: shape functions, their slopes, weight.
fn side_points() -> [([f64; 3], [f64; 3], f64); 3] {
    let g = 0.6f64.sqrt();
    [(-g, 5.0 / 9.0), (0.0, 8.0 / 9.0), (g, 5.0 / 9.0)].map(|(t, weight)| {
        let shape = [t * (t - 1.0) / 2.0, 1.0 - t * t, t * (t + 1.0) / 2.0];
        (shape, [t - 0.5, -2.0 * t, t + 0.5], weight)
    })
}

/// The last equilibria on the way up, at most three, to start the next from.
struct Path(Vec<(f64, Unknowns)>);

impl Path {
    fn from_rest(rest: Unknowns) -> Self {
        Self(vec![(0.0, rest)])
    }

    fn pressure(&self) -> f64 {
        self.0[self.0.len() - 1].0
    }

    fn last(&self) -> &Unknowns {
        &self.0[self.0.len() - 1].1
    }

    fn push(&mut self, pressure: f64, unknowns: Unknowns) {
        self.0.retain(|(known, _)| *known != pressure);
        if self.0.len() == 3 {
            self.0.remove(0);
        }
        self.0.push((pressure, unknowns));
    }

    /// Lagrange's polynomial through the known equilibria.
    fn predict(&self, pressure: f64) -> Unknowns {
        let mut sum = self.last() * 0.0;
        for (i, (here, unknowns)) in self.0.iter().enumerate() {
            let others = self.0.iter().enumerate().filter(|(j, _)| *j != i);
            let weight: f64 = others
                .map(|(_, (there, _))| (pressure - there) / (here - there))
                .product();
            sum.axpy(weight, unknowns, 1.0);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(size: MeshSize, bulk: f64) -> SectionModel {
        let section = Section {
            outer_radius_m: 9.6555e-3,
            bore_radius_m: 4.576e-3,
            bore_offset_m: 2.727e-3,
            flat_half_angle_rad: 55.98f64.to_radians(),
        };
        let rubber = Rubber {
            yeoh_pa: [0.1e6, 0.02e6, 200.0],
            bulk_modulus_pa: bulk,
        };
        SectionModel::new(&section, rubber, size).unwrap()
    }

    #[test]
    fn scratch() {
        let m = model(MeshSize::STANDARD, 20e6);
        let ps: Vec<f64> = (0..41).map(|i| 4e3 * i as f64).collect();
        let t = std::time::Instant::now();
        let r = m.inflate(&ps).unwrap();
        println!("{:?}", t.elapsed());
        for x in r.iter().step_by(5) {
            println!("{x:?}");
        }
        let m = model(
            MeshSize {
                around: 28,
                through: 6,
            },
            20e6,
        );
        println!("fine {:?}", m.inflate(&[160e3]).unwrap());
        println!("{:?}", m.inflate(&[400e3]));
        let m = model(MeshSize::STANDARD, 1e9);
        println!("{:?}", m.inflate(&[1e3, 2e3]));
    }
}

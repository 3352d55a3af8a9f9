//! Derivatives of the section's potential `Π(x, λ, κ)` (see [`crate::yeoh`]) in finite elements.

use nalgebra::{DVector, SMatrix, SVector};

use crate::bordered::Bordered;
use crate::deformation::{Gradient, principal_stretches};
use crate::hyperelastic::Rubber;
use crate::mesh::{ElementNodes, Mesh, Point};

/// Positions of the nodes, then `λ` and `κ`.
pub(crate) type Unknowns = DVector<f64>;

/// The potential of a meshed half-section.
pub(crate) struct Potential {
    mesh: Mesh,
    rubber: Rubber,
    /// Unknowns held by symmetry, and one to stop the section from sliding along `y`.
    held: Vec<bool>,
}

impl Potential {
    pub fn new(mesh: Mesh, rubber: Rubber) -> Self {
        let mut held = vec![false; 2 * mesh.nodes.len()];
        for &node in &mesh.axis {
            held[2 * node] = true;
        }
        held[2 * mesh.nodes.len() - 1] = true;
        Self { mesh, rubber, held }
    }

    /// The undeformed section.
    pub fn rest(&self) -> Unknowns {
        let mut rest: Vec<f64> = self.mesh.nodes.iter().flatten().copied().collect();
        rest.extend([1.0, 0.0]);
        DVector::from_vec(rest)
    }

    /// `λ` and `κ`.
    pub fn axial(&self, unknowns: &Unknowns) -> [f64; 2] {
        let n = self.held.len();
        [unknowns[n], unknowns[n + 1]]
    }

    /// Stretch along the finger, averaged over the wall.
    pub fn mean_stretch(&self, unknowns: &Unknowns) -> f64 {
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

    /// The principal stretches, greatest first, beyond which the wall's material is unstable, if it is at
    /// `factor` times its logarithmic strains; of several points on the way to the greatest stretch.
    pub fn unstable_beyond(&self, unknowns: &Unknowns, factor: f64) -> Option<[f64; 3]> {
        let energy = &self.rubber.energy;
        if energy.is_always_stable() {
            return None;
        }
        let [stretch, curvature] = self.axial(unknowns);
        let of_element = |(nodes, points): &(ElementNodes, [Point; 4])| {
            let position = SMatrix::<f64, 2, 8>::from_fn(|axis, a| unknowns[2 * nodes[a] + axis]);
            points.each_ref().map(|point| {
                principal_stretches(&deformation(&position, point, stretch, curvature))
            })
        };
        let stretches = self.mesh.elements.iter().flat_map(of_element);
        stretches
            .map(|stretches| stretches.map(|stretch| stretch.powf(factor)))
            .filter(|stretches| !energy.is_stable_at(*stretches))
            .max_by(|a, b| a[0].total_cmp(&b[0]))
            .map(|stretches| energy.last_stable(stretches))
    }

    /// Newton's equations for a stationary point at `pressure`, Pa; `None` if an element is turned
    /// inside out.
    pub fn equations(&self, unknowns: &Unknowns, pressure: f64) -> Option<Bordered> {
        let mut equations = Bordered::new(self.held.len(), 2 * self.mesh.column);
        self.add_wall(&mut equations, unknowns)?;
        self.add_bore(&mut equations, unknowns, pressure);
        for (i, _) in self.held.iter().enumerate().filter(|(_, held)| **held) {
            equations.add(i, i, 1.0);
        }
        Some(equations)
    }

    /// Adds the wall's energy.
    fn add_wall(&self, equations: &mut Bordered, unknowns: &Unknowns) -> Option<()> {
        let [stretch, curvature] = self.axial(unknowns);
        for (nodes, points) in &self.mesh.elements {
            let position = SMatrix::<f64, 2, 8>::from_fn(|axis, a| unknowns[2 * nodes[a] + axis]);
            let mut gradient = SVector::<f64, 18>::zeros();
            let mut hessian = SMatrix::<f64, 18, 18>::zeros();
            for point in points {
                let y = position.row(1).dot(&point.shape.transpose());
                let f = deformation(&position, point, stretch, curvature);
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

/// The deformation gradient at a point of an element whose nodes are at `position`.
#[inline]
fn deformation(
    position: &SMatrix<f64, 2, 8>,
    point: &Point,
    stretch: f64,
    curvature: f64,
) -> Gradient {
    let plane = position * point.gradient;
    let y = position.row(1).dot(&point.shape.transpose());
    Gradient::new(
        plane[(0, 0)],
        plane[(0, 1)],
        plane[(1, 0)],
        plane[(1, 1)],
        stretch + curvature * y,
    )
}

/// Three-point rule on a quadratic side: shape functions, their slopes, weight.
fn side_points() -> [([f64; 3], [f64; 3], f64); 3] {
    let g = 0.6f64.sqrt();
    [(-g, 5.0 / 9.0), (0.0, 8.0 / 9.0), (g, 5.0 / 9.0)].map(|(t, weight)| {
        let shape = [t * (t - 1.0) / 2.0, 1.0 - t * t, t * (t + 1.0) / 2.0];
        (shape, [t - 0.5, -2.0 * t, t + 0.5], weight)
    })
}

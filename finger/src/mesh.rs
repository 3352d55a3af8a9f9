//! Half of a section in eight-node quadrilaterals, between the bore and the outline.

use nalgebra::{SMatrix, SVector};

use crate::section::Section;

/// How fine the half-section is meshed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSize {
    /// Elements from the thin side around the bore to the flat; at least 4.
    pub around: usize,
    /// Elements from the bore to the outline; at least 1.
    pub through: usize,
}

impl MeshSize {
    /// Fine enough for 0.5 % in curvature (see [`crate::yeoh::mesh_study`]).
    pub const STANDARD: Self = Self {
        around: 14,
        through: 3,
    };
}

/// Nodes of one element, corners first, each side's middle after them.
pub(crate) type ElementNodes = [usize; 8];

/// An integration point of an element in the undeformed section.
pub(crate) struct Point {
    /// Shape functions.
    pub shape: SVector<f64, 8>,
    /// Their gradients, 1/m.
    pub gradient: SMatrix<f64, 8, 2>,
    /// Area that the point stands for, m².
    pub area: f64,
}

/// The mesh. Its nodes are numbered in columns from the thin side to the flat, a column being the nodes
/// on a ray from the bore's centre and those in the middle between it and the next ray, so that an
/// element joins a column only to the next one.
pub(crate) struct Mesh {
    /// Undeformed positions, m.
    pub nodes: Vec<[f64; 2]>,
    /// Nodes in a full column; the last column lacks the middle nodes.
    pub column: usize,
    /// Elements with their integration points.
    pub elements: Vec<(ElementNodes, [Point; 4])>,
    /// Sides of elements on the bore, thin side to flat: end, middle, end.
    pub bore: Vec<[usize; 3]>,
    /// Nodes on the axis of symmetry.
    pub axis: Vec<usize>,
}

impl Mesh {
    /// Meshes a section that has been checked and has a bore.
    pub fn of(section: &Section, size: MeshSize) -> Self {
        let (around, through) = (size.around.max(4), size.through.max(1));
        let (on_ray, column) = (2 * through + 1, 3 * through + 2);
        let rays = Rays::of(section, around);
        let mut nodes = Vec::with_capacity(around * column + on_ray);
        for j in 0..=around {
            let t = j as f64;
            nodes.extend((0..on_ray).map(|i| rays.at(t, i as f64 / (on_ray - 1) as f64)));
            if j < around {
                nodes.extend((0..=through).map(|i| rays.at(t + 0.5, i as f64 / through as f64)));
            }
        }
        let ray = |j: usize, i: usize| j * column + i;
        let middle = |j: usize, i: usize| j * column + on_ray + i;
        let mut elements = Vec::with_capacity(around * through);
        for j in 0..around {
            for i in 0..through {
                let element = [
                    ray(j, 2 * i),
                    ray(j + 1, 2 * i),
                    ray(j + 1, 2 * i + 2),
                    ray(j, 2 * i + 2),
                    middle(j, i),
                    ray(j + 1, 2 * i + 1),
                    middle(j, i + 1),
                    ray(j, 2 * i + 1),
                ];
                elements.push((element, points(&element.map(|n| nodes[n]))));
            }
        }
        Self {
            column,
            elements,
            bore: (0..around)
                .map(|j| [ray(j, 0), middle(j, 0), ray(j + 1, 0)])
                .collect(),
            axis: (0..on_ray)
                .flat_map(|i| [ray(0, i), ray(around, i)])
                .collect(),
            nodes,
        }
    }
}

/// A flat that subtends less than this at the bore's centre, rad, counts as none: the outline changes by
/// two millionths of its radius at most, and an element as narrow as the flat would degenerate.
const NO_FLAT_RAD: f64 = 1e-3;

/// Rays from the bore's centre, evenly spread on either side of the one that meets the end of the flat.
struct Rays<'a> {
    section: &'a Section,
    /// Rays up to the end of the flat, and their angle from the thin side, rad.
    to_corner: f64,
    corner: f64,
    around: f64,
}

impl<'a> Rays<'a> {
    fn of(section: &'a Section, around: usize) -> Self {
        use std::f64::consts::PI;
        let (sin, cos) = section.flat_half_angle_rad.sin_cos();
        let outer = section.outer_radius_m;
        let corner = (outer * sin).atan2(-outer * cos - section.bore_offset_m);
        let around = around as f64;
        let (to_corner, corner) = match PI - corner < NO_FLAT_RAD {
            true => (around, PI),
            false => (
                (around * corner / PI).round().clamp(1.0, around - 1.0),
                corner,
            ),
        };
        Self {
            section,
            to_corner,
            corner,
            around,
        }
    }

    /// The point on ray `t` (0 to `around`), `depth` (0 to 1) of the way from bore to outline.
    fn at(&self, t: f64, depth: f64) -> [f64; 2] {
        let angle = if t <= self.to_corner {
            self.corner * t / self.to_corner
        } else {
            let share = (t - self.to_corner) / (self.around - self.to_corner);
            self.corner + (std::f64::consts::PI - self.corner) * share
        };
        let (sin, cos) = angle.sin_cos();
        let section = self.section;
        let (outer, offset) = (section.outer_radius_m, section.bore_offset_m);
        let outline = if t <= self.to_corner {
            (outer.powi(2) - (offset * sin).powi(2)).sqrt() - offset * cos
        } else {
            -(outer * section.flat_half_angle_rad.cos() + offset) / cos
        };
        let radius = section.bore_radius_m + depth * (outline - section.bore_radius_m);
        [radius * sin, offset + radius * cos]
    }
}

/// Two by two points: with eight nodes they integrate exactly enough, and do not lock at constant volume.
fn points(nodes: &[[f64; 2]; 8]) -> [Point; 4] {
    let positions = SMatrix::<f64, 8, 2>::from_fn(|node, axis| nodes[node][axis]);
    let g = 1.0 / 3f64.sqrt();
    [[-g, -g], [g, -g], [g, g], [-g, g]].map(|[xi, eta]| {
        let (shape, slopes) = shape(xi, eta);
        let jacobian = positions.transpose() * slopes;
        let area = jacobian.determinant();
        // A section that has been checked is star-shaped from the bore's centre: no element is degenerate.
        let inverse = jacobian.try_inverse().unwrap_or_default();
        Point {
            shape,
            gradient: slopes * inverse,
            area,
        }
    })
}

/// Serendipity shape functions and their slopes in the parent square.
fn shape(xi: f64, eta: f64) -> (SVector<f64, 8>, SMatrix<f64, 8, 2>) {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    const MIDDLES: [[f64; 2]; 4] = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
    let mut shape = SVector::zeros();
    let mut slopes = SMatrix::zeros();
    for (i, [a, b]) in CORNERS.into_iter().enumerate() {
        let (u, v) = (a * xi, b * eta);
        shape[i] = (1.0 + u) * (1.0 + v) * (u + v - 1.0) / 4.0;
        slopes[(i, 0)] = a * (1.0 + v) * (2.0 * u + v) / 4.0;
        slopes[(i, 1)] = b * (1.0 + u) * (u + 2.0 * v) / 4.0;
    }
    for (i, [a, b]) in MIDDLES.into_iter().enumerate() {
        let i = i + 4;
        if a == 0.0 {
            shape[i] = (1.0 - xi * xi) * (1.0 + b * eta) / 2.0;
            slopes[(i, 0)] = -xi * (1.0 + b * eta);
            slopes[(i, 1)] = b * (1.0 - xi * xi) / 2.0;
        } else {
            shape[i] = (1.0 + a * xi) * (1.0 - eta * eta) / 2.0;
            slopes[(i, 0)] = a * (1.0 - eta * eta) / 2.0;
            slopes[(i, 1)] = -eta * (1.0 + a * xi);
        }
    }
    (shape, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covers_the_section() {
        let section = Section {
            outer_radius_m: 9.6e-3,
            bore_radius_m: 4.6e-3,
            bore_offset_m: 2.7e-3,
            flat_half_angle_rad: 0.98,
        };
        for size in [
            MeshSize::STANDARD,
            MeshSize {
                around: 28,
                through: 6,
            },
        ] {
            let mesh = Mesh::of(&section, size);
            let mut sums = [0.0; 3];
            for (nodes, points) in &mesh.elements {
                for point in points {
                    assert!(point.area > 0.0);
                    let y: f64 = (0..8)
                        .map(|a| point.shape[a] * mesh.nodes[nodes[a]][1])
                        .sum();
                    for (power, sum) in sums.iter_mut().enumerate() {
                        *sum += 2.0 * point.area * y.powi(power as i32);
                    }
                }
            }
            let moment = section.second_moment_about_centre_m4();
            assert!((sums[0] / section.area_m2() - 1.0).abs() < 1e-4);
            assert!(
                (sums[1] / sums[0] - section.centroid_m()).abs() < 1e-3 * section.outer_radius_m
            );
            assert!((sums[2] / moment - 1.0).abs() < 1e-3);
        }
    }
}

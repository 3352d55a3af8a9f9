//! Objects between the fingers, in a finger's plane, and where a chain of round links touches them.

use softgrip_table::LINKS;

use crate::contact::Contact;

/// Shape and size of an object that is centred on the gripper's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Object {
    /// A sphere.
    Sphere {
        /// Radius, m.
        radius_m: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Radius, m.
        radius_m: f64,
        /// Height, m.
        height_m: f64,
    },
}

/// A place where a link touches the object or could.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    /// The contact, without friction.
    pub contact: Contact,
    /// Distance between the surfaces, m; negative where they overlap.
    pub gap_m: f64,
}

impl Object {
    /// Places where links of radius `link_radius` with their ends at `joints` could touch the object with
    /// its centre at `centre`.
    pub(crate) fn touches(
        &self,
        centre: [f64; 2],
        joints: &[[f64; 2]; LINKS + 1],
        link_radius: f64,
    ) -> Vec<Touch> {
        let links = || joints.windows(2).enumerate();
        match *self {
            Self::Sphere { radius_m } => links()
                .filter_map(|(link, ends)| {
                    let (near, _) = nearest(ends, centre);
                    touch(link, near, centre, radius_m, link_radius)
                })
                .collect(),
            Self::Cylinder { radius_m, height_m } => {
                let side = centre[1] - radius_m;
                let (top, bottom) = (centre[0] - height_m / 2.0, centre[0] + height_m / 2.0);
                // A face is touched by the ends of links, an edge by links anywhere.
                let by_face = links().filter_map(|(link, ends)| {
                    let [x, y] = ends[1];
                    let (face, normal, gap) = if (top..=bottom).contains(&x) {
                        ([x, side], [0.0, 1.0], side - y)
                    } else if x > bottom && y > side {
                        ([bottom, y], [-1.0, 0.0], x - bottom)
                    } else {
                        return None;
                    };
                    Some(Touch {
                        contact: frictionless(link, face, normal),
                        gap_m: gap - link_radius,
                    })
                });
                let by_edge = links().flat_map(|(link, ends)| {
                    [top, bottom].into_iter().filter_map(move |edge| {
                        let edge = [edge, side];
                        let (near, inward) = nearest(ends, edge);
                        match inward {
                            // The link may have swept past the edge by less than its radius.
                            Some(normal) => Some(Touch {
                                contact: frictionless(link, edge, normal),
                                gap_m: (edge[0] - near[0]) * normal[0]
                                    + (edge[1] - near[1]) * normal[1]
                                    - link_radius,
                            }),
                            None => touch(link, near, edge, 0.0, link_radius),
                        }
                    })
                });
                by_face.chain(by_edge).collect()
            }
        }
    }
}

/// The contact of a link's axis at `axis` with a ball of `radius` around `centre`; `None` in its centre.
fn touch(
    link: usize,
    axis: [f64; 2],
    centre: [f64; 2],
    radius: f64,
    link_radius: f64,
) -> Option<Touch> {
    let distance = distance(axis, centre);
    let normal = [0, 1].map(|k| (centre[k] - axis[k]) / distance);
    (distance > 0.0).then(|| Touch {
        contact: frictionless(link, [0, 1].map(|k| centre[k] - radius * normal[k]), normal),
        gap_m: distance - radius - link_radius,
    })
}

fn frictionless(link: usize, point_m: [f64; 2], normal: [f64; 2]) -> Contact {
    Contact {
        link,
        point_m,
        normal,
        friction_n: 0.0,
    }
}

/// The point of a segment nearest to `to`, with the segment's inward normal unless it is one of the ends.
fn nearest(ends: &[[f64; 2]], to: [f64; 2]) -> ([f64; 2], Option<[f64; 2]>) {
    let (a, b) = (ends[0], ends[1]);
    let length = distance(a, b);
    let along = [0, 1].map(|k| (b[k] - a[k]) / length);
    let share = (to[0] - a[0]) * along[0] + (to[1] - a[1]) * along[1];
    let inside = share.clamp(0.0, length);
    let normal = (share == inside).then_some([-along[1], along[0]]);
    ([0, 1].map(|k| a[k] + inside * along[k]), normal)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

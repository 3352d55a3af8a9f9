//! What the gripper can hold: the chain pressed against an object, and the mass that its friction carries.
//!
//! Statics, where the paper simulates: with the object on the gripper's axis, each finger comes to rest
//! against it with friction used up at every contact, the object being about to slide towards the tips.
//! Complementarity decides which links touch. The lift of that state carries `m (g + a)`.

use nalgebra::{DMatrix, DVector};
use softgrip_table::LINKS;

use crate::complementarity::complementary;
use crate::contact::{self, Contact};
use crate::links;
use crate::object::{Object, Touch};

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// A gripper of equal fingers, evenly spaced, at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// How many there are.
    pub fingers: usize,
    /// Length of each link, from the clamp to the tip, m.
    pub link_length_m: [f64; LINKS],
    /// Torsional stiffness `k_i` of each joint, N·m/rad (eq. 24).
    pub joint_stiffness_nm_per_rad: [f64; LINKS],
    /// Angle `φ_i` of each joint of the free finger at this pressure, rad.
    pub free_angle_rad: [f64; LINKS],
    /// Distance of the fingers' clamps from the gripper's axis, m.
    pub palm_radius_m: f64,
    /// Radius of the round links, whose surface touches the object, m.
    pub link_radius_m: f64,
    /// Coefficient of Coulomb friction `μ` between finger and object; not negative.
    pub friction: f64,
}

/// The gripper in equilibrium with an object that is about to slide towards the tips. The fingers are
/// alike, so everything but the lift is of one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    /// Distance of the object's centre below the palm, m.
    pub depth_m: f64,
    /// Angle `φ'_i` of each joint, from the clamp to the tip, rad.
    pub joint_angle_rad: [f64; LINKS],
    /// The contacts that press, with friction used up: `f = −μ N`. Empty where the finger does not touch.
    pub contacts: Vec<Contact>,
    /// Normal force `N` of each of them, N.
    pub normal_n: Vec<f64>,
    /// Force of all fingers against gravity, N (eq. 35, corrected: [`contact::lift_n`]).
    pub lift_n: f64,
}

/// Why a grip cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GripError {
    /// A dimension, stiffness, angle or coefficient is out of range.
    #[error("{name} = {value}: must be {expected}")]
    Value {
        /// Which one, as messages call it.
        name: &'static str,
        /// Its value: m, rad, N·m/rad, or without unit.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The object overlaps the fingers before they bend: it is too wide for the palm.
    #[error("the object overlaps the open fingers by {:.3} mm", 1e3 * overlap_m)]
    Overlap {
        /// By how much, m.
        overlap_m: f64,
    },
    /// No configuration of the fingers balances, or friction locks them.
    #[error("no equilibrium of fingers and object {:.1} mm below the palm", 1e3 * depth_m)]
    NoEquilibrium {
        /// Distance of the object's centre below the palm, m.
        depth_m: f64,
    },
}

impl Hold {
    /// The largest mass, kg, that the hold lifts at an upward acceleration `a`, m/s²: its weight and inertia
    /// `m (g + a)` are the lift (eq. 35).
    pub fn max_mass_kg(&self, acceleration_m_s2: f64) -> f64 {
        self.lift_n / (GRAVITY_M_S2 + acceleration_m_s2)
    }
}

impl Grip {
    /// Closes the open fingers on an object with its centre held `depth_m`, m, below the palm.
    ///
    /// # Errors
    /// [`GripError`], if a dimension is wrong, the object does not fit between the open fingers, or
    /// nothing balances.
    pub fn close(&self, object: Object, depth_m: f64) -> Result<Hold, GripError> {
        self.check(object, depth_m)?;
        self.settle(object, depth_m, [0.0; LINKS])
    }

    /// Lets the object slide from `depth_m` towards the tips, a millimetre at a time, and returns the hold of
    /// largest lift on the way: an object heavier than the first hold carries may still come to rest there.
    ///
    /// # Errors
    /// As [`Grip::close`].
    pub fn strongest(&self, object: Object, depth_m: f64) -> Result<Hold, GripError> {
        let mut hold = self.close(object, depth_m)?;
        let mut strongest = hold.clone();
        let reach: f64 = self.link_length_m.iter().sum();
        while !hold.contacts.is_empty() && hold.depth_m < depth_m + reach {
            match self.settle(object, hold.depth_m + 1e-3, hold.joint_angle_rad) {
                Ok(next) => hold = next,
                // Beyond the last equilibrium the object is gone.
                Err(GripError::NoEquilibrium { .. }) => break,
                Err(error) => return Err(error),
            }
            if hold.lift_n > strongest.lift_n {
                strongest = hold.clone();
            }
        }
        Ok(strongest)
    }

    fn check(&self, object: Object, depth_m: f64) -> Result<(), GripError> {
        let (radius, height) = match object {
            Object::Sphere { radius_m } => (radius_m, radius_m),
            Object::Cylinder { radius_m, height_m } => (radius_m, height_m),
        };
        let mut dimensions = vec![
            ("object radius", radius),
            ("object height", height),
            ("depth", depth_m),
            ("palm radius", self.palm_radius_m),
            ("link radius", self.link_radius_m),
        ];
        dimensions.extend(self.link_length_m.map(|length| ("link length", length)));
        dimensions.extend(
            self.joint_stiffness_nm_per_rad
                .map(|k| ("joint stiffness", k)),
        );
        let positive = dimensions
            .into_iter()
            .map(|(name, value)| (name, value, value > 0.0, "positive"));
        let friction = self.friction;
        let rest = [("friction", friction, friction >= 0.0, "not negative")]
            .into_iter()
            .chain(
                self.free_angle_rad
                    .map(|angle| ("free angle", angle, true, "finite")),
            );
        for (name, value, ok, expected) in positive.chain(rest) {
            if !(value.is_finite() && ok) {
                return Err(GripError::Value {
                    name,
                    value,
                    expected,
                });
            }
        }
        let overlap_m = radius + self.link_radius_m - self.palm_radius_m;
        if overlap_m > 0.0 {
            return Err(GripError::Overlap { overlap_m });
        }
        Ok(())
    }

    /// Moves the joints from `angle` to equilibrium, by linear complementarity at each step.
    fn settle(
        &self,
        object: Object,
        depth_m: f64,
        mut angle: [f64; LINKS],
    ) -> Result<Hold, GripError> {
        // Steps short enough that no link jumps through an edge.
        const LONGEST_STEP_RAD: f64 = 0.02;
        for _ in 0..2000 {
            let joints = self.joints(&angle);
            let touches =
                object.touches([depth_m, self.palm_radius_m], &joints, self.link_radius_m);
            let (step, normal) = self
                .step(&angle, &joints, &touches)
                .ok_or(GripError::NoEquilibrium { depth_m })?;
            let longest = step
                .iter()
                .fold(0.0, |longest: f64, d| longest.max(d.abs()));
            if longest < 1e-9 {
                return Ok(self.hold(depth_m, angle, &touches, &normal));
            }
            let share = (LONGEST_STEP_RAD / longest).min(1.0);
            for (angle, step) in angle.iter_mut().zip(step) {
                *angle += share * step;
            }
        }
        Err(GripError::NoEquilibrium { depth_m })
    }

    fn joints(&self, angle: &[f64; LINKS]) -> [[f64; 2]; LINKS + 1] {
        let mut sum = 0.0;
        let link_angle = angle.map(|angle| {
            sum += angle;
            sum
        });
        links::joints_m(&self.link_length_m, &link_angle)
    }

    /// Change of the angles, and normal forces, that close all gaps or leave them open, to first order.
    fn step(
        &self,
        angle: &[f64; LINKS],
        joints: &[[f64; 2]; LINKS + 1],
        touches: &[Touch],
    ) -> Option<([f64; LINKS], Vec<f64>)> {
        let n = touches.len();
        let lever = |touch: &Touch, joint: usize, direction: [f64; 2]| {
            let Contact { link, point_m, .. } = touch.contact;
            let moment = contact::moment(point_m, joints[joint], direction);
            if joint <= link { moment } else { 0.0 }
        };
        let normal = DMatrix::from_fn(n, LINKS, |j, i| {
            lever(&touches[j], i, touches[j].contact.normal)
        });
        let sliding = DMatrix::from_fn(n, LINKS, |j, i| {
            let contact = Contact {
                friction_n: -self.friction,
                ..touches[j].contact
            };
            lever(&touches[j], i, contact.force_n(1.0)) / self.joint_stiffness_nm_per_rad[i]
        });
        let to_free = DVector::from_fn(LINKS, |i, _| self.free_angle_rad[i] - angle[i]);
        let gaps = DVector::from_fn(n, |j, _| touches[j].gap_m) - &normal * &to_free;
        let force = complementary(&(&normal * sliding.transpose()), &gaps)?;
        let step = to_free - sliding.tr_mul(&force);
        Some((
            std::array::from_fn(|i| step[i]),
            force.iter().copied().collect(),
        ))
    }

    fn hold(&self, depth_m: f64, angle: [f64; LINKS], touches: &[Touch], normal: &[f64]) -> Hold {
        let pressing = || {
            touches
                .iter()
                .zip(normal)
                .filter(|(_, normal)| **normal > 0.0)
        };
        let contacts: Vec<Contact> = pressing()
            .map(|(touch, normal)| Contact {
                friction_n: -self.friction * normal,
                ..touch.contact
            })
            .collect();
        let normal_n: Vec<f64> = pressing().map(|(_, normal)| *normal).collect();
        Hold {
            depth_m,
            joint_angle_rad: angle,
            lift_n: contact::lift_n(self.fingers, &contacts, &normal_n),
            contacts,
            normal_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GRIP: Grip = Grip {
        fingers: 3,
        link_length_m: [0.018, 0.018, 0.018, 0.018, 0.018, 0.010],
        joint_stiffness_nm_per_rad: [0.236, 0.112, 0.107, 0.096, 0.093, 0.064],
        free_angle_rad: [0.2, 0.22, 0.29, 0.23, 0.24, 0.11],
        palm_radius_m: 39.98e-3,
        link_radius_m: 4.5e-3,
        friction: 0.8,
    };
    const SPHERE: Object = Object::Sphere { radius_m: 35e-3 };
    const CYLINDER: Object = Object::Cylinder {
        radius_m: 35e-3,
        height_m: 70e-3,
    };

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn a_hold_is_an_equilibrium_without_overlap(
            share in 0.3f64..1.2,
            depth in 0.03f64..0.075,
            friction in 0.0f64..0.9,
            sphere in any::<bool>(),
        ) {
            let grip = Grip {
                free_angle_rad: GRIP.free_angle_rad.map(|angle| share * angle),
                friction,
                ..GRIP
            };
            let object = if sphere { SPHERE } else { CYLINDER };
            let hold = grip.close(object, depth).expect("closes");
            let joints = grip.joints(&hold.joint_angle_rad);
            for touch in object.touches([depth, grip.palm_radius_m], &joints, grip.link_radius_m) {
                prop_assert!(touch.gap_m > -1e-7, "{:?}", touch);
            }
            // Joint by joint: the springs carry what the contacts exert.
            for (i, joint) in joints.iter().enumerate().take(LINKS) {
                let torque: f64 = hold.contacts.iter().zip(&hold.normal_n)
                    .filter(|(contact, _)| contact.link >= i)
                    .map(|(contact, normal)| {
                        contact::moment(contact.point_m, *joint, contact.force_n(*normal))
                    })
                    .sum();
                let spring = grip.joint_stiffness_nm_per_rad[i]
                    * (grip.free_angle_rad[i] - hold.joint_angle_rad[i]);
                prop_assert!((torque - spring).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn without_pressure_nothing_is_held() {
        let limp = Grip {
            free_angle_rad: [0.0; LINKS],
            ..GRIP
        };
        let hold = limp.close(SPHERE, 39e-3).expect("does not touch");
        assert!(hold.contacts.is_empty());
        assert_eq!(hold.lift_n, 0.0);
    }

    #[test]
    fn the_strongest_hold_is_no_weaker_than_the_first() {
        for (object, depth) in [(SPHERE, 39e-3), (CYLINDER, 57e-3), (SPHERE, 45e-3)] {
            let first = GRIP.close(object, depth).expect("closes");
            let strongest = GRIP.strongest(object, depth).expect("closes");
            assert!(strongest.lift_n >= first.lift_n && strongest.depth_m >= depth);
            let weight = strongest.max_mass_kg(2.0) * (GRAVITY_M_S2 + 2.0);
            assert!((weight - strongest.lift_n).abs() < 1e-12);
        }
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let big = Object::Sphere { radius_m: 36e-3 };
        let error = GRIP.close(big, 39e-3).expect_err("too big");
        assert_eq!(
            error.to_string(),
            "the object overlaps the open fingers by 0.520 mm"
        );
        let flat = Object::Cylinder {
            radius_m: 35e-3,
            height_m: 0.0,
        };
        let error = GRIP.close(flat, 57e-3).expect_err("no height");
        assert_eq!(error.to_string(), "object height = 0: must be positive");
        let broken = Grip {
            free_angle_rad: [f64::NAN; LINKS],
            ..GRIP
        };
        assert!(broken.close(SPHERE, 39e-3).is_err());
    }
}

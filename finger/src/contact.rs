//! Forces between the chain and an object at several contacts (eqs. 30–37, corrected).
//!
//! In the finger's plane, `x` along the unbent finger and `y` towards the object. Cutting the chain at each
//! joint gives, for forces `F_j` of the finger on the object at `r_j` and joints at `A`,
//!
//! ```text
//! k_i (φ_i − φ'_i) = Σ_{j ≥ i} (r_j − A_{i−1}) × F_j,    φ free, φ' held
//! ```
//!
//! The paper subtracts only the next joint's torque, counts the next contact twice and leaves friction out.
//! The links' weights (a few percent of the joints' torques) are left out here.

use softgrip_table::LINKS;

use crate::links;

/// A contact between a link and the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The link, counted from 0 at the clamp.
    pub link: usize,
    /// The point of contact `r` in the finger's plane, m.
    pub point_m: [f64; 2],
    /// Unit normal into the object.
    pub normal: [f64; 2],
    /// Friction `f` of the finger on the object, N, along the normal turned towards the tip.
    pub friction_n: f64,
}

/// The normal forces of a finger's contacts, and what they leave unbalanced.
#[derive(Debug, Clone, PartialEq)]
pub struct Balance {
    /// Normal force of each contact, N, in the order in which the contacts were given.
    pub normal_n: Vec<f64>,
    /// Torque that each joint still lacks for equilibrium, N·m: zero at joints of links with a contact,
    /// and at all of them if the held angles are an equilibrium.
    pub missing_torque_nm: [f64; LINKS],
}

/// Why contacts cannot be balanced.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// The chain has no such link.
    #[error("contact on link {link}: links are 0 to {}", LINKS - 1)]
    NoSuchLink {
        /// The link asked for, counted from 0 at the clamp.
        link: usize,
    },
    /// One joint cannot tell two contacts apart.
    #[error("two contacts on link {link}: give one contact a link, in order from the clamp")]
    Order {
        /// The link of the second one, counted from 0 at the clamp.
        link: usize,
    },
    /// The contact's normal passes through the joint.
    #[error("the contact on link {link} has no lever about its joint")]
    NoLever {
        /// The link, counted from 0 at the clamp.
        link: usize,
    },
    /// A contact cannot pull.
    #[error("the contact on link {link} would have to pull with {:.3} N", -normal_n)]
    Pulls {
        /// The link, counted from 0 at the clamp.
        link: usize,
        /// The normal force that would balance, N; negative.
        normal_n: f64,
    },
}

impl Contact {
    /// Unit tangent: the normal turned by a right angle, towards the tip where the normal points inwards.
    pub fn tangent(&self) -> [f64; 2] {
        [self.normal[1], -self.normal[0]]
    }

    /// Force `N n + f t` of the finger on the object, N, for a normal force `N`, N.
    pub fn force_n(&self, normal_n: f64) -> [f64; 2] {
        let tangent = self.tangent();
        [0, 1].map(|axis| normal_n * self.normal[axis] + self.friction_n * tangent[axis])
    }
}

/// `(r − A) × d`, the moment about a joint at `a` of a force along `d` at `r`.
pub(crate) fn moment(r: [f64; 2], a: [f64; 2], d: [f64; 2]) -> f64 {
    (r[0] - a[0]) * d[1] - (r[1] - a[1]) * d[0]
}

/// Normal forces of contacts with known friction on a chain whose joints are held at `held_angle_rad` and
/// would be at `free_angle_rad` without them (eqs. 30–34, corrected as above). At most one contact a link, in
/// order from the clamp: lengths in m, stiffnesses in N·m/rad, joint angles in rad.
///
/// # Errors
/// [`ContactError`], if the contacts are out of order, have no lever, or would have to pull.
pub fn balance(
    link_length_m: &[f64; LINKS],
    joint_stiffness_nm_per_rad: &[f64; LINKS],
    free_angle_rad: &[f64; LINKS],
    held_angle_rad: &[f64; LINKS],
    contacts: &[Contact],
) -> Result<Balance, ContactError> {
    let mut before = None;
    for &Contact { link, .. } in contacts {
        if link >= LINKS {
            return Err(ContactError::NoSuchLink { link });
        }
        if before.is_some_and(|before| link <= before) {
            return Err(ContactError::Order { link });
        }
        before = Some(link);
    }
    let mut sum = 0.0;
    let link_angle = held_angle_rad.map(|angle| {
        sum += angle;
        sum
    });
    let joints = links::joints_m(link_length_m, &link_angle);
    let mut missing_torque_nm = std::array::from_fn(|i| {
        joint_stiffness_nm_per_rad[i] * (free_angle_rad[i] - held_angle_rad[i])
    });
    let mut normal_n = vec![0.0; contacts.len()];
    // From the tip inwards each contact is the only unknown at its link's joint.
    for (contact, normal_n) in contacts.iter().zip(&mut normal_n).rev() {
        let link = contact.link;
        let joint = joints[link];
        let lever = moment(contact.point_m, joint, contact.normal);
        if lever.abs() < 1e-6 * link_length_m[link] {
            return Err(ContactError::NoLever { link });
        }
        let friction = contact.friction_n * moment(contact.point_m, joint, contact.tangent());
        *normal_n = (missing_torque_nm[link] - friction) / lever;
        if *normal_n < 0.0 {
            return Err(ContactError::Pulls {
                link,
                normal_n: *normal_n,
            });
        }
        let force = contact.force_n(*normal_n);
        for (missing, &joint) in missing_torque_nm.iter_mut().zip(&joints).take(link + 1) {
            *missing -= moment(contact.point_m, joint, force);
        }
    }
    Ok(Balance {
        normal_n,
        missing_torque_nm,
    })
}

/// Force of all fingers on the object along the gripper's axis, N, against gravity when the unbent fingers
/// point down: `3 Σ (N n + f t)` for three, which carries `m (g + a)` (eq. 35; its horizontal row has no factor 3,
/// because evenly spaced radial forces cancel). The contacts are those of one finger.
pub fn lift_n(fingers: usize, contacts: &[Contact], normal_n: &[f64]) -> f64 {
    let down: f64 = contacts
        .iter()
        .zip(normal_n)
        .map(|(contact, &normal)| contact.force_n(normal)[0])
        .sum();
    -(fingers as f64) * down
}

/// Whether no contact slips at the coefficient of friction `μ`: `|f_j| ≤ μ N_j` at each of them (eqs. 36–37,
/// which sum over the contacts although one may slip while another has friction to spare).
pub fn is_stable(contacts: &[Contact], normal_n: &[f64], friction: f64) -> bool {
    contacts
        .iter()
        .zip(normal_n)
        .all(|(contact, &normal)| contact.friction_n.abs() <= friction * normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LENGTHS_M: [f64; LINKS] = [0.018, 0.018, 0.018, 0.018, 0.018, 0.010];
    const STIFFNESS: [f64; LINKS] = [0.236, 0.112, 0.107, 0.096, 0.093, 0.064];

    /// A contact in the middle of a link whose radius is 4.5 mm.
    fn contact(held: &[f64; LINKS], link: usize, friction_n: f64) -> Contact {
        let mut sum = 0.0;
        let link_angle = held.map(|angle| {
            sum += angle;
            sum
        });
        let joint = links::joints_m(&LENGTHS_M, &link_angle)[link];
        let (sin, cos) = link_angle[link].sin_cos();
        let half = LENGTHS_M[link] / 2.0;
        Contact {
            link,
            point_m: [
                joint[0] + half * cos - 4.5e-3 * sin,
                joint[1] + half * sin + 4.5e-3 * cos,
            ],
            normal: [-sin, cos],
            friction_n,
        }
    }

    proptest! {
        #[test]
        fn returns_the_forces_that_hold_the_chain(
            held in prop::array::uniform6(-0.1f64..0.3),
            normal in prop::array::uniform6(0.0f64..2.0),
            share in prop::array::uniform6(-0.8f64..0.8),
        ) {
            let contacts: Vec<Contact> = (0..LINKS)
                .map(|link| contact(&held, link, share[link] * normal[link]))
                .collect();
            // The angles that the chain would have without the forces, joint by joint from the sum itself.
            let mut sum = 0.0;
            let angles = held.map(|angle| { sum += angle; sum });
            let joints = links::joints_m(&LENGTHS_M, &angles);
            let free = std::array::from_fn(|i| {
                let torque: f64 = (i..LINKS)
                    .map(|j| moment(contacts[j].point_m, joints[i], contacts[j].force_n(normal[j])))
                    .sum();
                held[i] + torque / STIFFNESS[i]
            });
            let balance = balance(&LENGTHS_M, &STIFFNESS, &free, &held, &contacts);
            // Rounding may turn a normal force of nothing into a pull of nothing.
            prop_assume!(normal.iter().all(|normal| *normal > 1e-6));
            let balance = balance.expect("all press");
            for (found, normal) in balance.normal_n.iter().zip(normal) {
                prop_assert!((found - normal).abs() < 1e-9);
            }
            for missing in balance.missing_torque_nm {
                prop_assert!(missing.abs() < 1e-12);
            }
            prop_assert!(is_stable(&contacts, &balance.normal_n, 0.8));
        }
    }

    #[test]
    fn without_friction_the_lever_is_along_the_link() {
        // Eq. 31 without weight: a single contact in the middle of the last link.
        let mut free = [0.1; LINKS];
        let held = free;
        free[5] += 0.2;
        let tip = contact(&held, 5, 0.0);
        let balance = balance(&LENGTHS_M, &STIFFNESS, &free, &held, &[tip]).expect("presses");
        let expected = 2.0 * STIFFNESS[5] * 0.2 / LENGTHS_M[5];
        assert!((balance.normal_n[0] - expected).abs() < 1e-12);
        // The other joints were not bent back, so they lack torque: this is no equilibrium yet.
        assert!(balance.missing_torque_nm[0] < -0.1);
        // The last link points 0.6 rad inwards: its normal force lifts.
        let lift = lift_n(3, &[tip], &balance.normal_n);
        assert!((lift - 3.0 * expected * 0.6f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn contacts_that_cannot_be_are_named() {
        let held = [0.1; LINKS];
        let solve = |free: [f64; LINKS], contacts: &[Contact]| {
            balance(&LENGTHS_M, &STIFFNESS, &free, &held, contacts)
        };
        let (near, far) = (contact(&held, 2, 0.0), contact(&held, 4, 0.0));
        let order = solve(held, &[far, near]);
        assert_eq!(order, Err(ContactError::Order { link: 2 }));
        let beyond = Contact { link: 6, ..far };
        let beyond = solve(held, &[beyond]);
        assert_eq!(beyond, Err(ContactError::NoSuchLink { link: 6 }));
        let along = Contact {
            point_m: [0.0; 2],
            normal: [1.0, 0.0],
            link: 0,
            friction_n: 0.0,
        };
        let along = solve(held, &[along]);
        assert_eq!(along, Err(ContactError::NoLever { link: 0 }));
        let pulls = solve([0.0; LINKS], &[far]);
        assert!(matches!(pulls, Err(ContactError::Pulls { link: 4, .. })));
        assert!(!is_stable(&[contact(&held, 3, 0.9)], &[1.0], 0.8));
    }
}

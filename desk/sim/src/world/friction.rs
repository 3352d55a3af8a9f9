//! Static and sliding friction. Rapier has one coefficient per contact; its contact hook sets it before every
//! step.

use rapier3d_f64::prelude::*;

/// Surfaces that move against each other faster than this slide, m/s: a held object creeps by less
/// than a millionth of it, and a lost one is faster within a millisecond.
const SLIDING_M_S: f64 = 0.001;

/// Coulomb coefficients between finger and object.
pub(super) struct Friction {
    pub at_rest: f64,
    pub sliding: f64,
}

impl PhysicsHooks for Friction {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let bodies = context.bodies;
        let (Some(one), Some(other)) = (context.rigid_body1, context.rigid_body2) else {
            return;
        };
        let Some(manifold) = context.rigid_mut() else {
            return;
        };
        let normal = *manifold.normal;
        let slides = manifold.solver_contacts.iter().any(|contact| {
            let relative = bodies[one].velocity_at_point(contact.anchor1)
                - bodies[other].velocity_at_point(contact.anchor2);
            (relative - normal * relative.dot(normal)).length() > SLIDING_M_S
        });
        *manifold.friction = if slides { self.sliding } else { self.at_rest };
    }
}

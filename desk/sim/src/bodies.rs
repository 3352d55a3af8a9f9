//! The rigid bodies of a gripper above an object.

use std::f64::consts::TAU;

use finger::grasp::Grasp;
use finger::object::Object;

use crate::gripper::Gripper;
use crate::hand::Hand;
use crate::scenario::{ObjectKind, Scenario};
use crate::world::{Finger, Shape, WorldConfig};

/// Fingers and object as the rigid-body engine knows them.
pub fn world_config(
    scenario: &Scenario,
    gripper: &Gripper,
    hand: &Hand,
    grasp: &Grasp,
) -> WorldConfig {
    let parameters = &gripper.hand;
    let fingers = std::array::from_fn(|i| {
        let (chain, factor) = (&hand.chains[i], parameters.finger_stiffness[i]);
        Finger {
            length_m: chain.link_length_m,
            mass_kg: chain.link_mass_kg,
            stiffness_nm_rad: chain.joint_stiffness_nm_per_rad.map(|k| factor * k),
            damping_s: 1e-3 * parameters.damping_ms,
        }
    });
    let gripped = match scenario.object {
        ObjectKind::Sphere => grasp.sphere,
        ObjectKind::Cylinder => grasp.cylinder,
    };
    let shape = match gripped.object {
        Object::Sphere { radius_m } => Shape::Sphere {
            diameter_m: 2.0 * radius_m,
        },
        Object::Cylinder { radius_m, height_m } => Shape::Cylinder {
            diameter_m: 2.0 * radius_m,
            height_m,
        },
    };
    WorldConfig {
        fingers,
        link_radius_m: grasp.link_radius_m,
        palm_radius_m: grasp.palm_radius_m,
        first_finger_rad: TAU * parameters.first_finger_deg / 360.0,
        shape,
        mass_kg: scenario.mass_kg,
        grasp_depth_m: gripped.depth_m,
        friction: scenario.friction,
        sliding_friction: parameters.sliding_friction * scenario.friction,
        carry_m: 1e-3 * gripper.arm.carry_mm,
        fingers_touch: parameters.fingers_touch,
        step_s: 1e-3 * gripper.world.step_ms,
    }
}

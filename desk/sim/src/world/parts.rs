//! Parameters of the rigid-body world, and the bodies built from them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, TAU};

use rapier3d_f64::prelude::*;

/// Fingers of the gripper.
pub use softgrip::FINGERS;
/// Links, and joints, of a finger.
pub const LINKS: usize = 6;

/// Collision groups: fingers never touch the ground.
const FINGER: Group = Group::GROUP_1;
const OBJECT: Group = Group::GROUP_2;
const GROUND: Group = Group::GROUP_3;

/// Shape of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A solid sphere; it stands on three small balls.
    Sphere {
        /// Diameter of the object, m.
        diameter_m: f64,
    },
    /// A solid upright cylinder; it stands on a disc.
    Cylinder {
        /// Diameter of the object, m.
        diameter_m: f64,
        /// Height of the cylinder, m.
        height_m: f64,
    },
}

/// One finger as a chain of rigid links, from the palm to the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finger {
    /// Length of each link, m.
    pub length_m: [f64; LINKS],
    /// Mass of each link, kg.
    pub mass_kg: [f64; LINKS],
    /// Stiffness of the joint above each link, N·m/rad.
    pub stiffness_nm_rad: [f64; LINKS],
    /// Damping of every joint divided by its stiffness, s.
    pub damping_s: f64,
}

/// Constant parameters of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldConfig {
    /// The fingers; they may differ.
    pub fingers: [Finger; FINGERS],
    /// Radius of the links, m.
    pub link_radius_m: f64,
    /// Radius of the circle on the palm from which the fingers hang, m.
    pub palm_radius_m: f64,
    /// Angle from the direction of the transfer to the first finger, rad; the others follow at 120°.
    pub first_finger_rad: f64,
    /// Shape of the object.
    pub shape: Shape,
    /// Mass of the object, kg.
    pub mass_kg: f64,
    /// Depth of the object's centre below the palm when the arm is at its origin, m.
    pub grasp_depth_m: f64,
    /// Coulomb friction coefficient between the object and everything else.
    pub friction: f64,
    /// Coulomb friction coefficient while a finger slides over the object.
    pub sliding_friction: f64,
    /// Distance from the fixture where the object stands at first to the one for which it is bound, m.
    pub carry_m: f64,
    /// Whether fingers collide with each other. If not, they pass through one another when they close on
    /// nothing, and bend as freely as a single finger.
    pub fingers_touch: bool,
    /// Length of one step, s.
    pub step_s: f64,
}

/// One link with the joint above it.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
    pub joint: MultibodyJointHandle,
    pub stiffness_nm_rad: f64,
    pub length_m: f64,
}

/// Hangs finger `n` on the palm. In a finger's own frame x points outwards, z up, and a turn about
/// +y bends inwards; each link hangs from its origin.
pub(super) fn hang_finger(
    rapier: &mut PhysicsWorld,
    config: &WorldConfig,
    n: usize,
) -> [Link; LINKS] {
    let finger = &config.fingers[n];
    let outwards = about_z(config.first_finger_rad + TAU * n as f64 / FINGERS as f64);
    let frame = Pose::from_parts(outwards * (config.palm_radius_m * Vector::X), outwards);
    let partners = match config.fingers_touch {
        true => OBJECT | FINGER,
        false => OBJECT,
    };
    let mut parent = rapier.insert_body(RigidBodyBuilder::fixed().pose(frame));
    let mut hinge = Vector::ZERO;
    std::array::from_fn(|i| {
        let end = -finger.length_m[i] * Vector::Z;
        let capsule =
            ColliderBuilder::capsule_from_endpoints(Vector::ZERO, end, config.link_radius_m)
                .mass(finger.mass_kg[i])
                .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        let (body, collider) = rapier.insert(
            RigidBodyBuilder::dynamic().pose(frame).can_sleep(false),
            surface(capsule, config.friction, FINGER, partners),
        );
        let joint = RevoluteJointBuilder::new(Vector::Y).local_anchor1(hinge);
        let joint = rapier
            .insert_multibody_joint(parent, body, joint)
            .expect("a new body closes no loop");
        (parent, hinge) = (body, end);
        Link {
            body,
            collider,
            joint,
            stiffness_nm_rad: finger.stiffness_nm_rad[i],
            length_m: finger.length_m[i],
        }
    })
}

/// Puts the object in place. Rapier's cylinders stand along y.
pub(super) fn insert_object(
    rapier: &mut PhysicsWorld,
    config: &WorldConfig,
    centre_m: Vector,
) -> (RigidBodyHandle, ColliderHandle) {
    let solid = match config.shape {
        Shape::Sphere { diameter_m } => ColliderBuilder::ball(diameter_m / 2.0),
        Shape::Cylinder {
            diameter_m,
            height_m,
        } => ColliderBuilder::cylinder(height_m / 2.0, diameter_m / 2.0)
            .rotation(FRAC_PI_2 * Vector::X),
    };
    rapier.insert(
        RigidBodyBuilder::dynamic()
            .translation(centre_m)
            .can_sleep(false),
        surface(solid, config.friction, OBJECT, FINGER | GROUND).mass(config.mass_kg),
    )
}

/// Builds the ground: two fixtures and, below them, the floor. Its origin is the object's first place.
pub(super) fn insert_ground(
    rapier: &mut PhysicsWorld,
    config: &WorldConfig,
    origin_m: Vector,
) -> RigidBodyHandle {
    let (bottom_m, fixture) = match config.shape {
        Shape::Sphere { diameter_m } => {
            // Three balls, 30° off the lowest point.
            let ball_m = 0.003;
            let reach = -(diameter_m / 2.0 + ball_m) * Vector::Z;
            let tilted = Rotation::from_rotation_y(FRAC_PI_6) * reach;
            let balls = [0.0, 1.0, 2.0]
                .map(|n| about_z(TAU * n / 3.0) * tilted)
                .map(|place| ColliderBuilder::ball(ball_m).translation(place));
            (diameter_m / 2.0, balls.to_vec())
        }
        Shape::Cylinder {
            diameter_m,
            height_m,
        } => {
            let half_thickness_m = 0.0025;
            let bottom_m = height_m / 2.0;
            let disc = ColliderBuilder::cylinder(half_thickness_m, 0.4 * diameter_m)
                .rotation(FRAC_PI_2 * Vector::X)
                .translation(-(bottom_m + half_thickness_m) * Vector::Z);
            (bottom_m, vec![disc])
        }
    };
    let ground =
        rapier.insert_body(RigidBodyBuilder::kinematic_position_based().translation(origin_m));
    let elsewhere = config.carry_m * Vector::X;
    let second = fixture.iter().cloned().map(|mut part| {
        part.position.translation += elsewhere;
        part
    });
    // The floor stops what falls past a fixture, out of the fingers' reach.
    let half_thickness_m = 0.05;
    let floor = ColliderBuilder::cuboid(5.0, 5.0, half_thickness_m)
        .translation(-(bottom_m + 0.7 + half_thickness_m) * Vector::Z);
    for part in second.chain(fixture.clone()).chain([floor]) {
        let part = surface(part, config.friction, GROUND, OBJECT);
        rapier.insert_collider(part, Some(ground));
    }
    ground
}

/// Gives a collider its friction and says what it can touch.
fn surface(
    collider: ColliderBuilder,
    friction: f64,
    member: Group,
    partners: Group,
) -> ColliderBuilder {
    collider
        .friction(friction)
        .friction_combine_rule(CoefficientCombineRule::Min)
        .collision_groups(InteractionGroups::new(
            member,
            partners,
            InteractionTestMode::And,
        ))
}

/// A turn about z. Sines come from rapier's mathematics only: the standard library's may differ in
/// their last bit between machines.
fn about_z(angle_rad: f64) -> Rotation {
    Rotation::from_rotation_z(angle_rad)
}

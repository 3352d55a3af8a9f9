//! The rigid-body world: three fingers of six links, an object, and the fixtures on which it stands, in the
//! palm's frame. The palm stays at the origin (z up, x in the direction of the transfer); the arm's motion
//! enters as a fictitious force and as the motion of the ground.

mod friction;
mod parts;

pub use parts::{FINGERS, Finger, LINKS, Shape, WorldConfig};

use finger::capability::GRAVITY_M_S2;
use rapier3d_f64::prelude::*;

use friction::Friction;
use parts::Link;

/// The place of a revolute joint's angle among rapier's six joint coordinates.
const ANGLE: usize = 3;

/// The simulated gripper, its object and the ground.
pub struct World {
    rapier: PhysicsWorld,
    fingers: [[Link; LINKS]; FINGERS],
    object: RigidBodyHandle,
    object_collider: ColliderHandle,
    ground: RigidBodyHandle,
    /// The object's first place in the palm's frame while the arm is at its origin.
    place_m: Vector,
    /// How far the ground has been lowered under the object, m.
    lowered_m: f64,
    /// Position of the palm now and one step ago.
    palm_m: [Vector; 2],
    friction: Friction,
    step_s: f64,
}

impl World {
    /// Sets up the world with the arm resting at `palm_m` (see [`crate::arm::ArmState`]).
    pub fn new(config: &WorldConfig, palm_m: [f64; 3]) -> World {
        let mut rapier = PhysicsWorld {
            integration_parameters: settings(config.step_s),
            ..PhysicsWorld::default()
        };
        let palm_m = Vector::from(palm_m);
        let fingers = std::array::from_fn(|n| parts::hang_finger(&mut rapier, config, n));
        let place_m = -config.grasp_depth_m * Vector::Z;
        let ground = parts::insert_ground(&mut rapier, config, place_m - palm_m);
        let (object, object_collider) = parts::insert_object(&mut rapier, config, place_m - palm_m);

        // Until its first step rapier counts six freedoms for a fixed root; a step of no length
        // removes them. Only then can its default damping be replaced: 0.1 N·m·s/rad is about 35
        // times that of a finger.
        rapier.integration_parameters.dt = 0.0;
        rapier.step();
        rapier.integration_parameters.dt = config.step_s;
        for (links, finger) in fingers.iter().zip(&config.fingers) {
            for link in links {
                let joints = &mut rapier.multibody_joints;
                if let Some((multibody, id)) = joints.get_mut(link.joint) {
                    multibody.set_self_contacts_enabled(false);
                    // One freedom per joint, none for the root, which is link 0.
                    multibody.damping_mut()[id - 1] = link.stiffness_nm_rad * finger.damping_s;
                }
            }
        }

        World {
            rapier,
            fingers,
            object,
            object_collider,
            ground,
            place_m,
            lowered_m: 0.0,
            palm_m: [palm_m; 2],
            friction: Friction {
                at_rest: config.friction,
                sliding: config.sliding_friction,
            },
            step_s: config.step_s,
        }
    }

    /// Advances by one step: the joints are driven by `torques_nm` (inward positive, N·m), and the
    /// arm brings the palm to `palm_m` at the end of the step.
    ///
    /// The palm's acceleration comes from its last three positions, so that the object and the
    /// fixture under it always feel the same motion.
    pub fn step(&mut self, torques_nm: &[[f64; LINKS]; FINGERS], palm_m: [f64; 3]) {
        let [now, before] = self.palm_m;
        let next = Vector::from(palm_m);
        let acceleration = (next - 2.0 * now + before) / (self.step_s * self.step_s);
        self.palm_m = [next, now];

        self.rapier.gravity = -GRAVITY_M_S2 * Vector::Z - acceleration;
        let ground_m = self.place_m - next - self.lowered_m * Vector::Z;
        self.rapier.bodies[self.ground].set_next_kinematic_translation(ground_m);
        for (links, torques) in self.fingers.iter().zip(torques_nm) {
            for (link, torque) in links.iter().zip(torques) {
                let joints = &mut self.rapier.multibody_joints;
                let Some((multibody, id)) = joints.get_mut(link.joint) else {
                    continue;
                };
                if let Some(body) = multibody.link_mut(id) {
                    // A torque T is a spring whose rest angle is T/k; rapier integrates it implicitly.
                    let k = link.stiffness_nm_rad;
                    body.joint.set_spring(ANGLE, k, torque / k);
                }
            }
        }
        self.rapier.step_with_events(&self.friction, &());
    }

    /// Pushes the object at its centre with this force, in the palm's frame, N, until told otherwise.
    pub fn push(&mut self, force_n: [f64; 3]) {
        let object = &mut self.rapier.bodies[self.object];
        object.reset_forces(true);
        object.add_force(Vector::from(force_n), true);
    }

    /// Puts the object on its first stand, at rest, wherever it was. The fingers must be out of its way.
    pub fn place_object(&mut self) {
        self.lowered_m = 0.0;
        let pose = Pose::from_translation(self.place_m - self.palm_m[0]);
        let object = &mut self.rapier.bodies[self.object];
        object.set_enabled(true);
        object.reset_forces(true);
        object.set_position(pose, true);
        object.set_linvel(Vector::ZERO, true);
        object.set_angvel(Vector::ZERO, true);
    }

    /// Takes the object out of the world.
    pub fn remove_object(&mut self) {
        self.rapier.bodies[self.object].set_enabled(false);
    }

    /// Lowers the ground by this, m, until the object is placed anew: what is not held falls.
    pub fn lower_ground(&mut self, by_m: f64) {
        self.lowered_m = by_m;
    }

    /// Angle of every joint, inward positive, rad.
    pub fn joint_angles(&self) -> [[f64; LINKS]; FINGERS] {
        self.fingers.map(|links| {
            links.map(|link| {
                let found = self.rapier.multibody_joints.get(link.joint);
                found
                    .and_then(|(multibody, id)| multibody.link(id))
                    .map_or(0.0, |link| link.joint.coords()[ANGLE])
            })
        })
    }

    /// Upper and lower end of every link in the palm's frame, for drawing, m.
    pub fn link_ends(&self) -> [[[[f64; 3]; 2]; LINKS]; FINGERS] {
        self.fingers.map(|links| {
            links.map(|link| {
                let pose = self.rapier.bodies[link.body].position();
                [0.0, -link.length_m].map(|z| (*pose * Vector::new(0.0, 0.0, z)).into())
            })
        })
    }

    /// Direction in which the cylinder stands, in the palm's frame.
    pub fn object_axis(&self) -> [f64; 3] {
        let pose = self.rapier.bodies[self.object].position();
        (pose.rotation * Vector::Z).into()
    }

    /// Centre of the object in the palm's frame, m.
    pub fn object_position(&self) -> [f64; 3] {
        self.rapier.bodies[self.object].translation().into()
    }

    /// Normal force between each finger and the object, summed over the links, N.
    pub fn contact_force(&self) -> [f64; FINGERS] {
        self.fingers.map(|links| {
            let pairs = links.iter().filter_map(|link| {
                self.rapier
                    .contact_pair(link.collider, self.object_collider)
            });
            pairs.fold(0.0, |sum, pair| sum + pair.total_impulse_magnitude()) / self.step_s
        })
    }

    /// Sliding speed of the object along each finger that touches it, m/s, at the slowest contact: it may
    /// roll over one that sticks.
    pub fn sliding_m_s(&self) -> [Option<f64>; FINGERS] {
        let bodies = &self.rapier.bodies;
        let object = &bodies[self.object];
        self.fingers.map(|links| {
            let speeds = links.iter().filter_map(|link| {
                let pair = self
                    .rapier
                    .contact_pair(link.collider, self.object_collider)?;
                // Rapier may name the two in either order.
                let first = &self.rapier.colliders[pair.collider1];
                let contacts = pair.manifolds().iter().flat_map(|manifold| {
                    let normal = manifold.data.normal;
                    let touching = manifold.points.iter().filter(|c| c.data.impulse > 0.0);
                    touching.map(move |contact| (normal, contact.local_p1))
                });
                contacts
                    .map(|(normal, local)| {
                        let at = *first.position() * local;
                        let relative =
                            object.velocity_at_point(at) - bodies[link.body].velocity_at_point(at);
                        (relative - normal * relative.dot(normal)).length()
                    })
                    .reduce(f64::min)
            });
            speeds.reduce(f64::min)
        })
    }

    /// Whether each finger presses on the object.
    pub fn touching(&self) -> [bool; FINGERS] {
        self.contact_force().map(|force| force > 0.0)
    }
}

/// Solver settings, chosen by measuring how fast a held sphere creeps out of the grip: less than
/// 1 nm/s with these, 0.1 mm/s with eight solver iterations (substeps) in place of one. Outcomes are
/// the same with one, four and eight.
fn settings(step_s: f64) -> IntegrationParameters {
    let softness = SpringCoefficients::new(120.0, 5.0);
    IntegrationParameters {
        dt: step_s,
        num_solver_iterations: 1,
        num_internal_pgs_iterations: 12,
        num_internal_stabilization_iterations: 1,
        warmstart_coefficient: 1.0,
        contact_softness: softness,
        static_contact_softness: softness,
        // Scales rapier's tolerances, made for objects of a metre, to a hand's.
        length_unit: 0.01,
        contact_clustering: false,
        contact_recycling: false,
        max_ccd_substeps: 0,
        friction_model: FrictionModel::Coulomb,
        ..IntegrationParameters::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::{ArmTask, Phase, Profile};

    const STEP_S: f64 = 0.001;
    /// Stiffness and torques at 140 kPa, N·mm/° and N·mm, from the paper's Tables 2 and 3.
    const STIFFNESS: [f64; LINKS] = [4.12, 1.95, 1.87, 1.68, 1.62, 1.12];
    const TORQUE: [f64; LINKS] = [48.08, 24.14, 31.28, 22.24, 22.41, 7.12];

    fn sphere(mass_kg: f64) -> WorldConfig {
        let finger = Finger {
            length_m: [0.018, 0.018, 0.018, 0.018, 0.018, 0.010],
            mass_kg: [0.00394, 0.00394, 0.00394, 0.00394, 0.00405, 0.00136],
            stiffness_nm_rad: STIFFNESS.map(|k| (1e-3 * k).to_degrees()),
            damping_s: 0.026,
        };
        WorldConfig {
            fingers: [finger; FINGERS],
            link_radius_m: 0.0045,
            palm_radius_m: 0.03998,
            first_finger_rad: 0.0,
            shape: Shape::Sphere { diameter_m: 0.07 },
            mass_kg,
            grasp_depth_m: 0.039,
            friction: 0.8,
            sliding_friction: 0.75,
            carry_m: 0.8,
            fingers_touch: false,
            step_s: STEP_S,
        }
    }

    fn torques(share: f64) -> [[f64; LINKS]; FINGERS] {
        [TORQUE.map(|t| 1e-3 * t * share); FINGERS]
    }

    /// Runs one cycle with full torques or none, handing every step to `look`.
    fn cycle(config: &WorldConfig, acceleration: f64, mut look: impl FnMut(Phase, &World)) {
        let profile = Profile::new(&ArmTask {
            acceleration_m_s2: acceleration,
            ..ArmTask::default()
        });
        let mut world = World::new(config, profile.at(0.0).position_m);
        let (mut share, mut t) = (0.0, 0.0);
        while t < profile.duration_s() {
            t += STEP_S;
            let arm = profile.at(t);
            let wanted = f64::from(u8::from(arm.phase.wants_grip()));
            share += (wanted - share) * STEP_S / 0.1;
            world.step(&torques(share), arm.position_m);
            look(arm.phase, &world);
        }
    }

    #[test]
    fn a_weightless_free_finger_settles_at_torque_over_stiffness() {
        let far = WorldConfig {
            grasp_depth_m: 1.0,
            ..sphere(0.15)
        };
        let mut world = World::new(&far, [0.0; 3]);
        for n in 1..=1500 {
            // The gripper in free fall.
            let t = f64::from(n) * STEP_S;
            let z = -GRAVITY_M_S2 * t * t / 2.0;
            world.step(&torques(1.0), [0.0, 0.0, z]);
        }
        for angles in world.joint_angles() {
            for (angle, (torque, stiffness)) in angles.iter().zip(TORQUE.iter().zip(STIFFNESS)) {
                let expected = (torque / stiffness).to_radians();
                assert!((angle / expected - 1.0).abs() < 0.002);
            }
        }
    }

    #[test]
    fn a_free_finger_settles_where_springs_torques_and_gravity_balance() {
        let far = WorldConfig {
            grasp_depth_m: 1.0,
            ..sphere(0.15)
        };
        let mut world = World::new(&far, [0.0; 3]);
        for _ in 0..1500 {
            world.step(&torques(1.0), [0.0; 3]);
        }
        // The first finger hangs at +x and bends towards −x.
        let (angles, ends) = (world.joint_angles()[0], world.link_ends()[0]);
        for i in 0..LINKS {
            let weight: f64 = (i..LINKS)
                .map(|j| {
                    let lever = ends[i][0][0] - (ends[j][0][0] + ends[j][1][0]) / 2.0;
                    far.fingers[0].mass_kg[j] * GRAVITY_M_S2 * lever
                })
                .sum();
            let spring = far.fingers[0].stiffness_nm_rad[i] * angles[i];
            assert!((spring + weight - 1e-3 * TORQUE[i]).abs() < 1e-5);
        }
    }

    #[test]
    fn fingers_that_close_on_nothing_meet_unless_they_may_pass_through_one_another() {
        let tips_across_m = |fingers_touch: bool| {
            let far = WorldConfig {
                grasp_depth_m: 1.0,
                fingers_touch,
                ..sphere(0.15)
            };
            let mut world = World::new(&far, [0.0; 3]);
            for _ in 0..1500 {
                world.step(&torques(1.0), [0.0; 3]);
            }
            let ends = world.link_ends();
            // How far each tip is from the palm's axis, on its own finger's side.
            [0, 1, 2].map(|n| {
                let (tip, root) = (ends[n][LINKS - 1][1], ends[n][0][0]);
                (tip[0] * root[0] + tip[1] * root[1]) / root[0].hypot(root[1])
            })
        };
        // Three round tips of 4.5 mm around the axis: 2/√3 of it is 5.2 mm.
        assert!(tips_across_m(true).iter().all(|across| *across > 0.004));
        assert!(tips_across_m(false).iter().all(|across| *across < -0.004));
    }

    #[test]
    fn an_object_on_its_fixture_rests_while_the_gripper_comes_down_hard() {
        let profile = Profile::new(&ArmTask {
            acceleration_m_s2: 10.0,
            ..ArmTask::default()
        });
        let config = sphere(0.15);
        let mut world = World::new(&config, profile.at(0.0).position_m);
        for n in 1..=700 {
            let palm_m = profile.at(f64::from(n) * STEP_S).position_m;
            world.step(&torques(0.0), palm_m);
            let at = world.object_position();
            let height = at[2] + palm_m[2] + config.grasp_depth_m;
            assert!(at[0].abs() < 2e-5 && at[1].abs() < 2e-5 && height.abs() < 2e-5);
            assert_eq!(world.touching(), [false; FINGERS]);
        }
    }

    #[test]
    fn a_light_sphere_reaches_its_destination() {
        let (mut held, mut last) = (false, [0.0; 3]);
        cycle(&sphere(0.15), 5.0, |phase, world| {
            if phase == Phase::Carry {
                held = world.touching() == [true; FINGERS];
                assert!(held);
            }
            last = world.object_position();
        });
        // Left standing on the second fixture, below the palm by lift and grasp depth.
        assert!(held && last[0].abs() < 1e-3 && (last[2] + 0.239).abs() < 1e-3);
    }

    #[test]
    fn a_heavy_sphere_is_lost_while_being_picked_and_nothing_blows_up() {
        cycle(&sphere(0.25), 10.0, |phase, world| {
            if phase >= Phase::Carry {
                assert_eq!(world.touching(), [false; FINGERS]);
            }
            let angles = world.joint_angles();
            assert!(angles.iter().flatten().all(|angle| angle.abs() < 2.0));
            assert!(world.object_position().iter().all(|x| x.is_finite()));
        });
    }

    #[test]
    fn two_runs_are_identical_to_the_last_bit() {
        let run = || {
            let mut seen = Vec::new();
            cycle(&sphere(0.15), 10.0, |_, world| {
                seen.push((world.object_position(), world.joint_angles()));
            });
            seen
        };
        assert_eq!(run(), run());
    }
}

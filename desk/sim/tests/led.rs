//! The simulated gripper under an arm that is told its moves, with an object that comes and goes.

use sim::arm::Move;
use sim::plant::{Disturbance, Plant, Truth};
use sim::setup::Setup;
use softgrip::units::Kilopascals;

fn setup() -> Setup {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    Setup::of(&recipe).expect("a setup")
}

/// The plant's state after so many ticks at this pressure.
fn at(plant: &mut Plant, setup: &Setup, kpa: f32, ticks: u32) -> Truth {
    let dac = setup.gripper.front_end().command(Kilopascals(kpa));
    let mut last = plant.step(dac).1;
    for _ in 1..ticks {
        last = plant.step(dac).1;
    }
    last
}

fn touching(truth: &Truth) -> usize {
    truth.contact_n.iter().filter(|n| **n > 0.0).count()
}

#[test]
fn an_object_is_there_only_while_it_is_in_the_world() {
    let setup = setup();
    let mut plant = setup.plant_at_object();
    assert_eq!(touching(&at(&mut plant, &setup, 140.0, 1500)), 3);
    plant.world_mut().remove_object();
    assert_eq!(touching(&at(&mut plant, &setup, 140.0, 10)), 0);
    at(&mut plant, &setup, 0.0, 2000);
    plant.world_mut().place_object();
    let placed = at(&mut plant, &setup, 0.0, 500);
    let depth_m = setup.gripped().depth_m;
    assert!((placed.object_m[2] + depth_m).abs() < 1e-4, "{placed:?}");
    assert_eq!(touching(&at(&mut plant, &setup, 140.0, 1500)), 3);
}

#[test]
fn what_is_held_stays_when_the_ground_is_lowered_and_goes_when_it_is_pulled() {
    let setup = setup();
    let mut plant = setup.plant_at_object();
    let held = at(&mut plant, &setup, 140.0, 1500);
    plant.world_mut().lower_ground(0.3);
    let hanging = at(&mut plant, &setup, 140.0, 1000);
    assert!((hanging.object_m[2] - held.object_m[2]).abs() < 0.005);
    plant.disturb(Disturbance {
        push_n: [0.0, 0.0, -20.0],
        ..Disturbance::default()
    });
    let pulled = at(&mut plant, &setup, 140.0, 500);
    assert!(pulled.object_m[2] < held.object_m[2] - 0.1, "{pulled:?}");
}

#[test]
fn an_arm_that_is_led_carries_what_is_held() {
    let setup = setup();
    let mut plant = setup.plant_at_object();
    let still = at(&mut plant, &setup, 140.0, 1500);
    assert_eq!(still.arm.position_m, [0.0; 3]);
    for (wanted, expected) in [(Move::Lift, [0.0, 0.2]), (Move::Carry, [0.8, 0.2])] {
        let t_s = plant.t_s();
        let task = setup.gripper.arm_task(2.0);
        let arm = plant.arm_mut().expect("an arm that is led");
        arm.begin(t_s, wanted, &task).expect("a possible move");
        let there = at(&mut plant, &setup, 140.0, 3000);
        let at_m = there.arm.position_m;
        assert!((at_m[0] - expected[0]).abs() + (at_m[2] - expected[1]).abs() < 1e-9);
        assert_eq!(touching(&there), 3);
    }
    assert_eq!(at(&mut plant, &setup, 140.0, 1).arm.velocity_m_s, [0.0; 3]);
}

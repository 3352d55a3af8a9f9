//! Random grasps, simulated once each, with the contact bend at every joint, from which the signal of a gauge
//! anywhere on the finger follows.

use std::ops::Range;

use finger::chain::LINKS;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sim::air::TICK_S;
use sim::arm::Phase;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use softgrip::frontend::FrontEnd;
use softgrip::units::{DacCode, Kilopascals};

/// The object is gone once it has moved this far against the palm, m.
const GONE_M: f64 = 0.020;
/// It slides from here on, m: objects that are held move by 1.4 mm at 10 m/s².
const SLIDES_M: f64 = 0.002;

/// Ranges of what is drawn at random. Friction is that of silicone on smooth and on dusty plastic.
const FRICTION: Range<f64> = 0.6..0.9;
const ACCEL_M_S2: Range<f64> = 2.0..12.0;
/// The fingers stand 120° apart.
const DIRECTION_DEG: Range<f64> = 0.0..120.0;

/// About 0.4 to 2 times what is held at 5 m/s².
fn mass_kg(object: ObjectKind) -> Range<f64> {
    match object {
        ObjectKind::Sphere => 0.060..0.350,
        ObjectKind::Cylinder => 0.030..0.250,
    }
}

/// One grasp, from the request for a grip to the request for a release.
pub struct Record {
    /// Free bend minus actual bend at each joint, summed over the fingers, rad, in every tick.
    pub withheld_rad: Vec<[f64; LINKS]>,
    /// Displacement relative to the palm since the lift began, m, in every tick.
    pub moved_m: Vec<f64>,
    /// The first tick of the lift.
    pub lift: usize,
}

impl Record {
    /// The tick in which the object begins to slide, if it is lost.
    pub fn slides(&self) -> Option<usize> {
        let moved = &self.moved_m[self.lift..];
        let gone = moved.iter().position(|&m| m > GONE_M)?;
        let still = moved[..gone].iter().rposition(|&m| m <= SLIDES_M)?;
        Some(self.lift + still + 1)
    }
}

/// Number of random grasps of each object.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Grasps that are lost, at random accelerations.
    pub lost: usize,
    /// Grasps that are held, at each of [`HELD_ACCELS_M_S2`].
    pub held: usize,
}

/// Accelerations at which held objects shake the gauges, m/s².
pub const HELD_ACCELS_M_S2: [f64; 2] = [5.0, 10.0];

/// Random grasps of one object.
pub struct Grasps {
    /// Grasps that are lost.
    pub lost: Vec<Record>,
    /// Grasps that are held, at each of [`HELD_ACCELS_M_S2`].
    pub held: [Vec<Record>; 2],
}

/// Draws and runs them; the result does not depend on how many threads there are. `done` is called after each.
///
/// # Errors
/// If too few random grasps are lost or held as wanted.
pub fn grasps(
    setup: &Setup,
    seed: u64,
    wanted: Wanted,
    done: impl Fn() + Sync,
) -> anyhow::Result<Grasps> {
    let look = |stream: u64, accel_m_s2: Option<f64>, lost: bool, wanted: usize| {
        let stream = ((setup.scenario.object as u64) << 48) + (stream << 32);
        first(wanted, |n| {
            let record = run(&draw(setup, seed, stream + n, accel_m_s2))?;
            let fits = match lost {
                true => record.slides().is_some(),
                false => record.moved_m.iter().all(|&m| m <= SLIDES_M),
            };
            if fits {
                done();
            }
            Ok(fits.then_some(record))
        })
    };
    let [calm, hard] = HELD_ACCELS_M_S2;
    Ok(Grasps {
        lost: look(0, None, true, wanted.lost)?,
        held: [
            look(1, Some(calm), false, wanted.held)?,
            look(2, Some(hard), false, wanted.held)?,
        ],
    })
}

/// The first `wanted` results, in the order of their numbers, of a function that does not always have one.
fn first(
    wanted: usize,
    result: impl Fn(u64) -> anyhow::Result<Option<Record>> + Sync,
) -> anyhow::Result<Vec<Record>> {
    /// So few that a batch is soon done, and enough for the threads of a desk.
    const BATCH: usize = 4;
    /// Of a hundred draws at least one must do.
    const MOST: u64 = 100;
    let mut found = Vec::new();
    let mut next = 0;
    while found.len() < wanted {
        anyhow::ensure!(
            next < MOST * wanted as u64,
            "{} of {next} random grasps were what is looked for, and {wanted} are needed",
            found.len()
        );
        let end = next + (wanted - found.len()).max(BATCH) as u64;
        let batch = (next..end).into_par_iter().map(&result);
        let batch: Vec<_> = batch.collect::<anyhow::Result<_>>()?;
        found.extend(batch.into_iter().flatten());
        next = end;
    }
    found.truncate(wanted);
    Ok(found)
}

fn draw(setup: &Setup, seed: u64, stream: u64, accel_m_s2: Option<f64>) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    let mut drawn = setup.clone();
    drawn.scenario.mass_kg = rng.random_range(mass_kg(setup.scenario.object));
    drawn.scenario.friction = rng.random_range(FRICTION);
    drawn.gripper.hand.first_finger_deg = rng.random_range(DIRECTION_DEG);
    drawn.scenario.accel_m_s2 = accel_m_s2.unwrap_or_else(|| rng.random_range(ACCEL_M_S2));
    drawn
}

/// Closes at the pressure of the scenario and moves, without any controller: what a gauge can see does not
/// depend on what is made of it.
fn run(setup: &Setup) -> anyhow::Result<Record> {
    setup.check()?;
    let mut plant = setup.plant();
    let slew_kpa = f64::from(setup.settings().regulator.slew_kpa_per_s) * TICK_S;
    let (mut withheld_rad, mut places, mut lift) = (Vec::new(), Vec::new(), 0);
    let (mut kpa, mut dac) = (0.0, DacCode(0));
    loop {
        let (_, truth) = plant.step(dac);
        match truth.arm.phase {
            Phase::Approach => continue,
            Phase::Grip => lift = places.len() + 1,
            Phase::Lift | Phase::Carry | Phase::Place => {}
            Phase::Release | Phase::Retreat | Phase::Done => break,
        }
        kpa = setup.scenario.pressure_kpa.min(kpa + slew_kpa);
        dac = FrontEnd::REFERENCE.command(Kilopascals(kpa as f32));
        let (free, angles) = (plant.free_joint_angles(), plant.joint_angles());
        withheld_rad.push(std::array::from_fn(|i| {
            let fingers = free.iter().zip(&angles);
            fingers.map(|(free, finger)| free[i] - finger[i]).sum()
        }));
        places.push(truth.object_m);
    }
    let moved_m = places
        .iter()
        .map(|to| {
            let squares = (0..3).map(|i| (to[i] - places[lift][i]).powi(2));
            squares.sum::<f64>().sqrt()
        })
        .collect();
    Ok(Record {
        withheld_rad,
        moved_m,
        lift,
    })
}

//! What a free-bend sweep is good for: random castings are swept, and then judged by what the sweep did not see.
//!
//! Each hand has its own fingers, gauges, noise and regulator. The free-bend error is taken at other pressures than
//! the sweep's; closes on nothing and on objects are random, and each is judged by the controller with the recipe's
//! table and by the one with the swept fingers.

use std::ops::AddAssign;

use anyhow::Context;
use finger::object::Object;
use finger::recipe::Recipe;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use report::json::round;
use report::table::Table;
use serde::Serialize;
use sim::arm::Phase;
use sim::hand::Likeness;
use sim::run;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use sim::sweep::{self, Swept};
use softgrip::estimate::Casting;
use softgrip::settings::Settings;
use softgrip::telemetry::Event;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, FINGERS, Grip, TICK_US};

use crate::case::generator;
use crate::statistics::Histogram;

/// Noise of the gauges, µε rms: of one hand after the other.
const NOISE_UE: [f64; 3] = [20.0, 100.0, 300.0];
/// Normal force of a finger that holds something, N: the weight of two grams.
const HOLDS_N: f64 = 0.02;
/// A close that has not been judged by then never is, s.
const LONGEST_S: f64 = 8.0;
/// Pressures at which the free bend is compared, and how long fingers and air are given to rest, ticks.
const COMPARED: u32 = 10;
const REST_TICKS: u32 = 1_500;
/// The arm's moves are over after so many of these rests.
const ARM_RESTS: u32 = 6;
/// Free bend is free up to this share of the pressure at which the fingers meet.
const BEFORE_MEETING: f64 = 0.9;

const STREAM: u64 = 1 << 20;

/// Options of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// The first hand is the castings of this seed.
    pub seed: u64,
    /// Number of hands.
    pub hands: u32,
    /// Closes on nothing, and on an object, of each.
    pub grips: u32,
}

/// How closes were judged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Closes {
    /// Closes on nothing, and those of them that were called *empty*.
    pub empty: [u32; 2],
    /// Closes after which at least two fingers pressed on an object, and those that were called *holding*.
    pub held: [u32; 2],
}

impl AddAssign for Closes {
    fn add_assign(&mut self, other: Self) {
        for i in 0..2 {
            self.empty[i] += other.empty[i];
            self.held[i] += other.held[i];
        }
    }
}

/// One hand after its sweep.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Hand {
    /// Length of the sweep, s.
    pub sweep_s: f64,
    /// Largest free-bend error up to where the fingers meet, percent of full scale: by the recipe, and by the sweep.
    pub error_percent: [f64; 2],
    /// Half the hysteresis that was measured, percent of the highest pressure.
    pub half_loop_percent: f64,
    /// How closes were judged: by the recipe, and by the sweep.
    pub closes: [Closes; 2],
}

/// All hands.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// Those that were swept.
    pub hands: Vec<Hand>,
    /// Why the others were not, by seed.
    pub refused: Vec<(u64, String)>,
}

/// Sweeps random hands of a recipe and judges what the sweep has made of them. `done` counts hands.
///
/// # Errors
/// If the recipe cannot be cast or gripped with.
pub fn measure(
    recipe: &Recipe,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> anyhow::Result<Measured> {
    let seeds: Vec<u64> = (0..u64::from(options.hands))
        .map(|n| options.seed + n)
        .collect();
    let results: Vec<(u64, Result<Hand, String>)> = seeds
        .into_par_iter()
        .map(|seed| {
            let result = of_hand(recipe, seed, options.grips)?;
            done();
            Ok((seed, result))
        })
        .collect::<anyhow::Result<_>>()?;
    let mut measured = Measured {
        hands: Vec::new(),
        refused: Vec::new(),
    };
    for (seed, result) in results {
        match result {
            Ok(hand) => measured.hands.push(hand),
            Err(why) => measured.refused.push((seed, why)),
        }
    }
    Ok(measured)
}

/// Sweeps and judges the hand of one seed, or says why it was not swept.
fn of_hand(recipe: &Recipe, seed: u64, grips: u32) -> anyhow::Result<Result<Hand, String>> {
    let setup =
        Setup::with_castings(recipe, seed).with_context(|| format!("castings of seed {seed}"))?;
    let (setup, mut rng) = equipped(setup, seed);
    let settings = setup.settings();
    let swept = match sweep::sweep(&setup, &settings) {
        Ok(swept) => swept,
        Err(why) => return Ok(Err(format!("{why:#}"))),
    };
    let calibrated = calibrated(&setup, &swept)?;
    let mut closes = [Closes::default(); 2];
    for _ in 0..grips {
        let (nothing, object) = draw(&setup, &mut rng);
        for (closes, settings) in closes.iter_mut().zip([&settings, &calibrated]) {
            *closes += Closes {
                empty: [1, u32::from(close(&nothing, settings)?.0 == Judged::Empty)],
                held: match close(&object, settings)? {
                    (_, false) => [0, 0],
                    (Judged::Holding, true) => [1, 1],
                    (Judged::Empty | Judged::Otherwise, true) => [1, 0],
                },
            };
        }
    }
    Ok(Ok(Hand {
        sweep_s: round(swept.duration_s, 3),
        error_percent: errors_percent(&setup, &swept)?.map(|error| round(error, 3)),
        half_loop_percent: round(half_loop_percent(&setup, &swept), 3),
        closes,
    }))
}

/// The hand of a seed with the noise of its gauges and a regulator of its own, and the generator of what follows.
pub fn equipped(mut setup: Setup, seed: u64) -> (Setup, ChaCha8Rng) {
    let mut rng = generator(seed, STREAM, 0);
    setup.scenario.seed = seed;
    setup.scenario.noise_ue = NOISE_UE[(seed % 3) as usize];
    setup.gripper.regulator.lag_ms = rng.random_range(20.0..=200.0);
    (setup, rng)
}

/// The settings of a setup, with what its sweep has found.
///
/// # Errors
/// If they cannot be set, which no sweep finds.
pub fn calibrated(setup: &Setup, swept: &Swept) -> anyhow::Result<Settings> {
    let settings = setup.settings();
    let stated = swept.calibration.stated(&settings.values(), setup.table());
    settings
        .with(&stated, setup.table())
        .map_err(|error| anyhow::anyhow!("sweep: {error}"))
}

/// Half the hysteresis that was measured, percent of the highest pressure.
pub fn half_loop_percent(setup: &Setup, swept: &Swept) -> f64 {
    50.0 * f64::from(swept.calibration.hysteresis_kpa) / setup.chain.max_pressure_kpa()
}

/// A close on nothing, and the same on an object.
fn draw(setup: &Setup, rng: &mut ChaCha8Rng) -> (Setup, Setup) {
    let mut object = setup.clone();
    let arm = &mut object.gripper.arm;
    (arm.approach_mm, arm.dwell_ms, arm.grip_ms) = (1.0, 50.0, 1e3 * (LONGEST_S + 1.0));
    object.gripper.hand.first_finger_deg = rng.random_range(0.0..120.0);
    let highest_kpa = object.chain.max_pressure_kpa();
    let scenario = &mut object.scenario;
    scenario.seed = rng.random();
    scenario.object = match rng.random_bool(0.5) {
        true => ObjectKind::Sphere,
        false => ObjectKind::Cylinder,
    };
    scenario.pressure_kpa = highest_kpa * rng.random_range(0.625..=1.0);
    scenario.friction = rng.random_range(0.6..=1.0);
    let nothing = object.emptied();
    let gripped = object.gripped_mut();
    gripped.depth_m += 1e-3 * rng.random_range(-3.0..=3.0);
    let (Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. }) = &mut gripped.object;
    *radius_m *= rng.random_range(0.92..=1.0);
    (nothing, object)
}

/// What the controller made of a close.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Judged {
    Holding,
    Empty,
    /// A fault, a refusal, or nothing at all.
    Otherwise,
}

/// Closes the fingers of a setup once; says too whether at least two of them press on an object.
fn close(setup: &Setup, settings: &Settings) -> anyhow::Result<(Judged, bool)> {
    let mut controller = run::controller(setup.table(), settings)?;
    let mut plant = setup.plant();
    let from_s = plant.profile().start_s(Phase::Grip);
    let grip = Grip::Pressure(Kilopascals(setup.scenario.pressure_kpa as f32));
    let (mut dac, mut asked) = (DacCode(0), false);
    for tick in 1.. {
        let (frame, truth) = plant.step(dac);
        let command = match !asked && truth.t_s > from_s {
            true => Command::Grip(grip),
            false => Command::Alive,
        };
        asked |= truth.t_s > from_s;
        let outputs = controller.step(Instant::from_micros(TICK_US * tick), &frame, command);
        dac = outputs.dac;
        let judged = outputs.events.iter().find_map(|event| match event {
            Event::Holding { .. } => Some(Judged::Holding),
            Event::Empty => Some(Judged::Empty),
            Event::Fault { .. } | Event::Refused(_) => Some(Judged::Otherwise),
            _ => None,
        });
        let late = truth.t_s > from_s + LONGEST_S;
        if let Some(judged) = judged.or(late.then_some(Judged::Otherwise)) {
            let pressing = truth.contact_n.iter().filter(|&&n| n > HOLDS_N).count();
            return Ok((judged, pressing >= 2));
        }
    }
    Ok((Judged::Otherwise, false))
}

/// Largest error of what is expected of free fingers, percent of full scale, at other pressures than the sweep's, up to
/// where the fingers meet: by the recipe's table, and with what the sweep has found.
///
/// # Errors
/// As [`calibrated`].
pub fn errors_percent(setup: &Setup, swept: &Swept) -> anyhow::Result<[f64; 2]> {
    let found = &swept.calibration;
    let calibrated = calibrated(setup, swept)?.finger;
    let highest_kpa = setup.chain.max_pressure_kpa();
    let full_ue = setup.chain.free_strain_ue(highest_kpa);
    let up_to_kpa = found
        .meeting
        .map_or(highest_kpa, |meeting| BEFORE_MEETING * f64::from(meeting.0));
    // The way up is half a loop behind the middle, which the table means.
    let behind_kpa = 0.5 * f64::from(found.hysteresis_kpa);
    let mut worst = [0.0f64; 2];
    for (kpa, strain_ue) in free_strains(setup) {
        if kpa > up_to_kpa {
            continue;
        }
        for (i, strain_ue) in strain_ue.into_iter().enumerate() {
            let (gain, stiffness) = (calibrated.free_bend_gain[i], calibrated.stiffness[i]);
            let casting = Casting::of(setup.table(), gain, stiffness);
            let middle_ue = setup.chain.free_strain_ue(kpa - behind_kpa);
            let swept_ue = middle_ue * f64::from(casting.ratio((middle_ue / full_ue) as f32));
            let recipe_ue = setup.chain.free_strain_ue(kpa);
            for (worst, expected_ue) in worst.iter_mut().zip([recipe_ue, swept_ue]) {
                *worst = worst.max(100.0 * (expected_ue - strain_ue).abs() / full_ue);
            }
        }
    }
    Ok(worst)
}

/// What comes closest to the fingers of a setup as they are mounted, with their weight, but without what their silicone
/// does: its hysteresis and creep have settings of their own.
pub fn mounted(setup: &Setup) -> Likeness {
    let mut ideal = setup.clone();
    let hand = &mut ideal.gripper.hand;
    (hand.hysteresis_percent, hand.creep_percent) = (0.0, 0.0);
    ideal.gripper.gauge.creep_percent = 0.0;
    Likeness::of(&setup.chain, &free_strains(&ideal))
}

/// Pressures, kPa, and what each gauge shows more than without pressure, µε, at rest on the way up, with nothing in the
/// grip, of fingers that pass through one another.
fn free_strains(setup: &Setup) -> Vec<(f64, [f64; FINGERS])> {
    let mut free = setup.emptied();
    free.scenario.noise_ue = 0.0;
    free.gripper.hand.fingers_touch = false;
    let front_end = softgrip::frontend::FrontEnd::REFERENCE;
    let mut plant = free.plant();
    let mut rest = |kpa: f64| {
        let dac = front_end.command(Kilopascals(kpa as f32));
        (0..REST_TICKS).for_each(|_| _ = plant.step(dac));
        let (frame, truth) = plant.step(dac);
        let strain_ue = front_end.strains(&frame.gauges).map(|ue| f64::from(ue.0));
        (truth.pressure_kpa, strain_ue)
    };
    (1..ARM_RESTS).for_each(|_| _ = rest(0.0));
    let (_, zero_ue) = rest(0.0);
    let highest_kpa = setup.chain.max_pressure_kpa();
    let pressures = (1..=COMPARED).map(|n| (f64::from(n) - 0.2) / f64::from(COMPARED));
    pressures
        .map(|share| {
            let (kpa, strain_ue) = rest(share * highest_kpa);
            (kpa, std::array::from_fn(|i| strain_ue[i] - zero_ue[i]))
        })
        .collect()
}

/// The results as a table: by the recipe alone, and after the sweep.
pub fn table(measured: &Measured) -> Table {
    let hands = &measured.hands;
    let row = |index: usize, name: &str| {
        let mut errors = Histogram::default();
        let mut closes = Closes::default();
        for hand in hands {
            errors.add(hand.error_percent[index]);
            closes += hand.closes[index];
        }
        let percent = |share| {
            errors
                .quantile(share)
                .map_or("-".into(), |e| format!("{e:.1}"))
        };
        let of = |[all, right]: [u32; 2]| format!("{right} of {all}");
        vec![
            name.to_owned(),
            percent(0.5),
            percent(0.95),
            of(closes.empty),
            of(closes.held),
        ]
    };
    let longest_s = hands.iter().map(|hand| hand.sweep_s).fold(0.0, f64::max);
    let within = |hand: &&Hand| hand.error_percent[1] <= 1.0 + hand.half_loop_percent;
    Table {
        title: format!(
            "{} random hands, swept in at most {longest_s:.0} s",
            hands.len()
        ),
        head: vec![
            "known by",
            "error p50 %",
            "error p95 %",
            "empty as empty",
            "held as holding",
        ],
        rows: vec![row(0, "recipe"), row(1, "sweep")],
        note: format!(
            "Error: largest difference between free fingers and what is expected of them, up to where they meet, in percent of full scale; after the sweep it is within 1 % and half the hysteresis for {} of {} hands. {} sweeps were refused.",
            hands.iter().filter(within).count(),
            hands.len(),
            measured.refused.len(),
        ),
    }
}

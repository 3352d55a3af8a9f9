//! The surrogate behaves like the simulated gripper, a recording measured again gives what was measured at
//! once, and everything is repeatable.

use std::path::Path;

use evaluate::alarms::{self, Group};
use evaluate::case::{Case, Knowledge};
use evaluate::cycle::{Activity, PalmMotion};
use evaluate::identified_model::{Held, IdentifiedModel};
use evaluate::latency::trials_of;
use evaluate::options::Options;
use evaluate::record::{ObjectOutcome, Recording};
use evaluate::rig::Rig;
use evaluate::surrogate::{GaugeErrors, Surrogate};
use evaluate::tally::Tally;
use evaluate::trial::judge;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sim::run;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use softgrip::settings::Settings;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, FINGERS, Grip, TICK_US};

fn base() -> Setup {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recipes/rtv225.toml");
    Setup::of(&finger::recipe::load(&path).expect("the default recipe")).expect("a setup")
}

fn options(seed: u64) -> Options {
    Options {
        seed,
        losses: 3,
        hours: 0.05,
        recordings: None,
        slowest: 0,
        settings: Settings::default(),
    }
}

/// A grip in the middle of what the surrogate draws from.
fn grip(object: ObjectKind, mass_kg: f64) -> Setup {
    let mut setup = base();
    setup.scenario.object = object;
    setup.scenario.mass_kg = mass_kg;
    setup.scenario.pressure_kpa = 140.0;
    setup
}

/// Change of the residuals over the plateau: rms and peak of the sum, and of the liveliest finger.
#[derive(Debug, Clone, Copy)]
struct Statistics {
    sum_rms: f64,
    sum_peak: f64,
    finger_rms: f64,
    finger_peak: f64,
}

impl Statistics {
    fn of(course: &[[f64; FINGERS]]) -> Self {
        let rms = |values: &[f64]| {
            (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
        };
        let peak = |values: &[f64]| values.iter().fold(0.0f64, |peak, x| peak.max(x.abs()));
        let mean = |row: &[f64; FINGERS]| row.iter().sum::<f64>() / FINGERS as f64;
        let sums: Vec<f64> = course.iter().map(mean).collect();
        let fingers: [Vec<f64>; FINGERS] =
            std::array::from_fn(|i| course.iter().map(|row| row[i]).collect());
        Self {
            sum_rms: rms(&sums),
            sum_peak: peak(&sums),
            finger_rms: fingers.iter().map(|f| rms(f)).fold(0.0, f64::max),
            finger_peak: fingers.iter().map(|f| peak(f)).fold(0.0, f64::max),
        }
    }
}

/// The same motion on the simulated gripper and on the surrogate.
fn both(
    setup: &Setup,
    model: &IdentifiedModel,
    motion: &PalmMotion,
    time_s: f64,
) -> [Statistics; 2] {
    let mut rig = Rig::holding(setup, setup.scenario.pressure_kpa);
    let plateau = rig.residual_ue();
    let mut held = Held::new(model);
    let (mut simulated, mut surrogate) = (Vec::new(), Vec::new());
    for tick in 0..(time_s * 1e3) as usize {
        let acceleration = motion.at(tick as f64 * 1e-3);
        rig.step(acceleration);
        let (now, change) = (rig.residual_ue(), held.step(acceleration));
        simulated.push(std::array::from_fn(|i| now[i] / plateau[i] - 1.0));
        surrogate.push(std::array::from_fn(|i| change[i] / plateau[i]));
    }
    [Statistics::of(&simulated), Statistics::of(&surrogate)]
}

/// Asserts that two numbers agree within a share of the first and a floor of 0.05 % of the plateau.
#[track_caller]
fn near(what: &str, simulated: f64, surrogate: f64, share: f64) {
    assert!(
        (simulated - surrogate).abs() <= share * simulated + 5e-4,
        "{what}: simulated {simulated:.5}, surrogate {surrogate:.5}"
    );
}

const GRIPS: [(ObjectKind, f64); 2] = [(ObjectKind::Sphere, 0.06), (ObjectKind::Cylinder, 0.03)];

/// A direction with a part along and a part across.
const SLANTING: [f64; 3] = [0.48, -0.64, 0.6];

#[test]
fn the_surrogate_moves_like_the_simulated_gripper_at_5_and_10_m_s2() {
    for (object, mass_kg) in GRIPS {
        let setup = grip(object, mass_kg);
        let model = IdentifiedModel::of(&setup).expect("a model");
        for accel in [5.0, 10.0] {
            let motion = PalmMotion::Travel {
                vector: SLANTING.map(|x| accel * x),
                ramp_s: 0.03,
                push_s: 0.25,
                cruise_s: 0.1,
            };
            let [simulated, surrogate] = both(&setup, &model, &motion, 0.9);
            let name = |what| format!("{what}, {object}, {accel} m/s²");
            near(&name("sum rms"), simulated.sum_rms, surrogate.sum_rms, 0.15);
            near(
                &name("sum peak"),
                simulated.sum_peak,
                surrogate.sum_peak,
                0.15,
            );
            near(
                &name("finger rms"),
                simulated.finger_rms,
                surrogate.finger_rms,
                0.25,
            );
            near(
                &name("finger peak"),
                simulated.finger_peak,
                surrogate.finger_peak,
                0.25,
            );
        }
    }
}

#[test]
fn the_surrogate_shakes_like_the_simulated_gripper_at_every_frequency() {
    for (object, mass_kg) in GRIPS {
        let setup = grip(object, mass_kg);
        let model = IdentifiedModel::of(&setup).expect("a model");
        for hz in [5.0, 10.0, 20.0, 40.0] {
            // 2 m/s² rms.
            let sine = (SLANTING.map(|x| 2.0 * 2f64.sqrt() * x), hz, 0.0);
            let none = ([0.0; 3], hz, 0.0);
            let motion = PalmMotion::Vibration([sine, none, none]);
            let [simulated, surrogate] = both(&setup, &model, &motion, 1.0);
            let name = |what| format!("{what}, {object}, {hz} Hz");
            near(&name("sum rms"), simulated.sum_rms, surrogate.sum_rms, 0.1);
            near(
                &name("sum peak"),
                simulated.sum_peak,
                surrogate.sum_peak,
                0.1,
            );
            near(
                &name("finger rms"),
                simulated.finger_rms,
                surrogate.finger_rms,
                0.15,
            );
            near(
                &name("finger peak"),
                simulated.finger_peak,
                surrogate.finger_peak,
                0.15,
            );
        }
    }
}

/// Knocks shift the object in the grip. How far, friction decides, and the surrogate's law of it is a
/// simple one. Over some knocks it must be as rough as the simulated gripper; it may be rougher, for that makes false
/// alarms more and not fewer.
#[test]
fn stops_and_bumps_are_as_rough_as_on_the_simulated_gripper() {
    for (object, mass_kg) in GRIPS {
        let setup = grip(object, mass_kg);
        let model = IdentifiedModel::of(&setup).expect("a model");
        for (name, peak, length_s) in [("stop", 17.0, 0.12), ("bump", 45.0, 0.012)] {
            let mut squares = [0.0; 2];
            let mut sums = [0.0; 2];
            for sixth in [0.3, 1.7, 2.6, 3.9, 5.1] {
                let angle = std::f64::consts::TAU * sixth / 6.0;
                let motion = PalmMotion::Pulse {
                    vector: [
                        0.9 * peak * f64::cos(angle),
                        0.9 * peak * angle.sin(),
                        0.43 * peak,
                    ],
                    length_s,
                    ring_hz: 10.0,
                    ring_share: 0.2,
                };
                let statistics = both(&setup, &model, &motion, 0.6);
                for (n, statistics) in statistics.iter().enumerate() {
                    squares[n] += statistics.finger_rms.powi(2);
                    sums[n] += statistics.sum_peak;
                }
            }
            let [simulated, surrogate] = squares.map(f64::sqrt);
            let ratio = surrogate / simulated;
            assert!(
                (0.7..2.5).contains(&ratio),
                "{object}, {name}: fingers × {ratio:.2}"
            );
            let [simulated, surrogate] = sums.map(|sum| sum / 5.0);
            assert!(
                (simulated - surrogate).abs() < 0.03,
                "{object}, {name}: sums {simulated:.3} and {surrogate:.3}"
            );
        }
    }
}

/// Closing, a change of the pressure and a release, by the eyes of the controller.
#[test]
fn the_surrogate_grips_and_lets_go_like_the_simulated_gripper() {
    for (object, first, second) in [
        (ObjectKind::Sphere, 140.0, 110.0),
        (ObjectKind::Cylinder, 110.0, 150.0),
    ] {
        let mut setup = grip(object, 0.05);
        setup.scenario.pressure_kpa = first;
        setup.scenario.noise_ue = 1.0;
        let model = IdentifiedModel::of(&setup).expect("a model");
        let arm = &mut setup.gripper.arm;
        (arm.approach_mm, arm.dwell_ms, arm.grip_ms) = (1.0, 10.0, 9_000.0);
        let mut plant = setup.plant();
        let gauge = GaugeErrors {
            gain: 1.0,
            offset_ue: 0.0,
            noise_ue: 1.0,
        };
        let noise = ChaCha8Rng::seed_from_u64(1);
        let mut fast = Surrogate::new(&setup.gripper, setup.table(), [gauge; FINGERS], noise);
        fast.place(Some(&model));
        let controller = || run::controller(setup.table(), &Settings::default());
        let mut controllers = [controller().expect("one"), controller().expect("another")];
        let mut dacs = [DacCode(0); 2];
        let plateau = FINGERS as f64 * model.residual_at(first);
        for tick in 1..5_500 {
            let frames = [plant.step(dacs[0]).0, fast.step(dacs[1], [0.0; 3], 0.0)];
            let command = match tick {
                300 => Command::Grip(Grip::Pressure(Kilopascals(first as f32))),
                2_000 => Command::Grip(Grip::Pressure(Kilopascals(second))),
                4_500 => Command::Release,
                _ => Command::Continue,
            };
            let now = Instant::from_micros(TICK_US * tick);
            let mut sums = [0.0; 2];
            for n in 0..2 {
                let outputs = controllers[n].step(now, &frames[n], command);
                dacs[n] = outputs.dac;
                let residual = outputs.snapshot.residual;
                sums[n] = residual.iter().flatten().map(|r| f64::from(r.0)).sum();
            }
            let off = (sums[1] - sums[0]) / plateau;
            // Under way within 4 % of the plateau, at rest within 0.3 %.
            let at_rest = matches!(tick, 1_500..2_000 | 3_500..4_500);
            let limit = if at_rest { 0.003 } else { 0.04 };
            assert!(off.abs() < limit, "{object}: {off:.4} at {tick} ms");
        }
    }
}

/// The report says that gauge noise does not reach the physics before a report.
#[test]
fn measuring_again_is_as_good_as_measuring_in_closed_loop() {
    let base = base();
    let settings = Settings::default();
    let mut lost = 0;
    for index in 0..6 {
        let case = Case::draw(&base, base.table(), 500, Knowledge::Calibrated, index);
        let record = |noise_ue| {
            Recording::of(&case, base.table(), &settings, noise_ue).expect("a recording")
        };
        let again = judge(&case, &record(20.0), 100.0, &settings, &base).expect("a trial");
        let closed = judge(&case, &record(100.0), 100.0, &settings, &base).expect("a trial");
        assert_eq!(again.report, closed.report, "{index}");
        lost += usize::from(matches!(again.outcome, ObjectOutcome::Lost { .. }));
    }
    assert!(lost > 0, "nothing was lost");
}

#[test]
fn recordings_are_found_again() {
    let dir = tempfile::tempdir().expect("a directory");
    let base = base();
    let mut options = options(501);
    let fresh = trials_of(&base, &options, Knowledge::Calibrated, 1).expect("trials");
    options.recordings = Some(dir.path().to_path_buf());
    for _ in 0..2 {
        let trials = trials_of(&base, &options, Knowledge::Calibrated, 1).expect("trials");
        for (fresh, trial) in fresh.iter().zip(&trials) {
            assert_eq!(fresh.report, trial.report);
            assert_eq!(fresh.outcome, trial.outcome);
        }
    }
    let files: Vec<_> = std::fs::read_dir(dir.path())
        .expect("a directory")
        .collect();
    assert_eq!(files.len(), 1);
    let file = files[0].as_ref().expect("a file").path();
    std::fs::write(&file, b"half").expect("written");
    let error = trials_of(&base, &options, Knowledge::Calibrated, 1).expect_err("half a file");
    assert!(format!("{error:#}").contains("not a whole recording; remove it"));
}

#[test]
fn every_hour_is_counted_once_and_every_activity_happens() {
    let base = base();
    let options = options(503);
    let responses = GRIPS
        .map(|(object, mass_kg)| IdentifiedModel::of(&grip(object, mass_kg)).expect("a model"));
    let hours = Group {
        noise_ue: 20.0,
        hours: 0.5,
        evidence: None,
        compared: false,
    };
    let mut tally = Tally::none(20.0);
    for stretch in alarms::stretches(&[hours]) {
        tally.add(stretch.count(&base, &options, &responses).expect("a tally"));
    }
    let total = tally.total();
    assert!((total.time_s - 1800.0).abs() < 1.0, "{}", total.time_s);
    for (activity, count) in Activity::ALL.iter().zip(tally.counts) {
        assert!(count.times > 0 && count.time_s > 0.0, "{activity:?}");
    }
    assert_eq!(tally.alarms.len() as u64, total.lost + total.faults);
}

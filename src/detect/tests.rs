//! Verdicts by what happens to what is held.

mod changes;

use super::*;
use crate::condition::{Gauge, Monitor};
use crate::table::{self, FINGER, Range};
use crate::units::{Degrees, Kilopascals, Microstrain};
use std::vec::Vec;

const PLATEAU: f32 = 4_000.0;

struct Bench {
    detector: Detector,
    active: Active,
    free: Microstrain,
    motion: Motion,
    pressure_changes: bool,
    tick: u64,
}

impl Bench {
    fn new() -> Self {
        Self {
            detector: Detector::new(),
            active: Settings::default().active(),
            free: table::free_strain(&FINGER, Kilopascals(140.0)).0,
            motion: Motion::Moving,
            pressure_changes: false,
            tick: 0,
        }
    }

    /// One tick with each finger at this share of the plateau.
    fn step(&mut self, shares: [Option<f32>; 3], air: Air, holding: bool) -> Verdict {
        self.tick += 1;
        let contact = Contact {
            residual: shares.map(|share| share.map(|share| Microstrain(share * PLATEAU))),
            touching: [true; 3],
            mean: None,
            free: self.free,
            bend: Degrees(0.0),
            range: Range::Inside,
            known: true,
        };
        let now = Instant::from_micros(1_000 * self.tick);
        let reading = Reading {
            gauges: [Gauge::Missing; 3],
            noise_variance: [400.0; 3],
            monitor: Monitor::Missing,
            supply: None,
            rail_is_off: false,
            stale_ticks: 0,
            overrun: false,
        };
        let watch = holding.then_some(Watch {
            motion: self.motion,
            carrying: [true; 3],
            pressure_changes: self.pressure_changes,
            fingers_follow: false,
        });
        self.detector
            .step(now, &reading, &contact, &air, watch, &self.active)
    }

    fn hold(&mut self) {
        for _ in 0..500 {
            self.step([Some(1.0); 3], STEADY, false);
        }
        for _ in 0..500 {
            assert_eq!(self.step([Some(1.0); 3], STEADY, true), Verdict::Holding);
        }
    }
}

const STEADY: Air = Air {
    measured: Some(Kilopascals(140.0)),
    expected: Some(Kilopascals(140.0)),
    deviating_us: 0,
    deviated: Instant::from_micros(0),
};

/// From 90 % to 10 % in 35 ms, the middle of what a falling object does.
fn collapse(ms: u64) -> f32 {
    (0.9 - 0.8 * ms as f32 / 35.0).max(0.14)
}

#[test]
fn a_collapse_is_lost_within_5_ms_and_its_onset_is_known() {
    let mut bench = Bench::new();
    bench.hold();
    let start = bench.tick;
    let (ms, onset) = (0..40)
        .find_map(
            |ms| match bench.step([Some(collapse(ms)); 3], STEADY, true) {
                Verdict::Lost { onset, .. } => Some((ms, onset)),
                _ => None,
            },
        )
        .expect("a collapse is a loss");
    assert!(ms <= 5, "{ms} ms");
    assert!(onset.micros().abs_diff(1_000 * start) <= 3_000);
}

#[test]
fn a_missing_gauge_changes_nothing() {
    let mut bench = Bench::new();
    bench.hold();
    let lost = (0..40).any(|ms| {
        let share = Some(collapse(ms));
        matches!(
            bench.step([share, None, share], STEADY, true),
            Verdict::Lost { .. }
        )
    });
    assert!(lost);
}

#[test]
fn load_that_moves_from_finger_to_finger_is_not_a_loss() {
    let mut bench = Bench::new();
    bench.hold();
    for tick in 0..2_000 {
        let swing = 0.3 * libm::sinf(tick as f32 * 0.05);
        let shares = [Some(1.0 + swing), Some(1.0 - swing), Some(1.0)];
        assert_eq!(bench.step(shares, STEADY, true), Verdict::Holding);
    }
}

#[test]
fn an_object_that_leaves_sideways_is_lost_before_the_last_finger_knows() {
    let mut bench = Bench::new();
    bench.hold();
    let lost = (0..200).find(|&ms| {
        let gone = Some((1.0 - ms as f32 / 150.0).max(0.3));
        let pressed = Some((1.0 + ms as f32 / 1_000.0).min(1.1));
        matches!(
            bench.step([gone, pressed, pressed], STEADY, true),
            Verdict::Lost { .. }
        )
    });
    assert!(lost.is_some_and(|ms| ms < 100), "{lost:?}");
}

#[test]
fn one_gauge_that_fades_while_the_others_stay_is_not_a_loss() {
    let mut bench = Bench::new();
    bench.hold();
    for ms in 0..1_000 {
        let fading = Some((1.0 - ms as f32 / 3_000.0).max(0.7));
        let verdict = bench.step([fading, Some(1.0), Some(1.0)], STEADY, true);
        assert!(!matches!(verdict, Verdict::Lost { .. }), "{ms} ms");
    }
}

#[test]
fn a_glitch_of_all_gauges_that_is_over_in_two_ticks_is_forgotten() {
    let mut bench = Bench::new();
    bench.hold();
    for tick in 0..1_000 {
        let share = if tick % 100 < 2 { 0.2 } else { 1.0 };
        assert_eq!(bench.step([Some(share); 3], STEADY, true), Verdict::Holding);
    }
}

#[test]
fn a_knock_and_an_emergency_stop_are_no_loss() {
    let mut bench = Bench::new();
    bench.hold();
    // What the simulated arm does to a held sphere: 100 m/s² for 5 ms, and a stop at 20 m/s².
    for (ms, depth, back_ms) in [(12, 0.05, 30), (32, 0.10, 200)] {
        for tick in 0..ms + back_ms {
            let dip = if tick < ms {
                depth * tick as f32 / ms as f32
            } else {
                depth * (ms + back_ms - tick) as f32 / back_ms as f32
            };
            let verdict = bench.step([Some(1.0 - dip); 3], STEADY, true);
            assert_eq!(verdict, Verdict::Holding, "{depth} at {tick} ms");
        }
    }
}

#[test]
fn a_slip_that_is_caught_again_is_no_loss_on_its_way_back() {
    let mut bench = Bench::new();
    bench.hold();
    for ms in 0..400 {
        // Up to 20 % in 60 ms, and back in 40.
        let rise = match ms {
            0..60 => 0.2 * ms as f32 / 60.0,
            60..100 => 0.2 * (100 - ms) as f32 / 40.0,
            _ => 0.0,
        };
        let verdict = bench.step([Some(1.0 + rise); 3], STEADY, true);
        assert!(!matches!(verdict, Verdict::Lost { .. }), "{ms} ms");
    }
}

#[test]
fn a_sphere_that_has_passed_the_tips_is_lost_before_its_residual_is_back_at_the_plateau() {
    let mut bench = Bench::new();
    bench.hold();
    let lost = (0..200).find_map(|ms| {
        let share = match ms {
            0..80 => 1.0 + 0.4 * ms as f32 / 80.0,
            _ => 1.4 - (ms - 80) as f32 / 40.0,
        };
        match bench.step([Some(share); 3], STEADY, true) {
            Verdict::Lost { .. } => Some(share),
            _ => None,
        }
    });
    assert!(lost.is_some_and(|share| share > 1.0), "{lost:?}");
}

#[test]
fn a_slip_ends_when_the_object_is_held_again_and_the_next_one_counts_from_there() {
    let mut bench = Bench::new();
    bench.hold();
    let mut starts = Vec::new();
    let mut slipping = false;
    for ms in 0..2_000 {
        let steps = [(100, 0.10), (1_200, 0.12)]
            .map(|(start, rise)| rise * ((ms as f32 - start as f32) / 50.0).clamp(0.0, 1.0));
        let share = Some(1.0 + steps[0] + steps[1]);
        let verdict = bench.step([share; 3], STEADY, true);
        let slips = matches!(verdict, Verdict::Slipping { .. });
        if slips && !slipping {
            starts.push(ms);
        }
        slipping = slips;
    }
    assert!(!slipping);
    assert!(matches!(starts[..], [100..160, 1_200..1_260]), "{starts:?}");
}

#[test]
fn a_rise_at_constant_pressure_is_a_slip() {
    let mut bench = Bench::new();
    bench.hold();
    let slip = (0..150).find_map(|ms| {
        let share = Some(1.0 + 0.2 * ms as f32 / 150.0);
        match bench.step([share; 3], STEADY, true) {
            Verdict::Slipping { rate } => Some(rate),
            _ => None,
        }
    });
    assert!(
        slip.is_some_and(|rate| (0.8..1.8).contains(&rate)),
        "{slip:?}"
    );
}

#[test]
fn at_rest_a_slip_and_a_slow_loss_are_told_sooner_and_a_knock_is_still_none() {
    // A slide of 15 % in 150 ms, and a fall of 20 % in 200 ms.
    let first = |motion, change: fn(f32) -> f32| {
        let mut bench = Bench::new();
        bench.motion = motion;
        bench.hold();
        (0..400).find(|&ms| {
            let share = Some(1.0 + change(ms as f32));
            bench.step([share; 3], STEADY, true) != Verdict::Holding
        })
    };
    for change in [
        |ms: f32| 0.15 * (ms / 150.0).min(1.0),
        |ms: f32| -0.2 * (ms / 200.0).min(1.0),
    ] {
        let moving = first(Motion::Moving, change).expect("a slip or a loss");
        let still = first(Motion::Still, change).expect("a slip or a loss");
        assert!(still + 20 <= moving, "{still} ms, {moving} ms");
    }
    let knock = |ms: f32| match ms {
        0.0..12.0 => -0.05 * ms / 12.0,
        12.0..42.0 => -0.05 * (42.0 - ms) / 30.0,
        _ => 0.0,
    };
    assert_eq!(first(Motion::Still, knock), None);
}

#[test]
fn creep_over_minutes_is_followed_in_silence() {
    let mut bench = Bench::new();
    bench.hold();
    for tick in 0..300_000 {
        let share = Some(1.0 - 0.3 * tick as f32 / 300_000.0);
        assert_eq!(bench.step([share; 3], STEADY, true), Verdict::Holding);
    }
}

#[test]
fn falling_pressure_is_an_air_loss_and_never_a_lost_object() {
    for time_constant in [20.0, 100.0, 400.0] {
        let mut bench = Bench::new();
        bench.hold();
        let (mut inflated, mut lagged) = (140.0, 140.0);
        let mut found = None;
        for ms in 0..2_000 {
            let pressure = 140.0 * libm::expf(-(ms as f32) / time_constant);
            inflated += (pressure - inflated) / 80.0;
            lagged += (inflated - lagged) / 26.0;
            // The grip ends at 95 kPa.
            let share = ((lagged - 95.0) / 45.0f32).max(0.0);
            bench.free = table::free_strain(&FINGER, Kilopascals(lagged)).0;
            let air = Air {
                measured: Some(Kilopascals(pressure)),
                expected: Some(Kilopascals(140.0)),
                deviating_us: 0,
                deviated: Instant::from_micros(0),
            };
            match bench.step([Some(share); 3], air, true) {
                Verdict::Lost { .. } => panic!("lost after {ms} ms at {time_constant}"),
                Verdict::AirLoss => {
                    found = Some((ms, pressure));
                    break;
                }
                _ => {}
            }
        }
        let (ms, _) = found.expect("an air loss");
        // 6 % of the pressure must be gone first.
        assert!((ms as f32) < 50.0 + 0.06 * time_constant, "{ms} ms");
    }
}

/// The same share of every finger, in a hold at a steady pressure.
fn all(bench: &mut Bench, share: f32) -> Verdict {
    bench.step([Some(share); 3], STEADY, true)
}

#[test]
fn the_settings_are_shares_and_ticks_in_the_control_tick() {
    let active = Settings::default().active();
    for (value, expected) in [
        (active.loss_allowance, 0.05),
        // 8 %·ms at a tick of 1 ms.
        (active.loss_evidence, 0.08),
        (active.slip, 0.07),
    ] {
        assert!((value - expected).abs() < 1e-6, "{value}");
    }
}

#[test]
fn a_loss_is_told_its_latency_after_its_onset() {
    let loss = Loss {
        onset: Instant::from_micros(5_000),
        flagged: Instant::from_micros(12_000),
        cause: LossCause::Collapse,
        evidence: [None; 3],
    };
    assert_eq!(loss.latency_us(), 7_000);
}

#[test]
fn a_loss_says_how_far_each_finger_has_fallen() {
    let mut bench = Bench::new();
    bench.hold();
    let (evidence, left) = (0..60)
        .find_map(|ms| {
            let left = collapse(ms);
            match bench.step([Some(left), None, Some(left + 0.05)], STEADY, true) {
                Verdict::Lost { evidence, .. } => Some((evidence, left)),
                _ => None,
            }
        })
        .expect("a loss");
    for (share, expected) in [(evidence[0], 1.0 - left), (evidence[2], 0.95 - left)] {
        assert!(
            share.is_some_and(|share| (share - expected).abs() < 0.01),
            "{evidence:?}"
        );
    }
    assert_eq!(evidence[1], None);
}

#[test]
fn the_level_is_known_while_something_is_held_and_is_its_share_of_the_plateau() {
    let mut bench = Bench::new();
    assert_eq!(bench.detector.level(), None);
    bench.hold();
    for _ in 0..100 {
        all(&mut bench, 0.95);
    }
    let level = bench.detector.level();
    assert!(
        level.is_some_and(|level| (level - 0.95).abs() < 0.005),
        "{level:?}"
    );
    bench.step([Some(0.95); 3], STEADY, false);
    assert_eq!(bench.detector.level(), None);
}

#[test]
fn what_is_off_by_more_than_calm_is_no_creep() {
    let mut bench = Bench::new();
    bench.hold();
    for _ in 0..30_000 {
        assert_eq!(all(&mut bench, 0.95), Verdict::Holding);
    }
    let level = bench.detector.level();
    assert!(
        level.is_some_and(|level| (level - 0.95).abs() < 0.005),
        "{level:?}"
    );
}

#[test]
fn one_gauge_that_empties_at_once_while_the_others_feel_nothing_is_not_a_loss() {
    let mut bench = Bench::new();
    bench.hold();
    for ms in 0..400 {
        let dying = Some((1.0 - ms as f32 / 30.0).max(0.0));
        let verdict = bench.step([dying, Some(1.0), Some(1.0)], STEADY, true);
        assert!(!matches!(verdict, Verdict::Lost { .. }), "{ms} ms");
    }
}

#[test]
fn what_was_looked_at_is_told_while_something_is_held_at_a_steady_pressure() {
    let mut bench = Bench::new();
    assert_eq!(bench.detector.signs(), None);
    for _ in 0..500 {
        bench.step([Some(1.0); 3], STEADY, false);
    }
    // A grip that still tightens tells nothing.
    for _ in 0..400 {
        all(&mut bench, 1.0);
        assert_eq!(bench.detector.signs(), None);
    }
    for ms in 0..100 {
        all(&mut bench, 1.0 - 0.0005 * ms as f32);
    }
    let signs = bench.detector.signs().expect("a steady hold");
    // 0.05 in 100 ms.
    assert!((signs.slow - 0.05).abs() < 0.005, "{signs:?}");
    // In the 8 ms of the level's average.
    assert!((signs.collapse - 0.004).abs() < 0.001, "{signs:?}");
    assert!(
        signs.excess < -0.04 && signs.one_sided.is_none(),
        "{signs:?}"
    );
    bench.pressure_changes = true;
    all(&mut bench, 1.0);
    assert_eq!(bench.detector.signs(), None);
}

#[test]
fn what_counts_for_nothing_is_least_at_rest_and_most_with_two_fingers() {
    let [still, moving, two] = [
        Limits::of(Motion::Still, 3),
        Limits::of(Motion::Moving, 3),
        Limits::of(Motion::Moving, 2),
    ];
    for (less, more) in [(still, moving), (moving, two)] {
        assert!(less.held_fall_per_s < more.held_fall_per_s);
        assert!(less.slow_allowance < more.slow_allowance);
        assert!(less.slip < more.slip);
        assert!(less.quick_allowance <= more.quick_allowance);
    }
    assert!(moving.quick_allowance < two.quick_allowance);
    // Two fingers are not told from two at rest.
    assert_eq!(Limits::of(Motion::Still, 2), two);
}

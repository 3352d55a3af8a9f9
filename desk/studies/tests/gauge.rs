//! The study of the gauge's place: what a span makes of grasps by hand.

use finger::chain::{Chain, LINKS};
use studies::gauge::judge::{Floor, Span, judge, quantile};
use studies::gauge::record::{Grasps, Record};

fn chain() -> Chain {
    studies::paper::recipe().expect("the paper's recipe").chain
}

/// A grasp of which contact takes away the bend of one joint. The lift begins in tick 200, the object slides
/// by `speed_mm` per tick from tick 300 on, and `share` of the plateau is left in every tick.
fn record(joint: usize, speed_mm: f64, share: impl Fn(usize) -> f64) -> Record {
    Record {
        withheld_rad: (0..1_000)
            .map(|tick| {
                let mut withheld = [0.0; LINKS];
                withheld[joint] = share(tick);
                withheld
            })
            .collect(),
        moved_m: (0..1_000)
            .map(|tick: usize| 1e-3 * speed_mm * tick.saturating_sub(300) as f64)
            .collect(),
        lift: 200,
    }
}

fn seen(share: impl Fn(usize) -> f64, noise_ue: f64) -> studies::gauge::judge::ObjectResult {
    let held = |sway: f64| {
        let swings = move |tick: usize| 1.0 + sway * (tick.saturating_sub(200) as f64 / 10.0).sin();
        vec![record(0, 0.0, swings)]
    };
    let grasps = Grasps {
        lost: vec![record(0, 0.1, share)],
        held: [held(0.02), held(0.04)],
    };
    let span = Span {
        from_m: 0.0,
        to_m: 0.009,
    };
    let floor = Floor {
        noise_ue,
        drift: 0.08,
    };
    judge(span, &chain(), &grasps, floor)
}

#[test]
fn slip_and_loss_are_dated_from_the_first_sliding() {
    // Rises by 0.1 % per tick from tick 300 on; gone from tick 600 on.
    let ramp = |tick: usize| match tick {
        600.. => 0.1,
        tick => 1.0 + 1e-3 * tick.saturating_sub(300) as f64,
    };
    let seen = seen(ramp, 0.0);
    assert!((seen.held[0] - 0.02).abs() < 1e-4 && (seen.held[1] - 0.04).abs() < 1e-4);
    // The floor of 8 % is above 1.5 times what the held ones did.
    assert!((seen.threshold - 0.08).abs() < 1e-9);
    assert!(
        (seen.slip_m[0] - 8.1e-3).abs() < 1.1e-4,
        "{:?}",
        seen.slip_m
    );
    assert_eq!(seen.early(), 1.0);
    // It slides from 2 mm on, 21 ticks after 300, and the collapse is the whole sum's.
    assert_eq!(seen.loss_ms, [279.0]);
    assert!((seen.loss_m[0] - 30e-3).abs() < 1e-9);
    assert!(
        (seen.signal[0] - 0.149 / 0.04).abs() < 0.05,
        "{:?}",
        seen.signal
    );
}

#[test]
fn a_noisy_gauge_warns_later_and_what_does_not_show_is_never_seen() {
    let ramp = |tick: usize| 1.0 + 1e-3 * tick.saturating_sub(300) as f64;
    let quiet = seen(ramp, 100.0);
    let noisy = seen(ramp, 1.0e3 * quiet.plateau_ue / 1.0e4);
    assert!(noisy.slip_m[0] > 2.0 * quiet.slip_m[0]);
    assert_eq!(quiet.loss_ms, [f64::INFINITY]);
    let nothing = seen(|_| 1.0, 100.0);
    assert_eq!(nothing.slip_m, [f64::INFINITY]);
    assert_eq!(nothing.early(), 0.0);
    assert_eq!(quantile(&[1.0, 2.0, f64::INFINITY], 0.5), 2.0);
}

//! Verdicts while the pressure changes, sags, or a grip still settles.

use super::*;

#[test]
fn a_change_of_the_pressure_ends_in_a_new_plateau_and_is_no_slip() {
    let mut bench = Bench::new();
    bench.hold();
    bench.pressure_changes = true;
    for ms in 0..600 {
        let share = 1.0 + 0.3 * (ms as f32 / 300.0).min(1.0);
        assert_eq!(all(&mut bench, share), Verdict::Holding, "{ms} ms");
    }
    // Until then it is judged by the old one.
    assert!(bench.detector.level().is_some_and(|level| level > 1.25));
    bench.pressure_changes = false;
    for _ in 0..1_000 {
        assert_eq!(all(&mut bench, 1.3), Verdict::Holding);
    }
    let level = bench.detector.level();
    assert!(
        level.is_some_and(|level| (level - 1.0).abs() < 0.005),
        "{level:?}"
    );
}

#[test]
fn an_object_that_falls_while_the_pressure_changes_is_lost_also_when_the_change_ends_meanwhile() {
    for ends_at in [0, 1, 2, 40] {
        let mut bench = Bench::new();
        bench.hold();
        bench.pressure_changes = true;
        all(&mut bench, 1.0);
        let lost = (0..40).any(|ms| {
            bench.pressure_changes = ms < ends_at;
            matches!(all(&mut bench, collapse(ms)), Verdict::Lost { .. })
        });
        assert!(lost, "{ends_at}");
    }
}

#[test]
fn while_the_pressure_changes_nothing_is_a_way_past_the_tips() {
    let mut bench = Bench::new();
    bench.hold();
    bench.pressure_changes = true;
    // Up by more than a third and back, faster than an arm could.
    for ms in 0..400 {
        let share = 1.0 + 0.35 * (1.0 - (ms as f32 - 200.0).abs() / 40.0).max(0.0);
        assert_eq!(all(&mut bench, share), Verdict::Holding, "{ms} ms");
    }
}

#[test]
fn what_free_fingers_lose_with_the_pressure_is_no_loss_and_what_is_lost_beyond_it_is_one() {
    let free_ue = Bench::new().free.0;
    // 1 µε of each finger is 1/4000 of the plateau. The pressure takes its share in 30 ms.
    for (sag, fallen, expected) in [(0.3, 0.3, false), (0.0, 0.3, true), (0.3, 0.8, true)] {
        let mut bench = Bench::new();
        bench.hold();
        let lost = (0..60).any(|ms| {
            let way = (ms as f32 / 30.0).min(1.0);
            bench.free = Microstrain(free_ue - way * sag * PLATEAU);
            matches!(all(&mut bench, 1.0 - way * fallen), Verdict::Lost { .. })
        });
        assert_eq!(lost, expected, "{sag} {fallen}");
    }
}

#[test]
fn while_a_grip_settles_twice_the_change_is_a_slip() {
    for (fallen, expected) in [(0.10, false), (0.16, true)] {
        let mut bench = Bench::new();
        for _ in 0..500 {
            bench.step([Some(1.0); 3], STEADY, false);
        }
        // Slower than an arm, and over in 80 ms.
        let slips = (0..350).any(|ms| {
            let share = 1.0 - fallen * (ms as f32 / 80.0).min(1.0);
            matches!(all(&mut bench, share), Verdict::Slipping { .. })
        });
        assert_eq!(slips, expected, "{fallen}");
    }
}

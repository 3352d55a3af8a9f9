//! Gauges by what they show.

use super::*;
use crate::fault::GaugeFault;

const FE: FrontEnd = FrontEnd::REFERENCE;

fn frame(gauges_ue: [f32; 3]) -> RawFrame {
    RawFrame {
        gauges: gauges_ue.map(|ue| AdcCode(FE.gauge_code(0, Microstrain(ue)) as u16)),
        monitor: AdcCode(FE.monitor_code(Kilopascals(100.0)) as u16),
        supply: AdcCode(FE.supply_code(Volts(24.0)) as u16),
        rail: crate::frontend::RAIL,
        scans: 10,
        overrun: false,
        carried: false,
    }
}

/// One tick without an offset, with what a free finger would show, µε.
fn step(conditioner: &mut Conditioner, frame: &RawFrame, free_ue: f32) -> Reading {
    step_after(conditioner, frame, free_ue, false)
}

/// The same; `acknowledged`: somebody has seen the failures before it.
fn step_after(
    conditioner: &mut Conditioner,
    frame: &RawFrame,
    free_ue: f32,
    acknowledged: bool,
) -> Reading {
    let expected = Expected {
        free_strain: Some(Microstrain(free_ue)),
        ..Expected::default()
    };
    conditioner.step(frame, &FE, &expected, acknowledged)
}

/// Measures the same until the amplifiers are warm: nothing may jump from there.
fn warm(conditioner: &mut Conditioner, frame: &RawFrame) {
    for tick in 0..100 {
        let reading = step(conditioner, frame, 0.0);
        assert!(matches!(reading.gauges[0], Gauge::Valid(_)), "{tick}");
    }
}

/// Steps until finger 0 fails, at most `ticks`; says after how many and how.
fn fails(
    conditioner: &mut Conditioner,
    ticks: u32,
    free: impl Fn(u32) -> f32,
    make: impl Fn(u32) -> RawFrame,
) -> Option<(u32, GaugeFault)> {
    (0..ticks).find_map(|tick| {
        let reading = step(conditioner, &make(tick), free(tick));
        match reading.gauges[0] {
            Gauge::Failed(fault) => Some((tick + 1, fault)),
            Gauge::Valid(_) | Gauge::Missing => None,
        }
    })
}

fn flicker(tick: u32) -> f32 {
    if tick.is_multiple_of(2) { 15.0 } else { -15.0 }
}

#[test]
fn codes_become_strain_pressure_and_supply() {
    let mut conditioner = Conditioner::new();
    let reading = step(&mut conditioner, &frame([1_000.0, -500.0, 0.0]), 0.0);
    for (gauge, expected) in reading.gauges.iter().zip([1_000.0, -500.0, 0.0]) {
        let strain = gauge.strain().expect("a good gauge");
        assert!((strain.0 - expected).abs() < 1.0);
    }
    assert!(matches!(reading.monitor, Monitor::Valid(p) if (p.0 - 100.0).abs() < 0.01));
    assert!(reading.supply.is_some_and(|v| (v.0 - 24.0).abs() < 0.01));
}

#[test]
fn open_and_shorted_gauges_fail_in_three_ticks_and_a_saturated_one_within_20_ms() {
    for (code, expected, ticks) in [
        (AdcCode(65_520), GaugeFault::Open, 3),
        (AdcCode(0), GaugeFault::Short, 3),
        (
            AdcCode(FE.gauge_code(0, Microstrain(20_500.0)) as u16),
            GaugeFault::Saturated,
            15,
        ),
    ] {
        let mut bad = frame([0.0; 3]);
        bad.gauges[0] = code;
        let found = fails(&mut Conditioner::new(), 20, |_| 0.0, |_| bad);
        assert_eq!(found, Some((ticks, expected)));
    }
}

#[test]
fn a_single_spike_is_missing_and_not_a_fault() {
    let mut conditioner = Conditioner::new();
    for tick in 0..200 {
        let spike = if tick == 150 { 9_000.0 } else { 0.0 };
        let reading = step(
            &mut conditioner,
            &frame([spike + flicker(tick), 0.0, 0.0]),
            0.0,
        );
        match reading.gauges[0] {
            Gauge::Missing => assert_eq!(tick, 150),
            Gauge::Valid(_) => assert_ne!(tick, 150),
            Gauge::Failed(fault) => panic!("{fault:?} at {tick}"),
        }
    }
    let found = fails(
        &mut conditioner,
        20,
        |_| 0.0,
        |_| frame([9_000.0, 0.0, 0.0]),
    );
    assert_eq!(found, Some((3, GaugeFault::Jump)));
}

#[test]
fn a_flickering_gauge_that_freezes_is_stuck_within_20_ms() {
    let mut conditioner = Conditioner::new();
    let found = fails(
        &mut conditioner,
        2_000,
        |_| 0.0,
        |tick| frame([flicker(tick), 0.0, 0.0]),
    );
    assert_eq!(found, None);
    let found = fails(
        &mut conditioner,
        2_000,
        |_| 0.0,
        |_| frame([15.0, 0.0, 0.0]),
    );
    assert!(matches!(found, Some((ticks, GaugeFault::Stuck)) if ticks <= 20));
}

#[test]
fn what_lies_between_measurements_is_neither_stuck_nor_noise_and_a_frozen_measurement_is_stuck() {
    let mut conditioner = Conditioner::new();
    // One measurement in ten ticks; two in a row are alike now and then, and so is all between them.
    let slow = |frozen: bool| {
        move |tick: u32| {
            let sample = tick / 10;
            let ue = match frozen || sample % 7 < 2 {
                true => 15.0,
                false => flicker(sample),
            };
            RawFrame {
                carried: !tick.is_multiple_of(10),
                ..frame([ue, 0.0, 0.0])
            }
        }
    };
    assert_eq!(fails(&mut conditioner, 60_000, |_| 0.0, slow(false)), None);
    // Of the steps of 30 µε that four sevenths of the samples make, times ten.
    let variance = step(&mut conditioner, &slow(false)(60_000), 0.0).noise_variance[0];
    assert!((1_500.0..4_000.0).contains(&variance), "{variance}");
    let alive = |tick: u32| RawFrame {
        carried: !tick.is_multiple_of(10),
        ..frame([flicker(tick / 10), 0.0, 0.0])
    };
    assert_eq!(fails(&mut conditioner, 60_000, |_| 0.0, alive), None);
    let found = fails(&mut conditioner, 1_000, |_| 0.0, slow(true));
    assert!(
        matches!(found, Some((ticks, GaugeFault::Stuck)) if ticks <= 200),
        "{found:?}"
    );
}

#[test]
fn a_quiet_gauge_is_stuck_only_when_it_ignores_the_pressure() {
    let mut conditioner = Conditioner::new();
    let quiet = |_| frame([0.0; 3]);
    assert_eq!(fails(&mut conditioner, 10_000, |_| 0.0, quiet), None);
    let found = fails(&mut conditioner, 1_000, |tick| tick as f32 * 10.0, quiet);
    assert!(matches!(found, Some((_, GaugeFault::Stuck))));
}

#[test]
fn a_gauge_that_turns_noisy_fails_within_20_ms_and_400_ue_do_not() {
    let normal = |seed: u32, rms: f32| {
        // The sum of twelve uniform numbers has a variance of one.
        let mut random = 0x9e37_79b9u32.wrapping_mul(seed + 1);
        let sum: f32 = (0..12)
            .map(|_| {
                random ^= random << 13;
                random ^= random >> 17;
                random ^= random << 5;
                random as f32 / u32::MAX as f32
            })
            .sum();
        rms * (sum - 6.0)
    };
    let mut conditioner = Conditioner::new();
    let allowed = |tick| frame([normal(tick, 400.0), 0.0, 0.0]);
    assert_eq!(fails(&mut conditioner, 100_000, |_| 0.0, allowed), None);
    let noisy = |tick| frame([normal(tick, 1_800.0), 0.0, 0.0]);
    let found = fails(&mut conditioner, 100, |_| 0.0, noisy);
    assert!(
        matches!(found, Some((ticks, GaugeFault::Noisy)) if ticks <= 20),
        "{found:?}"
    );
}

#[test]
fn acknowledging_clears_a_gauge_that_works_again_and_no_other() {
    let open = {
        let mut open = frame([0.0; 3]);
        open.gauges[0] = AdcCode(65_520);
        open
    };
    let mut conditioner = Conditioner::new();
    let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
    assert_eq!(found, Some((3, GaugeFault::Open)));
    // Repaired, it stays failed until somebody has seen it.
    let good = frame([0.0; 3]);
    let reading = step(&mut conditioner, &good, 0.0);
    assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
    let reading = step_after(&mut conditioner, &good, 0.0, true);
    assert!(matches!(reading.gauges[0], Gauge::Valid(_)));
    // Acknowledged while it is still broken, it comes back when it is repaired.
    let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
    assert_eq!(found, Some((3, GaugeFault::Open)));
    step(&mut conditioner, &open, 0.0);
    let reading = step_after(&mut conditioner, &open, 0.0, true);
    assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
    let reading = step(&mut conditioner, &good, 0.0);
    assert!(matches!(reading.gauges[0], Gauge::Valid(_)));
}

#[test]
fn a_frozen_gauge_is_stuck_in_its_time_however_often_somebody_acknowledges() {
    let mut conditioner = Conditioner::new();
    for tick in 0..2_000 {
        step(&mut conditioner, &frame([flicker(tick), 0.0, 0.0]), 0.0);
    }
    let stuck = (0..20).find(|_| {
        let reading = step_after(&mut conditioner, &frame([15.0, 0.0, 0.0]), 0.0, true);
        reading.gauges[0] == Gauge::Failed(GaugeFault::Stuck)
    });
    assert!(stuck.is_some());
}

#[test]
fn a_stale_or_overrun_frame_gives_nothing() {
    let mut conditioner = Conditioner::new();
    for bad in [
        RawFrame {
            scans: 0,
            ..frame([0.0; 3])
        },
        RawFrame {
            overrun: true,
            ..frame([0.0; 3])
        },
    ] {
        let reading = step(&mut conditioner, &bad, 0.0);
        assert_eq!(reading.gauges, [Gauge::Missing; 3]);
        assert_eq!(reading.monitor, Monitor::Missing);
    }
    let reading = step(&mut conditioner, &frame([0.0; 3]), 0.0);
    assert_eq!(reading.stale_ticks, 0);
}

#[test]
fn the_zero_is_taken_off_every_strain_also_off_one_that_clips_and_one_that_is_carried() {
    let mut conditioner = Conditioner::new();
    let expected = Expected {
        zero_ue: [300.0, -200.0, 0.0],
        ..Expected::default()
    };
    // The last clips.
    for (ue, carried) in [
        (1_000.0, false),
        (1_000.0, true),
        (20_300.0, false),
        (20_300.0, true),
    ] {
        let frame = RawFrame {
            carried,
            ..frame([ue; 3])
        };
        let reading = conditioner.step(&frame, &FE, &expected, false);
        for (gauge, zero_ue) in reading.gauges.into_iter().zip(expected.zero_ue) {
            let strain = gauge.strain().expect("a good gauge");
            assert!((strain.0 + zero_ue - ue).abs() < 1.0, "{strain:?} of {ue}");
        }
    }
    // And off the first one of a gauge that has been repaired.
    let mut open = frame([0.0; 3]);
    open.gauges[0] = AdcCode(65_520);
    for _ in 0..4 {
        conditioner.step(&open, &FE, &expected, false);
    }
    let reading = conditioner.step(&frame([1_000.0; 3]), &FE, &expected, true);
    let strain = reading.gauges[0].strain().expect("a repaired gauge");
    assert!((strain.0 - 700.0).abs() < 1.0, "{strain:?}");
}

#[test]
fn a_failed_gauge_stays_failed_in_a_tick_without_data_and_in_one_without_a_measurement() {
    let mut conditioner = Conditioner::new();
    let mut open = frame([0.0; 3]);
    open.gauges[0] = AdcCode(65_520);
    let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
    assert_eq!(found, Some((3, GaugeFault::Open)));
    for frame in [
        RawFrame { scans: 0, ..open },
        RawFrame {
            carried: true,
            ..frame([0.0; 3])
        },
    ] {
        let reading = step(&mut conditioner, &frame, 0.0);
        assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
        assert_eq!(reading.gauges.map(Gauge::has_failed), [true, false, false]);
    }
}

#[test]
fn between_measurements_a_suspect_gauge_is_missing_unless_it_only_clips() {
    // Of an open gauge nothing is known. One that clips from nearby shows an empty finger that swings; one that
    // has come there by a jump, nothing.
    for (from_ue, code, is_known) in [
        (0.0, AdcCode(65_520), false),
        (
            18_000.0,
            AdcCode(FE.gauge_code(0, Microstrain(20_300.0)) as u16),
            true,
        ),
        (
            5_000.0,
            AdcCode(FE.gauge_code(0, Microstrain(20_300.0)) as u16),
            false,
        ),
    ] {
        let mut conditioner = Conditioner::new();
        warm(&mut conditioner, &frame([from_ue; 3]));
        let mut suspect = frame([from_ue; 3]);
        suspect.gauges[0] = code;
        let measured = step(&mut conditioner, &suspect, 0.0).gauges[0];
        suspect.carried = true;
        let carried = step(&mut conditioner, &suspect, 0.0).gauges[0];
        assert_eq!(measured.strain().is_some(), is_known, "{code:?}");
        assert_eq!(carried, measured);
    }
}

#[test]
fn a_gauge_may_jump_in_its_first_100_ticks_and_not_after_them() {
    let mut conditioner = Conditioner::new();
    for tick in 0..99 {
        step(&mut conditioner, &frame([0.0; 3]), tick as f32);
    }
    // In the hundredth, to stay there: neither a jump nor noise.
    let found = fails(
        &mut conditioner,
        100,
        |_| 0.0,
        |_| frame([9_000.0, 0.0, 0.0]),
    );
    assert_eq!(found, None);

    let mut conditioner = Conditioner::new();
    warm(&mut conditioner, &frame([0.0; 3]));
    // No amplifier's filter charges any more.
    let reading = step(&mut conditioner, &frame([9_000.0, 0.0, 0.0]), 0.0);
    assert_eq!(reading.gauges[0], Gauge::Missing);
}

#[test]
fn a_gauge_that_flickers_while_it_warms_up_is_not_noisy() {
    let mut conditioner = Conditioner::new();
    let make = |tick: u32| match tick {
        0..100 => frame([100.0 * flicker(tick), 0.0, 0.0]),
        _ => frame([flicker(tick), 0.0, 0.0]),
    };
    assert_eq!(fails(&mut conditioner, 500, |_| 0.0, make), None);
}

#[test]
fn a_jump_counts_from_the_last_strain_whatever_that_was() {
    for from_ue in [3_000.0, -3_000.0, 12_000.0] {
        let mut conditioner = Conditioner::new();
        warm(&mut conditioner, &frame([from_ue; 3]));
        for (to_ue, is_believed) in [(from_ue + 3_900.0, true), (from_ue - 200.0, false)] {
            let reading = step(&mut conditioner, &frame([to_ue; 3]), 0.0);
            assert_eq!(
                reading.gauges[0].strain().is_some(),
                is_believed,
                "{from_ue} to {to_ue}"
            );
        }
    }
}

#[test]
fn measurements_20_ticks_apart_may_differ_by_a_snap_more() {
    // 4 500 µε beyond the 4 000 of a jump.
    for (to_ue, is_believed) in [(8_400.0, true), (8_600.0, false)] {
        let mut conditioner = Conditioner::new();
        warm(&mut conditioner, &frame([0.0; 3]));
        for _ in 0..19 {
            let between = RawFrame {
                carried: true,
                ..frame([0.0; 3])
            };
            step(&mut conditioner, &between, 0.0);
        }
        let reading = step(&mut conditioner, &frame([to_ue, 0.0, 0.0]), 0.0);
        assert_eq!(reading.gauges[0].strain().is_some(), is_believed, "{to_ue}");
    }
}

#[test]
fn spike_after_spike_is_noise_and_a_spike_now_and_then_is_none() {
    for (period, expected) in [(3, Some(GaugeFault::Noisy)), (40, None)] {
        let mut conditioner = Conditioner::new();
        warm(&mut conditioner, &frame([0.0; 3]));
        let make = |tick: u32| match tick % period {
            0 => frame([9_000.0, 0.0, 0.0]),
            _ => frame([flicker(tick), 0.0, 0.0]),
        };
        let found = fails(&mut conditioner, 2_000, |_| 0.0, make);
        assert_eq!(found.map(|(_, fault)| fault), expected);
    }
}

#[test]
fn at_its_limits_a_code_is_beyond_the_amplifier_and_one_code_further_is_the_wire() {
    let AdcCode(short) = FE.amplifier.short_below;
    let AdcCode(open) = FE.amplifier.open_above;
    for (code, expected) in [
        (short, GaugeFault::Saturated),
        (short - 1, GaugeFault::Short),
        (open, GaugeFault::Saturated),
        (open + 1, GaugeFault::Open),
    ] {
        let mut bad = frame([0.0; 3]);
        bad.gauges[0] = AdcCode(code);
        let found = fails(&mut Conditioner::new(), 20, |_| 0.0, |_| bad);
        assert_eq!(found.map(|(_, fault)| fault), Some(expected), "{code}");
    }
}

#[test]
fn a_failure_that_is_acknowledged_twice_ends_with_its_cause() {
    let mut conditioner = Conditioner::new();
    let mut open = frame([0.0; 3]);
    open.gauges[0] = AdcCode(65_520);
    let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
    assert_eq!(found, Some((3, GaugeFault::Open)));
    step(&mut conditioner, &open, 0.0);
    for _ in 0..2 {
        let reading = step_after(&mut conditioner, &open, 0.0, true);
        assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
    }
    let reading = step(&mut conditioner, &frame([0.0; 3]), 0.0);
    assert!(matches!(reading.gauges[0], Gauge::Valid(_)));
}

#[test]
fn ticks_without_data_are_counted_until_the_next_ones() {
    let mut conditioner = Conditioner::new();
    let late = RawFrame {
        scans: 0,
        ..frame([0.0; 3])
    };
    for ticks in 1..=5 {
        let reading = step(&mut conditioner, &late, 0.0);
        assert_eq!((reading.stale_ticks, reading.supply), (ticks, None));
    }
    assert_eq!(step(&mut conditioner, &frame([0.0; 3]), 0.0).stale_ticks, 0);
}

//! What makes going on unsafe, and what ends it.

use super::*;
use crate::fault::GaugeFault;

/// The tick, from one, in which what is changed makes a gripper at rest that has been on for two seconds fail.
fn fails_after(
    ticks: u32,
    settings: impl FnOnce(&mut Settings),
    mut change: impl FnMut(&mut Bench, u32),
) -> Option<(u32, Fault)> {
    let mut bench = Bench::new(settings);
    bench.run(2_000);
    (1..=ticks).find_map(|tick| {
        change(&mut bench, tick);
        bench.step(Command::Continue);
        bench.state().fault().map(|fault| (tick, fault))
    })
}

#[test]
fn pressure_more_than_5_kpa_above_the_limit_is_a_fault_at_once() {
    let at = |kpa: f32| fails_after(10, |_| (), |bench, _| bench.blow(kpa));
    assert_eq!(at(164.9), None);
    assert_eq!(at(165.0), None);
    assert_eq!(at(165.1), Some((1, Fault::OverPressure)));
}

#[test]
fn the_fifth_tick_without_data_is_a_fault_named_by_what_the_converter_says() {
    for (overrun, fault) in [(false, Fault::AdcStale), (true, Fault::AdcOverrun)] {
        let found = fails_after(
            10,
            |_| (),
            |bench, tick| {
                bench.reading.stale_ticks = tick;
                bench.reading.overrun = overrun;
            },
        );
        assert_eq!(found, Some((5, fault)));
    }
}

#[test]
fn a_supply_below_20_4_v_for_20_ticks_in_a_row_is_a_fault() {
    let at = |volts: f32| {
        fails_after(
            100,
            |_| (),
            move |bench, _| bench.reading.supply = Some(Volts(volts)),
        )
    };
    assert_eq!(at(20.4), None);
    assert_eq!(at(20.3), Some((20, Fault::SupplyLow)));
    let gaps = fails_after(
        100,
        |_| (),
        |bench, tick| {
            let volts = if tick % 20 == 0 { 24.0 } else { 0.0 };
            bench.reading.supply = Some(Volts(volts));
        },
    );
    assert_eq!(gaps, None);
}

#[test]
fn a_supply_may_come_a_second_late() {
    let mut bench = Bench::new(|_| ());
    bench.reading.supply = Some(Volts(0.0));
    bench.run(1_000);
    assert_eq!(bench.state(), State::Idle);
    bench.run(1);
    assert_eq!(bench.state().fault(), Some(Fault::SupplyLow));
}

#[test]
fn a_pressure_that_does_not_follow_for_300_ms_is_a_fault() {
    let found = fails_after(
        1_000,
        |_| (),
        |bench, tick| bench.air.deviating_us = 1_000 * u64::from(tick),
    );
    assert_eq!(found, Some((300, Fault::NotFollowing)));
}

#[test]
fn a_robot_may_be_silent_for_its_timeout_and_any_command_is_a_word() {
    let timeout = |settings: &mut Settings| settings.host_timeout_ms = 300.0;
    let mut bench = Bench::new(timeout);
    // With the fingers open nobody has to.
    bench.run(1_000);
    assert_eq!(bench.state(), State::Idle);
    let mut bench = Bench::holding([true; 3], timeout);
    bench.step(Command::Alive);
    for _ in 0..5 {
        bench.run(300);
        assert!(bench.state().is_holding());
        bench.step(Command::Alive);
    }
    bench.run(301);
    assert_eq!(bench.state().fault(), Some(Fault::HostSilent));
    // Without a timeout nobody has to speak.
    assert_eq!(fails_after(2_000, |_| (), |_, _| ()), None);
}

#[test]
fn one_failed_gauge_is_told_and_the_second_is_a_fault() {
    let mut bench = Bench::new(|_| ());
    bench.reading.gauges[1] = Gauge::Failed(GaugeFault::Open);
    bench.run(10);
    let told = |fault, finger| Event::Fault { fault, finger };
    assert_eq!(bench.told(), [told(Fault::GaugeOpen, Some(1))]);
    assert_eq!(bench.state(), State::Idle);
    // Good again, and failed again.
    bench.reading.gauges[1] = Gauge::Missing;
    bench.run(1);
    bench.reading.gauges[1] = Gauge::Failed(GaugeFault::Open);
    bench.run(1);
    assert_eq!(bench.told(), []);
    bench.reading.gauges[1] = Gauge::Valid(Microstrain(0.0));
    bench.run(1);
    bench.reading.gauges[1] = Gauge::Failed(GaugeFault::Short);
    bench.reading.gauges[2] = Gauge::Failed(GaugeFault::Noisy);
    bench.run(10);
    assert_eq!(
        bench.told(),
        [
            told(Fault::GaugeShort, Some(1)),
            told(Fault::GaugeNoisy, Some(2)),
            told(Fault::GaugeNoisy, None),
        ]
    );
    assert_eq!(bench.state().fault(), Some(Fault::GaugeNoisy));
}

/// What is left of a hold at 140 kPa after a fault: its pressure, and whether it is watched.
fn after(bench: &Bench) -> (f32, bool) {
    match bench.state() {
        State::Fault {
            target, watching, ..
        } => (target.0, watching),
        state => panic!("{state:?}"),
    }
}

#[test]
fn a_fault_holds_or_vents_as_the_settings_and_its_rule_say() {
    for (on_fault, stopped) in [
        (OnFault::Hold, (140.0, true)),
        (OnFault::Vent, (0.0, false)),
    ] {
        let hold = || Bench::holding([true; 3], |settings| settings.on_fault = on_fault);
        let mut bench = hold();
        bench.step(Command::Stop);
        assert_eq!(after(&bench), stopped);
        // The gauges of a gripper whose data are stale tell nothing.
        let mut bench = hold();
        bench.reading.stale_ticks = 5;
        bench.run(1);
        assert_eq!(after(&bench), (stopped.0, false));
        // Too much pressure is never held.
        let mut bench = hold();
        bench.blow(170.0);
        bench.run(1);
        assert_eq!(after(&bench), (0.0, false));
    }
    // Where nothing is held, nothing is watched.
    let mut bench = Bench::new(|_| ());
    bench.step(Command::Stop);
    assert_eq!(after(&bench), (0.0, false));
}

#[test]
fn a_second_fault_takes_away_what_it_must_and_says_so_and_gives_nothing_back() {
    let told = |fault| Event::Fault {
        fault,
        finger: None,
    };
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.step(Command::Stop);
    bench.told();
    bench.reading.stale_ticks = 5;
    bench.run(10);
    assert_eq!(after(&bench), (140.0, false));
    assert_eq!(bench.told(), [told(Fault::AdcStale)]);
    bench.reading.stale_ticks = 0;
    bench.blow(170.0);
    bench.run(10);
    assert_eq!(after(&bench), (0.0, false));
    assert_eq!(bench.told(), [told(Fault::OverPressure)]);
    // The first stays latched.
    assert_eq!(bench.state().fault(), Some(Fault::Stopped));
    // One that could take nothing says nothing.
    bench.blow(140.0);
    bench.air.deviating_us = 300_000;
    bench.run(10);
    assert_eq!(bench.told(), []);
}

#[test]
fn on_its_way_to_another_pressure_a_fault_keeps_the_one_that_is_there() {
    for (measured, expected, kept) in [
        (Some(80.0), 90.0, 80.0),
        (None, 90.0, 90.0),
        // Never more than the commands account for, nor less than none.
        (Some(150.0), 90.0, 140.0),
        (Some(-2.0), 0.0, 0.0),
    ] {
        let mut bench = Bench::new(|_| ());
        bench.step(GRIP);
        bench.air.measured = measured.map(Kilopascals);
        bench.air.expected = Some(Kilopascals(expected));
        bench.step(Command::Stop);
        assert_eq!(after(&bench), (kept, false), "{measured:?}");
    }
}

#[test]
fn an_acknowledged_fault_that_holds_goes_on_with_its_pressure_and_one_that_vents_opens() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.step(Command::Stop);
    bench.run(10);
    bench.step(Command::Acknowledge);
    bench.run(1);
    assert!(closing_to(140.0, true)(bench.state()));
    // What was watched is held: it is lost where it is not there any more.
    assert!(bench.state().is_holding());
    let mut bench = Bench::holding([true; 3], |settings| settings.on_fault = OnFault::Vent);
    bench.step(Command::Stop);
    bench.run(10);
    bench.step(Command::Acknowledge);
    bench.run(1);
    assert!(matches!(
        bench.state(),
        State::Releasing { holding: false, .. }
    ));
}

#[test]
fn a_fault_ends_with_its_cause_once_it_has_been_acknowledged() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.reading.stale_ticks = 5;
    bench.run(10);
    bench.step(Command::Acknowledge);
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::AdcStale));
    bench.reading.stale_ticks = 0;
    bench.run(1);
    assert_eq!(bench.state().fault(), None);
    // Not acknowledged, it stays.
    bench.reading.stale_ticks = 5;
    bench.run(10);
    bench.reading.stale_ticks = 0;
    bench.run(1_000);
    assert_eq!(bench.state().fault(), Some(Fault::AdcStale));
}

#[test]
fn a_pressure_that_does_not_follow_is_acknowledged_when_it_is_where_it_should_be() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.air.deviating_us = 300_000;
    bench.run(1);
    bench.step(Command::Acknowledge);
    // As shortly as may be.
    bench.air.deviating_us = 1_000;
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::NotFollowing));
    bench.air.deviating_us = 0;
    bench.run(1);
    assert_eq!(bench.state().fault(), None);
    // Any other fault ends while the pressure is off for less than a fault.
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.step(Command::Stop);
    bench.run(10);
    bench.air.deviating_us = 1_000;
    bench.step(Command::Acknowledge);
    bench.run(1);
    assert_eq!(bench.state().fault(), None);
}

#[test]
fn behind_a_fault_that_has_gone_stands_what_is_still_wrong_to_be_acknowledged_in_its_turn() {
    let mut bench = Bench::holding([true; 3], |_| ());
    bench.run(1_000);
    bench.step(Command::Stop);
    bench.reading.supply = Some(Volts(12.0));
    bench.run(100);
    bench.told();
    bench.step(Command::Acknowledge);
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::SupplyLow));
    assert_eq!(after(&bench), (140.0, false));
    bench.reading.supply = Some(Volts(24.0));
    bench.run(10);
    assert_eq!(bench.state().fault(), Some(Fault::SupplyLow));
}

#[test]
fn what_only_a_restart_clears_is_not_acknowledged() {
    for (fault, stays) in [(Fault::SettingsInvalid, true), (Fault::Internal, false)] {
        let mut bench = Bench::new(|_| ());
        bench.supervisor = Supervisor::new(Some(fault));
        bench.run(10);
        assert_eq!(
            bench.told(),
            [Event::Fault {
                fault,
                finger: None
            }]
        );
        bench.step(Command::Acknowledge);
        bench.run(10);
        assert_eq!(bench.state().fault().is_some(), stays, "{fault:?}");
    }
}

#[test]
fn a_loss_in_a_fault_that_holds_on_is_told_once_and_changes_nothing_else() {
    let mut bench = Bench::holding([true; 3], |settings| settings.on_loss = OnLoss::Vent);
    bench.step(Command::Stop);
    bench.told();
    bench.lose();
    assert!(matches!(bench.told()[..], [Event::Lost(_)]));
    assert_eq!(after(&bench), (140.0, false));
}

#[test]
fn what_was_not_watched_is_not_watched_in_the_fault_that_remains_either() {
    let mut bench = Bench::holding([true; 3], |settings| settings.host_timeout_ms = 300.0);
    bench.reading.stale_ticks = 5;
    bench.run(1);
    assert_eq!(after(&bench), (140.0, false));
    bench.step(Command::Acknowledge);
    // The robot falls silent, which its hold would be watched in.
    bench.run(301);
    bench.reading.stale_ticks = 0;
    bench.run(1);
    assert_eq!(bench.state().fault(), Some(Fault::HostSilent));
    assert_eq!(after(&bench), (140.0, false));
}

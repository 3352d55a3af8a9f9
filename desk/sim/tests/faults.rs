//! What each fault does to the air and to the converter's codes, and how a run with faults is judged.

use sim::events::TimedEvent;
use sim::fault::Injected;
use sim::plant::Truth;
use sim::run::{Outcome, Run};
use sim::setup::Setup;
use softgrip::detect::{Loss, LossCause};
use softgrip::fault::Fault;
use softgrip::frontend::FrontEnd;
use softgrip::telemetry::Event;
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{FINGERS, RawFrame};

const FRONT_END: FrontEnd = FrontEnd::REFERENCE;
/// When everything breaks here: the grip is tight.
const BREAKS: usize = 1_500;

fn setup() -> Setup {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/paper.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("the paper's recipe");
    Setup::of(&recipe).expect("a setup")
}

fn fault(text: &str) -> Injected {
    text.parse().expect("a fault")
}

/// The plant's ticks from the fault on, while the command is changed from 140 kPa to `kpa` with it.
fn after(faults: &[&str], kpa: f32, ticks: usize) -> Vec<(RawFrame, Truth)> {
    let faults: Vec<_> = faults.iter().map(|text| fault(text)).collect();
    let mut plant = setup().plant().with_faults(&faults);
    let mut dac = DacCode(0);
    let run = (1..BREAKS + ticks).map(|tick| {
        let (frame, truth) = plant.step(dac);
        dac = match truth.arm.phase.wants_grip() {
            true if tick < BREAKS - 1 => FRONT_END.command(Kilopascals(140.0)),
            true => FRONT_END.command(Kilopascals(kpa)),
            false => DacCode(0),
        };
        (frame, truth)
    });
    run.skip(BREAKS - 1).collect()
}

fn pressure(ticks: &[(RawFrame, Truth)], ms: usize) -> f64 {
    ticks[ms].1.pressure_kpa
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{value}, not {expected}"
    );
}

#[test]
fn a_stuck_regulator_ignores_the_command() {
    let ticks = after(&["regulator-stuck@1.5s"], 0.0, 400);
    near(pressure(&ticks, 399), 140.0, 1.0);
    let ticks = after(&["regulator-stuck@1.5s..1.6s"], 0.0, 600);
    near(pressure(&ticks, 90), 140.0, 1.0);
    near(pressure(&ticks, 599), 0.0, 1.0);
}

#[test]
fn with_the_supply_closed_pressure_falls_on_command_and_does_not_rise() {
    let closed = ["supply-closed@1.5s"];
    near(pressure(&after(&closed, 160.0, 400), 399), 140.0, 1.0);
    near(pressure(&after(&closed, 0.0, 400), 399), 0.0, 1.0);
}

#[test]
fn a_burst_tube_and_a_leak_empty_the_fingers_at_their_rates() {
    for (kind, time_constant_ms) in [("tube-burst", 30.0), ("leak", 1_000.0)] {
        let ticks = after(&[&format!("{kind}@1.5s")], 140.0, 301);
        let held = pressure(&ticks, 0);
        for ms in [30, 300] {
            let left = (-(ms as f64) / time_constant_ms).exp();
            near(pressure(&ticks, ms), left * held, 0.01);
            let shown = FRONT_END.pressure(ticks[ms].0.monitor).0;
            near(shown.into(), left * held, 0.5);
        }
    }
}

#[test]
fn an_open_valve_gives_full_scale_whatever_the_command() {
    let ticks = after(&["over-pressure@1.5s"], 0.0, 500);
    assert!(pressure(&ticks, 100) > 180.0);
    near(pressure(&ticks, 499), 200.0, 1.0);
}

#[test]
fn an_open_monitor_is_pulled_to_nothing_while_the_pressure_stays() {
    let ticks = after(&["monitor-off@1.5s"], 140.0, 100);
    let shown = |ms: usize| f64::from(FRONT_END.pressure(ticks[ms].0.monitor).0);
    near(pressure(&ticks, 99), 140.0, 1.0);
    near(shown(2) / shown(0), (-2.0f64 / 3.0).exp(), 0.01);
    near(shown(99), 0.0, 0.5);
}

#[test]
fn a_fault_of_one_gauge_is_one_gauges_alone() {
    let sound = after(&[], 140.0, 600);
    for kind in ["open", "short", "stuck", "saturated", "noisy", "drift"] {
        let broken = after(&[&format!("gauge-{kind}:2@1.5s")], 140.0, 600);
        for ((ours, truth), (theirs, same)) in broken.iter().zip(&sound) {
            assert_eq!((truth, ours.monitor), (same, theirs.monitor), "{kind}");
            assert_eq!(ours.supply, theirs.supply, "{kind}");
            for finger in [0, 2] {
                assert_eq!(ours.gauges[finger], theirs.gauges[finger], "{kind}");
            }
        }
        let codes: Vec<_> = broken.iter().map(|(frame, _)| frame.gauges[1]).collect();
        let strain = |ms: usize| f64::from(FRONT_END.strains(&[codes[ms]; 3])[0].0);
        let of_sound = |ms: usize| f64::from(FRONT_END.strains(&sound[ms].0.gauges)[1].0);
        match kind {
            "open" => {
                assert!(codes.is_sorted(), "the pull-up charges the input");
                assert!(codes[599] > FRONT_END.amplifier.open_above);
            }
            "short" => assert!(
                codes
                    .iter()
                    .all(|&code| code < FRONT_END.amplifier.short_below)
            ),
            "stuck" => assert!(codes.iter().all(|&code| code == codes[0])),
            "saturated" => {
                assert!((0..600).all(|ms| {
                    strain(ms) > 20_000.0 && codes[ms] < FRONT_END.amplifier.open_above
                }))
            }
            "noisy" => {
                // The sound gauge has 20 µε of its own and the same mean.
                let squares = (0..600).map(|ms| (strain(ms) - of_sound(ms)).powi(2));
                near((squares.sum::<f64>() / 600.0).sqrt(), 19.0 * 20.0, 40.0);
            }
            "drift" => near(strain(599) / of_sound(599), (-0.6f64 / 3.0).exp(), 0.03),
            _ => unreachable!(),
        }
    }
}

#[test]
fn supply_and_converter_show_their_faults() {
    for (frame, _) in after(&["supply-sag@1.5s"], 140.0, 20) {
        near(FRONT_END.supply(frame.supply).0.into(), 15.0, 0.1);
    }
    let sound = after(&[], 140.0, 20);
    let rotated = after(&["adc-overrun@1.5s"], 140.0, 20);
    for ((ours, _), (theirs, _)) in rotated.iter().zip(&sound) {
        assert!(ours.overrun && !theirs.overrun);
        assert_eq!(ours.gauges[FINGERS - 1], theirs.monitor);
        assert_eq!(
            (ours.monitor, ours.supply),
            (theirs.supply, theirs.gauges[0])
        );
    }
    let stale = after(&["stale-frame@1.5s..1.51s"], 140.0, 20);
    let scans: Vec<_> = stale.iter().map(|(frame, _)| frame.scans > 0).collect();
    assert_eq!(scans, [[false; 10], [true; 10]].concat());
}

fn run(accel_m_s2: f64, faults: &[&str]) -> Run {
    let mut setup = setup();
    setup.scenario.accel_m_s2 = accel_m_s2;
    setup.faults = faults.iter().map(|text| fault(text)).collect();
    setup.run(|_| ()).expect("a run")
}

/// What would be wrong if the controller had reported these and nothing else.
fn mistake(run: &Run, reported: &[(f64, Event)]) -> Option<String> {
    let mut run = run.clone();
    run.events = reported
        .iter()
        .map(|&(t_s, event)| TimedEvent { t_s, event })
        .collect();
    let mut lost = reported.iter();
    let lost = lost.find(|(_, event)| matches!(event, Event::Lost(_)));
    run.flagged_at_s = lost.map(|&(t_s, _)| t_s);
    run.mistake()
}

const LOST: Event = Event::Lost(Loss {
    onset: Instant::from_micros(0),
    flagged: Instant::from_micros(0),
    cause: LossCause::Collapse,
    evidence: [None; FINGERS],
});
const HOLDING: Event = Event::Holding {
    touching: [true; FINGERS],
};
const FAULT: Event = Event::Fault {
    fault: Fault::SupplyLow,
    finger: None,
};

#[test]
fn what_falls_for_want_of_air_must_be_reported_but_not_as_lost() {
    let run = run(5.0, &["tube-burst@2.3s"]);
    assert_ne!(run.outcome, Outcome::Hold);
    assert_eq!(run.mistake(), None);
    let slid_at_s = run.slid_at_s.expect("it fell");
    let says = |reported: &[(f64, Event)]| mistake(&run, reported).unwrap_or_default();
    assert_eq!(says(&[(1.2, HOLDING), (2.32, Event::AirLoss)]), "");
    let lost = says(&[(1.2, HOLDING), (slid_at_s, LOST)]);
    assert!(lost.contains("the air was gone, but lost"), "{lost}");
    let silence = says(&[(1.2, HOLDING)]);
    assert!(silence.contains("nothing was reported"), "{silence}");
}

#[test]
fn what_falls_with_its_air_must_be_reported_lost_unless_a_fault_was_told_before() {
    let run = run(10.0, &["gauge-stuck:2@0.5s"]);
    assert_ne!(run.outcome, Outcome::Hold);
    let slid_at_s = run.slid_at_s.expect("it fell");
    let says = |reported: &[(f64, Event)]| mistake(&run, reported).unwrap_or_default();
    assert_eq!(says(&[(slid_at_s + 0.1, LOST)]), "");
    assert_eq!(says(&[(slid_at_s - 0.1, FAULT)]), "");
    let silence = says(&[(1.2, HOLDING), (slid_at_s + 0.1, FAULT)]);
    assert!(silence.contains("lost was reported 0 times"), "{silence}");
    let twice = says(&[(slid_at_s + 0.1, LOST), (slid_at_s + 0.2, LOST)]);
    assert!(twice.contains("lost was reported 2 times"), "{twice}");
    let early = says(&[(1.3, LOST)]);
    assert!(early.contains("when the object had moved by"), "{early}");
}

#[test]
fn a_silent_robot_and_a_stop_reach_the_controller_as_such() {
    let says =
        |run: &Run, event: Event| run.events.iter().find(|e| e.event == event).map(|e| e.t_s);
    let fault = |fault| Event::Fault {
        fault,
        finger: None,
    };
    let silent = run(5.0, &["host-silent@0.1s"]);
    assert!(silent.samples.iter().all(|sample| sample.asked_kpa == 0.0));
    assert_eq!(says(&silent, HOLDING), None);
    // Open fingers wait for nobody.
    assert_eq!(says(&silent, fault(Fault::HostSilent)), None);
    assert_eq!(silent.mistake(), None);

    let late = run(5.0, &["host-silent@2s"]);
    near(
        says(&late, fault(Fault::HostSilent)).expect("a fault"),
        3.0,
        0.002,
    );
    assert_eq!(says(&late, Event::Released), None);
    let back = run(5.0, &["host-silent@2s..2.5s"]);
    assert!(says(&back, Event::Released).is_some());
    let stopped = run(5.0, &["stop@2s..2.1s"]);
    near(
        says(&stopped, fault(Fault::Stopped)).expect("a fault"),
        2.0,
        1e-9,
    );
}

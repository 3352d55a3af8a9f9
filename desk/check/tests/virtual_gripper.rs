//! The check against the virtual gripper: whole, and with each of its faults.
#![cfg(unix)]

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use check::{Ended, Finding, Options, Person, Report, Step, Verdict, run};
use serve::script;
use sim::hand::Hand;
use sim::setup::Setup;
use softgrip::fault::Fault;
use watch::source::Virtual;
use watch::{Connection, Source};

/// A gripper with a good board's noise, nothing in the grip, and this script.
fn gripper(steps: &str, change: impl FnOnce(&mut Setup)) -> Connection {
    open(steps, false, change)
}

fn open(steps: &str, has_object: bool, change: impl FnOnce(&mut Setup)) -> Connection {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    let mut setup = Setup::of(&recipe).expect("a setup");
    setup.scenario.noise_ue = 4.0;
    change(&mut setup);
    let options = watch::Options {
        rate_hz: 50.0,
        with_ticks: false,
        in_real_time: true,
        baud: 115_200,
        id: 9,
        elf: None,
        gripper: Virtual {
            setup,
            has_object,
            script: (!steps.is_empty()).then(|| script::parse(steps).expect("a script")),
            // As fast as this machine is; all times of the check are the gripper's own.
            speed: 50.0,
        },
    };
    watch::open(&Source::Virtual, &options).expect("a gripper")
}

const TOP: Options = Options { top_kpa: 60.0 };

fn check(gripper: &Connection) -> Report {
    let stop = AtomicBool::new(false);
    run(gripper, TOP, Person::Nobody, &stop, &mut |_| {}).expect("a check")
}

fn check_with(steps: &str) -> Report {
    check(&gripper(steps, |_| {}))
}

fn failed(report: &Report) -> Vec<&Finding> {
    let findings = report.findings.iter();
    findings
        .filter(|finding| finding.verdict == Verdict::Failed)
        .collect()
}

/// The check has failed, has named this fault in this step, with its page, and the gripper has no pressure.
fn assert_names(report: &Report, fault: Fault, step: Step) {
    let page = check::faults::page(fault);
    let named = failed(report).into_iter().any(|finding| {
        finding.fault == Some(fault) && finding.step == step && finding.look_at.contains(&page)
    });
    assert!(named, "{fault:?}: {report:#?}");
    assert!(!report.has_passed() && !report.is_under_pressure);
    assert_eq!(report.ended, Ended::Whole);
}

fn has_moved(report: &Report) -> bool {
    let mut findings = report.findings.iter();
    findings.any(|finding| finding.what.starts_with("pressure at"))
}

#[test]
fn a_whole_gripper_passes_and_is_left_as_it_was_found() {
    let report = check_with("");
    assert!(report.has_passed(), "{report:#?}");
    assert_eq!(report.count(Verdict::Warned), 0, "{report:#?}");
    let pressures = [
        "pressure at 20 kPa",
        "pressure at 40 kPa",
        "pressure at 60 kPa",
    ];
    let whats: Vec<&str> = report.findings.iter().map(|f| f.what.as_str()).collect();
    for what in pressures {
        assert!(whats.contains(&what), "{whats:?}");
    }
    for finding in &report.findings {
        let takes_a_person = finding.step == Step::Fingers
            || finding.what.starts_with("lamps")
            || finding.what.starts_with("HOLDING");
        let is_left_out = finding.verdict == Verdict::NotTried;
        assert_eq!(is_left_out, takes_a_person, "{finding:?}");
    }
    assert_eq!(report.findings.last().map(|f| f.step), Some(Step::Left));
    let page = report.markdown();
    assert!(page.contains("| nobody was asked |"), "{page}");
    assert_eq!(report.json()["passed"], true);
}

#[test]
fn a_broken_wire_is_named_and_nothing_moves() {
    let report = check_with("[[step]]\nfault = 'gauge-open:2'\n");
    assert_names(&report, Fault::GaugeOpen, Step::Rest);
    assert!(!has_moved(&report), "{report:#?}");
    assert!(failed(&report).iter().any(|f| f.what == "gauge 2, fault"));
}

#[test]
fn a_shorted_gauge_is_named_and_nothing_moves() {
    let report = check_with("[[step]]\nfault = 'gauge-short:1'\n");
    assert_names(&report, Fault::GaugeShort, Step::Rest);
    assert!(!has_moved(&report), "{report:#?}");
}

#[test]
fn a_gauge_that_is_too_noisy_is_named_and_nothing_moves() {
    let noisy = "[[step]]\nfault = 'gauge-noisy:3'\n";
    // Twenty times as much.
    let report = check(&gripper(noisy, |setup| setup.scenario.noise_ue = 100.0));
    assert_names(&report, Fault::GaugeNoisy, Step::Rest);
    assert!(!has_moved(&report), "{report:#?}");
}

#[test]
fn a_low_supply_is_named_and_nothing_moves() {
    let report = check_with("[[step]]\nsupply_v = 15.0\n");
    assert_names(&report, Fault::SupplyLow, Step::Identity);
    assert_names(&report, Fault::SupplyLow, Step::Rest);
    assert!(!has_moved(&report), "{report:#?}");
}

#[test]
fn an_open_stop_circuit_is_named_and_nothing_moves() {
    let report = check_with("[[step]]\nfault = 'stop'\n");
    assert_names(&report, Fault::Stopped, Step::Identity);
    assert!(!has_moved(&report), "{report:#?}");
}

#[test]
fn a_closed_supply_of_air_is_named_at_the_first_pressure() {
    let report = check_with("[[step]]\nfault = 'supply-closed'\n");
    assert_names(&report, Fault::NotFollowing, Step::Pressure);
    assert!(!has_moved(&report), "{report:#?}");
}

#[test]
fn a_hose_that_bursts_under_pressure_is_named_and_the_pressure_is_let_go() {
    // State 4: 20 kPa are there, and nothing is held.
    let burst = "[[step]]\nwhen = { register = 0x1010, equals = 4 }\nfault = 'tube-burst'\n";
    let report = check_with(burst);
    assert_names(&report, Fault::NotFollowing, Step::Pressure);
    let mut released = report.findings.iter().filter(|f| f.step == Step::Release);
    assert!(
        released.all(|f| f.verdict == Verdict::Passed),
        "{report:#?}"
    );
}

/// What has failed of the strain of a finger whose gauge has this gain.
fn strain_with_gain(gain: f64) -> Report {
    let gripper = gripper("", |setup| {
        let mut hand = Hand::alike(&setup.chain);
        hand.gauge_gain[1] = gain;
        setup.castings = Some(hand);
    });
    check(&gripper)
}

#[test]
fn a_gauge_with_its_ends_swapped_falls_and_is_told_by_its_finger() {
    let report = strain_with_gain(-1.0);
    let failed = failed(&report);
    let [finding] = failed[..] else {
        panic!("{report:#?}");
    };
    assert_eq!(finding.what, "strain of finger 2");
    assert!(finding.look_at.contains("swapped"), "{finding:?}");
    assert!(!report.is_under_pressure);
}

#[test]
fn a_gauge_with_half_its_gain_is_told_by_its_finger() {
    let report = strain_with_gain(0.5);
    let failed = failed(&report);
    let [finding] = failed[..] else {
        panic!("{report:#?}");
    };
    assert_eq!(finding.what, "strain of finger 2");
    assert!(finding.look_at.contains("gain"), "{finding:?}");
}

#[test]
fn an_object_in_the_grip_ends_the_movement() {
    let gripper = open("", true, |_| {});
    let stop = AtomicBool::new(false);
    let top = Options { top_kpa: 160.0 };
    let report = run(&gripper, top, Person::Nobody, &stop, &mut |_| {}).expect("a check");
    let failed = failed(&report);
    assert!(failed.iter().any(|f| f.what == "grip"), "{report:#?}");
    let is_at = |what: &str| report.findings.iter().any(|f| f.what == what);
    assert!(!is_at("pressure at 160 kPa"), "{report:#?}");
    assert!(!report.is_under_pressure);
}

#[test]
fn an_interruption_lets_the_pressure_go_first() {
    let stop = AtomicBool::new(false);
    let gripper = gripper("", |_| {});
    let report = run(&gripper, TOP, Person::Nobody, &stop, &mut |finding| {
        if finding.what == "pressure at 20 kPa" {
            stop.store(true, Relaxed);
        }
    });
    let report = report.expect("a check");
    assert_eq!(report.ended, Ended::Interrupted);
    assert!(!report.is_under_pressure && !report.has_passed());
    let last = report.findings.last().expect("a finding");
    assert_eq!((last.step, last.verdict), (Step::Release, Verdict::Passed));
}

#[test]
fn a_gripper_that_is_gone_under_pressure_is_said_to_be_so() {
    let end = "[[step]]\nwhen = { register = 0x1010, equals = 4 }\nend = true\n";
    let report = check_with(end);
    assert!(matches!(report.ended, Ended::Gone(_)), "{report:#?}");
    assert!(report.is_under_pressure && !report.has_passed());
    assert!(
        report
            .markdown()
            .contains("**The pressure was not seen to leave.**")
    );
}

/// A check with a person who says these words, one after the other, and what the person was asked.
fn asked(answers: &[&str]) -> (Report, Vec<String>) {
    let mut answers = answers.iter();
    let mut questions = Vec::new();
    let mut ask = |question: &str| {
        questions.push(question.to_string());
        answers.next().map(ToString::to_string)
    };
    let stop = AtomicBool::new(false);
    let gripper = gripper("", |_| {});
    let person = Person::There(&mut ask);
    let report = run(&gripper, TOP, person, &stop, &mut |_| {}).expect("a check");
    (report, questions)
}

#[test]
fn without_consent_nothing_moves() {
    let (report, questions) = asked(&["y", "", "", "", "", "", "", "yes", "yes", "yes"]);
    assert!(questions[0].contains("no hands. Type yes"), "{questions:?}");
    assert!(!has_moved(&report) && !report.has_passed(), "{report:#?}");
}

#[test]
fn a_person_is_asked_for_fingers_and_lamps_and_believed() {
    let (report, questions) = asked(&["yes", "", "", "", "", "", "", "yes", "no", "yes"]);
    assert_eq!(questions.len(), 10, "{questions:#?}");
    assert!(has_moved(&report));
    // Nobody bends the virtual gripper's fingers.
    let bent = report.findings.iter().filter(|f| f.step == Step::Fingers);
    assert!(
        bent.clone().all(|f| f.verdict == Verdict::Failed),
        "{report:#?}"
    );
    assert_eq!(bent.count(), softgrip::FINGERS);
    let lamps = report
        .findings
        .iter()
        .filter(|f| f.what.starts_with("lamps"));
    let verdicts: Vec<Verdict> = lamps.map(|f| f.verdict).collect();
    assert_eq!(
        verdicts,
        [Verdict::Passed, Verdict::Failed, Verdict::Passed]
    );
}

#[test]
fn nobody_to_answer_ends_it_before_anything_moves() {
    let (report, _) = asked(&[]);
    assert_eq!(report.ended, Ended::Interrupted);
    assert!(!has_moved(&report));
}

#[test]
fn a_top_above_the_settings_is_refused_with_what_would_be_right() {
    let stop = AtomicBool::new(false);
    let gripper = gripper("", |_| {});
    let options = Options { top_kpa: 170.0 };
    let refused = run(&gripper, options, Person::Nobody, &stop, &mut |_| {});
    let error = refused.expect_err("too much").to_string();
    assert!(
        error.contains("170") && error.contains("at most 160 kPa"),
        "{error}"
    );
}

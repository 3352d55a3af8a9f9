//! The virtual gripper as a source: what it tells, and what can be wished of it.

use std::time::Duration;

use serve::script::Action;
use sim::setup::Setup;
use softgrip::table::ObjectKind;
use watch::source::Virtual;
use watch::told::EventTold;
use watch::{Answer, Connection, Observation, Options, Source, Told, Wish};

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(60);

fn options(with_ticks: bool) -> Options {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    Options {
        rate_hz: 50.0,
        with_ticks,
        in_real_time: true,
        baud: 115_200,
        id: 9,
        elf: None,
        gripper: Virtual {
            setup: Setup::of(&recipe).expect("a setup"),
            has_object: true,
            script: None,
            speed: 1.0,
        },
    }
}

fn gripper(with_ticks: bool) -> Connection {
    watch::open(&Source::Virtual, &options(with_ticks)).expect("a gripper")
}

fn wish(gripper: &Connection, wish: Wish) -> Answer {
    let wishes = gripper.wishes.as_ref().expect("it takes wishes");
    wishes.ask(wish).expect("it is there")
}

fn wait_for<T>(gripper: &Connection, what: &str, mut find: impl FnMut(Told) -> Option<T>) -> T {
    loop {
        let told = gripper.told.recv_timeout(LONG).expect(what);
        if let Some(found) = find(told) {
            return found;
        }
    }
}

fn wait_for_event(gripper: &Connection, wanted: &str) -> EventTold {
    wait_for(gripper, wanted, |told| match told {
        Told::Event(event) if event.name == wanted => Some(event),
        _ => None,
    })
}

fn next_observation(gripper: &Connection) -> Observation {
    wait_for(gripper, "an observation", |told| match told {
        Told::Observation(seen) => Some(*seen),
        _ => None,
    })
}

#[test]
fn a_grasp_is_wished_and_seen_and_its_loss_told() {
    let gripper = gripper(false);
    assert!(matches!(
        gripper.told.recv_timeout(LONG),
        Ok(Told::Provenance(about)) if about.recipe == softgrip::table::FINGER.recipe
    ));
    assert_eq!(wish(&gripper, Wish::Grip), Answer::Done);
    assert_eq!(wish(&gripper, Wish::Grip), Answer::Already);
    let held_s = wait_for_event(&gripper, "holding").t_s;
    let seen = next_observation(&gripper);
    assert_eq!(seen.holding, Some(true), "{seen:?}");
    assert!(seen.t_s.is_some_and(|t_s| t_s >= held_s), "{seen:?}");
    let is_pressed = |kpa: Option<f32>| kpa.is_some_and(|kpa| (130.0..150.0).contains(&kpa));
    assert!(is_pressed(seen.pressure_kpa) && is_pressed(seen.setpoint_kpa));

    assert_eq!(wish(&gripper, Wish::World(Action::PullOut)), Answer::Done);
    assert!(wait_for_event(&gripper, "lost").text.starts_with("LOST"));
    // What is repeated within a second changes nothing.
    while next_observation(&gripper)
        .t_s
        .is_none_or(|t_s| t_s < held_s + 1.5)
    {}
    match wish(&gripper, Wish::Grip) {
        Answer::Refused(why) => assert_eq!(why, "A loss is latched"),
        other => panic!("{other:?}"),
    }
    assert_eq!(wish(&gripper, Wish::Acknowledge), Answer::Done);
}

#[test]
fn what_cannot_be_done_is_refused_with_the_reason() {
    let gripper = gripper(false);
    let payload = |mass_kg| Wish::GripPayload {
        kind: ObjectKind::Sphere,
        mass_kg,
        acceleration_m_s2: 5.0,
    };
    for (wanted, why) in [
        (
            Wish::GripAt(500.0),
            "500 kPa: must lie within 0 and 160 kPa",
        ),
        (Wish::GripAt(f32::NAN), "must lie within 0 and"),
        (payload(60.0), "g would be possible"),
        (payload(-1.0), "mass, kg = -1: must lie within 0 and 65.535"),
        (
            Wish::Set(400, 1e6),
            "grip.grip_pressure_kpa = 1000000: must lie within",
        ),
        (Wish::Set(400, 170.0), "does not go with the other settings"),
        (Wish::Set(9999, 0.0), "there is none of that number"),
    ] {
        match wish(&gripper, wanted) {
            Answer::Refused(told) => assert!(told.contains(why), "{wanted:?}: {told}"),
            done => panic!("{wanted:?}: {done:?}"),
        }
    }
    wish(&gripper, Wish::Grip);
    wait_for_event(&gripper, "holding");
    match wish(&gripper, Wish::World(Action::Appear)) {
        Answer::Refused(why) => assert!(why.contains("fingers are not open"), "{why}"),
        done => panic!("{done:?}"),
    }
}

#[test]
fn settings_are_told_at_the_start_and_when_they_change() {
    let gripper = gripper(false);
    let told = |wanted: f32| {
        wait_for(&gripper, "settings", |told| match told {
            Told::Settings(told) if told.values.get(400) == Some(wanted) => Some(told),
            _ => None,
        })
    };
    let first = told(140.0);
    assert_eq!((first.t_s, first.applied), (Some(0.001), true));
    assert_eq!(wish(&gripper, Wish::Set(400, 120.0)), Answer::Done);
    assert!(told(120.0).applied);
}

#[test]
fn every_tick_is_told_where_ticks_are_wanted() {
    let gripper = gripper(true);
    let (mut ticks, mut looks) = (0_u64, 0);
    while ticks < 500 {
        match gripper.told.recv_timeout(LONG).expect("something") {
            Told::Tick(tick) => {
                ticks += 1;
                assert_eq!(tick.now.micros(), 1_000 * ticks);
            }
            Told::Observation(_) => looks += 1,
            _ => {}
        }
    }
    assert_eq!(looks, 25);
}

/// Why a source cannot be opened.
fn refusal(source: &str, options: &Options) -> String {
    let source: Source = source.parse().expect("a source");
    let error = watch::open(&source, options).err().expect("a refusal");
    format!("{error:#}")
}

#[test]
fn a_debugger_s_stream_needs_the_image_s_elf_file() {
    let source = "defmt:localhost:1";
    let error = refusal(source, &options(false));
    assert!(error.contains("needs --elf FILE"), "{error}");
    let not_elf = Options {
        elf: Some(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml").into()),
        ..options(false)
    };
    let error = refusal(source, &not_elf);
    assert!(error.contains("no ELF file"), "{error}");
}

#[cfg(not(feature = "probe"))]
#[test]
fn a_program_without_probes_says_how_one_is_built_and_how_to_do_without() {
    let error = refusal("probe", &options(false));
    assert!(error.contains("--features probe"), "{error}");
    assert!(error.contains("rtt server start"), "{error}");
}

#[test]
fn an_unknown_source_is_refused_with_what_would_be_right() {
    for text in [
        "",
        "virtual:1",
        "tty:",
        "tcp:host",
        "tcp:host:99999",
        "can0",
    ] {
        let error = text.parse::<Source>().expect_err(text).to_string();
        assert!(
            error.contains("tty:/dev/ttyUSB0, tcp:HOST:PORT, defmt:-, defmt:HOST:PORT, probe"),
            "{error}"
        );
    }
}

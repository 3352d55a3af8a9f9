//! The twin tick by tick, without a clock on the wall.
#![cfg(unix)]

use bus::modbus::{Frame, Request};
use serve::twin::{Ticked, Twin};
use sim::plant::Disturbance;
use sim::setup::Setup;
use softgrip::telemetry::Event;

fn twin() -> Twin {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    let setup = Setup::of(&recipe).expect("a setup");
    Twin::new(&setup, true).expect("a twin")
}

fn tick(twin: &mut Twin) -> Ticked {
    twin.tick(0, &mut |_| {})
}

/// Writes the action request; the ticks that its answer takes, and the answer.
fn write(twin: &mut Twin, words: [u16; 3]) -> (u32, Vec<u8>) {
    let mut data = vec![0x03, 0xE8, 0, 3, 6];
    data.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    let frame = Frame {
        is_broadcast: false,
        code: 16,
        request: Request::decode(16, &data),
    };
    let at_once = twin.request(&frame, &mut |_| {});
    assert!(at_once.is_none());
    let mut ticks = 1;
    loop {
        if let Some(reply) = tick(twin).reply {
            return (ticks, reply.bytes().to_vec());
        }
        ticks += 1;
    }
}

fn object(twin: &Twin) -> u16 {
    twin.register(0x07D0).expect("the status") >> 14
}

/// Holds the object.
fn grip(twin: &mut Twin) {
    write(twin, [0, 0, 0]);
    write(twin, [0x0100, 0, 0]);
    for _ in 0..200 {
        tick(twin);
    }
    // The end of the activation is seen by who asks.
    write(twin, [0x0100, 0, 0]);
    write(twin, [0x0900, 255, 0xFFFF]);
    assert_eq!(object(twin), 0);
    for _ in 0..3000 {
        tick(twin);
    }
    assert_eq!(object(twin), 2);
}

#[test]
fn a_write_is_answered_within_five_ticks_and_shows() {
    let mut twin = twin();
    for words in [
        [0, 0, 0],
        [0x0100, 0, 0],
        [0x0900, 255, 0x80FF],
        [0x0900, 9, 7],
    ] {
        let (ticks, answer) = write(&mut twin, words);
        assert!(ticks <= 5, "{words:?}: {ticks}");
        assert_eq!(answer[..6], [9, 16, 0x03, 0xE8, 0, 3]);
        assert_eq!(twin.register(0x07D1).expect("an echo") & 0xFF, words[1]);
    }
}

#[test]
fn a_lost_object_shows_in_the_tick_of_the_verdict() {
    let mut twin = twin();
    grip(&mut twin);
    twin.plant_mut().world_mut().lower_ground(0.3);
    twin.plant_mut().disturb(Disturbance {
        push_n: [0.0, 0.0, -20.0],
        ..Disturbance::default()
    });
    let is_lost = |ticked: &Ticked| ticked.events.iter().any(|e| matches!(e, Event::Lost(_)));
    let mut ticks = 0;
    loop {
        let ticked = tick(&mut twin);
        let shown = (object(&twin), twin.register(0x1030).expect("a loss") > 0);
        if is_lost(&ticked) {
            assert_eq!(shown, (3, true));
            assert_eq!(twin.register(0x07D1), Some(255));
            break;
        }
        assert_eq!(shown, (2, false));
        ticks += 1;
        assert!(ticks < 2000);
    }
}

#[test]
fn looking_at_a_register_is_no_request() {
    let mut twin = twin();
    write(&mut twin, [0, 0, 0]);
    let requests = twin.register(0x1041);
    assert!(requests.is_some());
    for _ in 0..10 {
        tick(&mut twin);
        assert_eq!(twin.register(0x1041), requests);
    }
    write(&mut twin, [0, 0, 0]);
    assert_eq!(twin.register(0x1041), requests.map(|count| count + 1));
    assert_eq!(twin.register(0x4000), None);
}

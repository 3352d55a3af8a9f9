//! Recordings: written, read, cut off, and done again by the controller.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use serve::script;
use sim::setup::Setup;
use softgrip::table::FINGER;
use watch::recorder::Recorder;
use watch::rerun::{Outcome, Rerun};
use watch::source::Virtual;
use watch::told::EventTold;
use watch::{Answer, Observation, Options, Source, Told, Wish, mcap_file, recording};

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(60);

/// A grasp, a settings change in the middle of it, a loss and its acknowledgement.
const SCRIPT: &str = "
[[step]]
at_s = 0.3
input = 'grip'

[[step]]
when = { event = 'holding' }
after_s = 0.4
object = 'pull out'

[[step]]
when = { event = 'lost' }
after_s = 0.1
input = 'acknowledge'

[[step]]
when = { event = 'acknowledged' }
input = 'release'

[[step]]
after_s = 0.5
end = true
";

/// All that is told of that grasp.
fn grasp() -> Vec<Told> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/rtv225.toml");
    let recipe = finger::recipe::load(path.as_ref()).expect("a recipe");
    let options = Options {
        rate_hz: 50.0,
        with_ticks: true,
        in_real_time: false,
        baud: 115_200,
        id: 9,
        elf: None,
        gripper: Virtual {
            setup: Setup::of(&recipe).expect("a setup"),
            has_object: true,
            script: Some(script::parse(SCRIPT).expect("a script")),
            speed: 4.0,
        },
    };
    let gripper = watch::open(&Source::Virtual, &options).expect("a gripper");
    let wishes = gripper.wishes.expect("it takes wishes");
    let mut told = Vec::new();
    loop {
        let something = gripper.told.recv_timeout(LONG).expect("something");
        let is_held = matches!(&something, Told::Event(event) if event.name == "holding");
        if is_held {
            let set = Wish::Set(300, 20.0);
            assert_eq!(wishes.ask(set).expect("it is there"), Answer::Done);
        }
        let is_over = matches!(something, Told::Ended(_));
        told.push(something);
        if is_over {
            return told;
        }
    }
}

fn write(path: &Path, told: &[Told]) {
    let mut recorder = Recorder::new(path, false).expect("a file");
    for told in told {
        recorder.add(told).expect("room");
    }
    recorder.finish().expect("room");
}

fn read(path: &Path) -> Vec<Told> {
    let mut all = Vec::new();
    let read = recording::read(path, &mut |told| {
        all.push(told);
        Ok(())
    });
    read.expect("a recording");
    all
}

fn rerun(path: &Path, stated: Vec<(u16, f32)>) -> Outcome {
    let mut rerun = Rerun::new(&FINGER, stated);
    recording::read(path, &mut |told| rerun.take(&told)).expect("a recording");
    rerun.outcome()
}

/// Of one kind alone.
fn only<T>(told: &[Told], kind: impl Fn(&Told) -> Option<T>) -> Vec<T> {
    told.iter().filter_map(kind).collect()
}

fn seen(told: &Told) -> Option<Observation> {
    match told {
        Told::Observation(seen) => Some(**seen),
        _ => None,
    }
}

fn event(told: &Told) -> Option<(f64, String)> {
    match told {
        Told::Event(event) => Some((event.t_s, event.name.clone())),
        _ => None,
    }
}

#[test]
fn a_recording_is_read_as_it_was_told_and_repeated_bit_for_bit() {
    let told = grasp();
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("grasp.mcap");
    write(&path, &told);
    let back = read(&path);
    assert_eq!(only(&back, seen), only(&told, seen));
    assert_eq!(only(&back, event), only(&told, event));
    let tick = |told: &Told| match told {
        Told::Tick(tick) => Some(**tick),
        _ => None,
    };
    assert_eq!(only(&back, tick), only(&told, tick));
    let rest = |told: &Told| match told {
        Told::Provenance(_) | Told::Settings(_) => Some(told.clone()),
        _ => None,
    };
    assert_eq!(only(&back, rest), only(&told, rest));

    let outcome = rerun(&path, Vec::new());
    assert_eq!(outcome.difference, None);
    assert!(outcome.from_start && outcome.gaps.is_empty());
    assert_eq!(outcome.codes, outcome.ticks);
    assert_eq!(outcome.snapshots, only(&told, seen).len() as u64);
    let events: Vec<_> = outcome
        .events
        .iter()
        .map(|timed| (timed.t_s, sim::events::name(&timed.event).to_string()))
        .collect();
    assert_eq!(events, only(&told, event));

    // What would have happened at a lower pressure, and is none of what was recorded.
    let other = rerun(&path, vec![(400, 100.0)]);
    let difference = other.difference.expect("another pressure");
    assert!(difference.t_s > 0.3, "{difference:?}");

    begins_later(&dir.path().join("later.mcap"), &told);
    has_a_gap(&dir.path().join("gap.mcap"), &told);
    was_cut_off(&path, &dir.path().join("cut.mcap"), &told);
    as_csv(&dir.path().join("grasp.csv"), &told);
}

/// A recording that begins later is said to.
fn begins_later(path: &Path, told: &[Told]) {
    let is_later = |told: &&Told| match told {
        Told::Tick(tick) => tick.number > 100,
        _ => true,
    };
    let later: Vec<Told> = told.iter().filter(is_later).cloned().collect();
    write(path, &later);
    let outcome = rerun(path, Vec::new());
    assert!(!outcome.from_start);
    assert!(outcome.compared_from_s.is_none_or(|from_s| from_s > 0.1));
}

/// Ticks that are missing are counted, and what follows is another history.
fn has_a_gap(path: &Path, told: &[Told]) {
    let is_kept = |told: &&Told| match told {
        Told::Tick(tick) => !(401..=410).contains(&tick.number),
        _ => true,
    };
    let kept: Vec<Told> = told.iter().filter(is_kept).cloned().collect();
    write(path, &kept);
    let outcome = rerun(path, Vec::new());
    let [(after_s, 10)] = outcome.gaps[..] else {
        panic!("{outcome:?}");
    };
    assert!((after_s - 0.4).abs() < 1e-9, "{after_s}");
    assert!((400..outcome.ticks).contains(&outcome.codes), "{outcome:?}");
}

/// Wherever a recording is cut off, what is whole of it is read, and recovered into a file that is whole.
fn was_cut_off(path: &Path, cut: &Path, told: &[Told]) {
    let bytes = std::fs::read(path).expect("a file");
    let whole = only(told, seen);
    let mut most = 0;
    for end in (8..bytes.len()).step_by(997).chain([bytes.len() - 1]) {
        std::fs::write(cut, &bytes[..end]).expect("room");
        let recovered = cut.with_file_name("recovered.mcap");
        let mut back = Vec::new();
        let is_read = recording::read(cut, &mut |told| {
            back.push(told);
            Ok(())
        });
        if let Err(error) = is_read {
            let error = format!("{error:#}");
            assert!(
                error.contains("nothing of a gripper is whole in it: its end is missing"),
                "{error}"
            );
            assert!(back.is_empty(), "{end} bytes");
            let error = mcap_file::recover(cut, &recovered, false).expect_err("nothing");
            assert!(
                error.to_string().contains("nothing in it is whole"),
                "{error}"
            );
            assert!(!recovered.exists());
            continue;
        }
        let looks = only(&back, seen);
        assert_eq!(looks, whole[..looks.len()], "{end} bytes");
        assert!(
            matches!(back.last(), Some(Told::Note(note)) if note.contains("its end is missing"))
        );

        let again = mcap_file::recover(cut, &recovered, true).expect("a recording");
        assert!(again.missing.is_some());
        let recovered = read(&recovered);
        assert_eq!(only(&recovered, seen), looks);
        assert!(!recovered.iter().any(|told| matches!(told, Told::Note(_))));
        most = most.max(looks.len());
    }
    assert_eq!(most, whole.len(), "all but the end is whole of the longest");

    // A chunk that was damaged is not made up, nor is anything of it taken: the first has more than 1000 bytes.
    let mut damaged = bytes.clone();
    damaged[1_000..1_016].fill(0);
    std::fs::write(cut, &damaged).expect("room");
    let mut looks = Vec::new();
    let _ = recording::read(cut, &mut |told| {
        looks.extend(seen(&told));
        Ok(())
    });
    assert!(looks.len() < whole.len());
    assert_eq!(looks, whole[..looks.len()]);

    std::fs::write(cut, b"t_s,strain1_ue").expect("room");
    let error = recording::read(cut, &mut |_| Ok(())).expect_err("no recording");
    assert!(
        format!("{error:#}").contains("not an MCAP file"),
        "{error:#}"
    );
}

/// A CSV file has the same snapshots and events.
fn as_csv(path: &Path, told: &[Told]) {
    write(path, told);
    let back = read(path);
    // Its times have microseconds.
    let rounded = |told: &Told| {
        seen(told).map(|seen| Observation {
            t_s: seen.t_s.map(|t_s| (1e6 * t_s).round()),
            ..seen
        })
    };
    assert_eq!(only(&back, rounded), only(told, rounded));
    let names = |told: &[Told]| {
        only(told, event)
            .into_iter()
            .map(|(_, name)| name)
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&back), names(told));
    let error = Recorder::new(path, false).err().expect("it is there");
    assert!(error.to_string().contains("--force"), "{error}");
    assert!(Recorder::new(path, true).is_ok());

    let text = "t_s,state,lost\n0.5,idle,0\n0.6,asleep,0\n";
    std::fs::write(path, text).expect("room");
    let error = recording::read(path, &mut |_| Ok(())).expect_err("no state");
    let error = format!("{error:#}");
    assert!(
        error.contains("line 3: state = \"asleep\": must be one of starting, idle"),
        "{error}"
    );
}

/// An MCAP file with one message, and what is wrong with it.
fn refusal(dir: &Path, topic: &str, schema: &str, encoding: &str, options: WriteOptions) -> String {
    let path = dir.join("foreign.mcap");
    let file = std::fs::File::create(&path).expect("room");
    let mut writer = options.create(file).expect("room");
    let schema = writer.add_schema(schema, encoding, b"").expect("room");
    let channel = writer.add_channel(schema, topic, encoding, &BTreeMap::new());
    let header = MessageHeader {
        channel_id: channel.expect("room"),
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    let written = writer.write_to_known_channel(&header, b"{}");
    written.and_then(|()| writer.finish()).expect("room");
    let error = recording::read(&path, &mut |_| Ok(())).expect_err("no gripper's");
    format!("{error:#}")
}

#[test]
fn a_recording_of_something_else_is_refused_by_what_it_is() {
    let dir = tempfile::tempdir().expect("a folder");
    let lz4 = || WriteOptions::new().compression(Some(Compression::Lz4));
    for (topic, schema, encoding) in [
        ("/camera", "foxglove.Log", "protobuf"),
        ("/event", "other.Event", "protobuf"),
        ("/event", "softgrip.Event", "json"),
    ] {
        let error = refusal(dir.path(), topic, schema, encoding, lz4());
        let expected = "foreign.mcap: nothing in it is of a gripper as `softgrip record` writes it";
        assert!(error.contains(expected), "{error}");
        assert!(error.ends_with(&format!("it has {topic}")), "{error}");
    }
    let path = dir.path().join("empty.mcap");
    write(&path, &[]);
    let error = recording::read(&path, &mut |_| Ok(())).expect_err("nothing");
    assert!(
        format!("{error:#}").contains("nothing was recorded"),
        "{error:#}"
    );
}

#[test]
fn a_damaged_chunk_is_not_taken_for_a_missing_end() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("damaged.mcap");
    let event = |t_s| {
        Told::Event(EventTold {
            t_s,
            name: "holding".into(),
            text: "holding".into(),
        })
    };
    write(&path, &[event(1.0), event(2.0)]);
    let mut bytes = std::fs::read(&path).expect("a recording");
    let text = bytes.windows(7).position(|seven| seven == b"holding");
    bytes[text.expect("its first text")] ^= 1;
    std::fs::write(&path, bytes).expect("room");
    let error = recording::read(&path, &mut |_| Ok(())).expect_err("nothing whole");
    let error = format!("{error:#}");
    assert!(error.contains("it is damaged"), "{error}");
    assert!(!error.contains("end is missing"), "{error}");
}

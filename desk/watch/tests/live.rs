//! What a program gets that connects while something is told: the topics of a recording, message by message the same.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};
use settings::Values;
use softgrip::command::{Command, Grip};
use softgrip::units::{AdcCode, DacCode, Instant, Kilopascals};
use softgrip::{FINGERS, RawFrame};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};
use watch::recorder::Recorder;
use watch::tick::Tick;
use watch::told::{EventTold, Provenance, SettingsTold};
use watch::{Observation, Told, recording};

/// Patience with a machine that has much else to do.
const LONG: Duration = Duration::from_secs(60);
const TOPICS: [&str; 5] = ["/snapshot", "/event", "/settings", "/provenance", "/frames"];

/// What is told once, at the start.
fn first() -> Vec<Told> {
    let about = Provenance {
        source: "a test".into(),
        recipe: "rtv225".into(),
        ..Provenance::default()
    };
    let settings = SettingsTold {
        t_s: None,
        values: Values::DEFAULT,
        applied: true,
    };
    vec![Told::Provenance(about), Told::Settings(settings)]
}

/// A hundred ticks, which are one message, with an observation and an event.
fn more() -> Vec<Told> {
    let tick = |number: u16| {
        Told::Tick(Box::new(Tick {
            number: number.into(),
            now: Instant::from_micros(1_000 * u64::from(number)),
            frame: RawFrame {
                gauges: [AdcCode(30_000 + number); FINGERS],
                ..RawFrame::default()
            },
            command: match number {
                50 => Command::Grip(Grip::Pressure(Kilopascals(80.0))),
                _ => Command::Continue,
            },
            dac: DacCode(number),
        }))
    };
    let seen = Observation {
        t_s: Some(0.05),
        pressure_kpa: Some(80.25),
        state: Some(3),
        holding: Some(true),
        ..Observation::default()
    };
    let event = EventTold {
        t_s: 0.06,
        name: "holding".into(),
        text: "HOLDING".into(),
    };
    let ticks = (1..=100).map(tick);
    let rest = [Told::Observation(Box::new(seen)), Told::Event(event)];
    ticks.chain(rest).collect()
}

type Socket = WebSocket<tungstenite::stream::MaybeTlsStream<TcpStream>>;

fn connect(address: SocketAddr) -> Socket {
    let mut request = format!("ws://{address}")
        .into_client_request()
        .expect("an address");
    let protocol = HeaderValue::from_static("foxglove.sdk.v1");
    let headers = request.headers_mut();
    headers.insert("sec-websocket-protocol", protocol);
    let (mut socket, response) = tungstenite::connect(request).expect("a server");
    assert_eq!(
        response.headers()["sec-websocket-protocol"],
        "foxglove.sdk.v1"
    );
    if let tungstenite::stream::MaybeTlsStream::Plain(stream) = socket.get_mut() {
        stream.set_read_timeout(Some(LONG)).expect("a limit");
    }
    socket
}

/// The next message of the protocol that says this.
fn says(socket: &mut Socket, op: &str) -> Value {
    loop {
        if let Message::Text(text) = socket.read().expect("a message") {
            let value: Value = serde_json::from_str(&text).expect("JSON");
            if value["op"] == op {
                return value;
            }
        }
    }
}

/// A message: its topic's number, and its bytes.
fn data(socket: &mut Socket) -> (usize, Vec<u8>) {
    loop {
        if let Message::Binary(bytes) = socket.read().expect("a message") {
            // Operation, subscription, time, data.
            let (head, data) = bytes.split_at(13);
            assert_eq!(head[0], 1);
            let topic = u32::from_le_bytes(head[1..5].try_into().expect("four bytes"));
            return (topic as usize, data.to_vec());
        }
    }
}

/// Subscribes to all topics, each under its number in [`TOPICS`].
fn subscribe(socket: &mut Socket, advertised: &Value) {
    let channels = advertised["channels"].as_array().expect("channels");
    let of = |topic: &str| channels.iter().find(|channel| channel["topic"] == topic);
    let wanted = (0..).zip(TOPICS).map(|(id, topic): (u32, _)| {
        let channel = of(topic).expect("a channel for each topic");
        json!({ "id": id, "channelId": channel["id"] })
    });
    let wanted: Vec<Value> = wanted.collect();
    let request = json!({ "op": "subscribe", "subscriptions": wanted });
    let request = Message::text(request.to_string());
    socket.send(request).expect("it is there");
}

/// A topic of a recording.
struct Recorded {
    schema_name: String,
    schema: Vec<u8>,
    messages: Vec<Vec<u8>>,
}

/// A recording, by topic.
fn recorded(path: &Path) -> BTreeMap<String, Recorded> {
    let bytes = std::fs::read(path).expect("a recording");
    let mut topics = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("a recording") {
        let message = message.expect("a message");
        let schema = message.channel.schema.clone().expect("a schema");
        let topic = topics.entry(message.channel.topic.clone());
        let topic = topic.or_insert_with(|| Recorded {
            schema_name: schema.name.clone(),
            schema: schema.data.to_vec(),
            messages: Vec::new(),
        });
        topic.messages.push(message.data.to_vec());
    }
    topics
}

#[test]
fn a_program_that_connects_gets_what_is_recorded_and_what_was_told_before() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("told.mcap");
    let mut file = Recorder::new(&path, false).expect("a file");
    let (mut live, address) = Recorder::live(([127, 0, 0, 1], 0).into()).expect("a port");
    let mut tell = |all: &[Told]| {
        for told in all {
            file.add(told).expect("room");
            live.add(told).expect("it serves");
        }
    };
    tell(&first());

    let mut socket = connect(address);
    assert_eq!(says(&mut socket, "serverInfo")["name"], "softgrip");
    let advertised = says(&mut socket, "advertise");
    subscribe(&mut socket, &advertised);
    // What was told before it came, in the order of subscription; the other topics have been subscribed by then but the last,
    // which comes right behind.
    let mut got = vec![data(&mut socket), data(&mut socket)];
    assert_eq!([got[0].0, got[1].0], [2, 3]);
    // An answer to something else, behind all subscriptions.
    socket
        .send(Message::Ping("all?".into()))
        .expect("it is there");
    while !matches!(socket.read().expect("a message"), Message::Pong(_)) {}
    tell(&more());
    got.extend((0..3).map(|_| data(&mut socket)));
    file.finish().expect("room");

    let recorded = recorded(&path);
    let channels = advertised["channels"].as_array().expect("channels");
    assert_eq!(channels.len(), TOPICS.len());
    for (number, topic) in TOPICS.into_iter().enumerate() {
        let recorded = &recorded[topic];
        let mut all = channels.iter();
        let channel = all.find(|channel| channel["topic"] == topic);
        let channel = channel.expect("a channel for each topic");
        assert_eq!(channel["encoding"], "protobuf");
        assert_eq!(channel["schemaName"], recorded.schema_name);
        let encoded = channel["schema"].as_str().expect("a schema");
        let advertised = data_encoding::BASE64.decode(encoded.as_bytes());
        assert_eq!(advertised.expect("base 64"), recorded.schema);
        let of_topic = got.iter().filter(|(of, _)| *of == number);
        let of_topic: Vec<_> = of_topic.map(|(_, bytes)| bytes.clone()).collect();
        assert_eq!(of_topic, recorded.messages, "{topic}");
    }
    means_what_was_told(&dir.path().join("got.mcap"), &recorded, &got);
}

/// What was got is what was told, to whoever reads it as a recording.
fn means_what_was_told(
    path: &Path,
    recorded: &BTreeMap<String, Recorded>,
    got: &[(usize, Vec<u8>)],
) {
    let file = std::fs::File::create(path).expect("room");
    let mut writer = mcap::Writer::new(file).expect("a file");
    for (topic, bytes) in got {
        let about = &recorded[TOPICS[*topic]];
        let schema = writer.add_schema(&about.schema_name, "protobuf", &about.schema);
        let schema = schema.expect("room");
        let channel = writer.add_channel(schema, TOPICS[*topic], "protobuf", &BTreeMap::new());
        let header = mcap::records::MessageHeader {
            channel_id: channel.expect("a channel"),
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        let written = writer.write_to_known_channel(&header, bytes);
        written.expect("room");
    }
    writer.finish().expect("room");
    let mut back = Vec::new();
    let read = recording::read(path, &mut |told| {
        back.push(told);
        Ok(())
    });
    read.expect("a recording");
    let told = [first(), more()].concat();
    assert_eq!(back.len(), told.len());
    for told in told {
        assert!(back.contains(&told), "{told:?}");
    }
}

#[test]
fn a_port_that_is_taken_is_told() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("its address");
    let error = Recorder::live(address).err().expect("it is taken");
    let error = format!("{error:#}");
    let expected = format!("{address}: cannot listen there: choose another port");
    assert!(error.starts_with(&expected), "{error}");
    assert!(error.contains("in use"), "{error}");
}

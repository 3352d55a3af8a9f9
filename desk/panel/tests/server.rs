//! The server below the page: what it refuses, and that no page holds up the source.

mod served;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{self, Sender};
use std::time::{Duration, Instant};

use panel::server::{End, Server};
use serde_json::{Value, json};
use served::Served;
use tungstenite::{Message, WebSocket};
use watch::{Connection, Observation, Told};

/// A busy machine takes its time.
const PATIENCE: Duration = Duration::from_secs(60);

fn served() -> (Served, Sender<Told>) {
    let (sender, told) = mpsc::channel();
    let connection = Connection {
        name: "a test".into(),
        rate_hz: 50.0,
        told,
        wishes: None,
    };
    (Served::of(connection, false), sender)
}

/// An observation in another state than the one before, so that it is not left out for being early.
fn observation(n: u16, t_s: f64) -> Told {
    Told::Observation(Box::new(Observation {
        t_s: Some(t_s),
        state: Some(n % 2 + 1),
        ..Observation::default()
    }))
}

/// What the server answers to these bytes.
fn answer(served: &Served, request: &str) -> String {
    let mut stream = TcpStream::connect(served.host()).expect("a connection");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

struct Page(WebSocket<TcpStream>);

impl Page {
    fn open(served: &Served) -> Self {
        let stream = TcpStream::connect(served.host()).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let url = format!("ws://{}/socket", served.host());
        let (socket, _) = tungstenite::client(url, stream).expect("a handshake");
        Self(socket)
    }

    fn send(&mut self, text: &str) {
        self.0.send(Message::text(text)).expect("sent");
    }

    /// The next message with this name.
    fn next(&mut self, name: &str) -> Value {
        let began = Instant::now();
        loop {
            assert!(began.elapsed() < PATIENCE, "no {name}");
            let Message::Text(text) = self.0.read().expect("a message") else {
                continue;
            };
            let mut message: Value = serde_json::from_str(&text).expect("JSON");
            if let Some(body) = message.get_mut(name) {
                return body.take();
            }
        }
    }
}

#[test]
fn the_page_and_its_files_are_served_and_nothing_else() {
    let (served, _told) = served();
    let get = |path: &str| {
        let request = format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", served.host());
        answer(&served, &request)
    };
    let page = get("/");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
    assert!(page.contains("default-src 'self'") && page.contains("<!doctype html>"));
    assert!(get("/uplot/LICENSE").contains("MIT License"));
    for path in ["/../Cargo.toml", "/page", "/index.html", "//", "/%2e%2e/"] {
        assert!(get(path).starts_with("HTTP/1.1 404 "), "{path}");
    }
    assert!(get("/socket").starts_with("HTTP/1.1 426 "));
}

#[test]
fn a_request_that_is_none_and_one_from_another_page_are_refused() {
    let (served, _told) = served();
    let host = served.host();
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    for (request, status) in [
        ("\u{1}\u{2}\u{3}\r\n\r\n".to_string(), "400"),
        (format!("POST / HTTP/1.1\r\nHost: {host}\r\n\r\n"), "405"),
        ("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n".into(), "403"),
        (
            format!(
                "GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://evil.example\r\n{upgrade}\r\n"
            ),
            "403",
        ),
        (
            format!(
                "GET /socket HTTP/1.1\r\nHost: rebound.example\r\nOrigin: http://rebound.example\r\n{upgrade}\r\n"
            ),
            "403",
        ),
    ] {
        let answer = answer(&served, &request);
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status} ")),
            "{request}: {answer}"
        );
    }
}

#[test]
fn a_message_that_cannot_be_read_is_answered_and_counted() {
    let (served, _told) = served();
    let mut page = Page::open(&served);
    for (count, text) in ["nonsense", "{}", "{\"id\":1}"].iter().enumerate() {
        page.send(text);
        let answer = page.next("answer");
        assert_eq!(answer["malformed"], json!(count + 1));
        let error = answer["error"].as_str().expect("an error");
        assert!(error.starts_with("not a message"), "{error}");
    }
    // What is too long to be one ends the connection.
    page.send(&"x".repeat(100_000));
    drop(page);
    let mut page = Page::open(&served);
    page.next("hello");
    drop(page);
    let (summary, _) = served.end();
    assert_eq!((summary.pages, summary.malformed >= 3), (2, true));
}

#[test]
fn a_wrong_token_is_none() {
    let (served, _told) = served();
    let mut page = Page::open(&served);
    assert_eq!(page.next("standing")["standing"], "no_token");
    page.send(r#"{"token":"0123456789abcdef0123456789abcdef"}"#);
    assert_eq!(page.next("standing")["standing"], "wrong_token");
    page.send(r#"{"id":1,"do":"stop"}"#);
    let answer = page.next("answer");
    assert!(
        answer["error"]
            .as_str()
            .is_some_and(|why| why.contains("wrong token")),
        "{answer}"
    );
}

#[test]
fn an_order_to_a_source_that_takes_none_says_so() {
    let (served, _told) = served();
    let mut page = Page::open(&served);
    let (_, token) = served.with_token.split_once("token=").expect("a token");
    page.send(&json!({ "token": token }).to_string());
    page.send(r#"{"id":5,"do":"grip"}"#);
    let answer = page.next("answer");
    assert_eq!(answer["id"], 5);
    assert_eq!(answer["error"], "this source takes no commands");
}

#[test]
fn a_port_that_is_taken_is_refused_with_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address: SocketAddr = taken.local_addr().expect("an address");
    let error = Server::open(address).err().expect("taken");
    let error = format!("{error:#}");
    assert!(
        error.contains("choose another port with --listen"),
        "{error}"
    );
}

#[test]
fn the_end_of_the_source_is_told_to_pages_and_terminal() {
    let (served, told) = served();
    let mut page = Page::open(&served);
    told.send(Told::Failed("the line is gone".into()))
        .expect("sent");
    let line = page.next("log");
    assert_eq!(line["ended"], true);
    assert!(
        line["text"]
            .as_str()
            .is_some_and(|text| text.contains("the line is gone")),
        "{line}"
    );
    // One that comes later is told, too.
    let line = Page::open(&served).next("log");
    assert_eq!(line["ended"], true);
    let (_, ended) = served.end();
    assert_eq!(ended, [End::Failed("the line is gone".into())]);
}

#[test]
fn a_page_that_reads_nothing_holds_up_neither_the_source_nor_another_page() {
    let (served, told) = served();
    let _deaf = Page::open(&served);
    let mut page = Page::open(&served);
    for n in 0..20_000 {
        told.send(observation(n, 0.02 * f64::from(n)))
            .expect("sent");
    }
    let mut last = 0;
    loop {
        let frame = page.next("frame");
        let n = frame["n"].as_u64().expect("a number");
        assert!(n > last, "{n} after {last}");
        last = n;
        page.send(r#"{"seen":1000000}"#);
        if n == 20_000 {
            break;
        }
    }
}

#[test]
fn observations_that_should_have_come_are_counted() {
    let (served, told) = served();
    let mut page = Page::open(&served);
    for (n, t_s) in [1.0, 1.02, 1.041, 1.3, 1.319].into_iter().enumerate() {
        told.send(observation(n as u16, t_s)).expect("sent");
    }
    // At 50 Hz there are twelve between 1.041 and 1.3 s.
    loop {
        let frame = page.next("frame");
        if frame["t_s"].as_f64().is_some_and(|t_s| t_s > 1.29) {
            assert_eq!(frame["dropped"], 12);
            break;
        }
    }
}

//! The port at which a browser finds the page.

use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::RecvTimeoutError;
use std::thread;
use std::time::Duration;

use anyhow::Context;
use watch::{Connection, Told};

use crate::bundle;
use crate::hand::Hand;
use crate::http::{self, Refusal, Request};
use crate::hub::Hub;
use crate::session::{self, Place};
use crate::tell::{About, Teller};
use crate::token::Token;

/// So many connections at once: sixteen pages, and the files that some browsers ask for.
const MOST_CONNECTIONS: usize = 64;
/// A browser that does not take a file for so long has gone.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often it is seen that the program is to end.
const LOOK: Duration = Duration::from_millis(100);

/// A port at which somebody listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: Token,
}

/// Why nothing more comes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// As it should be.
    Ended(String),
    /// Something is wrong.
    Failed(String),
}

/// How it went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// Pages that there were.
    pub pages: u64,
    /// Messages from pages that could not be read.
    pub malformed: u64,
}

impl Server {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// If the port is taken, or may not be used.
    pub fn open(address: SocketAddr) -> anyhow::Result<Self> {
        let listener = TcpListener::bind(address).with_context(|| {
            format!(
                "{address}: cannot listen there: choose another port with --listen, or port 0 for any that is free"
            )
        })?;
        Ok(Self {
            address: listener.local_addr()?,
            listener,
            token: Token::random(),
        })
    }

    /// Where the page is, without what lets it command.
    pub fn address(&self) -> String {
        // A browser cannot go to all addresses of a machine.
        let ip = match self.address.ip() {
            ip if ip.is_unspecified() && ip.is_ipv6() => "[::1]".into(),
            ip if ip.is_unspecified() => "127.0.0.1".into(),
            ip if ip.is_ipv6() => format!("[{ip}]"),
            ip => ip.to_string(),
        };
        format!("http://{ip}:{}/", self.address.port())
    }

    /// The same with what lets it command. A browser keeps what stands behind the `#` to itself.
    pub fn address_with_token(&self) -> String {
        format!("{}#token={}", self.address(), self.token.as_str())
    }

    /// Whether pages of this machine alone can reach it.
    pub fn is_local(&self) -> bool {
        self.address.ip().is_loopback()
    }

    /// Shows what a connection tells until `stop`, also when nothing more comes; then that is said by `ended`.
    pub fn run(
        self,
        connection: Connection,
        hand: Hand,
        world: bool,
        stop: &AtomicBool,
        ended: &mut impl FnMut(End),
    ) -> Summary {
        let about = About {
            name: connection.name,
            rate_hz: connection.rate_hz,
            commands: connection.wishes.is_some(),
            world,
        };
        let mut teller = Teller::new(hand, &about);
        let hub = Arc::new(Hub::new(self.token.clone()));
        let place = Place {
            hub: Arc::clone(&hub),
            hello: teller.hello(&about).into(),
            wishes: connection.wishes,
        };
        let is_local = self.is_local();
        // It ends with the program: it has nothing to lose.
        named("panel-accept", move || {
            accept(&self.listener, is_local, &place)
        });
        let mut told = Some(connection.told);
        while !stop.load(SeqCst) {
            let Some(source) = &told else {
                thread::sleep(LOOK);
                continue;
            };
            let news = match source.recv_timeout(LOOK) {
                Ok(news) => news,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => {
                    Told::Failed("it has stopped without a word".into())
                }
            };
            teller.tell(&hub, &news);
            let end = match news {
                Told::Ended(why) => End::Ended(why),
                Told::Failed(why) => End::Failed(why),
                _ => continue,
            };
            ended(end);
            told = None;
        }
        let (malformed, pages) = hub.counts();
        Summary { pages, malformed }
    }
}

/// A thread for each connection.
fn accept(listener: &TcpListener, is_local: bool, place: &Place) {
    let connections = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // The system is short of something for the moment.
            thread::sleep(LOOK);
            continue;
        };
        if connections.fetch_add(1, SeqCst) >= MOST_CONNECTIONS {
            connections.fetch_sub(1, SeqCst);
            let refusal = Refusal::new("503 Service Unavailable", "too many connections");
            reply(&stream, &refusal.answer());
            continue;
        }
        let (place, connections) = (place.clone(), Arc::clone(&connections));
        named("panel-page", move || {
            serve(stream, is_local, place);
            connections.fetch_sub(1, SeqCst);
        });
    }
}

/// Runs a thread whose name tells what its time goes into.
fn named(name: &str, work: impl FnOnce() + Send + 'static) {
    // Without one there is no page, and a connection ends; the gripper is not concerned.
    let _ = thread::Builder::new().name(name.into()).spawn(work);
}

/// Sends an answer to a browser; one that has gone does not take it.
fn reply(mut stream: &TcpStream, answer: &[u8]) {
    let _ = stream.set_write_timeout(Some(PATIENCE));
    let _ = stream.write_all(answer);
    let _ = stream.shutdown(Shutdown::Write);
}

fn serve(mut stream: TcpStream, is_local: bool, place: Place) {
    if stream.set_read_timeout(Some(PATIENCE)).is_err() {
        return;
    }
    let request = http::read(&mut stream).and_then(|request| {
        http::check_origin(&request, is_local)?;
        Ok(request)
    });
    let answer = match request {
        Ok(Request {
            path, key, rest, ..
        }) if path == "/socket" => match key {
            Some(key) => {
                if stream
                    .write_all(http::accept_socket(&key).as_bytes())
                    .is_ok()
                {
                    session::serve(stream, rest, place);
                }
                return;
            }
            None => {
                let why = "there is a WebSocket here, and nothing else";
                Refusal::new("426 Upgrade Required", why).answer()
            }
        },
        Ok(Request { path, .. }) => match bundle::at(&path) {
            Some(file) => http::answer("200 OK", file.content_type, file.text.as_bytes()),
            None => Refusal::new("404 Not Found", format!("there is no {path}")).answer(),
        },
        Err(refusal) => refusal.answer(),
    };
    reply(&stream, &answer);
}

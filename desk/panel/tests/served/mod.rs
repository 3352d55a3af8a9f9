//! A page that is served in this process.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::thread::{self, JoinHandle};

use panel::hand::Hand;
use panel::server::{End, Server, Summary};
use sim::setup::Setup;
use watch::source::Virtual;
use watch::{Connection, Options, Source};

/// A panel that ends with this.
pub struct Served {
    pub address: String,
    pub with_token: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<(Summary, Vec<End>)>>,
}

fn setup() -> Setup {
    let text = include_str!("../../../../recipes/rtv225.toml");
    let recipe = finger::recipe::parse(Path::new("rtv225.toml"), text).expect("a recipe");
    Setup::of(&recipe).expect("a setup")
}

impl Served {
    /// Of a connection.
    pub fn of(connection: Connection, world: bool) -> Self {
        let server = Server::open(SocketAddr::from(([127, 0, 0, 1], 0))).expect("a port");
        let (address, with_token) = (server.address(), server.address_with_token());
        let hand = Hand::of(&setup());
        let stop = Arc::new(AtomicBool::new(false));
        let until = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("panel-tell".into())
            .spawn(move || {
                let mut ended = Vec::new();
                let summary = server.run(connection, hand, world, &until, &mut |end| {
                    ended.push(end);
                });
                (summary, ended)
            });
        let thread = thread.expect("a thread");
        Self {
            address,
            with_token,
            stop,
            thread: Some(thread),
        }
    }

    /// Of the virtual gripper around a sphere of 150 g.
    #[allow(dead_code, reason = "not every test has one")]
    pub fn virtual_gripper() -> Self {
        let options = Options {
            rate_hz: 50.0,
            with_ticks: false,
            in_real_time: true,
            elf: None,
            baud: 115_200,
            id: 9,
            gripper: Virtual {
                setup: setup(),
                has_object: true,
                script: None,
                speed: 1.0,
            },
        };
        let connection = watch::open(&Source::Virtual, &options).expect("a connection");
        Self::of(connection, true)
    }

    /// Host and port.
    #[allow(dead_code, reason = "not every test looks below the page")]
    pub fn host(&self) -> &str {
        let address = self.address.strip_prefix("http://").expect("an address");
        address.trim_end_matches('/')
    }

    /// Ends it, and says how it went, and what was said of the source's end.
    #[allow(dead_code, reason = "not every test asks")]
    pub fn end(mut self) -> (Summary, Vec<End>) {
        self.stop.store(true, SeqCst);
        let thread = self.thread.take().expect("a thread");
        thread.join().expect("an end")
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

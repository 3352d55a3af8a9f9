//! The virtual gripper in real time: one loop that looks at the port, takes requests and makes the ticks that are due.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant as WallClock};

use bus::modbus::{Receiver, Reply, STALE_US, Timing};
use softgrip::TICK_US;
use softgrip::units::Instant;

use crate::io::Came;
use crate::pace::Pace;
use crate::play::{Flow, Orders, Play, Seen};
use crate::port::Port;
use crate::twin::{Ticked, Twin};

/// How the virtual gripper runs.
pub struct Options {
    /// Its seconds in one second.
    pub speed: f64,
    /// What happens to it.
    pub play: Option<Play>,
    /// What somebody wants to happen to it meanwhile.
    pub orders: Option<Orders>,
}

/// Something that has happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// When, by the gripper's own clock, s.
    pub t_s: f64,
    /// What.
    pub text: String,
}

/// How it went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Ticks that were made.
    pub ticks: u64,
    /// Those that began when the next one was due already.
    pub late: u64,
    /// How late the latest one was.
    pub worst: Duration,
    /// How far the gripper's own clock is behind, because the machine was too slow.
    pub lost: Duration,
    /// Answers that were sent.
    pub answers: u64,
}

/// A byte, and the earliest moment at which it can have come.
type Byte = (Instant, u8);

/// No more bytes wait than a few of the longest requests have; the system holds back what else a client sends.
const MOST_BYTES: usize = 1024;

/// The line, from bytes to requests.
struct Inlet {
    receiver: Receiver,
    bytes: VecDeque<Byte>,
    began: WallClock,
    /// When the port was last looked at: what is found now has come since.
    looked: Instant,
    /// When the request that waits can have come at the earliest.
    asked: Instant,
    /// Who sent it is still there.
    is_heard: bool,
    answers: u64,
}

impl Inlet {
    fn new(id: u8) -> Self {
        Self {
            receiver: Receiver::new(id, Timing::stream()),
            bytes: VecDeque::new(),
            began: WallClock::now(),
            looked: Instant::from_micros(0),
            asked: Instant::from_micros(0),
            is_heard: false,
            answers: 0,
        }
    }

    /// The clock on the wall: clients have no other.
    fn now(&self) -> Instant {
        Instant::from_micros(self.began.elapsed().as_micros() as u64)
    }

    /// Looks at the port. What a client asked that has gone is done, and the answer not sent to the next one.
    fn look(&mut self, port: &mut Port, say: &mut impl FnMut(String)) {
        if self.bytes.len() >= MOST_BYTES {
            return;
        }
        let mut bytes = [0; MOST_BYTES];
        let now = self.now();
        match port.read(&mut bytes) {
            Came::Nothing => {}
            Came::Bytes(count) => {
                let looked = self.looked;
                let bytes = bytes.get(..count).unwrap_or_default();
                self.bytes.extend(bytes.iter().map(|&byte| (looked, byte)));
            }
            Came::Client(text) => {
                say(text);
                self.forget();
            }
            Came::Left => {
                say("the client has gone".into());
                self.forget();
            }
        }
        self.looked = now;
    }

    fn forget(&mut self) {
        self.bytes.clear();
        self.receiver.forget();
        self.is_heard = false;
    }

    /// Takes the next request, once the one before is answered.
    fn take(&mut self, port: &mut Port, twin: &mut Twin, say: &mut impl FnMut(String)) {
        while !twin.is_waiting() {
            let byte = self.bytes.pop_front();
            if let Some((came, byte)) = byte {
                self.receiver.receive(came, byte);
                self.asked = came;
            }
            let is_late = self.is_late();
            // By the clock of the bytes: it stands still while they are taken, however late that is.
            let now = byte.map_or(self.looked, |(came, _)| came);
            match self.receiver.frame(now) {
                Some(frame) if !is_late => {
                    self.is_heard = true;
                    if let Some(reply) = twin.request(&frame, say) {
                        self.answer(port, &reply);
                    }
                }
                None if byte.is_none() => break,
                _ => {}
            }
        }
    }

    /// Whether who asked may have given up.
    fn is_late(&self) -> bool {
        self.now().micros_since(self.asked) > STALE_US
    }

    /// Sends an answer, but none that comes too late: who asked has given up, and would take it for that to its next
    /// question.
    fn answer(&mut self, port: &mut Port, reply: &Reply) {
        if self.is_heard && !self.is_late() && !reply.bytes().is_empty() {
            port.write(reply.bytes());
            self.answers += 1;
        }
    }
}

/// Runs until `stop`, or until the script ends it. `observe` sees every tick.
pub fn run(
    mut port: Port,
    mut twin: Twin,
    options: Options,
    stop: &AtomicBool,
    log: &mut impl FnMut(Line),
    observe: &mut impl FnMut(&Ticked),
) -> Summary {
    let Options {
        speed,
        mut play,
        mut orders,
    } = options;
    let mut pace = Pace::new(speed);
    let mut inlet = Inlet::new(twin.id());
    let mut flow = Flow::GoesOn;
    while flow == Flow::GoesOn && !stop.load(Relaxed) {
        let t_s = twin.t_s();
        let mut say = |text| log(Line { t_s, text });
        inlet.look(&mut port, &mut say);
        inlet.take(&mut port, &mut twin, &mut say);
        if let Some(left) = pace.left() {
            port.wait(left);
            continue;
        }
        if pace.tick() {
            say("this machine is too slow: the gripper's clock stands still at times".into());
        }
        let ticked = twin.tick(inlet.receiver.damaged(), &mut say);
        if let Some(reply) = &ticked.reply {
            inlet.answer(&mut port, reply);
        }
        observe(&ticked);
        if let Some(play) = &mut play {
            flow = step(play, &mut twin, &ticked, &mut say);
        }
        if let Some(orders) = &mut orders {
            let ends = orders.step(twin.plant_mut(), &ticked.truth) == Flow::Ends;
            if let Some(input) = orders.take_input() {
                twin.press(input);
            }
            if ends {
                flow = Flow::Ends;
            }
        }
    }
    Summary {
        ticks: twin.now().micros_since(Instant::from_micros(0)) / TICK_US,
        late: pace.late(),
        worst: pace.worst(),
        lost: pace.lost(),
        answers: inlet.answers,
    }
}

/// What the script does after a tick.
fn step(play: &mut Play, twin: &mut Twin, ticked: &Ticked, say: &mut impl FnMut(String)) -> Flow {
    let shown = play.register().and_then(|address| twin.register(address));
    let seen = Seen {
        truth: &ticked.truth,
        events: &ticked.events,
        register: shown,
    };
    let flow = play.step(twin.plant_mut(), &seen, say);
    if let Some(input) = play.take_input() {
        twin.press(input);
    }
    flow
}

//! One page: what it sends and what it gets, in a thread of its own.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;
use serve::script::Action;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message as Sent, WebSocket};
use watch::{Answer, Wish, Wishes};

use crate::hub::{Board, Hub, PageId, Seen, Standing};
use crate::order::{self, Message, Order, Problem};
use crate::tell;

/// The longest message of a page is a tenth of that.
const LONGEST_MESSAGE: usize = 4096;
/// What is new waits so long for its page, at most.
const LOOK: Duration = Duration::from_millis(10);
/// A page gets a frame this often, with the samples since the last one. Each costs a browser more than what is in it.
const FRAME: Duration = Duration::from_millis(120);
/// So many frames may be on their way to a page that has not seen them: more would only be older when they arrive.
const MOST_UNSEEN: u64 = 5;
/// So many orders of a page may wait for their answers.
const MOST_WAITING: usize = 8;
/// A page that can be sent nothing for so long has gone …
const PATIENCE: Duration = Duration::from_secs(2);
/// … and one that is silent for so long, though it is asked this often.
const SILENCE: Duration = Duration::from_secs(6);
const PING: Duration = Duration::from_secs(2);

/// What all pages have in common.
#[derive(Clone)]
pub struct Place {
    /// What they see.
    pub hub: Arc<Hub>,
    /// What each gets first.
    pub hello: Arc<str>,
    /// Takes wishes, if the source does.
    pub wishes: Option<Wishes>,
}

/// The answer to an order.
type Answered = (u64, Result<(), Problem>);

struct Session {
    place: Place,
    page: PageId,
    /// The page has shown a token: whether it is the right one.
    token: Option<bool>,
    told: Option<Standing>,
    seen: Seen,
    /// Frames that were sent, and those of them that have arrived.
    sent: u64,
    arrived: u64,
    last_frame: Instant,
    waiting: usize,
    answers: Receiver<Answered>,
    answer: Sender<Answered>,
}

/// Serves a page until it has gone. `rest` came behind its handshake.
pub fn serve(stream: TcpStream, rest: Vec<u8>, place: Place) {
    let Some(page) = place.hub.enter() else {
        return;
    };
    let hub = Arc::clone(&place.hub);
    // A socket that refuses these, or that breaks, is a page that has gone.
    let _ = run(stream, rest, place, page);
    hub.leave(page);
}

fn run(stream: TcpStream, rest: Vec<u8>, place: Place, page: PageId) -> Result<(), Error> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let config = WebSocketConfig::default()
        .read_buffer_size(LONGEST_MESSAGE)
        .write_buffer_size(0)
        .max_message_size(Some(LONGEST_MESSAGE))
        .max_frame_size(Some(LONGEST_MESSAGE));
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let (answer, answers) = mpsc::channel();
    let mut session = Session {
        page,
        token: None,
        told: None,
        seen: Seen::default(),
        sent: 0,
        arrived: 0,
        last_frame: Instant::now(),
        waiting: 0,
        answers,
        answer,
        place,
    };
    socket.send(text(&session.place.hello))?;
    let (mut heard, mut asked) = (Instant::now(), Instant::now());
    while heard.elapsed() < SILENCE {
        match socket.read() {
            Ok(sent) => {
                heard = Instant::now();
                session.receive(&mut socket, &sent)?;
            }
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(Error::Capacity(_)) => {
                session.place.hub.count_malformed();
                break;
            }
            Err(error) => return Err(error),
        }
        if asked.elapsed() > PING {
            asked = Instant::now();
            socket.send(Sent::Ping(Vec::new().into()))?;
        }
        session.send_news(&mut socket)?;
    }
    socket.close(None)
}

fn text(text: &str) -> Sent {
    Sent::Text(text.into())
}

impl Session {
    fn standing(&self) -> Standing {
        match self.token {
            None => Standing::NoToken,
            Some(false) => Standing::WrongToken,
            Some(true) => self.place.hub.standing(self.page),
        }
    }

    fn send_news(&mut self, socket: &mut WebSocket<TcpStream>) -> Result<(), Error> {
        let standing = self.standing();
        if self.told != Some(standing) {
            self.told = Some(standing);
            let told = json!({ "standing": { "standing": standing.name() } });
            socket.send(text(&told.to_string()))?;
        }
        while let Ok((id, result)) = self.answers.try_recv() {
            self.waiting -= 1;
            send_answer(socket, id, result)?;
        }
        let takes_frame = self.sent.saturating_sub(self.arrived) < MOST_UNSEEN;
        let is_due = self.last_frame.elapsed() >= FRAME;
        let news = self.place.hub.news(&mut self.seen, takes_frame, is_due);
        // A frame may be a little older than the last line, and none is newer than the next frame.
        if let Some(frame) = news.frame {
            self.sent += 1;
            self.last_frame = Instant::now();
            let samples = news.samples.join(",");
            socket.send(text(&format!(
                "{{\"samples\":[{samples}],\"frame\":{frame}}}"
            )))?;
        }
        for news in news.boards.iter().chain(&news.lines) {
            socket.send(text(news))?;
        }
        Ok(())
    }

    fn receive(&mut self, socket: &mut WebSocket<TcpStream>, sent: &Sent) -> Result<(), Error> {
        let read = match sent {
            Sent::Text(text) => order::read(text),
            Sent::Binary(_) => Err("not a message: it must be text".into()),
            Sent::Ping(_) | Sent::Pong(_) | Sent::Close(_) | Sent::Frame(_) => return Ok(()),
        };
        match read {
            Ok(Message::Token(token)) => {
                let is_right = self.place.hub.token().is(&token);
                self.token = Some(is_right);
                if is_right {
                    self.place.hub.take_over(self.page);
                }
                Ok(())
            }
            Ok(Message::Seen(count)) => {
                self.arrived = count.min(self.sent);
                Ok(())
            }
            Ok(Message::Order(id, order)) => {
                match order.and_then(|order| self.carry_out(id, order)) {
                    Ok(true) => send_answer(socket, id, Ok(())),
                    Ok(false) => Ok(()),
                    Err(problem) => send_answer(socket, id, Err(problem)),
                }
            }
            Err(why) => {
                let count = self.place.hub.count_malformed();
                let answer = json!({ "answer": { "error": why, "malformed": count } });
                socket.send(text(&answer.to_string()))
            }
        }
    }

    /// Whether an order is done already; else it is answered later.
    fn carry_out(&mut self, id: u64, order: Order) -> Result<bool, Problem> {
        let why = match (self.standing(), &order) {
            (Standing::NoToken, _) => {
                "this page has no token: open the address that the terminal prints"
            }
            (Standing::WrongToken, _) => {
                "this page has a wrong token: open the address that the terminal prints"
            }
            // Whoever may command may stop.
            (_, Order::Stop)
            | (Standing::Commands, _)
            | (Standing::NobodyCommands, Order::TakeOver) => "",
            (Standing::AnotherCommands, _) => "another page commands: it must be closed first",
            (Standing::NobodyCommands, Order::Wishes(_)) => {
                "this page only watches: take over first"
            }
        };
        if !why.is_empty() {
            return Err(refused(why));
        }
        let wishes = match order {
            Order::TakeOver => {
                self.place.hub.take_over(self.page);
                return Ok(true);
            }
            Order::Stop => vec![Wish::Stop],
            Order::Wishes(wishes) => wishes,
        };
        let Some(source) = self.place.wishes.clone() else {
            return Err(refused("this source takes no commands"));
        };
        if self.waiting >= MOST_WAITING && wishes != [Wish::Stop] {
            return Err(refused("too many commands wait for their answers"));
        }
        self.waiting += 1;
        let (answer, hub) = (self.answer.clone(), Arc::clone(&self.place.hub));
        // The page goes on meanwhile: a real gripper may take its time, or be gone.
        thread::spawn(move || {
            // A page that has gone needs no answer.
            let _ = answer.send((id, ask(&source, &hub, &wishes)));
        });
        Ok(false)
    }
}

fn refused(text: &str) -> Problem {
    Problem {
        field: None,
        text: text.into(),
    }
}

fn ask(source: &Wishes, hub: &Hub, wishes: &[Wish]) -> Result<(), Problem> {
    for wish in wishes {
        match source.ask(*wish) {
            Ok(Answer::Done | Answer::Already) => {}
            Ok(Answer::Refused(why)) => return Err(refused(&why)),
            Err(error) => return Err(refused(&format!("{error:#}"))),
        }
        match wish {
            Wish::Set(..) => hub.post(Board::Saved, saved(false)),
            Wish::Save => {
                hub.post(Board::Saved, saved(true));
                tell::note(hub, "the settings are stored");
            }
            // The next one would take its place.
            Wish::World(Action::Push(_, for_s)) => thread::sleep(Duration::from_secs_f64(*for_s)),
            _ => {}
        }
    }
    Ok(())
}

fn saved(is_saved: bool) -> String {
    json!({ "saved": { "saved": is_saved } }).to_string()
}

fn send_answer(
    socket: &mut WebSocket<TcpStream>,
    id: u64,
    result: Result<(), Problem>,
) -> Result<(), Error> {
    let answer = match result {
        Ok(()) => json!({ "id": id, "ok": true }),
        Err(Problem { field, text }) => json!({ "id": id, "error": text, "field": field }),
    };
    socket.send(text(&json!({ "answer": answer }).to_string()))
}

//! What all pages see, and which of them commands. The source writes here and waits for nobody: each page comes for
//! what is new since it was here last, and finds the newest frame and the last lines of the log, however slow it is.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::token::Token;

/// A page that comes later, or is slow, finds so many lines of the log.
const LINES: usize = 256;
/// A page that is slow finds so many samples: two seconds.
const SAMPLES: usize = 100;
/// So many pages at once.
const MOST_PAGES: usize = 16;

/// A page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageId(u64);

/// What a page may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// It has no token: it watches.
    NoToken,
    /// It has shown another one: it watches.
    WrongToken,
    /// It has the token, and another page commands: it watches, and may stop the gripper.
    AnotherCommands,
    /// It has the token, and nobody commands: it may take over.
    NobodyCommands,
    /// It commands.
    Commands,
}

impl Standing {
    /// Its name for the page.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoToken => "no_token",
            Self::WrongToken => "wrong_token",
            Self::AnotherCommands => "another_commands",
            Self::NobodyCommands => "nobody_commands",
            Self::Commands => "commands",
        }
    }
}

/// What stands until something else does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// The settings.
    Settings,
    /// Whether they are stored.
    Saved,
}

const BOARDS: usize = 2;

/// How far a page has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Seen {
    /// Number of the last frame.
    pub frame: u64,
    /// Number of the last frame that was urgent.
    pub urgent: u64,
    /// Numbers of what stands last on each board.
    pub boards: [u64; BOARDS],
    /// Lines of the log, lost ones counted.
    pub lines: u64,
}

/// What is new for a page. Every number is one more than that of the one before.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct News {
    /// Lines of the log, in their order.
    pub lines: Vec<Arc<str>>,
    /// What stands on the boards.
    pub boards: Vec<Arc<str>>,
    /// The newest frame, if the page takes one.
    pub frame: Option<Arc<str>>,
    /// With it, what charts show of all frames since the last one.
    pub samples: Vec<Arc<str>>,
}

/// What is seen of the gripper at one moment, as text.
pub struct Frame {
    /// All of it.
    pub text: String,
    /// What charts show of it.
    pub sample: String,
    /// It shows something that must be seen at once.
    pub is_urgent: bool,
}

/// Where source and pages meet.
pub struct Hub {
    token: Token,
    shared: Mutex<Shared>,
}

/// What stands on a board, and how many there were.
#[derive(Default)]
struct Posted {
    number: u64,
    text: Option<Arc<str>>,
}

#[derive(Default)]
struct Shared {
    frames: u64,
    /// Number of the last one that was urgent.
    urgent: u64,
    frame: Option<Arc<str>>,
    samples: VecDeque<Arc<str>>,
    boards: [Posted; BOARDS],
    lines_so_far: u64,
    lines: VecDeque<Arc<str>>,
    pages: usize,
    pages_so_far: u64,
    commander: Option<PageId>,
    malformed: u64,
}

impl Hub {
    /// Before anything has come; pages command that have this token.
    pub fn new(token: Token) -> Self {
        Self {
            token,
            shared: Mutex::default(),
        }
    }

    /// What lets a page command.
    pub fn token(&self) -> &Token {
        &self.token
    }

    /// A thread that has panicked with the lock held has left numbers and texts, each of them whole.
    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A frame takes the place of the last one, and its sample is added to the others. It is made from its number.
    pub fn put_frame(&self, make: impl FnOnce(u64) -> Frame) {
        let mut shared = self.shared();
        shared.frames += 1;
        let frame = make(shared.frames);
        shared.frame = Some(frame.text.into());
        keep(&mut shared.samples, frame.sample, SAMPLES);
        if frame.is_urgent {
            shared.urgent = shared.frames;
        }
    }

    /// A text takes the place of the last one on its board.
    pub fn post(&self, board: Board, text: String) {
        let mut shared = self.shared();
        let posted = &mut shared.boards[board as usize];
        posted.number += 1;
        posted.text = Some(text.into());
    }

    /// A line is added to the log. It is made from its number.
    pub fn put_line(&self, make: impl FnOnce(u64) -> String) {
        let mut shared = self.shared();
        shared.lines_so_far += 1;
        let line = make(shared.lines_so_far);
        keep(&mut shared.lines, line, LINES);
    }

    /// A page has come; none if there are as many as there may be.
    pub fn enter(&self) -> Option<PageId> {
        let mut shared = self.shared();
        if shared.pages >= MOST_PAGES {
            return None;
        }
        shared.pages += 1;
        shared.pages_so_far += 1;
        Some(PageId(shared.pages_so_far))
    }

    /// A page has gone.
    pub fn leave(&self, page: PageId) {
        let mut shared = self.shared();
        shared.pages -= 1;
        if shared.commander == Some(page) {
            shared.commander = None;
        }
    }

    /// A page with the token commands from now on, if no other does.
    pub fn take_over(&self, page: PageId) -> Standing {
        let mut shared = self.shared();
        shared.commander = shared.commander.or(Some(page));
        shared.standing(page)
    }

    /// What a page with the token may do.
    pub fn standing(&self, page: PageId) -> Standing {
        self.shared().standing(page)
    }

    /// What is new since then, which is up to now afterwards; a frame only if the page takes one, and one that is not
    /// urgent only if that is due.
    pub fn news(&self, seen: &mut Seen, takes_frame: bool, is_due: bool) -> News {
        let shared = self.shared();
        let mut news = News {
            lines: last_of(&shared.lines, shared.lines_so_far - seen.lines),
            ..News::default()
        };
        seen.lines = shared.lines_so_far;
        for (seen, posted) in seen.boards.iter_mut().zip(&shared.boards) {
            if std::mem::replace(seen, posted.number) < posted.number {
                news.boards.extend(posted.text.clone());
            }
        }
        let is_wanted = is_due || seen.urgent < shared.urgent;
        if takes_frame && is_wanted && seen.frame < shared.frames {
            news.samples = last_of(&shared.samples, shared.frames - seen.frame);
            news.frame = shared.frame.clone();
            seen.frame = shared.frames;
            seen.urgent = shared.urgent;
        }
        news
    }

    /// Counts a message from a page that could not be read, and says how many there were.
    pub fn count_malformed(&self) -> u64 {
        let mut shared = self.shared();
        shared.malformed += 1;
        shared.malformed
    }

    /// Messages from pages that could not be read, and pages that there were.
    pub fn counts(&self) -> (u64, u64) {
        let shared = self.shared();
        (shared.malformed, shared.pages_so_far)
    }
}

/// Adds a text, and forgets the oldest where there are too many.
fn keep(texts: &mut VecDeque<Arc<str>>, text: String, most: usize) {
    texts.push_back(text.into());
    if texts.len() > most {
        texts.pop_front();
    }
}

/// The last so many texts, or all of them.
fn last_of(texts: &VecDeque<Arc<str>>, count: u64) -> Vec<Arc<str>> {
    let skipped = (texts.len() as u64).saturating_sub(count) as usize;
    texts.iter().skip(skipped).cloned().collect()
}

impl Shared {
    fn standing(&self, page: PageId) -> Standing {
        match self.commander {
            None => Standing::NobodyCommands,
            Some(commander) if commander == page => Standing::Commands,
            Some(_) => Standing::AnotherCommands,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hub() -> Hub {
        Hub::new(Token::random())
    }

    fn texts(lines: &[Arc<str>]) -> Vec<&str> {
        lines.iter().map(AsRef::as_ref).collect()
    }

    #[test]
    fn one_page_commands_until_it_has_gone() {
        let hub = hub();
        let (first, second) = (hub.enter().expect("room"), hub.enter().expect("room"));
        assert_eq!(hub.standing(first), Standing::NobodyCommands);
        assert_eq!(hub.take_over(first), Standing::Commands);
        assert_eq!(hub.take_over(second), Standing::AnotherCommands);
        assert_eq!(hub.standing(first), Standing::Commands);
        hub.leave(first);
        assert_eq!(hub.standing(second), Standing::NobodyCommands);
        assert_eq!(hub.take_over(second), Standing::Commands);
        let third = hub.enter().expect("room");
        hub.leave(third);
        assert_eq!(hub.standing(second), Standing::Commands);
    }

    fn frame(number: u64) -> Frame {
        Frame {
            text: format!("frame {number}"),
            sample: format!("sample {number}"),
            is_urgent: false,
        }
    }

    #[test]
    fn a_slow_page_finds_the_newest_frame_and_the_last_lines() {
        let hub = hub();
        let mut seen = Seen::default();
        assert_eq!(hub.news(&mut seen, true, true), News::default());
        for _ in 0..3 * LINES {
            hub.put_frame(frame);
            hub.put_line(|number| format!("line {number}"));
            hub.post(Board::Settings, "settings".into());
        }
        let news = hub.news(&mut seen, true, true);
        assert_eq!(news.frame.as_deref(), Some("frame 768"));
        assert_eq!(news.samples.len(), SAMPLES);
        assert_eq!(news.samples[0].as_ref(), "sample 669");
        assert_eq!(texts(&news.boards), ["settings"]);
        assert_eq!(news.lines.len(), LINES);
        assert_eq!(news.lines[0].as_ref(), "line 513");
        assert_eq!(hub.news(&mut seen, true, true), News::default());

        hub.put_line(|number| format!("line {number}"));
        hub.put_frame(frame);
        hub.put_frame(frame);
        let news = hub.news(&mut seen, false, true);
        assert_eq!(texts(&news.lines), ["line 769"]);
        assert_eq!(news.frame, None, "it takes none yet");
        let news = hub.news(&mut seen, true, true);
        assert_eq!(news.frame.as_deref(), Some("frame 770"));
        assert_eq!(texts(&news.samples), ["sample 769", "sample 770"]);
    }

    #[test]
    fn what_must_be_seen_at_once_waits_for_no_moment() {
        let hub = hub();
        let mut seen = Seen::default();
        hub.put_frame(frame);
        assert_eq!(hub.news(&mut seen, true, false).frame, None);
        hub.put_frame(|number| Frame {
            is_urgent: true,
            ..frame(number)
        });
        hub.put_frame(frame);
        let news = hub.news(&mut seen, true, false);
        assert_eq!(news.frame.as_deref(), Some("frame 3"));
        assert_eq!(news.samples.len(), 3);
        hub.put_frame(frame);
        assert_eq!(hub.news(&mut seen, true, false).frame, None);
    }

    #[test]
    fn pages_beyond_the_most_are_refused_until_one_has_gone() {
        let hub = hub();
        let pages: Vec<PageId> = (0..MOST_PAGES).filter_map(|_| hub.enter()).collect();
        assert_eq!(pages.len(), MOST_PAGES);
        assert_eq!(hub.enter(), None);
        hub.leave(pages[3]);
        assert!(hub.enter().is_some());
    }
}

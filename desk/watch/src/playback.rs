//! A recording as a source.

use std::path::Path;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::ensure;

use crate::connection::Connection;
use crate::recorder::Format;
use crate::recording::read;
use crate::told::Told;

/// So much is read ahead.
const AHEAD: usize = 1000;

/// Tells what a recording has, as fast as it is taken or as it came.
///
/// # Errors
/// If there is no such file, or its name says that it is none.
pub fn open(path: &Path, in_real_time: bool) -> anyhow::Result<Connection> {
    Format::of(path)?;
    ensure!(path.is_file(), "{}: there is no such file", path.display());
    let (sender, told) = mpsc::sync_channel(AHEAD);
    let file = path.to_path_buf();
    thread::spawn(move || {
        let mut pace = Pace::default();
        let read = read(&file, &mut |told| {
            if let (true, Told::Observation(seen)) = (in_real_time, &told) {
                pace.wait(seen.t_s.unwrap_or_default());
            }
            Ok(sender.send(told)?)
        });
        let end = match read {
            Ok(()) => Told::Ended("the recording is at its end".into()),
            Err(error) => Told::Failed(format!("{error:#}")),
        };
        // Who has opened it may be gone.
        let _ = sender.send(end);
    });
    Ok(Connection {
        name: path.display().to_string(),
        rate_hz: 0.0,
        told,
        wishes: None,
    })
}

/// The clock of a recording on that on the wall.
#[derive(Default)]
struct Pace {
    began: Option<(Instant, f64)>,
}

impl Pace {
    /// Waits until it is this late, s.
    fn wait(&mut self, t_s: f64) {
        let (began, from_s) = *self.began.get_or_insert((Instant::now(), t_s));
        let since = Duration::try_from_secs_f64(t_s - from_s).ok();
        let Some(due) = since.and_then(|since| began.checked_add(since)) else {
            // The gripper has started again.
            self.began = None;
            return;
        };
        thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

//! A gripper at the other end of a line.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use serve::master::Master;
use serve::readout;

use crate::connection::Connection;
use crate::registers::{Look, carry_out};
use crate::told::{Provenance, SettingsTold, Told};
use crate::wish::{Answer, Asked, Wish, Wishes};

/// How long the line is watched before its rate is told.
const RATE_AFTER: Duration = Duration::from_secs(2);
/// A rate that is lower than this share of what was asked for is told.
const SLOW: f64 = 0.9;

/// Reads the gripper at the other end so often, and carries out what is wished.
///
/// # Errors
/// If the gripper does not answer, or has other settings than this program knows.
pub fn open(mut master: Master, name: String, rate_hz: f64) -> anyhow::Result<Connection> {
    let (sender, told) = mpsc::channel();
    let (wishes, asked) = mpsc::channel();
    let look = Look::take(&mut master)?;
    let provenance = Provenance {
        source: name.clone(),
        version: look.version(),
        recipe: String::new(),
        table: look.table(),
    };
    let first = [
        Told::Provenance(provenance),
        settings(&mut master, Some(look.t_s()))?,
    ];
    thread::spawn(move || {
        for told in first {
            // Who has opened it may be gone already: that is seen below.
            let _ = sender.send(told);
        }
        let watch = Watch {
            master,
            sender: &sender,
            asked,
            period: Duration::from_secs_f64(1.0 / rate_hz),
        };
        // Without an error nobody listens any more.
        if let Err(error) = watch.run(look) {
            let _ = sender.send(Told::Failed(format!("{error:#}")));
        }
    });
    Ok(Connection {
        name,
        rate_hz,
        told,
        wishes: Some(Wishes::new(wishes)),
    })
}

struct Watch<'a> {
    master: Master,
    sender: &'a Sender<Told>,
    asked: Receiver<Asked>,
    period: Duration,
}

impl Watch<'_> {
    /// Until nobody listens, or the gripper does not answer.
    fn run(mut self, mut before: Look) -> anyhow::Result<()> {
        let began = Instant::now();
        let mut looks = 0_u32;
        let mut is_rate_told = false;
        let mut due = began;
        loop {
            let look = Look::take(&mut self.master)?;
            let events = look.events_since(&before);
            let learns = events
                .iter()
                .any(|event| event.name == "tared" || event.name == "swept");
            let seen = Told::Observation(Box::new(look.observation()));
            let events = events.into_iter().map(Told::Event);
            for told in [seen].into_iter().chain(events) {
                if self.sender.send(told).is_err() {
                    return Ok(());
                }
            }
            if learns {
                let _ = self
                    .sender
                    .send(settings(&mut self.master, Some(look.t_s()))?);
            }
            looks += 1;
            let elapsed = began.elapsed();
            if !is_rate_told && elapsed >= RATE_AFTER {
                is_rate_told = true;
                self.tell_rate(f64::from(looks) / elapsed.as_secs_f64());
            }
            due = (due + self.period).max(Instant::now());
            self.answer_until(due, look.t_s())?;
            before = look;
        }
    }

    fn tell_rate(&self, rate_hz: f64) {
        let wanted_hz = 1.0 / self.period.as_secs_f64();
        if rate_hz < SLOW * wanted_hz {
            let _ = self.sender.send(Told::Note(format!(
                "the line gives {rate_hz:.1} observations a second, where {wanted_hz:.0} were asked for"
            )));
        }
    }

    /// Carries out wishes until the next look is due.
    fn answer_until(&mut self, due: Instant, t_s: f64) -> anyhow::Result<()> {
        loop {
            let left = due.saturating_duration_since(Instant::now());
            let Asked { wish, answer } = match self.asked.recv_timeout(left) {
                Ok(asked) => asked,
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => {
                    thread::sleep(left);
                    return Ok(());
                }
            };
            let done = carry_out(&mut self.master, &wish)?;
            let changes = matches!(wish, Wish::Set(..)) && done != Answer::Already;
            // Who has asked may have gone.
            let _ = answer.send(done);
            if changes {
                let _ = self.sender.send(settings(&mut self.master, Some(t_s))?);
            }
        }
    }
}

/// The gripper's settings, as they are told.
fn settings(master: &mut Master, t_s: Option<f64>) -> anyhow::Result<Told> {
    Ok(Told::Settings(SettingsTold {
        t_s,
        values: readout::settings(master)?,
        applied: true,
    }))
}

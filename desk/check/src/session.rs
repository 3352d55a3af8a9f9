//! A gripper that is being checked: what it has told last, and its own time.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use settings::Values;
use softgrip::units::FINGERS;
use watch::told::Provenance;
use watch::{Answer, Connection, Observation, Told, Wish, Wishes};

use crate::finding::{Finding, Step};

/// Ctrl-C is looked at so often.
const PATIENCE: Duration = Duration::from_millis(100);

/// Why the check does not go on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Halt {
    /// Somebody has ended it.
    Interrupted,
    /// The gripper does not tell any more, and why.
    Gone(String),
}

/// A gripper that is being checked.
pub struct Session<'a> {
    told: &'a Receiver<Told>,
    wishes: &'a Wishes,
    stop: &'a AtomicBool,
    /// Nothing but the end is left: Ctrl-C has been heard, or need not be.
    pub is_ending: bool,
    /// There may be pressure in the fingers, by this check.
    pub is_pressed: bool,
    /// What gripper it is.
    pub about: Provenance,
    /// The settings that it was found with.
    pub found: Values,
    /// The settings that it has told last.
    pub settings: Values,
    /// The last look.
    pub latest: Observation,
    /// Every look since it was last taken.
    trace: Vec<Observation>,
}

impl<'a> Session<'a> {
    /// Waits until the gripper has told what it is.
    ///
    /// # Errors
    /// If it ends before, or the user does; or if nothing can be wished of it.
    pub fn begin(connection: &'a Connection, stop: &'a AtomicBool) -> anyhow::Result<Self> {
        let wishes = connection
            .wishes
            .as_ref()
            .ok_or_else(|| anyhow::anyhow!("{}: nothing can be wished of it", connection.name))?;
        let mut session = Self {
            told: &connection.told,
            wishes,
            stop,
            is_ending: false,
            is_pressed: false,
            about: Provenance::default(),
            found: Values::DEFAULT,
            settings: Values::DEFAULT,
            latest: Observation::default(),
            trace: Vec::new(),
        };
        while session.latest.t_s.is_none() {
            session.see().map_err(|halt| match halt {
                Halt::Interrupted => anyhow::anyhow!("ended before the gripper had told anything"),
                Halt::Gone(why) => anyhow::anyhow!("{}: {why}", connection.name),
            })?;
        }
        session.found = session.settings;
        Ok(session)
    }

    /// Takes the next that is told.
    fn see(&mut self) -> Result<(), Halt> {
        loop {
            if self.stop.load(Relaxed) && !self.is_ending {
                return Err(Halt::Interrupted);
            }
            match self.told.recv_timeout(PATIENCE) {
                Ok(told) => return self.take(told),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Halt::Gone("the connection has ended".into()));
                }
            }
        }
    }

    fn take(&mut self, told: Told) -> Result<(), Halt> {
        match told {
            Told::Provenance(about) => self.about = about,
            Told::Settings(told) => self.settings = told.values,
            Told::Observation(seen) => {
                if seen.t_s < self.latest.t_s {
                    return Err(Halt::Gone("the gripper has started again".into()));
                }
                self.latest = *seen;
                self.trace.push(*seen);
            }
            Told::Ended(why) | Told::Failed(why) => return Err(Halt::Gone(why)),
            Told::Tick(_) | Told::Event(_) | Told::Note(_) => {}
        }
        Ok(())
    }

    /// Takes all that has been told meanwhile.
    ///
    /// # Errors
    /// If the gripper is gone.
    pub fn catch_up(&mut self) -> Result<(), Halt> {
        while let Ok(told) = self.told.try_recv() {
            self.take(told)?;
        }
        Ok(())
    }

    /// Wishes something. Every look after it has seen what has become of it.
    ///
    /// # Errors
    /// If the gripper is gone.
    pub fn wish(&mut self, wish: Wish) -> Result<Answer, Halt> {
        let answer = self.wishes.ask(wish);
        // Why it is gone stands in what it has told.
        self.catch_up()?;
        answer.map_err(|error| Halt::Gone(format!("{error:#}")))
    }

    /// Looks until it is so, for so long at most, s by the gripper's clock; says whether it has become so.
    ///
    /// # Errors
    /// If the gripper is gone, or Ctrl-C was pressed.
    pub fn until(
        &mut self,
        within_s: f64,
        mut is_so: impl FnMut(&Observation) -> bool,
    ) -> Result<bool, Halt> {
        let end_s = self.t_s() + within_s;
        loop {
            // It may have been so in a look that came before.
            let before = self.latest.t_s;
            while self.latest.t_s == before {
                self.see()?;
            }
            if is_so(&self.latest) {
                return Ok(true);
            }
            if self.t_s() >= end_s {
                return Ok(false);
            }
        }
    }

    /// All looks of so long, s by the gripper's clock.
    ///
    /// # Errors
    /// As [`Self::until`].
    pub fn watch(&mut self, for_s: f64) -> Result<Vec<Observation>, Halt> {
        self.catch_up()?;
        self.trace.clear();
        self.until(for_s, |_| false)?;
        Ok(self.take_trace())
    }

    /// All looks since this was last called.
    pub fn take_trace(&mut self) -> Vec<Observation> {
        std::mem::take(&mut self.trace)
    }

    /// The gripper's clock, s.
    pub fn t_s(&self) -> f64 {
        self.latest.t_s.unwrap_or_default()
    }

    /// What has failed: of the gripper, or of one gauge.
    pub fn failed(&self, step: Step, expected: &str) -> Option<Finding> {
        match self.latest.fault {
            None | Some(0) => {}
            Some(number) => return Some(Finding::fault(step, "latched fault", expected, number)),
        }
        (0..FINGERS).find_map(|finger| {
            let number = self.latest.gauge_fault[finger].filter(|number| *number != 0)?;
            let what = format!("gauge {}", finger + 1);
            Some(Finding::fault(step, what, expected, number))
        })
    }
}

/// The mean of what is told, and nothing where it is never told.
pub fn mean(looks: &[Observation], of: impl Fn(&Observation) -> Option<f32>) -> Option<f32> {
    let told: Vec<f32> = looks.iter().filter_map(of).collect();
    match told.len() {
        0 => None,
        count => Some(told.iter().sum::<f32>() / count as f32),
    }
}

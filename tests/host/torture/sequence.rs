//! One sequence: what is said and what happens at which tick. It can be played, and made smaller.

use crate::torture::Breach;
use crate::torture::limits::Limits;
use crate::torture::plant::{Happening, Plant};
use crate::torture::promises::{Promises, Tally};
use crate::torture::season::{Season, Start};
use softgrip::grasp::State;
use softgrip::telemetry::Event;
use softgrip::{Command, Grip, Outputs};
use std::fmt::{Display, Formatter};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A host that must speak does so every so many ticks, unless it is silent.
const ALIVE_TICKS: u64 = 20;
/// Good inputs before whoever repaired everything acknowledges.
const REPAIRED_TICKS: u32 = 2_000;

/// Something in a sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    Say(Command),
    Happen(Happening),
    /// The host falls silent for so many ticks.
    Silence(u16),
}

/// What is said and what happens, by the ticks at which it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    pub start: Start,
    pub noise_seed: u32,
    pub ticks: u32,
    /// In the order of their ticks.
    pub actions: Vec<(u32, Action)>,
    /// Everything is repaired in the end, and must work again.
    pub recovers: bool,
}

/// A rule that did not hold, and the tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    pub tick: u32,
    pub breach: Breach,
}

/// A plant with a controller, and what is checked about them.
#[derive(Clone)]
pub struct Player {
    pub plant: Plant,
    pub limits: Limits,
    pub promises: Promises,
    /// The host says that it is there.
    pub speaks: bool,
    pub silent_ticks: u16,
}

impl Player {
    /// One tick.
    fn step(&mut self, command: Option<Command>) -> Result<Outputs, Breach> {
        let quiet = self.silent_ticks > 0;
        self.silent_ticks = self.silent_ticks.saturating_sub(1);
        let tick = self.plant.board.now_us / 1_000;
        let alive = self.speaks && !quiet && tick.is_multiple_of(ALIVE_TICKS);
        let command = command.unwrap_or(match alive {
            true => Command::Alive,
            false => Command::Continue,
        });
        let outputs = self.plant.step(command);
        let pressure = self.plant.board.pressure_kpa;
        self.limits.check(command, &outputs, Some(pressure))?;
        self.promises.check(&self.plant, command, &outputs)?;
        Ok(outputs)
    }

    /// Ticks on the way to a start, where nothing can break a rule yet.
    pub fn warm_up(&mut self, command: Command, ticks: u32) {
        for _ in 0..ticks {
            if let Err(breach) = self.step(Some(command)) {
                // A start that cannot be reached would make every sequence from it worthless.
                panic!("{breach:?} on the way to a start");
            }
        }
    }

    /// Everything is repaired, and after an acknowledgement the gripper grips again.
    fn recover(&mut self, season: &Season, run: &mut Run) -> Result<(), Breach> {
        self.plant.repair();
        for tick in 0..REPAIRED_TICKS {
            // What was just being put in is there by now.
            if tick == 50 {
                self.plant.happen(Happening::Fall);
            }
            run.step(self, None)?;
        }
        run.step(self, Some(Command::Acknowledge))?;
        run.step(self, None)?;
        run.step(self, Some(Command::Release))?;
        let mut state = run.step(self, None)?.snapshot.state;
        for _ in 0..5 * season.grip_ms() {
            if state == State::Idle {
                break;
            }
            state = run.step(self, None)?.snapshot.state;
        }
        // The fingers follow the pressure.
        for _ in 0..500 {
            run.step(self, None)?;
        }
        self.plant.happen(Happening::PutIn([true; 3]));
        run.step(self, Some(Command::Grip(Grip::Default)))?;
        let mut heard = Vec::new();
        for _ in 0..season.grip_ms() {
            let outputs = run.step(self, None)?;
            heard.extend(outputs.events.iter().copied());
        }
        let all = [true; 3];
        match heard
            .iter()
            .filter(|event| **event == Event::Holding { touching: all })
            .count()
        {
            1 => Ok(()),
            _ => Err(Breach::of("what is repaired grips again", (state, heard))),
        }
    }
}

/// A sequence being played.
#[derive(Default)]
struct Run {
    tick: u32,
    /// What was heard, by tick, if anybody asks.
    told: Option<Vec<(u32, Event)>>,
}

impl Run {
    fn step(&mut self, player: &mut Player, command: Option<Command>) -> Result<Outputs, Breach> {
        self.tick += 1;
        let outputs = player.step(command)?;
        if let Some(told) = &mut self.told {
            told.extend(outputs.events.iter().map(|event| (self.tick, *event)));
        }
        Ok(outputs)
    }

    fn play(&mut self, sequence: &Sequence, season: &Season) -> Result<(u32, Tally), Breach> {
        let mut player = season.start(sequence.start);
        player.plant.board.seed(sequence.noise_seed);
        player.promises.tally = Tally::default();
        let mut actions = sequence.actions.iter().peekable();
        for tick in 0..sequence.ticks {
            let mut command = None;
            while let Some((_, action)) = actions.next_if(|(at, _)| *at <= tick) {
                match *action {
                    Action::Say(said) => command = Some(said),
                    Action::Happen(happening) => player.plant.happen(happening),
                    Action::Silence(ticks) => player.silent_ticks = ticks,
                }
            }
            self.step(&mut player, command)?;
        }
        if sequence.recovers {
            player.recover(season, self)?;
        }
        Ok((self.tick, player.promises.tally))
    }
}

impl Sequence {
    /// Plays it; gives the ticks that it took and what it has seen.
    pub fn play(&self, season: &Season) -> Result<(u32, Tally), Failure> {
        self.run(season, &mut Run::default())
    }

    fn run(&self, season: &Season, run: &mut Run) -> Result<(u32, Tally), Failure> {
        let played = catch_unwind(AssertUnwindSafe(|| run.play(self, season)));
        let result =
            played.unwrap_or_else(|panic| Err(Breach::of("no panic", panic_message(&*panic))));
        let tick = run.tick;
        result.map_err(|breach| Failure { tick, breach })
    }

    /// The smallest sequence found that breaks the same rule: without every action that it does not need.
    pub fn minimised(&self, season: &Season, failure: &Failure) -> (Self, Failure) {
        let mut smallest = self.clone();
        let mut failure = failure.clone();
        let mut try_smaller = |smallest: &mut Self, smaller: Self| match smaller.play(season) {
            Err(found) if found.breach.rule == failure.breach.rule => {
                *smallest = smaller;
                failure = found;
                true
            }
            _ => false,
        };
        loop {
            let mut shrunk = false;
            for index in (0..smallest.actions.len()).rev() {
                let mut smaller = smallest.clone();
                smaller.actions.remove(index);
                shrunk |= try_smaller(&mut smallest, smaller);
            }
            if !shrunk {
                return (smallest, failure);
            }
        }
    }

    /// What is said, happens and is told, tick by tick.
    pub fn story(&self, season: &Season) -> String {
        let mut run = Run {
            told: Some(Vec::new()),
            ..Run::default()
        };
        let result = self.run(season, &mut run);
        let mut lines: Vec<(u32, String)> = Vec::new();
        for (at, action) in &self.actions {
            lines.push((*at + 1, format!("{action:?}")));
        }
        for (at, event) in run.told.unwrap_or_default() {
            lines.push((at, format!("    -> {event:?}")));
        }
        if let Err(failure) = result {
            let Breach { rule, found } = failure.breach;
            lines.push((failure.tick, format!("    BROKEN: {rule}: {found}")));
        }
        lines.sort_by_key(|(at, _)| *at);
        let mut story = format!(
            "from {:?}, hose {:.0} ms, noise {:.0} µε, {}{:?}\n",
            self.start,
            season.hose_lag_ms,
            season.noise_ue,
            if self.recovers { "then repaired, " } else { "" },
            season.settings,
        );
        for (at, line) in lines {
            story.push_str(&format!("{at:>8} {line}\n"));
        }
        story
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Breach { rule, found } = &self.breach;
        write!(f, "{rule}: {found} at tick {}", self.tick)
    }
}

/// What a panic says.
pub fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    match (panic.downcast_ref::<String>(), panic.downcast_ref::<&str>()) {
        (Some(message), _) => message.clone(),
        (None, Some(message)) => (*message).into(),
        (None, None) => "a panic without a message".into(),
    }
}

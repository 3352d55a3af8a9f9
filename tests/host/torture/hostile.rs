//! Inputs that no plant would give: any codes, any settings, any numbers in a command, any time.

use crate::mock::MockBoard;
use crate::torture::Breach;
use crate::torture::generate;
use crate::torture::limits::Limits;
use crate::torture::plant::Plant;
use crate::torture::season::{STARTS, Season, pick};
use crate::torture::sequence::{Action, Failure, panic_message};
use fastrand::Rng;
use softgrip::command::{Motion, Payload};
use softgrip::fault::{Fault, RULES};
use softgrip::grasp::State;
use softgrip::settings::{Settings, Values};
use softgrip::table::{FINGER, ObjectKind};
use softgrip::telemetry::Event;
use softgrip::units::{
    AdcCode, Degrees, Kilograms, Kilopascals, MetresPerSecondSquared, Millivolts,
};
use softgrip::{Command, Controller, Grip, Outputs, RawFrame};
use softgrip_settings::{FIELDS, Field, Kind};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Lives that share a season.
const LIVES_PER_SEASON: u64 = 64;

/// Valid settings over their whole ranges, their ends most of all.
pub fn any_settings(rng: &mut Rng) -> Settings {
    let mut values = Values::DEFAULT;
    for field in &FIELDS {
        let (min, max) = range(field, &values);
        let value = values.get(field.number).expect("every field has a value");
        let value = match (field.kind, rng.u8(..8)) {
            (Kind::Choice(words), _) => rng.usize(..words.len()) as f32,
            (Kind::Whole { min, max }, _) => rng.u8(min..=max).into(),
            (_, 0) => min,
            (_, 1) => max,
            (_, 2 | 3) => min + (max - min) * rng.f32(),
            // As near to the lower end as the range is wide.
            (_, 4) => (min + (max - min) * rng.f32().powi(6)).min(max),
            _ => value.clamp(min, max),
        };
        values
            .set(field.number, value)
            .expect("a value in its range");
    }
    let mut settings = Settings::of(&values);
    // A smaller regulator would limit the pressures.
    let full_scale_kpa = &mut settings.front_end.regulator_full_scale_kpa;
    *full_scale_kpa = full_scale_kpa.max(FINGER.max_pressure_kpa);
    settings
}

/// Settings with one wrong value, and its number.
pub fn wrong_settings(rng: &mut Rng) -> (Settings, u16) {
    let values = any_settings(rng).values();
    let wrong = rng.usize(..FIELDS.len());
    let (min, max) = range(&FIELDS[wrong], &values);
    let mut all = *values.all();
    all[wrong] = match (FIELDS[wrong].kind, rng.u8(..6)) {
        // Those are never wrong once they are typed.
        (Kind::Choice(_) | Kind::Whole { .. }, _) => return wrong_settings(rng),
        (_, 0) => min.next_down(),
        (_, 1) => max.next_up(),
        (_, 2) => f32::NAN,
        (_, 3) => f32::INFINITY,
        (_, 4) => f32::NEG_INFINITY,
        _ => min - 1.0 - 1e6 * rng.f32(),
    };
    (Settings::of(&Values::from_all(all)), FIELDS[wrong].number)
}

/// What a setting may be with the default finger and the settings before it.
fn range(field: &Field, values: &Values) -> (f32, f32) {
    let limit = field.limit();
    let most = match field.number {
        100 | 408 => FINGER.max_pressure_kpa,
        400 => values.get(100).expect("the highest pressure"),
        _ => limit.max,
    };
    (limit.min, most)
}

/// How often each state was seen and each fault told.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Census {
    pub ticks: u64,
    pub states: [u64; 7],
    pub faults: [u64; RULES.len()],
}

const STATES: [&str; 7] = [
    "Idle",
    "Closing",
    "Holding",
    "Empty",
    "Sweeping",
    "Releasing",
    "Fault",
];

impl Census {
    fn count(&mut self, outputs: &Outputs) {
        self.ticks += 1;
        let state = match outputs.snapshot.state {
            State::Idle => 0,
            State::Closing { .. } => 1,
            State::Holding { .. } => 2,
            State::Empty { .. } => 3,
            State::Sweeping { .. } => 4,
            State::Releasing { .. } => 5,
            State::Fault { .. } => 6,
        };
        self.states[state] += 1;
        for event in outputs.events.iter() {
            if let Event::Fault {
                fault,
                finger: None,
            } = event
                && let Some(row) = RULES.iter().position(|rule| rule.fault == *fault)
            {
                self.faults[row] += 1;
            }
        }
    }

    /// Ticks in each state and reports of each fault, by name.
    pub fn rows(&self) -> Vec<(String, u64)> {
        let states = STATES.iter().map(|name| name.to_string()).zip(self.states);
        let faults = RULES
            .iter()
            .map(|rule| format!("{:2} {:?}", rule.fault.code(), rule.fault));
        states.chain(faults.zip(self.faults)).collect()
    }

    /// What was never seen.
    pub fn missing(&self) -> Vec<String> {
        let never = |(name, count): (String, u64)| (count == 0).then_some(name);
        self.rows().into_iter().filter_map(never).collect()
    }
}

/// Hostile lives of one seed; each can be lived again by its number.
pub struct Hostile {
    seed: u64,
    season: Option<(u64, Season)>,
    pub census: Census,
}

impl Hostile {
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            season: None,
            census: Census::default(),
        }
    }

    /// One life of a controller, from its start.
    pub fn live(&mut self, life: u64) -> Result<(), Failure> {
        let mut tick = 0;
        let lived = catch_unwind(AssertUnwindSafe(|| {
            let mut rng = Rng::with_seed(seed_of(self.seed, life));
            match rng.bool() {
                true => self.live_in_season(&mut rng, life / LIVES_PER_SEASON, &mut tick),
                false => self.live_in_the_wild(&mut rng, &mut tick),
            }
        }));
        let result = lived.unwrap_or_else(|panic| {
            // What a panic has left may be anything.
            self.season = None;
            Err(Breach::of("no panic", panic_message(&*panic)))
        });
        result.map_err(|breach| Failure { tick, breach })
    }

    /// A plausible board whose inputs are tampered with now and then.
    fn live_in_season(&mut self, rng: &mut Rng, season: u64, tick: &mut u32) -> Result<(), Breach> {
        if self
            .season
            .as_ref()
            .is_none_or(|(number, _)| *number != season)
        {
            // Seasons are counted from the far end, so that no life has the seed of its own season.
            self.season = Some((season, Season::new(seed_of(self.seed, u64::MAX - season))));
        }
        let Some((_, season)) = &self.season else {
            return Ok(());
        };
        let mut sequence = generate::sequence(rng, season);
        sequence.start = pick(rng, &STARTS);
        let mut player = season.start(sequence.start);
        player.plant.board.seed(sequence.noise_seed);
        let mut tampering = Tampering::new(rng, 400);
        let mut actions = sequence.actions.iter().peekable();
        while *tick < sequence.ticks {
            let mut command = Command::Continue;
            while let Some((_, action)) = actions.next_if(|(at, _)| at <= tick) {
                match *action {
                    Action::Say(said) => command = said,
                    Action::Happen(happening) => player.plant.happen(happening),
                    Action::Silence(_) => {}
                }
            }
            *tick += 1;
            let outputs = tampering.step(rng, &mut player.plant, command);
            self.census.count(&outputs);
            player.limits.check(command, &outputs, None)?;
        }
        Ok(())
    }

    /// Any settings, any frames, any commands.
    fn live_in_the_wild(&mut self, rng: &mut Rng, tick: &mut u32) -> Result<(), Breach> {
        let settings = any_settings(rng);
        let mut board = MockBoard::new(settings);
        let fault = match rng.u8(..8) {
            0 => Some(Fault::Internal),
            1 => Some(Fault::SettingsInvalid),
            _ => None,
        };
        let active = settings
            .validate(&FINGER)
            .expect("generated settings are valid");
        board.controller = Controller::starting_with(fault, &FINGER, active);
        board.grip = std::array::from_fn(|_| rng.f32());
        let mut plant = Plant::new(board);
        let mut limits = Limits::new(&settings, fault);
        let mut tampering = Tampering::new(rng, 50);
        let pause = pick(rng, &[1, 20, 300]);
        for _ in 0..rng.u32(300..4_000) {
            let command = match rng.u32(..pause) {
                0 => any_command(rng),
                _ => Command::Continue,
            };
            *tick += 1;
            let outputs = tampering.step(rng, &mut plant, command);
            self.census.count(&outputs);
            limits.check(command, &outputs, None)?;
        }
        Ok(())
    }
}

/// The seed of the life, or of the sequence, with this number: successive numbers are as good as random
/// (SplitMix64, Steele et al. 2014).
pub fn seed_of(seed: u64, number: u64) -> u64 {
    let mut mixed = seed.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// What is done to the frames for a while.
#[derive(Debug, Clone, Copy)]
enum Mode {
    Plausible,
    /// One channel carries this code.
    OneChannel(usize, u16),
    /// A bit of one channel is flipped.
    BitFlip(usize, u16),
    /// The converters' reference is this many millivolts.
    Rail(u16),
    /// Two channels have changed places.
    Swapped(usize, usize),
    /// All channels carry the same.
    All(u16),
    /// Rail to rail, tick by tick.
    Alternating,
    Random,
    /// Nothing new, or lost data, tick by tick.
    Lossy,
}

struct Tampering {
    mode: Mode,
    ticks: u32,
    /// Mean time between two tampered stretches.
    pause: u32,
    /// Time jumps as well.
    jumps: bool,
}

impl Tampering {
    fn new(rng: &mut Rng, pause: u32) -> Self {
        Self {
            mode: Mode::Plausible,
            ticks: rng.u32(..2 * pause),
            pause,
            jumps: rng.u8(..4) == 0,
        }
    }

    fn step(&mut self, rng: &mut Rng, plant: &mut Plant, command: Command) -> Outputs {
        if self.ticks == 0 {
            (self.mode, self.ticks) = match self.mode {
                Mode::Plausible => (Mode::any(rng), pick(rng, &[1, 2, 3, 5, 20, 60, 400])),
                _ => (Mode::Plausible, rng.u32(1..2 * self.pause)),
            };
        }
        self.ticks -= 1;
        plant.prepare();
        let mut frame = plant.board.sense();
        self.mode.tamper(rng, &mut frame);
        if self.jumps && rng.u8(..100) == 0 {
            let jump_us = pick(
                rng,
                &[
                    1,
                    999,
                    1_000,
                    10_000,
                    1_000_000,
                    10_000_000,
                    1 << 40,
                    1 << 62,
                ],
            );
            plant.board.now_us = plant.board.now_us.saturating_add(jump_us);
        }
        plant.board.act(&frame, command)
    }
}

impl Mode {
    fn any(rng: &mut Rng) -> Self {
        let code = match rng.u8(..4) {
            0 => 0,
            1 => u16::MAX,
            _ => rng.u16(..),
        };
        match rng.u8(..9) {
            0 | 1 => Self::OneChannel(rng.usize(..5), code),
            2 => Self::BitFlip(rng.usize(..5), 1 << rng.u32(..16)),
            3 => Self::Swapped(rng.usize(..5), rng.usize(..5)),
            4 => Self::All(code),
            5 => Self::Alternating,
            6 => Self::Random,
            7 => Self::Rail(code),
            _ => Self::Lossy,
        }
    }

    fn tamper(self, rng: &mut Rng, frame: &mut RawFrame) {
        let [a, b, c] = frame.gauges;
        let mut codes = [a, b, c, frame.monitor, frame.supply].map(|code| code.0);
        match self {
            Self::Plausible => {}
            Self::OneChannel(channel, code) => codes[channel] = code,
            Self::BitFlip(channel, bit) => codes[channel] ^= bit,
            Self::Rail(millivolts) => frame.rail = Millivolts(millivolts),
            Self::Swapped(one, other) => codes.swap(one, other),
            Self::All(code) => codes = [code; 5],
            Self::Alternating => {
                let code = if rng.bool() { u16::MAX } else { 0 };
                codes = [code; 5];
            }
            Self::Random => codes = std::array::from_fn(|_| rng.u16(..)),
            Self::Lossy => {
                frame.scans = rng.u16(..3);
                frame.overrun = rng.bool();
            }
        }
        let [a, b, c, monitor, supply] = codes.map(AdcCode);
        frame.gauges = [a, b, c];
        frame.monitor = monitor;
        frame.supply = supply;
    }
}

fn any_command(rng: &mut Rng) -> Command {
    let number = |rng: &mut Rng, most: f32| match rng.u8(..4) {
        0 => f32::from_bits(rng.u32(..)),
        1 => pick(
            rng,
            &[
                f32::NAN,
                f32::INFINITY,
                -0.0,
                f32::MAX,
                f32::MIN_POSITIVE,
                1e-42,
            ],
        ),
        _ => most * rng.f32(),
    };
    match rng.u8(..15) {
        0 | 1 => Command::Grip(Grip::Default),
        2 => Command::Grip(Grip::Pressure(Kilopascals(number(rng, 160.0)))),
        3 => Command::Grip(Grip::Bend(Degrees(number(rng, 91.0)))),
        4 => Command::Grip(Grip::Payload(Payload {
            kind: pick(rng, &[ObjectKind::Sphere, ObjectKind::Cylinder]),
            mass: Kilograms(number(rng, 0.3)),
            acceleration: MetresPerSecondSquared(number(rng, 10.0)),
        })),
        5 => Command::Release,
        6 => Command::Stop,
        7 | 8 => Command::Acknowledge,
        9 => Command::Alive,
        10 => Command::Motion(pick(rng, &[Motion::Still, Motion::Moving])),
        11 => Command::Tare,
        12 => Command::Halt,
        13 => Command::Slew(number(rng, 1.2)),
        _ => Command::Sweep,
    }
}

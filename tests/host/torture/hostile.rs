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
use softgrip::frontend::FrontEnd;
use softgrip::grasp::State;
use softgrip::settings::{GaugeSense, OnFault, OnLoss, Settings};
use softgrip::table::{FINGER, ObjectKind};
use softgrip::telemetry::Event;
use softgrip::units::{
    AdcCode, Degrees, Kilograms, Kilopascals, MetresPerSecondSquared, Millivolts,
};
use softgrip::{Command, Controller, Grip, Outputs, RawFrame};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// One number of the settings, and the range that it may be in.
type Field = (&'static str, f32, f32, fn(&mut Settings) -> &mut f32);

/// Every number of the settings; the grip's pressure comes last, for its limit is another one.
#[rustfmt::skip]
const FIELDS: [Field; 26] = [
    ("max_pressure_kpa", 1.0, 160.0, |s| &mut s.regulator.max_pressure_kpa),
    ("regrip_raise_kpa", 0.0, 160.0, |s| &mut s.grip.regrip_raise_kpa),
    ("host_timeout_ms", 0.0, 60_000.0, |s| &mut s.grip.host_timeout_ms),
    ("slew_kpa_per_s", 1.0, 10_000.0, |s| &mut s.regulator.slew_kpa_per_s),
    ("regulator_lag_ms", 1.0, 1_000.0, |s| &mut s.air.regulator_lag_ms),
    ("inflation_lag_ms", 1.0, 5_000.0, |s| &mut s.finger.silicone.inflation_lag_ms),
    ("deflation_lag_ms", 1.0, 5_000.0, |s| &mut s.finger.silicone.deflation_lag_ms),
    ("hysteresis_percent", 0.0, 25.0, |s| &mut s.finger.silicone.hysteresis_percent),
    ("creep_percent", 0.0, 25.0, |s| &mut s.finger.silicone.creep_percent),
    ("creep_time_s", 0.1, 600.0, |s| &mut s.finger.silicone.creep_time_s),
    ("bending_hz", 0.1, 50.0, |s| &mut s.finger.silicone.bending_hz),
    ("bending_damping", 0.1, 2.0, |s| &mut s.finger.silicone.bending_damping),
    ("free_bend_gain[0]", 0.5, 2.0, |s| &mut s.finger.free_bend_gain[0]),
    ("free_bend_gain[1]", 0.5, 2.0, |s| &mut s.finger.free_bend_gain[1]),
    ("free_bend_gain[2]", 0.5, 2.0, |s| &mut s.finger.free_bend_gain[2]),
    ("contact_ue", 1.0, 20_000.0, |s| &mut s.finger.contact_ue),
    ("contact_percent", 0.0, 50.0, |s| &mut s.finger.contact_percent),
    ("settle_ms", 0.0, 10_000.0, |s| &mut s.grip.settle_ms),
    ("loss_allowance_percent", 1.0, 50.0, |s| &mut s.detection.loss_allowance_percent),
    ("loss_evidence_percent_ms", 1.0, 10_000.0, |s| &mut s.detection.loss_evidence_percent_ms),
    ("slip_percent", 1.0, 50.0, |s| &mut s.detection.slip_percent),
    ("air_loss_kpa", 1.0, 100.0, |s| &mut s.detection.air_loss_kpa),
    ("not_following_ms", 10.0, 10_000.0, |s| &mut s.grip.not_following_ms),
    ("supply_min_v", 0.0, 30.0, |s| &mut s.grip.supply_min_v),
    ("lift_margin_percent", 0.0, 1_000.0, |s| &mut s.grip.lift_margin_percent),
    ("grip_pressure_kpa", 1.0, 160.0, |s| &mut s.grip.grip_pressure_kpa),
];

/// Lives that share a season.
const LIVES_PER_SEASON: u64 = 64;

/// Valid settings over their whole ranges, their ends most of all.
pub fn any_settings(rng: &mut Rng) -> Settings {
    let mut settings = Settings::default();
    settings.finger.gauge_sense = pick(rng, &[GaugeSense::Bend, GaugeSense::Contact]);
    settings.grip.on_fault = pick(rng, &[OnFault::Hold, OnFault::Vent]);
    settings.grip.on_loss = pick(rng, &[OnLoss::Hold, OnLoss::Vent, OnLoss::Regrip]);
    for (name, min, max, field) in FIELDS {
        let max = match name {
            "grip_pressure_kpa" => settings.regulator.max_pressure_kpa,
            _ => max,
        };
        let value = field(&mut settings);
        *value = match rng.u8(..8) {
            0 => min,
            1 => max,
            2 | 3 => min + (max - min) * rng.f32(),
            // As near to the lower end as the range is wide.
            4 => (min + (max - min) * rng.f32().powi(6)).min(max),
            _ => value.clamp(min, max),
        };
    }
    settings
}

/// Settings with one wrong number, and its name.
pub fn wrong_settings(rng: &mut Rng) -> (Settings, &'static str) {
    let mut settings = any_settings(rng);
    let (name, min, max, field) = FIELDS[rng.usize(..FIELDS.len())];
    let max = match name {
        "grip_pressure_kpa" => settings.regulator.max_pressure_kpa,
        _ => max,
    };
    *field(&mut settings) = match rng.u8(..6) {
        0 => min.next_down(),
        1 => max.next_up(),
        2 => f32::NAN,
        3 => f32::INFINITY,
        4 => f32::NEG_INFINITY,
        _ => -1.0 - 1e6 * rng.f32(),
    };
    (settings, name)
}

/// How often each state was seen and each fault told.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Census {
    pub ticks: u64,
    pub states: [u64; 6],
    pub faults: [u64; RULES.len()],
}

const STATES: [&str; 6] = ["Idle", "Closing", "Holding", "Empty", "Releasing", "Fault"];

impl Census {
    fn count(&mut self, outputs: &Outputs) {
        self.ticks += 1;
        let state = match outputs.snapshot.state {
            State::Idle => 0,
            State::Closing { .. } => 1,
            State::Holding { .. } => 2,
            State::Empty { .. } => 3,
            State::Releasing { .. } => 4,
            State::Fault { .. } => 5,
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
            .validate(&FrontEnd::REFERENCE, &FINGER)
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
    match rng.u8(..12) {
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
        _ => Command::Tare,
    }
}

//! Settings and a plant that go together, and the places from which sequences start.

use crate::mock::MockBoard;
use crate::torture::limits::Limits;
use crate::torture::plant::{Happening, Plant};
use crate::torture::promises::Promises;
use crate::torture::sequence::Player;
use fastrand::Rng;
use softgrip::settings::{OnFault, OnLoss, Settings};
use softgrip::{Command, Grip};

/// A regulator that differs from its setting by more than this on a ramp may be called not following: half
/// of what is a deviation, for pressure and command deviate in other ways too.
const MATCHED_KPA: f32 = 4.0;

/// Where a sequence starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    PowerOn,
    Idle,
    Closing,
    Holding,
    HoldingWithTwo,
    Changing,
    Empty,
    Stopped,
}

pub const STARTS: [Start; 8] = [
    Start::PowerOn,
    Start::Idle,
    Start::Closing,
    Start::Holding,
    Start::HoldingWithTwo,
    Start::Changing,
    Start::Empty,
    Start::Stopped,
];

/// What many sequences share.
pub struct Season {
    pub settings: Settings,
    pub hose_lag_ms: f32,
    pub noise_ue: f32,
    players: Vec<Player>,
}

impl Season {
    /// The season of this seed.
    pub fn new(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let hose_lag_ms = between(&mut rng, 20.0, 200.0);
        let slew_kpa_per_s = pick(&mut rng, &[200.0, 400.0, 400.0, 1_000.0]);
        // Most users measure the lag of their regulator.
        let regulator_lag_ms = match rng.u8(..4) {
            0 => Settings::default().air.regulator_lag_ms,
            _ => hose_lag_ms * between(&mut rng, 0.97, 1.03),
        };
        let mut settings = Settings::default();
        settings.grip.grip_pressure_kpa = between(&mut rng, 100.0, 145.0);
        settings.regulator.max_pressure_kpa = between(&mut rng, 150.0, 160.0);
        settings.regulator.slew_kpa_per_s = slew_kpa_per_s;
        settings.air.regulator_lag_ms = regulator_lag_ms;
        settings.grip.settle_ms = pick(&mut rng, &[100.0, 150.0, 150.0, 300.0]);
        settings.grip.not_following_ms = pick(&mut rng, &[100.0, 300.0, 300.0, 1_000.0]);
        settings.grip.host_timeout_ms = pick(&mut rng, &[0.0, 0.0, 100.0, 500.0]);
        settings.grip.on_fault = pick(&mut rng, &[OnFault::Hold, OnFault::Hold, OnFault::Vent]);
        settings.grip.on_loss = pick(&mut rng, &[OnLoss::Hold, OnLoss::Vent, OnLoss::Regrip]);
        settings.grip.regrip_raise_kpa = between(&mut rng, 0.0, 30.0);
        let noise_ue = match rng.u8(..8) {
            // The quietest that there is: a code that never changes while the pressure does is a stuck gauge.
            0 => 1.0,
            1..5 => 30.0,
            // 400 µε rms at the most.
            _ => between(&mut rng, 30.0, 690.0),
        };
        let mut season = Self {
            settings,
            hose_lag_ms,
            noise_ue,
            players: Vec::new(),
        };
        season.players = STARTS.map(|start| season.player(start)).into();
        season
    }

    /// A player at a start.
    pub fn start(&self, start: Start) -> Player {
        self.players[start as usize].clone()
    }

    /// Whether the regulator's model is good enough for a grip.
    pub fn is_matched(&self) -> bool {
        let off_s = (self.hose_lag_ms - self.settings.air.regulator_lag_ms).abs() * 1e-3;
        off_s * self.settings.regulator.slew_kpa_per_s < MATCHED_KPA
    }

    /// Time in which a grip at any pressure is judged, ms.
    pub fn grip_ms(&self) -> u32 {
        let ramp_s =
            self.settings.regulator.max_pressure_kpa / self.settings.regulator.slew_kpa_per_s;
        (1e3 * ramp_s + 5.0 * self.hose_lag_ms + self.settings.grip.settle_ms) as u32 + 600
    }

    fn player(&self, start: Start) -> Player {
        let mut board = MockBoard::new(self.settings);
        board.noise_ue = self.noise_ue;
        board.valve_lag_ms = self.hose_lag_ms;
        let mut player = Player {
            plant: Plant::new(board),
            limits: Limits::new(&self.settings, None),
            promises: Promises::default(),
            speaks: self.settings.grip.host_timeout_ms > 0.0,
            silent_ticks: 0,
        };
        if start != Start::PowerOn {
            player.warm_up(Command::Alive, 1_100);
        }
        let object = match start {
            Start::PowerOn | Start::Idle | Start::Empty => None,
            Start::HoldingWithTwo => Some([true, false, true]),
            Start::Closing | Start::Holding | Start::Changing | Start::Stopped => Some([true; 3]),
        };
        if let Some(fingers) = object {
            player.plant.happen(Happening::PutIn(fingers));
            player.warm_up(Command::Alive, 50);
        }
        let grips = match start {
            Start::PowerOn | Start::Idle => 0,
            Start::Closing => 300,
            _ => self.grip_ms() + 300,
        };
        if grips > 0 {
            player.warm_up(Command::Grip(Grip::Default), 1);
            player.warm_up(Command::Alive, grips);
        }
        match start {
            Start::Changing => {
                let other = softgrip::units::Kilopascals(self.settings.regulator.max_pressure_kpa);
                player.warm_up(Command::Grip(Grip::Pressure(other)), 1);
                player.warm_up(Command::Alive, 50);
            }
            Start::Stopped => player.warm_up(Command::Stop, 1),
            _ => {}
        }
        player
    }
}

pub fn between(rng: &mut Rng, low: f32, high: f32) -> f32 {
    low + (high - low) * rng.f32()
}

pub fn pick<T: Copy>(rng: &mut Rng, choices: &[T]) -> T {
    choices[rng.usize(..choices.len())]
}

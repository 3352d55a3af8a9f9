//! A gripper without physics: air that lags, fingers that follow the table, an object that takes a
//! share of their bend, and everything that can break.

use softgrip::condition::RawFrame;
use softgrip::frontend::{FrontEnd, RAIL};
use softgrip::grasp::State;
use softgrip::settings::Settings;
use softgrip::table::{self, FINGER};
use softgrip::telemetry::Event;
use softgrip::units::{AdcCode, DacCode, Instant, Kilopascals, Microstrain, Millivolts, Volts};
use softgrip::{Command, Controller, FINGERS, Grip, Outputs};

const FE: FrontEnd = FrontEnd::REFERENCE;
/// Pressure at which the free fingers would meet the object, kPa.
const TOUCH_KPA: f32 = 60.0;

/// What is wrong with one gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GaugeState {
    Good,
    Open,
    Short,
    /// Shows its last code for ever.
    Stuck,
    /// Beyond the range of the amplifier.
    Saturated,
    /// So much more strain than there is, µε.
    Offset(f32),
    /// Noise on top, uniform, ± µε.
    Noisy(f32),
}

/// The board, the air and the fingers.
#[derive(Clone)]
pub struct MockBoard {
    pub controller: Controller,
    /// Share of the object's grip on each finger: 1 is held, 0 is free.
    pub grip: [f32; FINGERS],
    /// Pressure at which the free fingers would meet the object, or one another, kPa.
    pub touch_kpa: f32,
    pub gauges: [GaugeState; FINGERS],
    /// Gauge noise, uniform, ± µε.
    pub noise_ue: f32,
    /// The supply line leaks: pressure never gets above this.
    pub leak_kpa: f32,
    /// The valve no longer moves.
    pub valve_stuck: bool,
    /// The valve gives this pressure, whatever it is told.
    pub valve_forced_kpa: Option<f32>,
    /// Time constant of the air behind the valve, ms.
    pub valve_lag_ms: f32,
    /// Steepest change that the valve makes, kPa/ms.
    pub valve_slew_kpa: f32,
    /// What the valve does is what it was told this long ago, ms; 255 at most.
    pub valve_dead_ms: u8,
    /// The monitor's wire carries this code instead of its signal.
    pub monitor_wire: Option<AdcCode>,
    /// The converter delivers nothing.
    pub late: bool,
    /// The converter loses data.
    pub overrun: bool,
    pub supply_v: f32,
    pub rail: Millivolts,
    pub now_us: u64,
    /// Everything reported, with its time in ms.
    pub events: Vec<(u64, Event)>,
    pub last: Option<Outputs>,
    told_kpa: [f32; 256],
    valve_kpa: f32,
    pub pressure_kpa: f32,
    inflated_kpa: f32,
    bend: [f32; 2],
    dac: DacCode,
    codes: [AdcCode; FINGERS],
    random: u32,
}

impl MockBoard {
    pub fn new(settings: Settings) -> Self {
        let active = settings
            .validate(&FINGER)
            .expect("the test's settings are valid");
        Self {
            controller: Controller::new(&FINGER, active),
            grip: [0.0; FINGERS],
            touch_kpa: TOUCH_KPA,
            gauges: [GaugeState::Good; FINGERS],
            noise_ue: 30.0,
            leak_kpa: f32::MAX,
            valve_stuck: false,
            valve_forced_kpa: None,
            valve_lag_ms: 60.0,
            valve_slew_kpa: f32::MAX,
            valve_dead_ms: 0,
            monitor_wire: None,
            late: false,
            overrun: false,
            supply_v: 24.0,
            rail: RAIL,
            now_us: 0,
            events: Vec::new(),
            last: None,
            told_kpa: [0.0; 256],
            valve_kpa: 0.0,
            pressure_kpa: 0.0,
            inflated_kpa: 0.0,
            bend: [0.0; 2],
            dac: DacCode(0),
            codes: [AdcCode(0); FINGERS],
            random: 1,
        }
    }

    /// Holding an object at 140 kPa, half a second after the controller said so.
    pub fn holding(settings: Settings) -> Self {
        let mut board = Self::new(settings);
        board.grip = [1.0; FINGERS];
        board.step(Command::Grip(Grip::Pressure(Kilopascals(140.0))));
        board.run(1_500);
        assert_eq!(
            board.count(|event| matches!(event, Event::Holding { .. })),
            1
        );
        board.events.clear();
        board
    }

    /// As it is some time after a reset with the valve still open.
    pub fn inflate(&mut self, kpa: f32) {
        self.pressure_kpa = kpa;
        self.inflated_kpa = kpa;
        self.bend = [kpa, 0.0];
    }

    /// One tick.
    pub fn step(&mut self, command: Command) -> Outputs {
        let outputs = self.quiet_step(command);
        let now_ms = self.now_us / 1_000;
        self.events
            .extend(outputs.events.iter().map(|&event| (now_ms, event)));
        assert_eq!(outputs.events.lost(), 0);
        self.last = Some(outputs.clone());
        outputs
    }

    /// One tick of which nothing is kept here but what the plant needs.
    pub fn quiet_step(&mut self, command: Command) -> Outputs {
        let frame = self.sense();
        self.act(&frame, command)
    }

    /// The first half of a tick: what the converter delivers.
    pub fn sense(&mut self) -> RawFrame {
        self.now_us = self.now_us.saturating_add(1_000);
        self.blow();
        self.frame()
    }

    /// The second half: what the controller makes of it.
    pub fn act(&mut self, frame: &RawFrame, command: Command) -> Outputs {
        let now = Instant::from_micros(self.now_us);
        let outputs = self.controller.step(now, frame, command);
        self.dac = outputs.dac;
        outputs
    }

    /// Another noise from now on.
    pub fn seed(&mut self, seed: u32) {
        // The generator never leaves zero.
        self.random = seed.max(1);
    }

    /// So many ticks without a new command.
    pub fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.step(Command::Continue);
        }
    }

    /// The grip of every finger goes from 90 % to 10 % in 35 ms and stays at the weight's 14 %.
    pub fn drop_object(&mut self) {
        for ms in 0..80 {
            self.grip = [(1.0 - ms as f32 / 44.0).max(0.14); FINGERS];
            self.step(Command::Continue);
        }
    }

    pub fn count(&self, is: impl Fn(&Event) -> bool) -> usize {
        self.events.iter().filter(|(_, event)| is(event)).count()
    }

    /// When something was first reported, ms.
    pub fn first(&self, is: impl Fn(&Event) -> bool) -> Option<u64> {
        self.events
            .iter()
            .find(|(_, event)| is(event))
            .map(|&(ms, _)| ms)
    }

    /// Where the gripper is.
    pub fn state(&self) -> State {
        self.last.as_ref().expect("a tick has run").snapshot.state
    }

    pub fn now_ms(&self) -> u64 {
        self.now_us / 1_000
    }

    /// Where the valve is.
    pub fn valve_kpa(&self) -> f32 {
        self.valve_kpa
    }

    /// What the controller asks of the regulator.
    pub fn commanded_kpa(&self) -> f32 {
        FE.commanded(self.dac).0
    }

    fn blow(&mut self) {
        let tick = self.now_us / 1_000;
        self.told_kpa[tick as usize % 256] = self.commanded_kpa();
        if !self.valve_stuck {
            let told = self.told_kpa[(tick + 256 - u64::from(self.valve_dead_ms)) as usize % 256];
            let slewed = (told - self.valve_kpa).clamp(-self.valve_slew_kpa, self.valve_slew_kpa);
            self.valve_kpa = self.valve_forced_kpa.unwrap_or(match self.valve_slew_kpa {
                f32::MAX => told,
                _ => self.valve_kpa + slewed,
            });
        }
        self.pressure_kpa +=
            (self.valve_kpa.min(self.leak_kpa) - self.pressure_kpa) / self.valve_lag_ms;
        self.inflated_kpa += (self.pressure_kpa - self.inflated_kpa) / 80.0;
        let [bend, rate] = &mut self.bend;
        // The free finger's swing, as in `desk/sim/src/air.rs`: rad/s, and damping ratio.
        const OMEGA: f32 = 37.0;
        const DAMPING: f32 = 0.45;
        let spring = OMEGA * OMEGA * (self.inflated_kpa - *bend);
        *rate += 1e-3 * (spring - 2.0 * DAMPING * OMEGA * *rate);
        *bend += 1e-3 * *rate;
    }

    fn frame(&mut self) -> RawFrame {
        let free = table::free_strain(&FINGER, Kilopascals(self.bend[0])).0.0;
        let blocked = table::free_strain(&FINGER, Kilopascals(self.bend[0].min(self.touch_kpa)))
            .0
            .0;
        let gauges = std::array::from_fn(|i| {
            let strain = free - self.grip[i] * (free - blocked) + self.noise_ue * self.uniform();
            let code = |ue| AdcCode(FE.gauge_code(0, Microstrain(ue)) as u16);
            match self.gauges[i] {
                GaugeState::Good => code(strain),
                GaugeState::Open => AdcCode(65_520),
                GaugeState::Short => AdcCode(0),
                GaugeState::Stuck => self.codes[i],
                GaugeState::Saturated => code(20_300.0),
                GaugeState::Offset(ue) => code(strain + ue),
                GaugeState::Noisy(ue) => code(strain + ue * self.uniform()),
            }
        });
        self.codes = gauges;
        RawFrame {
            gauges,
            monitor: self.monitor_wire.unwrap_or(AdcCode(
                FE.monitor_code(Kilopascals(self.pressure_kpa)) as u16,
            )),
            supply: AdcCode(FE.supply_code(Volts(self.supply_v)) as u16),
            rail: self.rail,
            scans: if self.late { 0 } else { 10 },
            overrun: self.overrun,
            carried: false,
        }
    }

    /// Uniform in ±1, the same in every run (xorshift, Marsaglia 2003).
    fn uniform(&mut self) -> f32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random as f32 / u32::MAX as f32 * 2.0 - 1.0
    }
}

/// The default settings, with a change.
pub fn adjusted(change: impl FnOnce(&mut Settings)) -> Settings {
    let mut settings = Settings::default();
    change(&mut settings);
    settings
}

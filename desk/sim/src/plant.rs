//! The simulated gripper as seen by its controller: a DAC code in, ADC codes out.

use finger::grasp::Grasp;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use softgrip::frontend::FrontEnd;
use softgrip::units::{AdcCode, DacCode, Kilopascals, Microstrain, Volts};
use softgrip::{FINGERS, RawFrame};

use crate::air::{Lag, Swing, TICK_S, Valve};
use crate::arm::{ArmState, Led, Profile};
use crate::bodies::world_config;
use crate::fault::{self, FaultKind, Injected};
use crate::gripper::Gripper;
use crate::hand::Hand;
use crate::scenario::Scenario;
use crate::silicone::{Creep, Silicone};
use crate::world::{LINKS, World};

/// One 12-bit step of a left-aligned code.
const ADC_STEP: f64 = 16.0;
const ADC_MAX: f64 = 4095.0 * ADC_STEP;
/// The supply's ripple, rms of a tick's mean, V.
const SUPPLY_RIPPLE_V: f64 = 0.02;

/// A burst tube and a leak: time constants of the pressure, s.
const BURST_S: f64 = 0.030;
const LEAK_S: f64 = 1.0;
/// Time constant with which a gauge that comes off loses its gain, s.
const GAUGE_FADE_S: f64 = 3.0;
/// Noise of a noisy gauge over that of a sound one.
const NOISY: f64 = 20.0;
/// A sagging supply, V.
const SAG_V: f64 = 15.0;
/// An open gauge input passes 3.2 V after 1.3 ms (`hardware/codes/gauge-open-sig.csv`), s.
const OPEN_INPUT_S: f64 = 0.0005;
/// An open monitor input discharges its 100 nF through the divider's lower 30 kΩ (`boards/README.md`), s.
const OPEN_MONITOR_S: f64 = 0.003;

/// True state of the plant, against which the controller is judged; the controller never sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Time since the start, s.
    pub t_s: f64,
    /// Phase, position, velocity and acceleration of the arm.
    pub arm: ArmState,
    /// Centre of the object in the palm's frame, m.
    pub object_m: [f64; 3],
    /// Pressure in the fingers' supply line, kPa.
    pub pressure_kpa: f64,
    /// Contact residual of each finger, without noise, creep and quantisation, µε.
    pub residual_ue: [f64; FINGERS],
    /// Strain under each gauge with creep, without its errors, noise and quantisation, µε.
    pub strain_ue: [f64; FINGERS],
    /// Normal force of each finger on the object, N.
    pub contact_n: [f64; FINGERS],
}

/// External disturbances; zero unless set.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Disturbance {
    /// Force on the object, in the palm's frame, N.
    pub push_n: [f64; 3],
    /// Pressure that the regulator adds on its own, kPa.
    pub ripple_kpa: f64,
}

/// Voltages at the converter's pins, as fractions of its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pins {
    /// One gauge per finger.
    pub gauges: [f64; FINGERS],
    /// The regulator's pressure monitor.
    pub monitor: f64,
    /// The supply voltage, behind its divider.
    pub supply: f64,
}

/// The gripper, the object, the arm and the air.
pub struct Plant {
    world: World,
    profile: Profile,
    /// An arm that is told its moves, in place of the profile.
    led: Option<Led>,
    gripper: Gripper,
    hand: Hand,
    front_end: FrontEnd,
    noise_ue: f64,
    rng: ChaCha8Rng,
    ticks: u64,
    /// Steps that the world has made.
    steps: u64,
    valve: Valve,
    pressure: Lag,
    silicone: Silicone,
    bending: Swing,
    creep: [Creep<LINKS>; FINGERS],
    gauge_creep: Creep<FINGERS>,
    /// Angles that the joints would have if nothing were in their way, rad.
    free_rad: [[f64; LINKS]; FINGERS],
    disturbance: Disturbance,
    /// Last voltages of the gauge inputs, which an open input keeps for a while.
    gauge_codes: [AdcCode; FINGERS],
    /// Pressure that corresponds to the monitor's input voltage, kPa.
    monitor_kpa: f64,
    faults: Vec<Injected>,
}

impl Plant {
    /// A gripper above an object, without pressure.
    pub fn new(scenario: &Scenario, gripper: &Gripper, hand: &Hand, grasp: &Grasp) -> Self {
        let profile = Profile::new(&gripper.arm_task(scenario.accel_m_s2));
        let config = world_config(scenario, gripper, hand, grasp);
        let max_kpa = hand.chains[0].max_pressure_kpa();
        Self {
            world: World::new(&config, profile.at(0.0).position_m),
            profile,
            led: None,
            hand: hand.clone(),
            front_end: gripper.front_end(),
            noise_ue: scenario.noise_ue,
            rng: ChaCha8Rng::seed_from_u64(scenario.seed),
            ticks: 0,
            steps: 0,
            valve: Valve::default(),
            pressure: Lag::new(1e-3 * gripper.regulator.lag_ms),
            silicone: Silicone::new(&gripper.hand, max_kpa),
            bending: Swing::default(),
            creep: [Creep::new(gripper.hand.creep_percent, gripper.hand.creep_time_s); FINGERS],
            gauge_creep: Creep::new(gripper.gauge.creep_percent, gripper.gauge.creep_time_s),
            free_rad: [[0.0; LINKS]; FINGERS],
            disturbance: Disturbance::default(),
            gauge_codes: [AdcCode(0); FINGERS],
            monitor_kpa: 0.0,
            faults: Vec::new(),
            gripper: gripper.clone(),
        }
    }

    /// As [`Plant::new`], with the object between the fingers, under an arm that stands still until
    /// it is told a move.
    pub fn led(scenario: &Scenario, gripper: &Gripper, hand: &Hand, grasp: &Grasp) -> Self {
        let arm = Led::new();
        let config = world_config(scenario, gripper, hand, grasp);
        Self {
            world: World::new(&config, arm.at(0.0).position_m),
            led: Some(arm),
            ..Self::new(scenario, gripper, hand, grasp)
        }
    }

    /// Adds injected faults.
    pub fn with_faults(mut self, faults: &[Injected]) -> Self {
        self.faults = faults.to_vec();
        self
    }

    /// The arm's planned moves over time.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Advances by one control tick with the regulator's command at `dac`; gives what the converter
    /// measured, and the truth.
    pub fn step(&mut self, dac: DacCode) -> (RawFrame, Truth) {
        let truth = self.advance(dac);
        (self.measure(self.shown(truth.strain_ue)), truth)
    }

    /// As [`Plant::step`], but gives what stands at the pins of a converter of its own. Faults of wires and
    /// converter are left to whoever has these.
    pub fn step_pins(&mut self, dac: DacCode) -> (Pins, Truth) {
        let truth = self.advance(dac);
        let front_end = self.front_end;
        let noise_ue = self.noise_ue;
        let monitor_noise = self.gripper.regulator.monitor_noise_kpa;
        let pins = Pins {
            gauges: self.shown(truth.strain_ue).map(|strain| {
                self.share(
                    noise_ue,
                    |ue| front_end.gauge_code(0, Microstrain(ue)),
                    strain,
                )
            }),
            monitor: self.share(
                monitor_noise,
                |kpa| front_end.monitor_code(Kilopascals(kpa)),
                truth.pressure_kpa,
            ),
            supply: self.share(
                SUPPLY_RIPPLE_V,
                |v| front_end.supply_code(Volts(v)),
                self.gripper.regulator.supply_v,
            ),
        };
        (pins, truth)
    }

    /// Advances arm, air and fingers by one control tick.
    fn advance(&mut self, dac: DacCode) -> Truth {
        self.ticks += 1;
        let t_s = self.t_s();
        let arm = self.arm_at(t_s);
        let inflated_kpa = self.inflate(dac);
        let torques = self.drive(inflated_kpa);
        self.move_world(&torques);

        let angles = self.world.joint_angles();
        let gauge = |i: usize, angles: &[_; LINKS]| self.hand.chains[i].gauge_strain_ue(angles);
        let strain = std::array::from_fn(|i| gauge(i, &angles[i]));
        let free: [f64; FINGERS] = std::array::from_fn(|i| gauge(i, &self.free_rad[i]));
        let crept = self.gauge_creep.step(strain);
        Truth {
            t_s,
            arm,
            object_m: self.world.object_position(),
            pressure_kpa: self.pressure_kpa(),
            residual_ue: std::array::from_fn(|i| free[i] - strain[i]),
            strain_ue: std::array::from_fn(|i| strain[i] + crept[i]),
            contact_n: self.world.contact_force(),
        }
    }

    /// Torque at every joint, N·m, for a pressure that the silicone has followed; moves the free finger along.
    fn drive(&mut self, inflated_kpa: f64) -> [[f64; LINKS]; FINGERS] {
        let swung_kpa = self.bending.step(inflated_kpa);
        std::array::from_fn(|i| {
            let (chain, factor) = (&self.hand.chains[i], self.gripper.hand.finger_stiffness[i]);
            let torque = chain.joint_torques_nm(inflated_kpa);
            let crept = self.creep[i].step(torque);
            // Creep is slow: only the rest of it swings.
            let bent = chain.joint_torques_nm(swung_kpa);
            let stiffness = chain.joint_stiffness_nm_per_rad;
            self.free_rad[i] =
                std::array::from_fn(|j| (bent[j] + crept[j]) / (factor * stiffness[j]));
            std::array::from_fn(|j| torque[j] + crept[j])
        })
    }

    /// What the gauges show of these strains, µε.
    fn shown(&self, strain_ue: [f64; FINGERS]) -> [f64; FINGERS] {
        let (gain, offset_ue) = (self.hand.gauge_gain, self.hand.gauge_offset_ue);
        std::array::from_fn(|i| gain[i] * strain_ue[i] + offset_ue[i])
    }

    /// Time since the start, s.
    pub fn t_s(&self) -> f64 {
        self.ticks as f64 * TICK_S
    }

    fn arm_at(&self, t_s: f64) -> ArmState {
        match &self.led {
            Some(led) => led.at(t_s),
            None => self.profile.at(t_s),
        }
    }

    /// The arm that is led; none where it moves as planned.
    pub fn arm_mut(&mut self) -> Option<&mut Led> {
        self.led.as_mut()
    }

    /// The object and the ground.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// The injected faults, of which there may be more or fewer from the next tick on.
    pub fn faults_mut(&mut self) -> &mut Vec<Injected> {
        &mut self.faults
    }

    /// Sets the supply voltage, V.
    pub fn set_supply(&mut self, supply_v: f64) {
        self.gripper.regulator.supply_v = supply_v;
    }

    /// Whether a fault of this kind is active.
    fn broken(&self, kind: FaultKind) -> bool {
        fault::any(&self.faults, kind, self.t_s())
    }

    /// The active fault of this kind at one finger's gauge.
    fn gauge_fault(&self, kind: FaultKind, finger: usize) -> Option<&Injected> {
        self.faults
            .iter()
            .find(|f| f.kind == kind && f.finger == Some(finger) && f.is_on(self.t_s()))
    }

    /// Sliding speed of the object along each finger that touches it, m/s.
    pub fn sliding_m_s(&self) -> [Option<f64>; FINGERS] {
        self.world.sliding_m_s()
    }

    /// Sets the external disturbances from the next tick on.
    pub fn disturb(&mut self, disturbance: Disturbance) {
        self.disturbance = disturbance;
        self.world.push(disturbance.push_n);
    }

    fn pressure_kpa(&self) -> f64 {
        // Ripple is made of air: there is none without pressure.
        (self.pressure.value + self.disturbance.ripple_kpa).max(0.0)
    }

    /// Brings the world up to this tick, in steps that may be shorter or longer than a tick.
    fn move_world(&mut self, torques_nm: &[[f64; LINKS]; FINGERS]) {
        let step_ms = self.gripper.world.step_ms;
        while (self.steps + 1) as f64 * step_ms <= self.ticks as f64 {
            self.steps += 1;
            let t_s = (self.steps as f64 * step_ms) * TICK_S;
            let palm_m = self.arm_at(t_s).position_m;
            self.world.step(torques_nm, palm_m);
        }
    }

    /// Angle of every joint, inward positive, rad.
    pub fn joint_angles(&self) -> [[f64; LINKS]; FINGERS] {
        self.world.joint_angles()
    }

    /// Angle that every joint would have if nothing were in its way, rad.
    pub fn free_joint_angles(&self) -> [[f64; LINKS]; FINGERS] {
        self.free_rad
    }

    /// Direction in which the cylinder stands, in the palm's frame, for drawing.
    pub fn object_axis(&self) -> [f64; 3] {
        self.world.object_axis()
    }

    /// Ends of every link in the palm's frame, for drawing, m.
    pub fn link_ends(&self) -> [[[[f64; 3]; 2]; LINKS]; FINGERS] {
        self.world.link_ends()
    }

    /// The pressure in the fingers for a command of the regulator, kPa.
    fn inflate(&mut self, dac: DacCode) -> f64 {
        let regulator = &self.gripper.regulator;
        let wanted = if self.broken(FaultKind::OverPressure) {
            f64::from(self.front_end.regulator_full_scale.0)
        } else {
            Valve::wanted_kpa(&self.front_end, regulator, dac)
        };
        if !self.broken(FaultKind::RegulatorStuck) {
            self.valve.step(&self.gripper.regulator, wanted);
        }
        let before = self.pressure.value;
        if self.broken(FaultKind::TubeBurst) {
            self.pressure.value *= (-TICK_S / BURST_S).exp();
        } else if self.broken(FaultKind::Leak) {
            self.pressure.value *= (-TICK_S / LEAK_S).exp();
        } else {
            self.pressure.step(self.valve.kpa);
        }
        if self.broken(FaultKind::SupplyClosed) {
            self.pressure.value = self.pressure.value.min(before);
        }
        let pressure = self.pressure_kpa();
        self.silicone.step(pressure)
    }

    fn measure(&mut self, strain_ue: [f64; FINGERS]) -> RawFrame {
        self.gauge_codes = std::array::from_fn(|i| self.measure_gauge(i, strain_ue[i]));
        let front_end = self.front_end;
        let monitor_noise = self.gripper.regulator.monitor_noise_kpa;
        self.monitor_kpa = match self.broken(FaultKind::MonitorOff) {
            true => self.monitor_kpa * (-TICK_S / OPEN_MONITOR_S).exp(),
            false => self.pressure_kpa(),
        };
        let monitor = self.convert(
            monitor_noise,
            |kpa| front_end.monitor_code(Kilopascals(kpa)),
            self.monitor_kpa,
        );
        let supply_v = match self.broken(FaultKind::SupplySag) {
            true => SAG_V,
            false => self.gripper.regulator.supply_v,
        };
        let supply = self.convert(
            SUPPLY_RIPPLE_V,
            |v| front_end.supply_code(Volts(v)),
            supply_v,
        );
        if self.broken(FaultKind::StaleFrame) {
            return RawFrame::default();
        }
        let frame = RawFrame {
            gauges: self.gauge_codes,
            monitor,
            supply,
            rail: softgrip::frontend::RAIL,
            scans: self.gripper.gauge.scans,
            overrun: false,
            carried: false,
        };
        if self.broken(FaultKind::AdcOverrun) {
            // Everything is in the place before its own.
            let mut gauges = frame.gauges;
            gauges.rotate_left(1);
            let supply = std::mem::replace(&mut gauges[FINGERS - 1], frame.monitor);
            return RawFrame {
                gauges,
                monitor: frame.supply,
                supply,
                overrun: true,
                ..frame
            };
        }
        frame
    }

    fn measure_gauge(&mut self, finger: usize, mut strain_ue: f64) -> AdcCode {
        let (front_end, last) = (self.front_end, self.gauge_codes[finger]);
        let fault = |kind| self.gauge_fault(kind, finger);
        let mut noise_ue = self.noise_ue;
        if let Some(drift) = fault(FaultKind::GaugeDrift) {
            strain_ue *= (-(self.t_s() - drift.from_s) / GAUGE_FADE_S).exp();
        }
        if fault(FaultKind::GaugeNoisy).is_some() {
            noise_ue *= NOISY;
        }
        if fault(FaultKind::GaugeSaturated).is_some() {
            // Between the end of the scale and that of the amplifier.
            strain_ue = 1.15 * f64::from(front_end.amplifier.full_scale.0);
        }
        let wire = [
            FaultKind::GaugeShort,
            FaultKind::GaugeOpen,
            FaultKind::GaugeStuck,
        ]
        .map(|kind| fault(kind).is_some());
        let to_code = |ue| front_end.gauge_code(finger, Microstrain(ue));
        let code = self.convert(noise_ue, to_code, strain_ue);
        match wire {
            [true, ..] => AdcCode(0),
            [_, true, _] => {
                let gain = 1.0 - (-TICK_S / OPEN_INPUT_S).exp();
                let last = f64::from(last.0);
                AdcCode((last + gain * (ADC_MAX - last)).round() as u16)
            }
            [.., true] => last,
            [false, false, false] => code,
        }
    }

    /// The voltage behind `value` with one draw of noise, as a share of the reference.
    fn share(&mut self, noise: f64, to_code: impl Fn(f32) -> f32, value: f64) -> f64 {
        let draw: f64 = self.rng.sample(StandardNormal);
        let code = f64::from(to_code((value + noise * draw) as f32));
        (code / 65_536.0).clamp(0.0, 1.0)
    }

    /// The mean of one tick's scans. `noise` is the rms of that mean; each scan is quantised to 12 bits.
    fn convert(&mut self, noise: f64, to_code: impl Fn(f32) -> f32, value: f64) -> AdcCode {
        let scans = self.gripper.gauge.scans;
        let scan_noise = noise * f64::from(scans).sqrt();
        let sum: f64 = (0..scans)
            .map(|_| {
                let noise: f64 = self.rng.sample(StandardNormal);
                let code = f64::from(to_code((value + scan_noise * noise) as f32));
                (code / ADC_STEP).round() * ADC_STEP
            })
            .map(|code| code.clamp(0.0, ADC_MAX))
            .sum();
        AdcCode((sum / f64::from(scans)) as u16)
    }
}

//! The simulated gripper as its controller sees it: a DAC code goes in, ADC codes come out.

use std::f64::consts::TAU;

use finger::capability::Object;
use finger::chain::Chain;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use softgrip::frontend::FrontEnd;
use softgrip::units::{AdcCode, DacCode, Kilopascals, Microstrain, Volts};
use softgrip::{FINGERS, RawFrame};

use crate::arm::{ArmState, Profile};
use crate::gripper::Gripper;
use crate::scenario::{ObjectKind, Scenario};
use crate::world::{Finger, LINKS, Shape, World, WorldConfig};

/// Control tick, s.
const TICK_S: f64 = 0.001;
/// One 12-bit step of a left-aligned code.
const ADC_STEP: f64 = 16.0;
const ADC_MAX: f64 = 4095.0 * ADC_STEP;
/// The supply's ripple, rms of a tick's mean, V.
const SUPPLY_RIPPLE_V: f64 = 0.02;

/// What really happens, for judging the controller; it never sees this.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Time since the start, s.
    pub t_s: f64,
    /// The arm.
    pub arm: ArmState,
    /// Centre of the object in the palm's frame, m.
    pub object_m: [f64; 3],
    /// Pressure in the fingers' supply line, kPa.
    pub pressure_kpa: f64,
    /// Contact residual of each finger, without noise, creep and quantisation, µε.
    pub residual_ue: [f64; FINGERS],
    /// Normal force of each finger on the object, N.
    pub contact_n: [f64; FINGERS],
}

/// What stands at the converter's pins, as shares of its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pins {
    /// One gauge per finger.
    pub gauges: [f64; FINGERS],
    /// The regulator's pressure monitor.
    pub monitor: f64,
    /// The supply voltage.
    pub supply: f64,
}

/// First-order lag.
#[derive(Debug, Clone, Copy)]
struct Lag {
    gain: f64,
    value: f64,
}

impl Lag {
    fn new(time_constant_s: f64) -> Self {
        Self {
            gain: 1.0 - (-TICK_S / time_constant_s).exp(),
            value: 0.0,
        }
    }

    fn step(&mut self, input: f64) -> f64 {
        self.value += self.gain * (input - self.value);
        self.value
    }
}

/// A free finger's swing behind its pressure, fitted to free closes and openings of the simulated
/// finger (0.003 rad at worst).
#[derive(Debug, Clone, Copy, Default)]
struct Swing {
    value: f64,
    rate: f64,
}

impl Swing {
    /// Natural frequency, 1/s, and damping ratio.
    const OMEGA: f64 = 37.0;
    const DAMPING: f64 = 0.45;

    fn step(&mut self, input: f64) -> f64 {
        let acceleration = Self::OMEGA * Self::OMEGA * (input - self.value)
            - 2.0 * Self::DAMPING * Self::OMEGA * self.rate;
        self.rate += TICK_S * acceleration;
        self.value += TICK_S * self.rate;
        self.value
    }
}

/// The gripper, the object, the arm and the air.
pub struct Plant {
    world: World,
    profile: Profile,
    gripper: Gripper,
    chain: Chain,
    front_end: FrontEnd,
    noise_ue: f64,
    rng: ChaCha8Rng,
    ticks: u64,
    /// Steps that the world has made.
    steps: u64,
    valve_kpa: f64,
    pressure: Lag,
    inflation: Lag,
    bending: Swing,
    creep: [Lag; FINGERS],
}

impl Plant {
    /// A gripper above an object, without pressure.
    pub fn new(scenario: &Scenario, gripper: &Gripper, chain: &Chain) -> Self {
        let profile = Profile::new(&gripper.motion(scenario.accel_m_s2));
        let hand = &gripper.hand;
        let finger = Finger {
            length_m: chain.link_length_m,
            mass_kg: chain.link_mass_kg,
            stiffness_nm_rad: chain.joint_stiffness_nm_per_rad,
            damping_s: 1e-3 * hand.damping_ms,
        };
        let gripped = match scenario.object {
            ObjectKind::Sphere => chain.grasp.sphere,
            ObjectKind::Cylinder => chain.grasp.cylinder,
        };
        let shape = match gripped.object {
            Object::Sphere { radius_m } => Shape::Sphere {
                diameter_m: 2.0 * radius_m,
            },
            Object::Cylinder { radius_m, height_m } => Shape::Cylinder {
                diameter_m: 2.0 * radius_m,
                height_m,
            },
        };
        let config = WorldConfig {
            fingers: [finger; FINGERS],
            link_radius_m: chain.grasp.link_radius_m,
            palm_radius_m: chain.grasp.palm_radius_m,
            first_finger_rad: TAU * hand.first_finger_deg / 360.0,
            shape,
            mass_kg: scenario.mass_kg,
            grasp_depth_m: gripped.depth_m,
            friction: scenario.friction,
            sliding_friction: hand.sliding_friction * scenario.friction,
            carry_m: 1e-3 * gripper.arm.carry_mm,
            fingers_touch: false,
            step_s: 1e-3 * gripper.world.step_ms,
        };
        Self {
            world: World::new(&config, profile.at(0.0).position_m),
            profile,
            chain: chain.clone(),
            front_end: FrontEnd::REFERENCE,
            noise_ue: scenario.noise_ue,
            rng: ChaCha8Rng::seed_from_u64(scenario.seed),
            ticks: 0,
            steps: 0,
            valve_kpa: 0.0,
            pressure: Lag::new(1e-3 * gripper.regulator.lag_ms),
            inflation: Lag::new(1e-3 * hand.inflation_lag_ms),
            bending: Swing::default(),
            creep: [Lag::new(gripper.gauge.creep_time_s); FINGERS],
            gripper: gripper.clone(),
        }
    }

    /// The arm's cycle.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Advances by one control tick with the regulator's command at `dac`; gives what the converter
    /// measured, and the truth.
    pub fn step(&mut self, dac: DacCode) -> (RawFrame, Truth) {
        let (strain, truth) = self.advance(dac);
        (self.measure(strain), truth)
    }

    /// As [`Plant::step`], but gives what stands at the pins of a converter of its own.
    pub fn step_pins(&mut self, dac: DacCode) -> (Pins, Truth) {
        let (strain, truth) = self.advance(dac);
        let front_end = self.front_end;
        let noise_ue = self.noise_ue;
        let monitor_noise = self.gripper.regulator.monitor_noise_kpa;
        let pins = Pins {
            gauges: strain.map(|strain| {
                self.share(noise_ue, |ue| front_end.gauge_code(Microstrain(ue)), strain)
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

    /// One tick of arm, air and fingers; gives what the gauges feel, and the truth.
    fn advance(&mut self, dac: DacCode) -> ([f64; FINGERS], Truth) {
        self.ticks += 1;
        let t_s = self.ticks as f64 * TICK_S;
        let arm = self.profile.at(t_s);
        let inflated_kpa = self.inflate(dac);
        let torques = self.chain.joint_torques_nm(inflated_kpa);
        self.move_world(&[torques; FINGERS]);

        let angles = self.world.joint_angles();
        let strain = angles.map(|angles: [f64; LINKS]| self.chain.gauge_strain_ue(&angles));
        let free = self.chain.free_strain_ue(self.bending.step(inflated_kpa));
        let truth = Truth {
            t_s,
            arm,
            object_m: self.world.object_position(),
            pressure_kpa: self.pressure.value,
            residual_ue: strain.map(|strain| free - strain),
            contact_n: self.world.contact_force(),
        };
        let creep = 0.01 * self.gripper.gauge.creep_percent;
        let felt = std::array::from_fn(|i| strain[i] + creep * self.creep[i].step(strain[i]));
        (felt, truth)
    }

    /// Brings the world up to this tick, in steps that may be shorter or longer than a tick.
    fn move_world(&mut self, torques_nm: &[[f64; LINKS]; FINGERS]) {
        let step_ms = self.gripper.world.step_ms;
        while (self.steps + 1) as f64 * step_ms <= self.ticks as f64 {
            self.steps += 1;
            let t_s = (self.steps as f64 * step_ms) * TICK_S;
            self.world.step(torques_nm, self.profile.at(t_s).position_m);
        }
    }

    /// Direction in which the cylinder stands, in the palm's frame, for drawing.
    pub fn object_axis(&self) -> [f64; 3] {
        self.world.object_axis()
    }

    /// Ends of every link in the palm's frame, for drawing, m.
    pub fn link_ends(&self) -> [[[[f64; 3]; 2]; LINKS]; FINGERS] {
        self.world.link_ends()
    }

    /// From the regulator's command to the pressure that bends the fingers.
    fn inflate(&mut self, dac: DacCode) -> f64 {
        let regulator = &self.gripper.regulator;
        let commanded = f64::from(self.front_end.commanded(dac).0);
        // Below its dead band a regulator shuts: zero is zero.
        let wanted = if commanded > 1.0 {
            (regulator.gain * commanded + regulator.offset_kpa).max(0.0)
        } else {
            0.0
        };
        let slew = regulator.slew_kpa_per_s * TICK_S;
        self.valve_kpa += (wanted - self.valve_kpa).clamp(-slew, slew);
        let pressure = self.pressure.step(self.valve_kpa);
        self.inflation.step(pressure)
    }

    fn measure(&mut self, strain_ue: [f64; FINGERS]) -> RawFrame {
        let front_end = self.front_end;
        let noise_ue = self.noise_ue;
        let gauges = strain_ue.map(|strain| {
            self.convert(noise_ue, |ue| front_end.gauge_code(Microstrain(ue)), strain)
        });
        let monitor_noise = self.gripper.regulator.monitor_noise_kpa;
        let pressure = self.pressure.value;
        let monitor = self.convert(
            monitor_noise,
            |kpa| front_end.monitor_code(Kilopascals(kpa)),
            pressure,
        );
        let supply_v = self.gripper.regulator.supply_v;
        let supply = self.convert(
            SUPPLY_RIPPLE_V,
            |v| front_end.supply_code(Volts(v)),
            supply_v,
        );
        RawFrame {
            gauges,
            monitor,
            supply,
            scans: self.gripper.gauge.scans,
            overrun: false,
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

//! All parameters of one run, and the names by which a sweep varies them.

use anyhow::{Context, ensure};
use finger::chain::Chain;
use finger::grasp::{Grasp, Gripped};
use finger::object::Object;
use finger::recipe::Recipe;
use softgrip::settings::Settings;
use softgrip::table::FingerTable;

use crate::arm::Profile;
use crate::fault::Injected;
use crate::gripper::Gripper;
use crate::hand::Hand;
use crate::plant::Plant;
use crate::run::{self, Run};
use crate::scenario::{ObjectKind, Scenario};

/// All parameters of one run.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Object, arm and grip.
    pub scenario: Scenario,
    /// Arm, air and gauges.
    pub gripper: Gripper,
    /// The recipe's finger as a chain of links.
    pub chain: Chain,
    /// The fingers as they were cast; none if all three are the recipe's. The controller keeps the recipe's table.
    pub castings: Option<Hand>,
    /// Positions of the fingers around the object.
    pub grasp: Grasp,
    /// Stiffness of every joint over that of the chain, at the same torques. The controller is
    /// calibrated to it, as after a free-bend sweep.
    pub stiffness_factor: f64,
    /// Injected faults.
    pub faults: Vec<Injected>,
    table: &'static FingerTable,
    settings: Settings,
    /// What a settings file states, by number.
    stated: Vec<(u16, f32)>,
}

/// A value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Value of a [`Parameter`], in the unit of its name.
    Number(f64),
    /// Value of [`OBJECT`].
    Object(ObjectKind),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Object(object) => write!(f, "{object}"),
        }
    }
}

/// The one parameter that is not a number.
pub const OBJECT: &str = "object";

/// A number that can be varied.
pub struct Parameter {
    /// Name with its unit. A name with a dot is a path in the recipe or in `gripper.toml`.
    pub name: &'static str,
    range: (f64, f64),
    set: fn(&mut Setup, f64),
}

/// Every parameter with its name, its range and how it is set.
#[rustfmt::skip]
pub const PARAMETERS: &[Parameter] = &[
    number("mass_kg", 0.001, 5.0, |s, x| s.scenario.mass_kg = x),
    number("accel_m_s2", 0.1, 50.0, |s, x| s.scenario.accel_m_s2 = x),
    number("pressure_kpa", 1.0, 160.0, |s, x| s.scenario.pressure_kpa = x),
    number("friction", 0.0, 2.0, |s, x| s.scenario.friction = x),
    number("noise_ue", 0.0, 5_000.0, |s, x| s.scenario.noise_ue = x),
    number("seed", 0.0, 9e15, |s, x| s.scenario.seed = x as u64),
    number("stiffness_factor", 0.5, 2.0, |s, x| s.stiffness_factor = x),
    number("grasp.palm_radius_mm", 1.0, 200.0, |s, x| s.grasp.palm_radius_m = 1e-3 * x),
    number("grasp.link_radius_mm", 0.1, 50.0, |s, x| s.grasp.link_radius_m = 1e-3 * x),
    number("grasp.depth_mm", 1.0, 200.0, |s, x| s.gripped_mut().depth_m = 1e-3 * x),
    number("grasp.diameter_mm", 1.0, 200.0, |s, x| s.set_diameter(1e-3 * x)),
    number("hand.first_finger_deg", -360.0, 360.0, |s, x| s.gripper.hand.first_finger_deg = x),
    number("hand.damping_ms", 1.0, 1_000.0, |s, x| s.gripper.hand.damping_ms = x),
    number("hand.inflation_lag_ms", 1.0, 5_000.0, |s, x| s.gripper.hand.inflation_lag_ms = x),
    number("hand.deflation_lag_ms", 1.0, 5_000.0, |s, x| s.gripper.hand.deflation_lag_ms = x),
    number("hand.hysteresis_percent", 0.0, 20.0, |s, x| s.gripper.hand.hysteresis_percent = x),
    number("hand.creep_percent", 0.0, 50.0, |s, x| s.gripper.hand.creep_percent = x),
    number("hand.creep_time_s", 0.01, 10_000.0, |s, x| s.gripper.hand.creep_time_s = x),
    number("hand.sliding_friction", 0.0, 1.0, |s, x| s.gripper.hand.sliding_friction = x),
    number("world.step_ms", 0.1, 5.0, |s, x| s.gripper.world.step_ms = x),
    number("arm.approach_mm", 1.0, 2_000.0, |s, x| s.gripper.arm.approach_mm = x),
    number("arm.lift_mm", 1.0, 2_000.0, |s, x| s.gripper.arm.lift_mm = x),
    number("arm.carry_mm", 1.0, 4_000.0, |s, x| s.gripper.arm.carry_mm = x),
    number("arm.jerk_ramp_ms", 1.0, 1_000.0, |s, x| s.gripper.arm.jerk_ramp_ms = x),
    number("arm.dwell_ms", 0.0, 10_000.0, |s, x| s.gripper.arm.dwell_ms = x),
    number("arm.grip_ms", 1.0, 10_000.0, |s, x| s.gripper.arm.grip_ms = x),
    number("arm.release_ms", 1.0, 10_000.0, |s, x| s.gripper.arm.release_ms = x),
    number("regulator.lag_ms", 1.0, 5_000.0, |s, x| s.gripper.regulator.lag_ms = x),
    number("regulator.slew_kpa_per_s", 1.0, 100_000.0, |s, x| s.gripper.regulator.slew_kpa_per_s = x),
    number("regulator.gain", 0.5, 1.5, |s, x| s.gripper.regulator.gain = x),
    number("regulator.offset_kpa", -20.0, 20.0, |s, x| s.gripper.regulator.offset_kpa = x),
    number("regulator.monitor_noise_kpa", 0.0, 20.0, |s, x| s.gripper.regulator.monitor_noise_kpa = x),
    number("regulator.supply_v", 0.0, 36.0, |s, x| s.gripper.regulator.supply_v = x),
    number("gauge.creep_percent", 0.0, 50.0, |s, x| s.gripper.gauge.creep_percent = x),
    number("gauge.creep_time_s", 0.01, 10_000.0, |s, x| s.gripper.gauge.creep_time_s = x),
];

const fn number(name: &'static str, low: f64, high: f64, set: fn(&mut Setup, f64)) -> Parameter {
    let range = (low, high);
    Parameter { name, range, set }
}

impl Setup {
    /// As [`Self::of`], with the castings of a seed for fingers; seed 0 means that all are the recipe's.
    ///
    /// # Errors
    /// As [`Self::of`] and [`Hand::cast`].
    pub fn with_castings(recipe: &Recipe, seed: u64) -> anyhow::Result<Self> {
        let mut setup = Self::of(recipe)?;
        if seed > 0 {
            setup.castings = Some(Hand::cast(recipe, seed)?);
        }
        Ok(setup)
    }

    /// The default run with the fingers of a recipe, at the pressure at which their controller grips.
    ///
    /// # Errors
    /// If the recipe does not say how the fingers stand around an object.
    pub fn of(recipe: &Recipe) -> anyhow::Result<Self> {
        let grasp = recipe.grasp.with_context(|| {
            format!(
                "the recipe {} has no [grasp], so nothing can be gripped: add [grasp] with palm_radius_mm, link_radius_mm and friction, [grasp.sphere] with diameter_mm and depth_mm, and [grasp.cylinder] with diameter_mm, height_mm and depth_mm",
                recipe.name
            )
        })?;
        let table = run::table_of(recipe)?;
        let settings = Settings::for_finger(table);
        Ok(Self {
            scenario: Scenario {
                pressure_kpa: settings.grip.grip_pressure_kpa.into(),
                ..Scenario::default()
            },
            gripper: Gripper::reference(),
            chain: recipe.chain.clone(),
            castings: None,
            grasp,
            stiffness_factor: 1.0,
            faults: Vec::new(),
            table,
            settings,
            stated: Vec::new(),
        })
    }

    /// The controller's table of the fingers.
    pub fn table(&self) -> &'static FingerTable {
        self.table
    }

    /// The settings of the fingers' controller: their defaults, and what is stated beyond those.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Takes what a settings file states. Grips are at its pressure from now on.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn state(&mut self, stated: Vec<(u16, f32)>) -> anyhow::Result<()> {
        self.settings = self.stated_in(&stated, self.settings)?;
        self.gripper.front_end = self.settings.front_end;
        self.scenario.pressure_kpa = self.settings.grip.grip_pressure_kpa.into();
        self.stated = stated;
        Ok(())
    }

    fn stated_in(&self, stated: &[(u16, f32)], settings: Settings) -> anyhow::Result<Settings> {
        let settings = settings.with(stated, self.table);
        settings.map_err(|error| anyhow::anyhow!("settings: {error}"))
    }

    /// The fingers.
    pub fn hand(&self) -> Hand {
        let alike = || Hand::alike(&self.chain);
        let mut hand = self.castings.clone().unwrap_or_else(alike);
        for chain in &mut hand.chains {
            let stiffness = &mut chain.joint_stiffness_nm_per_rad;
            *stiffness = stiffness.map(|k| self.stiffness_factor * k);
        }
        hand
    }

    /// The same gripper with nothing in reach.
    #[must_use]
    pub fn emptied(&self) -> Self {
        /// Below the palm, m.
        const OUT_OF_REACH_M: f64 = 1.0;

        let mut empty = self.clone();
        empty.gripped_mut().depth_m = OUT_OF_REACH_M;
        empty
    }

    /// The gripper above the object.
    pub fn plant(&self) -> Plant {
        Plant::new(&self.scenario, &self.gripper, &self.hand(), &self.grasp)
    }

    /// The gripper around the object, under an arm that is led.
    pub fn plant_at_object(&self) -> Plant {
        Plant::led(&self.scenario, &self.gripper, &self.hand(), &self.grasp)
    }

    /// Position and size of the gripped object.
    pub fn gripped(&self) -> Gripped {
        match self.scenario.object {
            ObjectKind::Sphere => self.grasp.sphere,
            ObjectKind::Cylinder => self.grasp.cylinder,
        }
    }

    /// As [`Self::gripped`], mutable.
    pub fn gripped_mut(&mut self) -> &mut Gripped {
        match self.scenario.object {
            ObjectKind::Sphere => &mut self.grasp.sphere,
            ObjectKind::Cylinder => &mut self.grasp.cylinder,
        }
    }

    fn set_diameter(&mut self, diameter_m: f64) {
        match &mut self.gripped_mut().object {
            Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. } => {
                *radius_m = diameter_m / 2.0;
            }
        }
    }

    /// Sets a parameter by its name. `object` must be set before what belongs to an object.
    ///
    /// # Errors
    /// If there is no parameter of this name.
    pub fn set(&mut self, name: &str, value: Value) -> anyhow::Result<()> {
        match value {
            Value::Object(object) => self.scenario.object = object,
            Value::Number(number) => (parameter(name)?.set)(self, number),
        }
        Ok(())
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// If the open fingers would be inside the object, the pressure is beyond the recipe's, or a fault begins
    /// after the end of the run.
    pub fn check(&self) -> anyhow::Result<()> {
        let grasp = &self.grasp;
        let (Object::Sphere { radius_m } | Object::Cylinder { radius_m, .. }) =
            self.gripped().object;
        let least_m = radius_m + grasp.link_radius_m;
        ensure!(
            grasp.palm_radius_m >= least_m,
            "the open fingers would stand inside the object: with a palm radius of {:.2} mm it must be less than {:.2} mm wide",
            1e3 * grasp.palm_radius_m,
            2e3 * (grasp.palm_radius_m - grasp.link_radius_m),
        );
        let (asked, most) = (self.scenario.pressure_kpa, self.chain.max_pressure_kpa());
        ensure!(
            asked <= most,
            "pressure {asked} kPa: must be at most {most}, where the recipe ends"
        );
        let most = f64::from(self.settings.regulator.max_pressure_kpa);
        ensure!(
            asked <= most,
            "pressure {asked} kPa: must be at most {most}, the setting regulator.max_pressure_kpa"
        );
        let motion = self.gripper.arm_task(self.scenario.accel_m_s2);
        let end_s = Profile::new(&motion).duration_s();
        for fault in &self.faults {
            ensure!(
                fault.from_s < end_s,
                "fault {fault}: must begin before {end_s:.3} s, when the run ends"
            );
        }
        Ok(())
    }

    /// Runs it under the controller. `progress` receives the completed fraction, 0 to 1.
    ///
    /// # Errors
    /// If [`Self::check`] refuses the setup.
    pub fn run(&self, progress: impl FnMut(f64)) -> anyhow::Result<Run> {
        self.check()?;
        let mut settings = self.settings;
        // The simulated robot speaks in every tick.
        settings.grip.host_timeout_ms = 1_000.0;
        settings = self.stated_in(&self.stated, settings)?;
        let gains = &mut settings.finger.free_bend_gain;
        *gains = gains.map(|gain| (f64::from(gain) / self.stiffness_factor) as f32);
        let controller = run::controller(self.table, &settings)?;
        Ok(run::run(
            &self.scenario,
            &self.gripper,
            &self.hand(),
            &self.grasp,
            controller,
            &self.faults,
            progress,
        ))
    }
}

/// Reads a value of the parameter `name`, within its range.
///
/// # Errors
/// If the value has the wrong type or is outside its range; the message names both.
pub fn value(name: &str, value: &toml::Value) -> anyhow::Result<Value> {
    if name == OBJECT {
        let object = value
            .as_str()
            .and_then(|text| text.parse().ok())
            .with_context(|| format!("{name} = {value}: must be \"sphere\" or \"cylinder\""))?;
        return Ok(Value::Object(object));
    }
    let (low, high) = parameter(name)?.range;
    let number = match *value {
        toml::Value::Integer(integer) => Some(integer as f64),
        toml::Value::Float(float) => Some(float),
        _ => None,
    };
    let number = number
        .filter(|number| (low..=high).contains(number))
        .with_context(|| format!("{name} = {value}: must be a number within {low} and {high}"))?;
    Ok(Value::Number(number))
}

fn parameter(name: &str) -> anyhow::Result<&'static Parameter> {
    PARAMETERS
        .iter()
        .find(|parameter| parameter.name == name)
        .with_context(|| {
            let known: Vec<_> = PARAMETERS.iter().map(|p| p.name).collect();
            format!(
                "{name}: there is no such parameter; there are {OBJECT}, {}",
                known.join(", ")
            )
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_its_own_place() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes/paper.toml");
        let recipe = finger::recipe::load(path.as_ref()).expect("the paper's recipe");
        let default = Setup::of(&recipe).expect("a setup");
        let mut seen = vec![format!("{default:?}")];
        for parameter in PARAMETERS {
            let mut varied = default.clone();
            let value = Value::Number(0.37 * parameter.range.0 + 0.63 * parameter.range.1);
            varied.set(parameter.name, value).expect("a parameter");
            let text = format!("{varied:?}");
            assert!(!seen.contains(&text), "{}", parameter.name);
            seen.push(text);
        }
    }
}

//! The options that say which gripper is watched: `--from`, and what the virtual one is.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serve::script;
use sim::scenario::ObjectKind;
use sim::setup::Setup;
use watch::source::{Options, Source, Virtual};
use watch::{Connection, open};

use super::{Castings, Controls, load_recipe, within};

/// What the virtual gripper is.
#[derive(Args)]
pub struct VirtualArgs {
    /// Object between the fingers.
    #[arg(long, default_value = "sphere", value_parser = object_or_none())]
    object: Chosen,
    /// Mass of the object.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = within(0.001, 5.0))]
    mass: Option<f64>,
    /// What happens, and when (TOML, docs/virtual-gripper.md) [default: nothing but what the robot asks for].
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// How much faster than real time it runs.
    #[arg(long, value_name = "X", default_value = "1", allow_negative_numbers = true, value_parser = within(0.1, 100.0))]
    speed: f64,
    /// Noise of the gauges, µε rms at the control tick.
    #[arg(long, value_name = "UE", allow_negative_numbers = true, value_parser = within(0.0, 5_000.0))]
    noise: Option<f64>,
    /// Seed of all noise.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
    #[command(flatten)]
    castings: Castings,
}

/// An object, or none.
#[derive(Clone, Copy)]
struct Chosen(Option<ObjectKind>);

/// Parses the kind of an object, or none.
fn object_or_none() -> impl TypedValueParser<Value = Chosen> {
    let names = ObjectKind::ALL.map(ObjectKind::name).into_iter();
    PossibleValuesParser::new(names.chain(["none"])).try_map(|name| match name.as_str() {
        "none" => Ok(Chosen(None)),
        name => name.parse().map(|kind| Chosen(Some(kind))),
    })
}

impl VirtualArgs {
    /// The gripper, and its script.
    pub fn gripper(&self) -> anyhow::Result<Virtual> {
        let recipe = load_recipe(self.recipe.as_deref())?;
        let mut setup = Setup::with_castings(&recipe, self.castings.finger_seed)?;
        self.controls.apply(&mut setup)?;
        let scenario = &mut setup.scenario;
        scenario.object = self.object.0.unwrap_or(scenario.object);
        scenario.mass_kg = self.mass.unwrap_or(scenario.mass_kg);
        scenario.noise_ue = self.noise.unwrap_or(scenario.noise_ue);
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        Ok(Virtual {
            setup,
            has_object: self.object.0.is_some(),
            script: self.script.as_deref().map(script::read).transpose()?,
            speed: self.speed,
        })
    }

    /// The script's file, for what is wrong with it.
    pub fn script_name(&self) -> String {
        let name = self.script.as_deref().map(std::path::Path::display);
        name.map_or(String::new(), |name| name.to_string())
    }
}

/// Which gripper is watched.
#[derive(Args)]
pub struct SourceArgs {
    /// Baud rate of a serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200)]
    baud: u32,
    /// The gripper's id on the bus.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u8).range(1..=247))]
    id: u8,
    /// The ELF file of the image that runs, for a debugger's stream (defmt:-, defmt:HOST:PORT, probe).
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    #[command(flatten)]
    gripper: VirtualArgs,
}

impl SourceArgs {
    /// The gripper if it is the virtual one; its fingers, whichever it is.
    pub fn gripper(&self) -> anyhow::Result<Virtual> {
        self.gripper.gripper()
    }

    /// Opens a source.
    pub fn open(
        &self,
        source: &Source,
        rate_hz: f64,
        with_ticks: bool,
        in_real_time: bool,
    ) -> anyhow::Result<Connection> {
        let options = Options {
            rate_hz,
            with_ticks,
            in_real_time,
            baud: self.baud,
            id: self.id,
            elf: self.elf.clone(),
            gripper: self.gripper()?,
        };
        open(source, &options)
    }
}

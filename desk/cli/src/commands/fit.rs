//! `softgrip fit`: fits a recipe to measurements of a free finger.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use report::files;
use studies::fit::data::Noise;
use studies::fit::parameter::Parameter;
use studies::fit::{Fit, Request};

use super::output;
use super::output::{out, outln};
use super::within;

#[derive(Args)]
pub struct FitArgs {
    /// Measurements of a free finger (CSV): pressure_kpa with tip_angle_deg, strain_ue or both.
    ///
    /// In any order, with repeats and empty cells; unloading is recognised by the order, and
    /// its difference from loading is printed. Separators, decimal commas and units are as for replay.
    #[arg(long, value_name = "FILE")]
    measured: PathBuf,
    /// The geometry recipe to start from [default: recipes/rtv225.toml].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Noise of the tip angles, standard deviation.
    #[arg(long, value_name = "DEG", default_value = "0.5", allow_negative_numbers = true, value_parser = within(0.01, 20.0))]
    noise_deg: f64,
    /// Noise of the strains, standard deviation.
    #[arg(long, value_name = "UE", default_value = "100", allow_negative_numbers = true, value_parser = within(1.0, 10_000.0))]
    noise_ue: f64,
    /// Parameters that are not to be changed, because they were measured, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = parameter)]
    known: Vec<Parameter>,
    /// Directory for fitted.toml and fit.svg.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &FitArgs) -> anyhow::Result<ExitCode> {
    files::prepare(&args.out)?;
    let (recipe, text) = match &args.recipe {
        Some(path) => {
            let text = std::fs::read_to_string(path);
            let text = text.with_context(|| format!("{}", path.display()))?;
            (path.as_path(), text)
        }
        None => (
            Path::new("recipes/rtv225.toml"),
            include_str!("../../../../recipes/rtv225.toml").to_string(),
        ),
    };
    let fit = Fit::new(&Request {
        measured: &args.measured,
        recipe,
        text: &text,
        noise: Noise {
            tip_angle_deg: args.noise_deg,
            strain_ue: args.noise_ue,
        },
        known: &args.known,
    })?;
    for note in fit.notes() {
        output::note(format_args!("{}: {note}", args.measured.display()));
    }
    let picture = fit.picture()?;
    files::write(&args.out, "fitted.toml", fit.toml().as_bytes())?;
    files::write(&args.out, "fit.svg", picture.as_bytes())?;
    if args.json {
        outln!("{}", fit.json());
    } else {
        out!("{}", fit.text());
        let dir = args.out.display();
        outln!("\nrecipe and picture: {dir}/fitted.toml, {dir}/fit.svg");
    }
    Ok(ExitCode::SUCCESS)
}

fn parameter(name: &str) -> anyhow::Result<Parameter> {
    let names = Parameter::ALL.map(Parameter::name);
    Parameter::ALL
        .into_iter()
        .find(|parameter| parameter.name() == name)
        .with_context(|| format!("must be one of {}", names.join(", ")))
}

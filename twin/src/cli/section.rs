//! `softgrip section`: one section under pressure.

use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use finger::hyperelastic::Rubber;
use finger::section::Section;
use twin::section::Report;

use super::output::{out, outln};
use super::within;

#[derive(Args)]
pub struct SectionArgs {
    /// Radius of the outer circle.
    #[arg(long = "R", value_name = "MM", allow_negative_numbers = true, value_parser = within(0.5, 100.0))]
    outer_radius: f64,
    /// Radius of the bore.
    #[arg(long = "r", value_name = "MM", allow_negative_numbers = true, value_parser = within(0.1, 100.0))]
    bore_radius: f64,
    /// Distance of the bore's centre from the outer circle's, away from the flat.
    #[arg(long = "e", value_name = "MM", allow_negative_numbers = true, value_parser = within(0.0, 100.0))]
    bore_offset: f64,
    /// Half the angle that the flat subtends at the outer circle's centre; 0 for no flat.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = within(0.0, 89.0))]
    alpha: f64,
    /// Inner pressures, separated by commas.
    #[arg(long, value_name = "KPA", required = true, value_delimiter = ',', allow_negative_numbers = true, value_parser = within(0.0, 1000.0))]
    pressure: Vec<f64>,
    /// Young's modulus of a neo-Hookean rubber, which is good for small pressures only.
    #[arg(long, value_name = "KPA", allow_negative_numbers = true, conflicts_with = "yeoh", value_parser = within(10.0, 100_000.0))]
    youngs_modulus: Option<f64>,
    /// Yeoh's constants, MPa [default: the paper's].
    #[arg(long, value_name = "C1,C2,C3", default_value = "0.1,0.02,0.0002", hide_default_value = true, allow_hyphen_values = true, value_parser = constants)]
    yeoh: Constants,
    /// Solve the highest pressure on several meshes too.
    #[arg(long)]
    mesh_study: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Yeoh's constants, MPa.
type Constants = [f64; 3];

pub fn run(args: &SectionArgs) -> anyhow::Result<ExitCode> {
    let section = Section {
        outer_radius_m: 1e-3 * args.outer_radius,
        bore_radius_m: 1e-3 * args.bore_radius,
        bore_offset_m: 1e-3 * args.bore_offset,
        flat_half_angle_rad: args.alpha.to_radians(),
    };
    let rubber = match args.youngs_modulus {
        Some(kpa) => Rubber::from_youngs_modulus(1e3 * kpa),
        None => Rubber::incompressible(args.yeoh.map(|mpa| 1e6 * mpa)),
    };
    let report = Report::new(section, rubber, &args.pressure, args.mesh_study)?;
    if args.json {
        outln!("{}", report.json());
    } else {
        out!("{}", report.text());
    }
    Ok(ExitCode::SUCCESS)
}

/// Within what a recipe may have.
fn constants(text: &str) -> anyhow::Result<Constants> {
    let ranges = [(0.001, 1.0), (-1.0, 1.0), (0.0, 1.0)];
    let parts: Vec<&str> = text.split(',').collect();
    let parts: [&str; 3] = parts.try_into().ok().context("must be three numbers")?;
    let mut constants = [0.0; 3];
    for (i, (min, max)) in ranges.into_iter().enumerate() {
        constants[i] =
            within(min, max)(parts[i]).map_err(|error| anyhow::anyhow!("C{}: {error}", i + 1))?;
    }
    Ok(constants)
}

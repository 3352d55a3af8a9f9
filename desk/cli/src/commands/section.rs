//! `softgrip section`: one cross-section under pressure.

use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use finger::hyperelastic::Rubber;
use finger::material::Constants;
use finger::section::Section;
use studies::section::SectionReport;

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
    #[arg(long, value_name = "KPA", allow_negative_numbers = true, group = "rubber", value_parser = within(10.0, 100_000.0))]
    youngs_modulus: Option<f64>,
    /// Yeoh's constants, MPa; the last one or two may be left out [default: the paper's].
    #[arg(long, value_name = "C1,C2,C3", group = "rubber", allow_hyphen_values = true, value_parser = numbers)]
    yeoh: Option<Numbers>,
    /// Mooney's and Rivlin's constants, MPa.
    #[arg(long, value_name = "C10,C01", group = "rubber", allow_hyphen_values = true, value_parser = numbers)]
    mooney_rivlin: Option<Numbers>,
    /// Ogden's constants, MPa, of Σ μ/α (λ₁^α + λ₂^α + λ₃^α − 3), as Ogden and Holzapfel write it.
    #[arg(long, value_name = "μ,α,…", group = "rubber", allow_hyphen_values = true, value_parser = numbers)]
    ogden: Option<Numbers>,
    /// Ogden's constants, MPa, of Σ 2μ/α² (λ₁^α + λ₂^α + λ₃^α − 3), as in Abaqus.
    #[arg(long, value_name = "μ,α,…", group = "rubber", allow_hyphen_values = true, value_parser = numbers)]
    ogden_abaqus: Option<Numbers>,
    /// Solve the highest pressure on several meshes too.
    #[arg(long)]
    mesh_study: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Numbers separated by commas. Not a plain `Vec`, which clap takes for several values.
#[derive(Clone)]
struct Numbers(Vec<f64>);

impl SectionArgs {
    /// The rubber, and the option that tells it.
    fn rubber(&self) -> anyhow::Result<(Rubber, &'static str)> {
        let (option, constants) = match self {
            Self {
                youngs_modulus: Some(kpa),
                ..
            } => return Ok((Rubber::from_youngs_modulus(1e3 * kpa), "--youngs-modulus")),
            Self { yeoh: Some(c), .. } => ("--yeoh", Constants::Yeoh(c.0.clone())),
            Self {
                mooney_rivlin: Some(c),
                ..
            } => {
                let [c10, c01] = c.0[..] else {
                    anyhow::bail!("--mooney-rivlin: must be two numbers, C10 and C01");
                };
                ("--mooney-rivlin", Constants::MooneyRivlin([c10, c01]))
            }
            Self { ogden: Some(c), .. } => ("--ogden", Constants::Ogden(c.pairs("--ogden")?)),
            Self {
                ogden_abaqus: Some(c),
                ..
            } => {
                let pairs = c.pairs("--ogden-abaqus")?;
                ("--ogden-abaqus", Constants::OgdenAbaqus(pairs))
            }
            // The paper's, section 3.1.
            _ => ("--yeoh", Constants::Yeoh(vec![0.1, 0.02, 0.0002])),
        };
        Ok((constants.rubber(option)?, option))
    }
}

impl Numbers {
    fn pairs(&self, option: &str) -> anyhow::Result<Vec<[f64; 2]>> {
        let (pairs, rest) = self.0.as_chunks::<2>();
        anyhow::ensure!(
            rest.is_empty(),
            "{option}: must be pairs of μ and α, not {} numbers",
            self.0.len()
        );
        Ok(pairs.to_vec())
    }
}

pub fn run(args: &SectionArgs) -> anyhow::Result<ExitCode> {
    let section = Section {
        outer_radius_m: 1e-3 * args.outer_radius,
        bore_radius_m: 1e-3 * args.bore_radius,
        bore_offset_m: 1e-3 * args.bore_offset,
        flat_half_angle_rad: args.alpha.to_radians(),
    };
    let (rubber, constants) = args.rubber()?;
    let report = SectionReport::new(section, rubber, constants, &args.pressure, args.mesh_study)?;
    if args.json {
        outln!("{}", report.json());
    } else {
        out!("{}", report.text());
    }
    Ok(ExitCode::SUCCESS)
}

fn numbers(text: &str) -> anyhow::Result<Numbers> {
    let number = |part: &str| {
        let number = part.trim().parse();
        number.with_context(|| format!("{part:?}: must be a number"))
    };
    text.split(',')
        .map(number)
        .collect::<anyhow::Result<_>>()
        .map(Numbers)
}

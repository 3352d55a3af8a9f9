//! `softgrip table`: the table of a finger, compared with the paper.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use report::files;
use studies::table::TableReport;

use super::load_recipe;
use super::output::{out, outln};

#[derive(Args)]
pub struct TableArgs {
    /// Recipe of the finger.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Pressures to show, separated by commas.
    #[arg(long, value_name = "KPA", value_delimiter = ',')]
    pressure: Vec<f64>,
    /// Draw deflection, capability, interpolation error and sensitivity into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &TableArgs) -> anyhow::Result<ExitCode> {
    if let Some(dir) = &args.out {
        files::prepare(dir)?;
    }
    let report = TableReport::new(|| load_recipe(args.recipe.as_deref()), &args.pressure)?;
    if args.json {
        outln!("{}", report.json());
    } else {
        out!("{}", report.text());
    }
    if let Some(dir) = &args.out {
        for (name, svg) in report.pictures()? {
            files::write(dir, name, svg.as_bytes())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

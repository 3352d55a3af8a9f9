//! `softgrip table`: a finger's table.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use twin::table::Report;

use super::load_recipe;

#[derive(Args)]
pub struct TableArgs {
    /// The finger.
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Pressures to show, separated by commas.
    #[arg(long, value_name = "KPA", value_delimiter = ',')]
    pressure: Vec<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &TableArgs) -> anyhow::Result<ExitCode> {
    let report = Report::new(load_recipe(args.recipe.as_deref())?, &args.pressure)?;
    if args.json {
        println!("{}", report.json());
    } else {
        print!("{}", report.text());
    }
    Ok(ExitCode::SUCCESS)
}

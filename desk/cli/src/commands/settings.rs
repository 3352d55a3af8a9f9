//! `softgrip settings`: the settings file and the table of all settings.

use std::path::PathBuf;
use std::process::ExitCode;

use ::settings::page;
use clap::{Args, Subcommand};
use softgrip::settings::Settings;

use super::output::{out, outln};
use super::{Controls, load_table};

#[derive(Args)]
pub struct SettingsArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Prints a settings file with every setting, its unit, range and meaning.
    Print(PrintArgs),
    /// Checks a settings file: exits with 2 and lists every problem with its line, if there is any.
    Check(CheckArgs),
    /// Prints the table of all settings (Markdown), by number.
    Registers,
}

#[derive(Args)]
struct PrintArgs {
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    controls: Controls,
}

#[derive(Args)]
struct CheckArgs {
    /// The settings file (TOML).
    file: PathBuf,
    /// The fingers [default: those that the firmware was built for].
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
}

pub fn run(args: &SettingsArgs) -> anyhow::Result<ExitCode> {
    match &args.action {
        Action::Print(args) => out!("{}", text(args)?),
        Action::Check(args) => {
            let table = load_table(args.recipe.as_deref())?;
            let stated = ::settings::file::read(&args.file, table.max_pressure_kpa)?;
            let (file, count) = (args.file.display(), stated.len());
            outln!("{file}: {count} settings, all right for {}", table.recipe);
        }
        Action::Registers => out!("{}", page::registers()),
    }
    Ok(ExitCode::SUCCESS)
}

/// The settings of the finger and the file, with what is to be known of each.
fn text(args: &PrintArgs) -> anyhow::Result<String> {
    let table = load_table(args.recipe.as_deref())?;
    let settings = Settings::for_finger(table)
        .with(&args.controls.stated(table)?, table)
        .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
    Ok(page::toml(&settings.values()))
}

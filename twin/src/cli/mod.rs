//! The subcommands: what they take, and what they do with it.

pub mod replay;
pub mod sim;
pub mod table;

use std::path::Path;

use anyhow::Context;
use finger::recipe::{self, Recipe};

/// The finger of a file, or the one that everything is about.
fn load_recipe(path: Option<&Path>) -> anyhow::Result<Recipe> {
    match path {
        Some(path) => Ok(recipe::load(path)?),
        None => {
            let name = Path::new("recipes/rtv225.toml");
            let text = include_str!("../../../recipes/rtv225.toml");
            Ok(recipe::parse(name, text)?)
        }
    }
}

/// Parses a number and refuses one outside its range.
fn within(min: f64, max: f64) -> impl Fn(&str) -> anyhow::Result<f64> + Clone {
    move |text| {
        let value: f64 = text.parse().context("must be a number")?;
        anyhow::ensure!(
            (min..=max).contains(&value),
            "must lie within {min} and {max}"
        );
        Ok(value)
    }
}

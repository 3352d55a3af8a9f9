//! How many fingers the gripper has: the recipe says it, and every array of one value per finger has that length.

use std::path::Path;
use std::process::ExitCode;

/// The recipe of the finger that the firmware is for, relative to the repository; `build.rs` of `softgrip` takes the same.
const DEFAULT_RECIPE: &str = "recipes/rtv225.toml";
/// Of a recipe that does not say.
const USUAL: i64 = 3;
const POSSIBLE: std::ops::RangeInclusive<i64> = 2..=4;

fn main() -> ExitCode {
    println!("cargo::rerun-if-env-changed=SOFTGRIP_RECIPE");
    let recipe = std::env::var("SOFTGRIP_RECIPE").unwrap_or_else(|_| DEFAULT_RECIPE.into());
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .join(recipe);
    println!("cargo::rerun-if-changed={}", recipe.display());
    match fingers(&recipe).and_then(write) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            println!("cargo::error={}: {error}", recipe.display());
            ExitCode::FAILURE
        }
    }
}

/// What the recipe says. All else in it is checked where the table is made of it.
fn fingers(recipe: &Path) -> Result<i64, Box<dyn std::error::Error>> {
    let recipe: toml::Table = std::fs::read_to_string(recipe)?.parse()?;
    let stated = recipe.get("grasp").and_then(|grasp| grasp.get("fingers"));
    let fingers = match stated {
        Some(stated) => stated
            .as_integer()
            .ok_or("grasp.fingers: must be a whole number")?,
        None => USUAL,
    };
    if !POSSIBLE.contains(&fingers) {
        return Err(format!("grasp.fingers = {fingers}: must lie within 2 and 4").into());
    }
    Ok(fingers)
}

fn write(fingers: i64) -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(&std::env::var("OUT_DIR")?).join("fingers.rs");
    std::fs::write(path, fingers.to_string())?;
    Ok(())
}

//! Recordings on disk, so that the physics is not simulated again while the detector is changed.

use std::path::Path;

use anyhow::Context;
use report::files;
use sha2::{Digest, Sha256};
use softgrip::FINGERS;
use softgrip::settings::Settings;

use crate::case::Case;
use crate::record::{Recording, Tick};

/// Values that are stored for each tick: the fields of `Tick`.
const NUMBERS: usize = FINGERS + 5;

/// Sources of simulator, finger and controller without its detector, and the versions of the engine and of all
/// else that they are built on (`build.rs`).
const PHYSICS: &str = env!("PHYSICS_SHA256");

/// The recording of a case from `dir`, or a new one that is kept there. Recordings made at other settings, of
/// another finger or by another simulator have other names, so they are not found.
///
/// `settings` and `noise_ue` are those at which `simulate` closes the loop.
///
/// # Errors
/// If a stored recording is incomplete (by its path), the simulation fails, or the file cannot be written.
pub fn recording(
    dir: &Path,
    case: &Case,
    settings: &Settings,
    noise_ue: f64,
    simulate: impl FnOnce() -> anyhow::Result<Recording>,
) -> anyhow::Result<Recording> {
    let name = name(PHYSICS, case, settings, noise_ue);
    let path = dir.join(&name);
    if path.exists() {
        let bytes = std::fs::read(&path).with_context(|| format!("{}", path.display()))?;
        return parse(&bytes)
            .with_context(|| format!("{}: not a whole recording; remove it", path.display()));
    }
    let recording = simulate()?;
    files::write(dir, &name, &bytes(&recording))?;
    Ok(recording)
}

/// The name of a recording's file: the SHA-256 of all that decides it. A case holds its finger, its gripper and
/// its scenario.
fn name(physics: &str, case: &Case, settings: &Settings, noise_ue: f64) -> String {
    let text = format!("{physics}\n{case:?}\n{settings:?}\n{noise_ue:?}");
    let digest = Sha256::digest(text)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect::<String>();
    digest + ".run"
}

fn bytes(recording: &Recording) -> Vec<u8> {
    let release = recording.release.unwrap_or(0);
    let head = [recording.grip, recording.lift, release];
    let head = head.iter().flat_map(|&n| (n as u64).to_le_bytes());
    let ticks = recording.ticks.iter().flat_map(|tick| {
        let others = [
            tick.pressure_kpa,
            tick.residual_ue,
            tick.contact_n,
            tick.moved_mm,
            tick.slid_mm,
        ];
        let numbers = tick.strain_ue.into_iter().chain(others);
        numbers.flat_map(f32::to_le_bytes)
    });
    head.chain(ticks).collect()
}

fn parse(bytes: &[u8]) -> Option<Recording> {
    let (head, ticks) = bytes.split_at_checked(3 * size_of::<u64>())?;
    let (head, _) = head.as_chunks::<8>();
    let [grip, lift, release] = [0, 1, 2].map(|i| u64::from_le_bytes(head[i]) as usize);
    let (numbers, rest) = ticks.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let (ticks, more) = numbers.as_chunks::<NUMBERS>();
    (rest.is_empty() && more.is_empty()).then(|| Recording {
        ticks: ticks
            .iter()
            .map(
                |&[
                    ref strain_ue @ ..,
                    pressure_kpa,
                    residual_ue,
                    contact_n,
                    moved_mm,
                    slid_mm,
                ]| Tick {
                    strain_ue: *strain_ue,
                    pressure_kpa,
                    residual_ue,
                    contact_n,
                    moved_mm,
                    slid_mm,
                },
            )
            .collect(),
        grip,
        lift,
        release: (release > 0).then_some(release),
    })
}

#[cfg(test)]
mod tests {
    use sim::setup::Setup;

    use super::*;
    use crate::case::Knowledge;

    #[test]
    fn whatever_decides_the_physics_decides_the_name() {
        let case = |recipe: &str, change: fn(&mut Setup)| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../recipes")
                .join(recipe);
            let recipe = finger::recipe::load(&path).expect("a recipe");
            let mut setup = Setup::of(&recipe).expect("a setup");
            change(&mut setup);
            Case::draw(&setup, setup.table(), 1, Knowledge::Calibrated, 1)
        };
        let settings = Settings::default();
        let mut slower = settings;
        slower.regulator.slew_kpa_per_s /= 2.0;
        let usual = case("rtv225.toml", |_| ());
        let names = [
            name(PHYSICS, &usual, &settings, 20.0),
            name("another simulator", &usual, &settings, 20.0),
            name(PHYSICS, &usual, &slower, 20.0),
            name(PHYSICS, &usual, &settings, 21.0),
            name(PHYSICS, &case("paper.toml", |_| ()), &settings, 20.0),
            name(
                PHYSICS,
                &case("rtv225.toml", |s| s.gripper.world.step_ms = 0.5),
                &settings,
                20.0,
            ),
            name(
                PHYSICS,
                &case("rtv225.toml", |s| s.gripper.hand.damping_ms += 1.0),
                &settings,
                20.0,
            ),
        ];
        for (n, name) in names.iter().enumerate() {
            assert_eq!(names.iter().position(|other| other == name), Some(n));
        }
        assert_eq!(
            names[0],
            name(PHYSICS, &case("rtv225.toml", |_| ()), &settings, 20.0)
        );
    }
}

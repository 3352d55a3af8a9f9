//! Recordings on disk, so that work on the detector need not wait for the physics.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use anyhow::Context;

use crate::case::Case;
use crate::record::{Recording, Tick};
use report::files;

/// Numbers per tick.
const NUMBERS: usize = 7;

/// The recording of a case from `dir`, or a new one that is kept there.
pub fn recording(
    dir: &Path,
    case: &Case,
    simulate: impl FnOnce() -> anyhow::Result<Recording>,
) -> anyhow::Result<Recording> {
    let mut hasher = DefaultHasher::new();
    // Everything that a case is made of.
    format!("{case:?}").hash(&mut hasher);
    let name = format!("{:016x}.run", hasher.finish());
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

fn bytes(recording: &Recording) -> Vec<u8> {
    let release = recording.release.unwrap_or(0);
    let head = [recording.grip, recording.lift, release];
    let head = head.iter().flat_map(|&n| (n as u64).to_le_bytes());
    let ticks = recording.ticks.iter().flat_map(|tick| {
        let [a, b, c] = tick.strain_ue;
        let numbers: [f32; NUMBERS] = [
            a,
            b,
            c,
            tick.pressure_kpa,
            tick.residual_ue,
            tick.moved_mm,
            tick.slid_mm,
        ];
        numbers.into_iter().flat_map(f32::to_le_bytes)
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
                |&[a, b, c, pressure_kpa, residual_ue, moved_mm, slid_mm]| Tick {
                    strain_ue: [a, b, c],
                    pressure_kpa,
                    residual_ue,
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

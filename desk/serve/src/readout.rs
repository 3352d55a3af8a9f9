//! What stands in a gripper's black box, read over its bus and in the units of its settings.

use anyhow::Context;
use bus::robot::{BLACK_BOX_FROM, Item, REGISTERS, SETTINGS_FROM};
use settings::FIELDS;
use softgrip::blackbox::{Codes, WORDS, ticks};
use softgrip::fault::RULES;
use softgrip::frontend::FrontEnd;
use softgrip::settings::{Settings, Values};
use softgrip::units::{AdcCode, DacCode, FINGERS, TICK_US};

use crate::master::Master;

/// Clears it (docs/registers.md).
const CLEAR: u16 = 11;
/// What comes before the codes of faults in its second word: those of losses.
const BEFORE_FAULTS: u32 = 256;

/// One tick of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time from the first tick that is kept, s.
    pub t_s: f64,
    /// Strain of each gauge less its tare, µε.
    pub strain_ue: [f32; FINGERS],
    /// Measured pressure, kPa.
    pub pressure_kpa: f32,
    /// What the regulator was told, kPa.
    pub commanded_kpa: f32,
}

/// What stands in a black box.
#[derive(Debug, Clone, PartialEq)]
pub struct Readout {
    /// The loss or the fault, in words.
    pub what: String,
    /// When it came, s since the gripper's start; none where the program failed.
    pub at_s: Option<f64>,
    /// When it came, in the time of the rows; none where that is not among them.
    pub came_s: Option<f64>,
    /// Every tick that is kept.
    pub rows: Vec<Row>,
}

/// The first register of an item of the own block.
///
/// # Errors
/// If the map has none.
pub fn register(item: Item) -> anyhow::Result<u16> {
    let found = REGISTERS.iter().find(|register| register.item == item);
    let found = found.context("the map has no such register")?;
    Ok(found.address)
}

/// Reads what stands in a gripper's black box; none while it runs.
///
/// # Errors
/// If the gripper does not answer.
pub fn read(master: &mut Master) -> anyhow::Result<Option<Readout>> {
    if master.read(register(Item::BlackBox)?, 1)? != [1] {
        return Ok(None);
    }
    let words = numbers(&master.read(BLACK_BOX_FROM, 2 * WORDS as u16)?);
    let settings = Settings::of(&settings(master)?);
    let front_end = FrontEnd::of(&settings.front_end, settings.gauge.gain);
    let tick_s = 1e-6 * TICK_US as f64;
    let rows: Vec<(u32, Codes)> = ticks(&words).map(|kept| (kept.tick, kept.codes)).collect();
    let came = rows.iter().position(|(tick, _)| *tick == words[4]);
    let us = u64::from(words[3]) << 32 | u64::from(words[2]);
    Ok(Some(Readout {
        what: what(words[1]),
        at_s: (us > 0).then_some(1e-6 * us as f64),
        came_s: came.map(|row| tick_s * row as f64),
        rows: rows
            .iter()
            .enumerate()
            .map(|(row, (_, codes))| {
                let (gauges, rest) = codes.split_at(FINGERS);
                let gauges: [u16; FINGERS] = std::array::from_fn(|finger| gauges[finger]);
                let (monitor, command) = (rest[0], rest[1]);
                // Converter codes are aligned to 16 bits.
                let strains = front_end.strains(&gauges.map(|code| AdcCode(code << 4)));
                let tares = strains.iter().zip(settings.gauge.tare_ue);
                let mut strain_ue = [0.0; FINGERS];
                for (place, (strain, tare_ue)) in strain_ue.iter_mut().zip(tares) {
                    *place = strain.0 - tare_ue;
                }
                Row {
                    t_s: tick_s * row as f64,
                    strain_ue,
                    pressure_kpa: front_end.pressure(AdcCode(monitor << 4)).0,
                    commanded_kpa: front_end.commanded(DacCode(command)).0,
                }
            })
            .collect(),
    }))
}

/// Has it run again.
///
/// # Errors
/// If the gripper does not answer.
pub fn clear(master: &mut Master) -> anyhow::Result<()> {
    master.write(register(Item::Command)?, CLEAR)
}

/// The gripper's settings.
///
/// # Errors
/// If it does not answer, or has other settings than this program knows.
pub fn settings(master: &mut Master) -> anyhow::Result<Values> {
    let mut values = Values::DEFAULT;
    for run in FIELDS.chunk_by(|a, b| a.number + 1 == b.number) {
        let from = SETTINGS_FROM + 2 * run[0].number;
        let bits = numbers(&master.read(from, 2 * run.len() as u16)?);
        for (field, bits) in run.iter().zip(bits) {
            values
                .set(field.number, f32::from_bits(bits))
                .map_err(|error| anyhow::anyhow!("the gripper's settings: {error}"))?;
        }
    }
    Ok(values)
}

/// Numbers of two registers each.
fn numbers(registers: &[u16]) -> Vec<u32> {
    let (pairs, _) = registers.as_chunks::<2>();
    let numbers = pairs
        .iter()
        .map(|[upper, lower]| u32::from(*upper) << 16 | u32::from(*lower));
    numbers.collect()
}

/// What the second word says.
fn what(word: u32) -> String {
    let fault = RULES
        .iter()
        .map(|rule| rule.fault)
        .find(|fault| word == BEFORE_FAULTS + u32::from(fault.code()));
    match (word, fault) {
        (1, _) => "the object was lost: the residuals collapsed".into(),
        (2, _) => "the object was lost: one finger emptied".into(),
        (3, _) => "the object was lost: nothing was there after a change of pressure".into(),
        (_, Some(fault)) => format!("fault {}, {fault:?}", fault.code()),
        _ => format!("something of number {word}, which is unknown here"),
    }
}

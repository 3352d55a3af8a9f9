//! The settings that a finger, and this image, start with.

use softgrip_settings::Values;

use crate::table::{FINGER, FingerTable, ROWS};

/// What the settings file of this build states (`SOFTGRIP_SETTINGS`), by number.
#[cfg(not(test))]
const STATED: &[(u16, f32)] = &include!(concat!(env!("OUT_DIR"), "/factory_settings.rs"));

/// The library's own tests are about the defaults, whichever the build is for.
#[cfg(test)]
const STATED: &[(u16, f32)] = &[];

/// The factory's settings: the defaults for the finger of this build, and what its settings file states.
pub static FACTORY: Values = match defaults(&FINGER).with(STATED, FINGER.max_pressure_kpa) {
    Ok(values) => values,
    Err(_) => panic!("the build script has checked them"),
};

/// The defaults for a finger.
pub(super) const fn defaults(table: &FingerTable) -> Values {
    let table_kpa = table.max_pressure_kpa;
    let highest_kpa = Values::DEFAULT.highest_kpa(table_kpa);
    Values::for_finger(table_kpa, free_strain_ue(table, highest_kpa))
}

/// As [`free_strain`](crate::table::free_strain), when the program is compiled.
const fn free_strain_ue(table: &FingerTable, kpa: f32) -> f32 {
    let last = ROWS - 1;
    let position = kpa * last as f32 / table.max_pressure_kpa;
    let index = position as usize;
    if index >= last {
        return table.rows[last].free_strain_ue;
    }
    let (low, high) = (&table.rows[index], &table.rows[index + 1]);
    let fraction = position - index as f32;
    low.free_strain_ue + fraction * (high.free_strain_ue - low.free_strain_ue)
}

//! The finger's table, made by `build.rs`, and its look-up: free-bend strain, bend and lift against pressure
//! and back.

pub use softgrip_table::{FingerTable, LINKS, LinkRow, LinkTable, OBJECTS, ObjectKind, ROWS, Row};

use crate::math::{larger, smaller};
use crate::units::{Degrees, Kilopascals, Microstrain, Newtons};

/// The table of the recipe that this build was made for.
#[cfg(not(test))]
pub static FINGER: FingerTable = include!(concat!(env!("OUT_DIR"), "/finger_table.rs"));

/// The links of the same finger.
#[cfg(not(test))]
pub static FINGER_LINKS: LinkTable = include!(concat!(env!("OUT_DIR"), "/finger_links.rs"));

/// The table of the default recipe: the library's own tests state numbers of that finger, whichever the
/// build is for.
#[cfg(test)]
pub static FINGER: FingerTable = include!(concat!(env!("OUT_DIR"), "/default_table.rs"));

/// The links of that one.
#[cfg(test)]
pub static FINGER_LINKS: LinkTable = include!(concat!(env!("OUT_DIR"), "/default_links.rs"));

/// Whether a look-up left the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Range {
    /// Within the table.
    Inside,
    /// Below its first row, which was returned.
    Below,
    /// Above its last row, which was returned.
    Above,
}

/// Gauge strain of the free finger.
pub fn free_strain(table: &FingerTable, pressure: Kilopascals) -> (Microstrain, Range) {
    let place = place(table.max_pressure_kpa, pressure);
    let strain = between(&table.rows, place, |row| row.free_strain_ue);
    (Microstrain(strain), place.range)
}

/// Bend of the free finger: the angle of its last link.
pub fn bend(table: &FingerTable, pressure: Kilopascals) -> (Degrees, Range) {
    let place = place(table.max_pressure_kpa, pressure);
    let angle = between(&table.rows, place, |row| row.tip_angle_deg);
    (Degrees(angle), place.range)
}

/// Everything that the table knows at a pressure.
pub fn row(table: &FingerTable, pressure: Kilopascals) -> (Row, Range) {
    let place = place(table.max_pressure_kpa, pressure);
    let row = Row {
        free_strain_ue: between(&table.rows, place, |row| row.free_strain_ue),
        tip_angle_deg: between(&table.rows, place, |row| row.tip_angle_deg),
        lift_n: [ObjectKind::Sphere, ObjectKind::Cylinder].map(|kind| {
            let lift = lift(table, kind, pressure);
            lift.map_or(0.0, |(lift, _)| lift.0)
        }),
    };
    (row, place.range)
}

/// Force of the three fingers against gravity before an object slides (statics); none where it is not
/// known.
pub fn lift(
    table: &FingerTable,
    kind: ObjectKind,
    pressure: Kilopascals,
) -> Option<(Newtons, Range)> {
    let place = place(table.max_pressure_kpa, pressure);
    // The upper of two rows counts only if it has a share beyond rounding.
    let needed = place.index + 1 + usize::from(place.fraction > 1e-3);
    (needed <= lift_rows(table, kind).len()).then(|| {
        let lift = between(&table.rows, place, |row| lift_n(row, kind));
        (Newtons(lift), place.range)
    })
}

/// The lowest pressure whose lift carries `load`; beyond [`lift_known_to`] it is [`Range::Above`]. None if no
/// lift is known.
pub fn pressure_for_lift(
    table: &FingerTable,
    kind: ObjectKind,
    load: Newtons,
) -> Option<(Kilopascals, Range)> {
    let rows = lift_rows(table, kind);
    (!rows.is_empty()).then(|| inverse(table, rows, load.0, |row| lift_n(row, kind)))
}

/// The highest pressure at which the lift is known; none if it is at no pressure.
pub fn lift_known_to(table: &FingerTable, kind: ObjectKind) -> Option<Kilopascals> {
    let rows = lift_rows(table, kind);
    (!rows.is_empty()).then(|| last_of(table, rows))
}

/// Angle of each link to the unbent finger: `Φ_i = Σ T_j / k_j, j ≤ i` (paper, eqs 22 and 24, corrected).
pub fn link_angles(links: &LinkTable, pressure: Kilopascals) -> ([Degrees; LINKS], Range) {
    let place = place(links.max_pressure_kpa, pressure);
    let mut sum = 0.0;
    let angles = core::array::from_fn(|i| {
        let torque_nmm = between(&links.rows, place, |row| row.torque_nmm[i]);
        sum += torque_nmm / links.stiffness_nmm_per_deg[i];
        Degrees(sum)
    });
    (angles, place.range)
}

/// The pressure at which the free finger bends by `bend`.
// Never inlined: a grip and a robot on the bus ask for it, both seldom.
#[inline(never)]
pub fn pressure_for_bend(table: &FingerTable, bend: Degrees) -> (Kilopascals, Range) {
    inverse(table, &table.rows, bend.0, |row| row.tip_angle_deg)
}

/// The pressure at which the free finger's gauge shows `strain`.
pub fn pressure_for_strain(table: &FingerTable, strain: Microstrain) -> (Kilopascals, Range) {
    inverse(table, &table.rows, strain.0, |row| row.free_strain_ue)
}

/// Bend of the finger whose gauge shows `strain` while it is free; that of the first or the last row beyond them.
pub fn bend_for_strain(table: &FingerTable, strain: Microstrain) -> Degrees {
    let above = rows_up_to(&table.rows, strain.0, |row| row.free_strain_ue);
    Degrees(
        match table
            .rows
            .get(above.saturating_sub(1)..)
            .unwrap_or_default()
        {
            [low, high, ..] if above > 0 => {
                let share =
                    (strain.0 - low.free_strain_ue) / (high.free_strain_ue - low.free_strain_ue);
                low.tip_angle_deg + share * (high.tip_angle_deg - low.tip_angle_deg)
            }
            [row, ..] => row.tip_angle_deg,
            [] => 0.0,
        },
    )
}

/// A place between two rows.
#[derive(Debug, Clone, Copy)]
struct Place {
    index: usize,
    fraction: f32,
    range: Range,
}

fn place(max_pressure_kpa: f32, pressure: Kilopascals) -> Place {
    let last = (ROWS - 1) as f32;
    let position = pressure.0 * last / max_pressure_kpa;
    let range = if position > last {
        Range::Above
    } else if position >= 0.0 {
        Range::Inside
    } else {
        // A NaN ends here too.
        Range::Below
    };
    let position = smaller(larger(position, 0.0), last);
    let index = (position as usize).min(ROWS - 2);
    Place {
        index,
        fraction: position - index as f32,
        range,
    }
}

fn between<R>(rows: &[R; ROWS], place: Place, column: impl Fn(&R) -> f32) -> f32 {
    match &rows[place.index..] {
        [low, high, ..] => {
            let low = column(low);
            low + place.fraction * (column(high) - low)
        }
        _ => 0.0,
    }
}

/// How many rows have no more than this in a rising column.
fn rows_up_to(rows: &[Row], value: f32, column: impl Fn(&Row) -> f32) -> usize {
    rows.partition_point(|row| column(row) <= value)
}

/// Inverts a rising column of the first `rows`; its search takes seven steps.
fn inverse(
    table: &FingerTable,
    rows: &[Row],
    value: f32,
    column: impl Fn(&Row) -> f32,
) -> (Kilopascals, Range) {
    let step = table.max_pressure_kpa / (ROWS - 1) as f32;
    let above = rows_up_to(rows, value, &column);
    // Never out of range, which the compiler cannot tell of a part of the table.
    match rows.get(above.saturating_sub(1)..).unwrap_or_default() {
        [low, high, ..] if above > 0 => {
            let fraction = (value - column(low)) / (column(high) - column(low));
            (
                Kilopascals(((above - 1) as f32 + fraction) * step),
                Range::Inside,
            )
        }
        [row] if above > 0 && value <= column(row) => (last_of(table, rows), Range::Inside),
        [_] if above > 0 => (last_of(table, rows), Range::Above),
        _ => (Kilopascals(0.0), Range::Below),
    }
}

/// The rows that know the lift.
fn lift_rows(table: &FingerTable, kind: ObjectKind) -> &[Row] {
    let [sphere, cylinder] = table.lift_rows;
    let rows = match kind {
        ObjectKind::Sphere => sphere,
        ObjectKind::Cylinder => cylinder,
    };
    table.rows.get(..rows.into()).unwrap_or(&table.rows)
}

fn lift_n(row: &Row, kind: ObjectKind) -> f32 {
    let [sphere, cylinder] = row.lift_n;
    match kind {
        ObjectKind::Sphere => sphere,
        ObjectKind::Cylinder => cylinder,
    }
}

/// Pressure of the last of the first `rows`.
fn last_of(table: &FingerTable, rows: &[Row]) -> Kilopascals {
    let share = rows.len().saturating_sub(1) as f32 / (ROWS - 1) as f32;
    Kilopascals(table.max_pressure_kpa * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use proptest::prelude::*;

    #[test]
    fn the_bend_of_a_strain_is_that_of_the_pressure_of_the_strain() {
        for ue in [-500.0, 0.0, 120.0, 3_000.0, 9_876.0, 15_000.0, 40_000.0] {
            let strain = Microstrain(ue);
            let (pressure, _) = pressure_for_strain(&FINGER, strain);
            let (bend, _) = bend(&FINGER, pressure);
            let direct = bend_for_strain(&FINGER, strain);
            assert!(
                (direct.0 - bend.0).abs() < 1e-3,
                "{ue}: {direct:?}, {bend:?}"
            );
        }
    }

    #[test]
    fn fits_its_flash_budget() {
        assert!(core::mem::size_of::<FingerTable>() <= 4096);
    }

    /// The recipe that `SOFTGRIP_RECIPE` names, or the default one.
    static BUILT: FingerTable = include!(concat!(env!("OUT_DIR"), "/finger_table.rs"));

    #[test]
    fn the_finger_of_this_build_starts_with_its_own_settings() {
        let settings = Settings::for_finger(&BUILT);
        settings.validate(&BUILT).expect("its own");
        assert!(settings.regulator.max_pressure_kpa <= BUILT.max_pressure_kpa);
        assert!(
            BUILT
                .lift_rows
                .iter()
                .all(|&rows| usize::from(rows) <= ROWS)
        );
        for pair in BUILT.rows.windows(2) {
            assert!(pair[1].tip_angle_deg >= pair[0].tip_angle_deg);
        }
    }

    #[test]
    fn lift_is_known_as_far_as_the_table_says_and_no_further() {
        let partly = FingerTable {
            lift_rows: [41, 0],
            ..FINGER
        };
        let known = lift_known_to(&partly, ObjectKind::Sphere);
        assert_eq!(known, Some(Kilopascals(FINGER.max_pressure_kpa / 2.0)));
        let (Some(end), full) = (known, FINGER) else {
            panic!("known to half");
        };
        let sphere = |table: &FingerTable, kpa| lift(table, ObjectKind::Sphere, Kilopascals(kpa));
        assert_eq!(sphere(&partly, end.0), sphere(&full, end.0));
        assert_eq!(sphere(&partly, end.0 + 1.0), None);
        assert_eq!(row(&partly, Kilopascals(end.0 + 1.0)).0.lift_n[0], 0.0);
        let (most, _) = sphere(&full, end.0).expect("known");
        let heavy = Newtons(2.0 * most.0);
        let (pressure, range) =
            pressure_for_lift(&partly, ObjectKind::Sphere, heavy).expect("some is known");
        assert_eq!((pressure, range), (end, Range::Above));
        assert_eq!(lift_known_to(&partly, ObjectKind::Cylinder), None);
        assert_eq!(lift(&partly, ObjectKind::Cylinder, end), None);
        assert_eq!(
            pressure_for_lift(&partly, ObjectKind::Cylinder, heavy),
            None
        );
    }

    #[test]
    fn states_an_error_bound_within_a_thousandth() {
        assert!(FINGER.error_bound_percent > 0.0 && FINGER.error_bound_percent <= 0.1);
    }

    #[test]
    fn a_look_up_beyond_the_ends_is_clamped_and_says_so() {
        let (low, range) = free_strain(&FINGER, Kilopascals(-3.0));
        assert_eq!((low.0, range), (0.0, Range::Below));
        let (top, range) = bend(&FINGER, Kilopascals(1e9));
        assert_eq!(
            (top.0, range),
            (FINGER.rows[ROWS - 1].tip_angle_deg, Range::Above)
        );
        assert_eq!(bend(&FINGER, Kilopascals(f32::NAN)).1, Range::Below);
        assert_eq!(pressure_for_bend(&FINGER, Degrees(-1.0)).1, Range::Below);
        assert_eq!(
            pressure_for_bend(&FINGER, Degrees(f32::NAN)).1,
            Range::Below
        );
        let (pressure, range) = pressure_for_bend(&FINGER, Degrees(400.0));
        assert_eq!((pressure.0, range), (FINGER.max_pressure_kpa, Range::Above));
        let (pressure, range) = pressure_for_bend(&FINGER, top);
        assert_eq!(
            (pressure.0, range),
            (FINGER.max_pressure_kpa, Range::Inside)
        );
    }

    #[test]
    fn link_angles_end_at_the_bend() {
        for kpa in [0.0, 37.0, 90.0, 140.0, 160.0] {
            let (angles, _) = link_angles(&FINGER_LINKS, Kilopascals(kpa));
            let (bend, _) = bend(&FINGER, Kilopascals(kpa));
            assert!((angles[LINKS - 1].0 - bend.0).abs() < 1e-3 * bend.0.max(1.0));
        }
    }

    proptest! {
        #[test]
        fn every_column_rises_and_the_inverse_returns(a in 0.0f32..1.0, b in 0.0f32..1.0) {
            let max = FINGER.max_pressure_kpa;
            let (low, high) = (a.min(b) * max, a.max(b) * max);
            let (at_low, _) = row(&FINGER, Kilopascals(low));
            let (at_high, _) = row(&FINGER, Kilopascals(high));
            prop_assert!(at_low.free_strain_ue <= at_high.free_strain_ue);
            prop_assert!(at_low.tip_angle_deg <= at_high.tip_angle_deg);
            let (back, range) = pressure_for_bend(&FINGER, Degrees(at_high.tip_angle_deg));
            prop_assert_eq!(range, Range::Inside);
            let (again, _) = bend(&FINGER, back);
            prop_assert!((again.0 - at_high.tip_angle_deg).abs() < 1e-3);
            for kind in [ObjectKind::Sphere, ObjectKind::Cylinder] {
                let known = |kpa| lift(&FINGER, kind, kpa).expect("known").0;
                let (low_lift, high_lift) = (known(Kilopascals(low)), known(Kilopascals(high)));
                prop_assert!(low_lift.0 <= high_lift.0);
                let (enough, _) = pressure_for_lift(&FINGER, kind, high_lift).expect("known");
                let again = known(enough);
                prop_assert!((again.0 - high_lift.0).abs() < 1e-4);
            }
            let (back, _) = pressure_for_strain(&FINGER, Microstrain(at_high.free_strain_ue));
            let (again, _) = free_strain(&FINGER, back);
            prop_assert!((again.0 - at_high.free_strain_ue).abs() < 0.2);
        }
    }
}

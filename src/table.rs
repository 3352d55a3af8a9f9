//! The finger's table: free-bend strain, bend and joint torques against pressure, made by `build.rs`.

use crate::math::{larger, smaller};
use crate::units::{Degrees, Kilopascals, Microstrain, Newtons};

/// Links, and joints, of the equivalent chain (paper, section 4.1).
pub const LINKS: usize = 6;
/// Kinds of object in the table.
pub const OBJECTS: usize = 2;
/// Pressures in the table.
pub const ROWS: usize = 81;

/// The finger at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Gauge strain of the free finger, µε.
    pub free_strain_ue: f32,
    /// Angle of the last link, degrees.
    pub tip_angle_deg: f32,
    /// Tip along the unbent finger and towards the inside of the bend, mm.
    pub tip_mm: [f32; 2],
    /// Joint torques, N·mm (paper, table 3).
    pub torque_nmm: [f32; LINKS],
    /// Force of the three fingers against gravity on an object of each kind, N; zero where it is not
    /// known.
    pub lift_n: [f32; OBJECTS],
}

/// A kind of object whose lift the table knows, in the size of the recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ObjectKind {
    /// A sphere.
    Sphere,
    /// An upright cylinder.
    Cylinder,
}

/// One finger on a uniform grid of pressures that starts at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerTable {
    /// Name of the recipe it was made from.
    pub recipe: &'static str,
    /// First eight bytes of the SHA-256 of that recipe.
    pub inputs_hash: u64,
    /// Largest deviation from the model between the rows, in percent of each column's full scale; lift
    /// apart.
    pub error_bound_percent: f32,
    /// The same for the lift.
    pub lift_error_percent: f32,
    /// Rows, from the first on, whose lift of each kind of object is known: none without a grasp in the
    /// recipe, not all where fingers and object find no equilibrium.
    pub lift_rows: [u8; OBJECTS],
    /// Pressure of the last row, kPa.
    pub max_pressure_kpa: f32,
    /// Joint stiffness, N·mm/deg (paper, table 2).
    pub stiffness_nmm_per_deg: [f32; LINKS],
    /// The finger at evenly spaced pressures.
    pub rows: [Row; ROWS],
}

/// The table of the recipe that this build was made for.
#[cfg(not(test))]
pub static FINGER: FingerTable = include!(concat!(env!("OUT_DIR"), "/finger_table.rs"));

/// The table of the default recipe: the library's own tests state numbers of that finger, whichever the
/// build is for.
#[cfg(test)]
pub static FINGER: FingerTable = include!(concat!(env!("OUT_DIR"), "/default_table.rs"));

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

/// A place between two rows.
#[derive(Debug, Clone, Copy)]
struct Place {
    index: usize,
    fraction: f32,
    range: Range,
}

impl Row {
    fn lift(&self, kind: ObjectKind) -> f32 {
        let [sphere, cylinder] = self.lift_n;
        match kind {
            ObjectKind::Sphere => sphere,
            ObjectKind::Cylinder => cylinder,
        }
    }
}

impl FingerTable {
    /// Gauge strain of the free finger.
    pub fn free_strain(&self, pressure: Kilopascals) -> (Microstrain, Range) {
        let place = self.place(pressure);
        let strain = self.between(place, |row| row.free_strain_ue);
        (Microstrain(strain), place.range)
    }

    /// Bend of the free finger: the angle of its last link.
    pub fn bend(&self, pressure: Kilopascals) -> (Degrees, Range) {
        let place = self.place(pressure);
        let angle = self.between(place, |row| row.tip_angle_deg);
        (Degrees(angle), place.range)
    }

    /// Everything that the table knows at a pressure.
    pub fn row(&self, pressure: Kilopascals) -> (Row, Range) {
        let place = self.place(pressure);
        let row = Row {
            free_strain_ue: self.between(place, |row| row.free_strain_ue),
            tip_angle_deg: self.between(place, |row| row.tip_angle_deg),
            tip_mm: core::array::from_fn(|i| self.between(place, |row| row.tip_mm[i])),
            torque_nmm: core::array::from_fn(|i| self.between(place, |row| row.torque_nmm[i])),
            lift_n: [ObjectKind::Sphere, ObjectKind::Cylinder].map(|kind| {
                let lift = self.lift(kind, pressure);
                lift.map_or(0.0, |(lift, _)| lift.0)
            }),
        };
        (row, place.range)
    }

    /// Force of the three fingers against gravity before an object slides (statics); none where it is
    /// not known.
    pub fn lift(&self, kind: ObjectKind, pressure: Kilopascals) -> Option<(Newtons, Range)> {
        let place = self.place(pressure);
        // The upper of two rows counts only if it has a share beyond rounding.
        let needed = place.index + 1 + usize::from(place.fraction > 1e-3);
        (needed <= self.lift_rows(kind).len()).then(|| {
            let lift = self.between(place, |row| row.lift(kind));
            (Newtons(lift), place.range)
        })
    }

    /// The lowest pressure whose lift carries `load`; beyond [`FingerTable::lift_known_to`] it is
    /// [`Range::Above`]. None if no lift is known.
    pub fn pressure_for_lift(
        &self,
        kind: ObjectKind,
        load: Newtons,
    ) -> Option<(Kilopascals, Range)> {
        let rows = self.lift_rows(kind);
        (!rows.is_empty()).then(|| self.inverse(rows, load.0, |row| row.lift(kind)))
    }

    /// The highest pressure at which the lift is known; none if it is at no pressure.
    pub fn lift_known_to(&self, kind: ObjectKind) -> Option<Kilopascals> {
        let rows = self.lift_rows(kind);
        (!rows.is_empty()).then(|| self.last_of(rows))
    }

    /// The rows that know the lift.
    fn lift_rows(&self, kind: ObjectKind) -> &[Row] {
        let [sphere, cylinder] = self.lift_rows;
        let rows = match kind {
            ObjectKind::Sphere => sphere,
            ObjectKind::Cylinder => cylinder,
        };
        self.rows.get(..rows.into()).unwrap_or(&self.rows)
    }

    /// Angle of each link to the unbent finger: `Φ_i = Σ T_j / k_j, j ≤ i` (paper, eqs 22 and 24, corrected).
    pub fn link_angles(&self, pressure: Kilopascals) -> ([Degrees; LINKS], Range) {
        let (row, range) = self.row(pressure);
        let mut sum = 0.0;
        let angles = core::array::from_fn(|i| {
            sum += row.torque_nmm[i] / self.stiffness_nmm_per_deg[i];
            Degrees(sum)
        });
        (angles, range)
    }

    /// The pressure at which the free finger bends by `bend`.
    pub fn pressure_for_bend(&self, bend: Degrees) -> (Kilopascals, Range) {
        self.inverse(&self.rows, bend.0, |row| row.tip_angle_deg)
    }

    /// The pressure at which the free finger's gauge shows `strain`.
    pub fn pressure_for_strain(&self, strain: Microstrain) -> (Kilopascals, Range) {
        self.inverse(&self.rows, strain.0, |row| row.free_strain_ue)
    }

    /// Pressure of the last of the first `rows`.
    fn last_of(&self, rows: &[Row]) -> Kilopascals {
        let share = rows.len().saturating_sub(1) as f32 / (ROWS - 1) as f32;
        Kilopascals(self.max_pressure_kpa * share)
    }

    fn place(&self, pressure: Kilopascals) -> Place {
        let last = (ROWS - 1) as f32;
        let position = pressure.0 * last / self.max_pressure_kpa;
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

    fn between(&self, place: Place, column: impl Fn(&Row) -> f32) -> f32 {
        match &self.rows[place.index..] {
            [low, high, ..] => {
                let low = column(low);
                low + place.fraction * (column(high) - low)
            }
            _ => 0.0,
        }
    }

    /// Inverts a rising column of the first `rows`; its search takes seven steps.
    fn inverse(
        &self,
        rows: &[Row],
        value: f32,
        column: impl Fn(&Row) -> f32,
    ) -> (Kilopascals, Range) {
        let step = self.max_pressure_kpa / (ROWS - 1) as f32;
        let above = rows.partition_point(|row| column(row) <= value);
        // Never out of range, which the compiler cannot tell of a part of the table.
        match rows.get(above.saturating_sub(1)..).unwrap_or_default() {
            [low, high, ..] if above > 0 => {
                let fraction = (value - column(low)) / (column(high) - column(low));
                (
                    Kilopascals(((above - 1) as f32 + fraction) * step),
                    Range::Inside,
                )
            }
            [row] if above > 0 && value <= column(row) => (self.last_of(rows), Range::Inside),
            [_] if above > 0 => (self.last_of(rows), Range::Above),
            _ => (Kilopascals(0.0), Range::Below),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frontend::FrontEnd;
    use crate::settings::Settings;
    use proptest::prelude::*;

    #[test]
    fn fits_its_flash_budget() {
        assert!(core::mem::size_of::<FingerTable>() <= 4096);
    }

    /// The recipe that `SOFTGRIP_RECIPE` names, or the default one.
    static BUILT: FingerTable = include!(concat!(env!("OUT_DIR"), "/finger_table.rs"));

    #[test]
    fn the_finger_of_this_build_starts_with_its_own_settings() {
        let front_end = FrontEnd::REFERENCE;
        let settings = Settings::for_finger(&front_end, &BUILT);
        settings.validate(&front_end, &BUILT).expect("its own");
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
        let known = partly.lift_known_to(ObjectKind::Sphere);
        assert_eq!(known, Some(Kilopascals(FINGER.max_pressure_kpa / 2.0)));
        let (Some(end), full) = (known, FINGER) else {
            panic!("known to half");
        };
        let lift = |table: &FingerTable, kpa| table.lift(ObjectKind::Sphere, Kilopascals(kpa));
        assert_eq!(lift(&partly, end.0), lift(&full, end.0));
        assert_eq!(lift(&partly, end.0 + 1.0), None);
        assert_eq!(partly.row(Kilopascals(end.0 + 1.0)).0.lift_n[0], 0.0);
        let (most, _) = lift(&full, end.0).expect("known");
        let heavy = Newtons(2.0 * most.0);
        let (pressure, range) = partly
            .pressure_for_lift(ObjectKind::Sphere, heavy)
            .expect("some is known");
        assert_eq!((pressure, range), (end, Range::Above));
        assert_eq!(partly.lift_known_to(ObjectKind::Cylinder), None);
        assert_eq!(partly.lift(ObjectKind::Cylinder, end), None);
        assert_eq!(partly.pressure_for_lift(ObjectKind::Cylinder, heavy), None);
    }

    #[test]
    fn states_an_error_bound_within_a_thousandth() {
        assert!(FINGER.error_bound_percent > 0.0 && FINGER.error_bound_percent <= 0.1);
    }

    #[test]
    fn a_look_up_beyond_the_ends_is_clamped_and_says_so() {
        let (low, range) = FINGER.free_strain(Kilopascals(-3.0));
        assert_eq!((low.0, range), (0.0, Range::Below));
        let (top, range) = FINGER.bend(Kilopascals(1e9));
        assert_eq!(
            (top.0, range),
            (FINGER.rows[ROWS - 1].tip_angle_deg, Range::Above)
        );
        assert_eq!(FINGER.bend(Kilopascals(f32::NAN)).1, Range::Below);
        assert_eq!(FINGER.pressure_for_bend(Degrees(-1.0)).1, Range::Below);
        assert_eq!(FINGER.pressure_for_bend(Degrees(f32::NAN)).1, Range::Below);
        let (pressure, range) = FINGER.pressure_for_bend(Degrees(400.0));
        assert_eq!((pressure.0, range), (FINGER.max_pressure_kpa, Range::Above));
        let (pressure, range) = FINGER.pressure_for_bend(top);
        assert_eq!(
            (pressure.0, range),
            (FINGER.max_pressure_kpa, Range::Inside)
        );
    }

    #[test]
    fn link_angles_end_at_the_bend() {
        for kpa in [0.0, 37.0, 90.0, 140.0, 160.0] {
            let (angles, _) = FINGER.link_angles(Kilopascals(kpa));
            let (bend, _) = FINGER.bend(Kilopascals(kpa));
            assert!((angles[LINKS - 1].0 - bend.0).abs() < 1e-3 * bend.0.max(1.0));
        }
    }

    proptest! {
        #[test]
        fn every_column_rises_and_the_inverse_returns(a in 0.0f32..1.0, b in 0.0f32..1.0) {
            let max = FINGER.max_pressure_kpa;
            let (low, high) = (a.min(b) * max, a.max(b) * max);
            let (at_low, _) = FINGER.row(Kilopascals(low));
            let (at_high, _) = FINGER.row(Kilopascals(high));
            prop_assert!(at_low.free_strain_ue <= at_high.free_strain_ue);
            prop_assert!(at_low.tip_angle_deg <= at_high.tip_angle_deg);
            let (back, range) = FINGER.pressure_for_bend(Degrees(at_high.tip_angle_deg));
            prop_assert_eq!(range, Range::Inside);
            let (again, _) = FINGER.bend(back);
            prop_assert!((again.0 - at_high.tip_angle_deg).abs() < 1e-3);
            for kind in [ObjectKind::Sphere, ObjectKind::Cylinder] {
                let lift = |kpa| FINGER.lift(kind, kpa).expect("known").0;
                let (low_lift, high_lift) = (lift(Kilopascals(low)), lift(Kilopascals(high)));
                prop_assert!(low_lift.0 <= high_lift.0);
                let (enough, _) = FINGER.pressure_for_lift(kind, high_lift).expect("known");
                let again = lift(enough);
                prop_assert!((again.0 - high_lift.0).abs() < 1e-4);
            }
            let (back, _) = FINGER.pressure_for_strain(Microstrain(at_high.free_strain_ue));
            let (again, _) = FINGER.free_strain(back);
            prop_assert!((again.0 - at_high.free_strain_ue).abs() < 0.2);
        }
    }
}

//! What the gauge of one finger, as it was cast and as its gauge was glued, shows over the recipe's.
//!
//! Rubber of another modulus bends in the same way at another pressure, for nothing but their ratio counts in the equations
//! of the finger; and 0.1 mm of the bore or the wall does nearly the same. So two numbers describe a casting: its
//! stiffness `s`, and the gain `g` of its gauge:
//!
//! ```text
//! ε(p) = g ε_free(p / s)
//! ```
//!
//! 200 castings of the default finger, each dimension off by up to 0.1 mm and the modulus by 10 %, are described within
//! 0.3 % of full scale rms. The tick takes the ratio to the table's strain as a parabola in it: one look-up does for
//! all fingers.

use crate::math::{larger, smaller};
use crate::table::{self, FingerTable};
use crate::units::Kilopascals;

/// The parabola meets the ratio at these shares of the highest pressure for which the table knows both.
const KNOTS: [f32; 3] = [0.45, 0.75, 1.0];

/// Ratio of one finger's strain to the table's, over the table's as a share of its last: `a + b x + c x²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Casting {
    a: f32,
    b: f32,
    c: f32,
}

/// One over the table's last free strain, 1/µε.
pub(super) fn per_free_ue(table: &FingerTable) -> f32 {
    1.0 / larger(1.0, free_ue(table, table.max_pressure_kpa))
}

// Not inlined: the image has little room.
#[inline(never)]
fn free_ue(table: &FingerTable, kpa: f32) -> f32 {
    table::free_strain(table, Kilopascals(kpa)).0.0
}

/// Strain must rise with pressure, or it would tell two of them: by so much `b` and `c` are made smaller where it did not,
/// which takes a casting that no mould makes. The strain is `a x + b x² + c x³`; its slope stays above `a`/20.
fn flatten(a: f32, b: f32, c: f32) -> f32 {
    const LEAST: f32 = 0.95;
    let falls = |x: f32| x * (2.0 * b + 3.0 * c * x);
    let turn = -b / (3.0 * c);
    let steepest = match turn > 0.0 && turn < 1.0 {
        true => smaller(falls(1.0), falls(turn)),
        false => falls(1.0),
    };
    match a > 0.0 && a * LEAST + steepest < 0.0 {
        true => -a * LEAST / steepest,
        false => 1.0,
    }
}

impl Casting {
    /// A finger with this gain and stiffness over the recipe's.
    pub fn of(table: &FingerTable, gain: f32, stiffness: f32) -> Self {
        let alike = Self {
            a: gain,
            b: 0.0,
            c: 0.0,
        };
        if stiffness == 1.0 {
            return alike;
        }
        let per_free_ue = per_free_ue(table);
        let known_kpa = table.max_pressure_kpa * smaller(stiffness, 1.0);
        let knot = |share: f32| {
            let kpa = share * known_kpa;
            let expected_ue = free_ue(table, kpa);
            let ratio = gain * free_ue(table, kpa / stiffness) / larger(1.0, expected_ue);
            (per_free_ue * expected_ue, ratio)
        };
        let [(x, at_x), (y, at_y), (z, at_z)] = KNOTS.map(knot);
        if !(x < y && y < z) {
            // A finger that does not strain tells nothing.
            return alike;
        }
        // Newton's divided differences.
        let first = (at_y - at_x) / (y - x);
        let c = ((at_z - at_y) / (z - y) - first) / (z - x);
        let b = first - c * (x + y);
        let a = at_x - x * (b + c * x);
        let flatter = flatten(a, b, c);
        Self {
            a,
            b: flatter * b,
            c: flatter * c,
        }
    }

    /// Strain of the finger over the table's, where that is this share of its last.
    pub fn ratio(&self, share: f32) -> f32 {
        self.a + share * (self.b + share * self.c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::FINGER;
    use proptest::prelude::*;

    /// Strain of a casting at a pressure, µε.
    fn strain_ue(casting: &Casting, kpa: f32) -> f32 {
        let free = free_ue(&FINGER, kpa);
        casting.ratio(per_free_ue(&FINGER) * free) * free
    }

    #[test]
    fn the_recipes_own_finger_is_itself_to_the_bit() {
        let casting = Casting::of(&FINGER, 1.0, 1.0);
        for share in [0.0, 0.3, 1.0] {
            assert_eq!(casting.ratio(share), 1.0);
        }
    }

    #[test]
    fn the_parabola_is_within_a_hundredth_of_full_scale_for_what_moulds_make() {
        let full = free_ue(&FINGER, FINGER.max_pressure_kpa);
        for stiffness in [0.8, 0.9, 1.1, 1.2] {
            let casting = Casting::of(&FINGER, 1.05, stiffness);
            for kpa in (0..=160).map(|kpa| kpa as f32) {
                if kpa / stiffness > FINGER.max_pressure_kpa {
                    continue;
                }
                let exact = 1.05 * free_ue(&FINGER, kpa / stiffness);
                let off = (strain_ue(&casting, kpa) - exact).abs() / full;
                assert!(off < 0.01, "{stiffness} at {kpa} kPa: {off}");
            }
        }
    }

    proptest! {
        #[test]
        fn strain_rises_with_pressure_in_every_casting_that_may_be_set(
            gain in 0.5f32..=2.0,
            stiffness in 0.7f32..=1.5,
            from in 0.0f32..1.0,
            to in 0.0f32..1.0,
        ) {
            let casting = Casting::of(&FINGER, gain, stiffness);
            let max = FINGER.max_pressure_kpa;
            let at = |share: f32| strain_ue(&casting, share * max);
            prop_assert!(at(from.min(to)) <= at(from.max(to)) + 0.01);
        }
    }
}

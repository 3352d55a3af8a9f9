//! Residuals of one tick, as shares of a reference: of all fingers, of the emptiest, of the others.

use crate::estimate::Contact;
use crate::math::larger;
use crate::units::FINGERS;

/// A finger that carries less than this share of the strongest one's residual is not part of the grip.
const CARRYING: f32 = 0.2;

/// Residuals of one tick, as shares of a reference.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shares {
    /// Of all fingers.
    pub sum: f32,
    /// Of all but the emptiest.
    pub others: f32,
    /// Of the emptiest.
    pub emptiest: f32,
    /// Change of the sum if every finger's strain changes by 1 µε.
    pub per_ue: f32,
    /// Variances of the noise of sum and emptiest.
    pub variance: f32,
    pub emptiest_variance: f32,
    /// Fingers in the sum.
    pub fingers: usize,
}

impl Shares {
    /// None without a usable gauge that carries any of the grip; the supervisor knows how many are left.
    pub fn of(
        reference: &[f32; FINGERS],
        contact: &Contact,
        noise_variance: &[f32; FINGERS],
    ) -> Option<Self> {
        let strongest = reference.iter().copied().fold(0.0, larger);
        let mut all = Finger::EMPTY;
        let mut fingers = 0usize;
        let mut emptiest: Option<Finger> = None;
        for ((residual, &reference), &variance) in
            contact.residual.iter().zip(reference).zip(noise_variance)
        {
            let Some(residual) = *residual else {
                continue;
            };
            if reference <= CARRYING * strongest {
                continue;
            }
            let finger = Finger {
                residual: residual.0,
                reference,
                variance,
            };
            fingers = fingers.saturating_add(1);
            all.residual += finger.residual;
            all.reference += finger.reference;
            all.variance += finger.variance;
            if emptiest.is_none_or(|emptiest| finger.share() < emptiest.share()) {
                emptiest = Some(finger);
            }
        }
        let emptiest = emptiest?;
        let left = all.reference - emptiest.reference;
        Some(Self {
            sum: all.share(),
            others: match left > 0.0 {
                true => (all.residual - emptiest.residual) / left,
                // It is the only one.
                false => all.share(),
            },
            emptiest: emptiest.share(),
            per_ue: fingers as f32 / all.reference,
            variance: all.noise(),
            emptiest_variance: emptiest.noise(),
            fingers,
        })
    }
}

/// One finger's part, or that of several.
#[derive(Debug, Clone, Copy)]
struct Finger {
    residual: f32,
    reference: f32,
    variance: f32,
}

impl Finger {
    const EMPTY: Self = Self {
        residual: 0.0,
        reference: 0.0,
        variance: 0.0,
    };

    fn share(&self) -> f32 {
        self.residual / self.reference
    }

    /// Variance of the share.
    fn noise(&self) -> f32 {
        self.variance / (self.reference * self.reference)
    }
}

#[cfg(test)]
impl Shares {
    /// Three fingers without noise, each with this share of the same plateau.
    pub fn every(share: f32) -> Self {
        Self {
            sum: share,
            others: share,
            emptiest: share,
            per_ue: 1.0 / 4_000.0,
            variance: 0.0,
            emptiest_variance: 0.0,
            fingers: FINGERS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Range;
    use crate::units::{Degrees, Microstrain};

    fn shares(reference: [f32; FINGERS], residual_ue: [Option<f32>; FINGERS]) -> Option<Shares> {
        let contact = Contact {
            residual: residual_ue.map(|ue| ue.map(Microstrain)),
            touching: [true; FINGERS],
            mean: None,
            free: Microstrain(10_000.0),
            bend: Degrees(60.0),
            range: Range::Inside,
            known: true,
        };
        Shares::of(&reference, &contact, &[100.0, 400.0, 900.0])
    }

    fn assert_close(value: f32, expected: f32) {
        assert!(
            (value / expected - 1.0).abs() < 1e-5,
            "{value} and not {expected}"
        );
    }

    #[test]
    fn fingers_count_by_what_they_carry() {
        let all = shares(
            [4_000.0, 2_000.0, 3_000.0],
            [Some(4_000.0), Some(1_000.0), Some(3_600.0)],
        )
        .expect("three fingers");
        assert_close(all.sum, 8_600.0 / 9_000.0);
        assert_close(all.emptiest, 0.5);
        assert_close(all.others, 7_600.0 / 7_000.0);
        assert_eq!(all.fingers, 3);
        // 1 µε of each finger is 3 of 9 000.
        assert_close(all.per_ue, 1.0 / 3_000.0);
        // Variances add up: 37 µε of noise on 9 000, and 20 on the emptiest's 2 000.
        assert_close(all.variance, 1_400.0 / 81e6);
        assert_close(all.emptiest_variance, 1e-4);
    }

    #[test]
    fn a_finger_without_a_gauge_or_with_less_than_a_fifth_of_the_load_is_no_part_of_the_grip() {
        for (weak_ue, fingers) in [(810.0, 3), (790.0, 2)] {
            let all = shares(
                [4_000.0, weak_ue, 4_000.0],
                [Some(4_000.0), Some(0.0), Some(4_000.0)],
            )
            .expect("two fingers at least");
            assert_eq!(all.fingers, fingers, "{weak_ue}");
            assert_eq!(all.emptiest == 0.0, fingers == 3, "{weak_ue}");
        }
        let two = shares([4_000.0; 3], [Some(2_000.0), None, Some(4_000.0)]).expect("two fingers");
        assert_eq!((two.sum, two.fingers), (0.75, 2));
        assert!(shares([4_000.0; 3], [None; 3]).is_none());
        assert!(shares([0.0; 3], [Some(1.0); 3]).is_none());
    }

    #[test]
    fn the_last_finger_is_the_others_too() {
        let one = shares([4_000.0; 3], [Some(1_000.0), None, None]).expect("one finger");
        assert_eq!((one.emptiest, one.others, one.sum), (0.25, 0.25, 0.25));
    }
}

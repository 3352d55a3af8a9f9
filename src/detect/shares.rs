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

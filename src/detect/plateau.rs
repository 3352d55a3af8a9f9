//! The residual that a hold is judged against: what each finger felt when it began.

use crate::estimate::Contact;
use crate::math::{lag_gain, larger};
use crate::units::{FINGERS, Instant, Microstrain};

/// Averaging of each residual into the plateau that a hold starts from: short against `settle_ms`,
/// long against noise.
const PLATEAU_MS: f32 = 40.0;
/// The plateau follows creep (minutes), but no slip: a sphere that slides by 1 mm in a second is 1 % off.
const REFERENCE_MS: f32 = 5_000.0;
/// The plateau only follows while the level is this close to one.
pub(super) const CALM: f32 = 0.03;
/// A hold's plateau follows a rise for this long: four times the fingers' lag of 0.1 s.
const SETTLING_US: u64 = 400_000;
/// Averaging of what a finger has carried lately. An object that has been turned in the grip and is held
/// again is a new start for each finger.
const LATELY_MS: f32 = 1_000.0;
/// A gauge that was away for longer than a spike comes back as a new start of its finger: it may have been
/// repaired, and the object may have been turned meanwhile.
const AWAY_TICKS: u8 = 3;

/// Gains of the averages.
#[derive(Debug, Clone, Copy)]
struct Gains {
    plateau: f32,
    reference: f32,
    lately: f32,
}

/// Residuals of the last moments, held or not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plateau {
    residual_ue: [f32; FINGERS],
    /// Strain of a free finger, averaged like the residuals, µε.
    free_ue: f32,
    /// Ticks since each gauge was usable.
    away: [u8; FINGERS],
    gains: Gains,
}

impl Plateau {
    /// No contact.
    pub fn new() -> Self {
        Self {
            residual_ue: [0.0; FINGERS],
            free_ue: 0.0,
            away: [0; FINGERS],
            gains: Gains {
                plateau: lag_gain(PLATEAU_MS),
                reference: lag_gain(REFERENCE_MS),
                lately: lag_gain(LATELY_MS),
            },
        }
    }

    /// Follows the residuals. A gauge that comes back is a new start of its finger, in a hold too.
    pub fn step(&mut self, contact: &Contact, mut hold: Option<&mut Reference>) {
        for (i, residual) in contact.residual.iter().enumerate() {
            let Some(residual) = residual else {
                self.away[i] = self.away[i].saturating_add(1);
                continue;
            };
            let average = &mut self.residual_ue[i];
            *average += self.gains.plateau * (residual.0 - *average);
            if self.away[i] == 0 {
                continue;
            }
            if core::mem::take(&mut self.away[i]) >= AWAY_TICKS {
                *average = residual.0;
                if let Some(hold) = &mut hold {
                    hold.plateau[i] = residual.0;
                    hold.lately[i] = residual.0;
                }
            }
        }
        self.free_ue += self.gains.plateau * (contact.free.0 - self.free_ue);
    }

    /// The reference of a hold by these fingers. One that did not touch is no part of it, even if what it
    /// felt before still fades.
    pub fn reference(&self, now: Instant, carrying: [bool; FINGERS]) -> Reference {
        let mut plateau = self.residual_ue;
        for (plateau, carries) in plateau.iter_mut().zip(carrying) {
            if !carries {
                *plateau = 0.0;
            }
        }
        Reference {
            since: now,
            plateau,
            lately: plateau,
            free: Microstrain(self.free_ue),
        }
    }
}

/// What a hold is judged against.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reference {
    since: Instant,
    /// Residual of each finger when the hold began, µε.
    pub plateau: [f32; FINGERS],
    /// Residual of each finger lately, µε.
    pub lately: [f32; FINGERS],
    /// Strain of a free finger at that plateau.
    free: Microstrain,
}

impl Reference {
    /// While the fingers follow the last of the pressure, the grip still tightens, and the plateau with it.
    /// Says whether that is so.
    pub fn settle(
        &mut self,
        now: Instant,
        plateau: &Plateau,
        contact: &Contact,
        carrying: [bool; FINGERS],
    ) -> bool {
        let settling = now.micros_since(self.since) < SETTLING_US;
        if settling {
            self.free.0 = larger(self.free.0, contact.free.0);
            let plateaus = self.plateau.iter_mut().zip(plateau.residual_ue);
            for ((held, plateau), carries) in plateaus.zip(carrying) {
                if carries {
                    *held = larger(*held, plateau);
                }
            }
        }
        settling
    }

    /// Takes this tick into what each finger has carried lately.
    pub fn follow_lately(&mut self, plateau: &Plateau, contact: &Contact) {
        for (lately, residual) in self.lately.iter_mut().zip(contact.residual) {
            if let Some(residual) = residual {
                *lately += plateau.gains.lately * (residual.0 - *lately);
            }
        }
    }

    /// Follows creep.
    pub fn follow_creep(&mut self, plateau: &Plateau, contact: &Contact) {
        for (held, plateau_ue) in self.plateau.iter_mut().zip(plateau.residual_ue) {
            *held += plateau.gains.reference * (plateau_ue - *held);
        }
        self.free.0 += plateau.gains.reference * (contact.free.0 - self.free.0);
    }

    /// What every free finger would have lost since, at a lower pressure, µε. One that is held by an object
    /// loses less than that.
    pub fn sag_ue(&self, contact: &Contact) -> f32 {
        larger(self.free.0 - contact.free.0, 0.0)
    }

    /// How far each finger's residual has fallen, as a share of its plateau.
    pub fn fallen(&self, contact: &Contact) -> [Option<f32>; FINGERS] {
        core::array::from_fn(|i| {
            let held = self.plateau[i].max(1.0);
            contact.residual[i].map(|residual| 1.0 - residual.0 / held)
        })
    }
}

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

    /// What a free finger gains just now, at a pressure that its shape still follows, µε.
    pub fn swell_ue(&self, contact: &Contact) -> f32 {
        larger(contact.free.0 - self.free_ue, 0.0)
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
    /// Of no hold.
    pub const NONE: Self = Self {
        since: Instant::from_micros(0),
        plateau: [0.0; FINGERS],
        lately: [0.0; FINGERS],
        free: Microstrain(0.0),
    };

    /// Begins with what these fingers feel. One that did not touch is no part of it, even if what it felt before
    /// still fades.
    pub fn begin(&mut self, now: Instant, plateau: &Plateau, carrying: [bool; FINGERS]) {
        self.since = now;
        self.plateau = plateau.residual_ue;
        for (plateau, carries) in self.plateau.iter_mut().zip(carrying) {
            if !carries {
                *plateau = 0.0;
            }
        }
        self.lately = self.plateau;
        self.free = Microstrain(plateau.free_ue);
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Range;
    use crate::units::Degrees;

    const CARRYING: [bool; FINGERS] = [true; FINGERS];

    impl Plateau {
        /// The reference of a hold that begins now.
        fn reference(&self, now: Instant, carrying: [bool; FINGERS]) -> Reference {
            let mut reference = Reference::NONE;
            reference.begin(now, self, carrying);
            reference
        }
    }

    fn at(ms: u64) -> Instant {
        Instant::from_micros(1_000 * ms)
    }

    /// One tick with these residuals, and this strain of a free finger, µε.
    fn felt(residual_ue: [Option<f32>; FINGERS], free_ue: f32) -> Contact {
        Contact {
            residual: residual_ue.map(|ue| ue.map(Microstrain)),
            touching: CARRYING,
            mean: None,
            free: Microstrain(free_ue),
            bend: Degrees(60.0),
            range: Range::Inside,
            known: true,
        }
    }

    fn all(residual_ue: f32) -> Contact {
        felt([Some(residual_ue); FINGERS], 12_000.0)
    }

    /// A plateau after so many ticks alike.
    fn plateau(contact: &Contact, ticks: u32) -> Plateau {
        let mut plateau = Plateau::new();
        for _ in 0..ticks {
            plateau.step(contact, None);
        }
        plateau
    }

    fn assert_close(values_ue: [f32; FINGERS], expected_ue: f32) {
        for ue in values_ue {
            assert!((ue - expected_ue).abs() < 2.0, "{ue} and not {expected_ue}");
        }
    }

    #[test]
    fn a_plateau_goes_63_percent_of_its_way_in_40_ms() {
        let reference = plateau(&all(4_000.0), 40).reference(at(40), CARRYING);
        assert_close(reference.plateau, 0.632 * 4_000.0);
        assert_close(reference.lately, 0.632 * 4_000.0);
        // A free finger's strain does, too.
        assert_close([reference.free.0; FINGERS], 0.632 * 12_000.0);
    }

    #[test]
    fn a_finger_that_did_not_touch_carries_nothing_in_a_hold() {
        let plateau = plateau(&all(4_000.0), 1_000);
        let reference = plateau.reference(at(0), [true, false, true]);
        assert_eq!(reference.plateau[1], 0.0);
        assert_eq!(reference.lately[1], 0.0);
        assert!(reference.plateau[0] > 3_999.0 && reference.plateau[2] > 3_999.0);
    }

    #[test]
    fn a_gauge_that_was_away_for_three_ticks_is_a_new_start_and_a_spike_is_none() {
        for (away, restarts) in [(2, false), (3, true)] {
            let mut plateau = plateau(&all(4_000.0), 1_000);
            let mut hold = plateau.reference(at(0), CARRYING);
            for _ in 0..away {
                plateau.step(
                    &felt([None, Some(4_000.0), Some(4_000.0)], 12_000.0),
                    Some(&mut hold),
                );
            }
            // The finger has another load than before, and so has one that was never away.
            let turned = felt([Some(2_000.0), Some(2_000.0), Some(4_000.0)], 12_000.0);
            plateau.step(&turned, Some(&mut hold));
            let first = |values: [f32; FINGERS]| values[0];
            assert_eq!(first(hold.plateau) == 2_000.0, restarts, "{hold:?}");
            assert_eq!(first(hold.lately) == 2_000.0, restarts, "{hold:?}");
            let fresh = plateau.reference(at(1), CARRYING);
            assert_eq!(first(fresh.plateau) == 2_000.0, restarts, "{fresh:?}");
            assert!(hold.plateau[1] > 3_900.0 && fresh.plateau[1] > 3_900.0);
            // What comes next is averaged again.
            plateau.step(&all(1_000.0), Some(&mut hold));
            let next = plateau.reference(at(2), CARRYING);
            assert!(first(next.plateau) > 1_900.0, "{next:?}");
        }
    }

    #[test]
    fn a_hold_follows_a_rise_for_400_ms_and_no_fall() {
        let mut plateau = plateau(&all(4_000.0), 1_000);
        let mut hold = plateau.reference(at(0), [true, true, false]);
        let tighter = felt([Some(5_000.0), Some(3_000.0), Some(5_000.0)], 13_000.0);
        for ms in 1..400 {
            plateau.step(&tighter, Some(&mut hold));
            assert!(
                hold.settle(at(ms), &plateau, &tighter, [true, true, false]),
                "{ms}"
            );
        }
        let [risen, fallen, loose] = hold.plateau;
        assert!((risen - 5_000.0).abs() < 1.0, "{risen}");
        assert!((fallen - 4_000.0).abs() < 1.0, "{fallen}");
        assert_eq!(loose, 0.0);
        assert_eq!(hold.free, Microstrain(13_000.0));
        // From then on it stays.
        plateau.step(&all(9_000.0), Some(&mut hold));
        assert!(!hold.settle(at(400), &plateau, &all(9_000.0), CARRYING));
        assert_eq!(hold.plateau, [risen, fallen, loose]);
    }

    #[test]
    fn what_a_finger_has_carried_lately_goes_63_percent_of_its_way_in_a_second() {
        let plateau = plateau(&all(4_000.0), 1_000);
        let mut hold = plateau.reference(at(0), CARRYING);
        for _ in 0..1_000 {
            hold.follow_lately(
                &plateau,
                &felt([Some(3_000.0), None, Some(3_000.0)], 12_000.0),
            );
        }
        let [first, missing, _] = hold.lately;
        assert!((first - 3_368.0).abs() < 2.0, "{first}");
        assert!((missing - 4_000.0).abs() < 1.0, "{missing}");
        assert_close(hold.plateau, 4_000.0);
    }

    #[test]
    fn creep_is_followed_by_63_percent_in_5_s() {
        let mut hold = plateau(&all(4_000.0), 1_000).reference(at(0), CARRYING);
        let crept = felt([Some(3_800.0); FINGERS], 11_000.0);
        let plateau = plateau(&crept, 1_000);
        for _ in 0..5_000 {
            hold.follow_creep(&plateau, &crept);
        }
        assert_close(hold.plateau, 3_873.6);
        assert_close([hold.free.0; FINGERS], 11_367.9);
    }

    #[test]
    fn a_lower_pressure_takes_what_a_free_finger_loses_and_a_higher_one_gives_nothing() {
        let hold = plateau(&all(4_000.0), 1_000).reference(at(0), CARRYING);
        for (free_ue, sag_ue) in [(11_500.0, 500.0), (12_500.0, 0.0)] {
            let sag = hold.sag_ue(&felt([Some(4_000.0); FINGERS], free_ue));
            assert!((sag - sag_ue).abs() < 1.0, "{sag}");
        }
    }

    #[test]
    fn a_finger_has_fallen_by_what_is_missing_of_its_plateau() {
        let plateau = plateau(&all(4_000.0), 1_000);
        let hold = plateau.reference(at(0), [true, true, false]);
        let [fallen, missing, loose] =
            hold.fallen(&felt([Some(1_000.0), None, Some(0.0)], 12_000.0));
        assert!(
            fallen.is_some_and(|share| (share - 0.75).abs() < 1e-3),
            "{fallen:?}"
        );
        assert_eq!(missing, None);
        // One that never carried is no division by zero.
        assert_eq!(loose, Some(1.0));
    }
}

//! From the curves of a sweep to the numbers of a calibration.
//!
//! Stiffness and gain of each finger are those that fit its curve best where it is free, weighed against what moulds and
//! gauges are good for: fingers that meet early leave a short piece of their curve, which alone could not tell one from
//! the other. One stiffness is tried in each tick.

use crate::command::SweepFault;
use crate::estimate::Calibration;
use crate::math::larger;
use crate::table::{self, FingerTable};
use crate::units::{FINGERS, Kilopascals, Microstrain};

/// Pressures of a sweep beside zero.
pub(super) const LEVELS: usize = 12;
/// A pressure, and what the fingers show there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Level {
    pub kpa: f32,
    pub strain_ue: [f32; FINGERS],
}

impl Level {
    /// Of one finger.
    fn finger_ue(&self, finger: usize) -> f32 {
        self.strain_ue.get(finger).copied().unwrap_or(0.0)
    }

    pub fn sum_ue(&self) -> f32 {
        self.strain_ue.iter().sum()
    }
}

/// Fewer free levels make no curve.
const FEWEST: usize = 3;
/// A finger has met another one where it rises by less than this share of what it did in the step before, or in its steepest
/// one: the slopes of a free finger change by a tenth from step to step, with noise by a fifth.
const KNEE: f32 = 0.75;
const BENT: f32 = 0.5;
/// The step before is free, too, if it was no less than this share of the steepest.
const ROUNDED: f32 = 0.85;
/// What stops the fingers below this share of the strain at which the table says that they meet is no finger.
const MEETS: f32 = 0.8;
/// Error of a measured strain, as a share of full scale: hysteresis and creep that the two ways do not cancel.
const ERROR: f32 = 0.003;
/// Moulds are good for this share of a finger's stiffness, and gauges for this one of gain, rms.
const STIFFNESS_SPREAD: f32 = 0.08;
const GAIN_SPREAD: f32 = 0.10;
const GAIN_MEAN: f32 = 0.9;
/// A finger that the fit misses by this share of full scale is not this recipe's, or touches something.
const MISSES: f32 = 0.03;
/// Pressures on which the table's finger shows what this one does, over its own: tried from the first step to the last, …
const TRIES: i8 = 4;
const STEPS: [f32; 4] = [0.08, 0.02, 0.005, 0.0013];
/// … and within these, as are gains: a finger's own weight takes a tenth or two of its strain.
const SOFTNESS: core::ops::RangeInclusive<f32> = 0.7..=1.4;
const GAIN: core::ops::RangeInclusive<f32> = 0.6..=1.5;

/// What has become of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Progress {
    /// It goes on.
    Goes,
    /// It is over.
    Ended(Result<Calibration, SweepFault>),
}

/// Where the fingers have met.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knee {
    /// Levels at which they are free, from the first on.
    pub free: usize,
    /// What each gauge shows where they have met, µε.
    met_ue: [f32; FINGERS],
}

/// A fit that is running.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    found: Calibration,
    knee: Option<Knee>,
    finger: usize,
    round: usize,
    /// The middle of this round, and what is tried, in steps from there.
    softness: f32,
    step: i8,
    best: Option<Candidate>,
}

/// A finger that was tried.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// One over the stiffness.
    softness: f32,
    gain: f32,
    /// Sum of squared errors, each over its spread.
    cost: f32,
}

impl Fit {
    /// Of fingers that meet there, with this hysteresis and these lags.
    pub fn of(knee: Option<Knee>, hysteresis_kpa: f32, lag_ms: [f32; 2]) -> Self {
        Self {
            found: Calibration {
                gain: [1.0; FINGERS],
                stiffness: [1.0; FINGERS],
                meeting: None,
                passing_share: 1.0,
                hysteresis_kpa,
                lag_ms,
                regulator_ms: None,
                error_percent: 0.0,
            },
            knee,
            finger: 0,
            round: 0,
            softness: 1.0,
            step: -TRIES,
            best: None,
        }
    }

    /// Tries one finger.
    pub fn step(&mut self, levels: &[Level; LEVELS], table: &FingerTable) -> Progress {
        let (Some(&width), true) = (STEPS.get(self.round), self.finger < FINGERS) else {
            return Progress::Ended(self.finish(levels, table));
        };
        let softness = self.softness + width * f32::from(self.step);
        let free = self.knee.map_or(LEVELS, |knee| knee.free);
        let free = levels.get(..free).unwrap_or(levels);
        let candidate = self.candidate(softness, free, table);
        if self.best.is_none_or(|best| candidate.cost < best.cost) {
            self.best = Some(candidate);
        }
        self.step = self.step.saturating_add(1);
        if self.step > TRIES {
            self.step = -TRIES;
            self.round = self.round.saturating_add(1);
            if let Some(best) = self.best {
                self.softness = best.softness;
            }
            if self.round >= STEPS.len()
                && let Some(best) = self.best.take()
            {
                if let Err(fault) = self.keep(best, free, table) {
                    return Progress::Ended(Err(fault));
                }
                self.finger = self.finger.saturating_add(1);
                self.round = 0;
                self.softness = 1.0;
            }
        }
        Progress::Goes
    }

    /// The gain that fits best for a softness, and how well it does.
    #[inline(never)]
    fn candidate(&self, softness: f32, free: &[Level], table: &FingerTable) -> Candidate {
        let per_error = 1.0 / (ERROR * full_scale_ue(table));
        let per_spread = 1.0 / GAIN_SPREAD;
        let mut product = GAIN_MEAN * per_spread * per_spread;
        let mut square = per_spread * per_spread;
        for level in free {
            let expected = per_error * strain_ue(table, softness * level.kpa);
            product += expected * per_error * self.strain_ue(level);
            square += expected * expected;
        }
        let gain = product / square;
        let mut cost =
            squared((gain - GAIN_MEAN) * per_spread) + squared((softness - 1.0) / STIFFNESS_SPREAD);
        for level in free {
            let expected = gain * strain_ue(table, softness * level.kpa);
            cost += squared(per_error * (expected - self.strain_ue(level)));
        }
        Candidate {
            softness,
            gain,
            cost,
        }
    }

    /// Strain of the finger in turn.
    fn strain_ue(&self, level: &Level) -> f32 {
        level.finger_ue(self.finger)
    }

    fn keep(
        &mut self,
        best: Candidate,
        free: &[Level],
        table: &FingerTable,
    ) -> Result<(), SweepFault> {
        let full_scale_ue = full_scale_ue(table);
        let mut error = 0.0;
        for level in free {
            let expected = best.gain * strain_ue(table, best.softness * level.kpa);
            error = larger(
                error,
                (expected - self.strain_ue(level)).abs() / full_scale_ue,
            );
        }
        if error > MISSES {
            return Err(SweepFault::Shape);
        }
        if best.softness < *SOFTNESS.start() || best.gain < *GAIN.start() {
            // What bends so little is held up from the first step on.
            return Err(SweepFault::Contact);
        }
        if best.softness > *SOFTNESS.end() || best.gain > *GAIN.end() {
            return Err(SweepFault::OutOfRange);
        }
        self.found.error_percent = larger(self.found.error_percent, 100.0 * error);
        if let Some(gain) = self.found.gain.get_mut(self.finger) {
            *gain = best.gain;
        }
        if let Some(stiffness) = self.found.stiffness.get_mut(self.finger) {
            *stiffness = 1.0 / best.softness;
        }
        Ok(())
    }

    /// Where the fingers meet, in terms of the recipe's, and how far those bend that pass one another.
    fn finish(
        &self,
        levels: &[Level; LEVELS],
        table: &FingerTable,
    ) -> Result<Calibration, SweepFault> {
        let mut found = self.found;
        let Some(Knee { met_ue, free }) = self.knee else {
            return Ok(found);
        };
        let met_ue = self.mean_ue(met_ue, table);
        if table
            .meeting_kpa
            .is_some_and(|kpa| met_ue < MEETS * strain_ue(table, kpa))
        {
            return Err(SweepFault::Contact);
        }
        found.meeting = Some(table::pressure_for_strain(table, Microstrain(met_ue)).0);
        for level in levels.iter().skip(free) {
            let mean_ue = self.mean_ue(level.strain_ue, table);
            let share = mean_ue / larger(strain_ue(table, level.kpa), 1.0);
            if mean_ue > met_ue && share < found.passing_share {
                found.passing_share = share;
            }
        }
        Ok(found)
    }

    /// Mean of what the recipe's fingers would show where these show so much, µε.
    fn mean_ue(&self, strain_ue: [f32; FINGERS], table: &FingerTable) -> f32 {
        let castings = self.found.gain.into_iter().zip(self.found.stiffness);
        let each = strain_ue.into_iter().zip(castings);
        each.fold(0.0, |sum, (strain_ue, (gain, stiffness))| {
            sum + recipes_ue(table, strain_ue, gain, stiffness) / FINGERS as f32
        })
    }
}

/// Strain of the recipe's finger, µε, at the pressure at which this one would show `strain` if it were free.
fn recipes_ue(table: &FingerTable, strain: f32, gain: f32, stiffness: f32) -> f32 {
    let (pressure, _) = table::pressure_for_strain(table, Microstrain(strain / gain));
    strain_ue(table, stiffness * pressure.0)
}

impl Knee {
    /// Whether a finger has met another one at the last of these levels, on its way up.
    pub fn of(levels: &[Level], table: &FingerTable) -> Result<Option<Self>, SweepFault> {
        let mut rounded = false;
        for finger in 0..FINGERS {
            let (mut steepest, mut last, mut slope) = (0.0, 0.0, 0.0);
            for pair in levels.windows(2) {
                let [low, high] = pair else { continue };
                let expected = strain_ue(table, high.kpa) - strain_ue(table, low.kpa);
                last = slope;
                steepest = larger(steepest, last);
                slope = (high.finger_ue(finger) - low.finger_ue(finger)) / larger(expected, 1.0);
            }
            rounded |= last < ROUNDED * steepest;
            if slope < KNEE * last || slope < BENT * steepest {
                // The step before the last, too, if any finger has slowed down by then.
                let free = levels.len().saturating_sub(match rounded {
                    true => 2,
                    false => 1,
                });
                let met_ue = levels
                    .last()
                    .map_or([0.0; FINGERS], |level| level.strain_ue);
                return match free < FEWEST {
                    true => Err(SweepFault::Contact),
                    false => Ok(Some(Self { free, met_ue })),
                };
            }
            if slope <= 0.0 && levels.len() > 1 {
                return Err(SweepFault::Shape);
            }
        }
        Ok(None)
    }
}

fn full_scale_ue(table: &FingerTable) -> f32 {
    larger(1.0, strain_ue(table, table.max_pressure_kpa))
}

/// Free strain of the recipe's finger, µε; beyond the table it goes on as it ends.
// Here and below not inlined: a sweep has time, and the image little room.
#[inline(never)]
pub(super) fn strain_ue(table: &FingerTable, kpa: f32) -> f32 {
    let at = |kpa: f32| table::free_strain(table, Kilopascals(kpa)).0.0;
    let beyond_kpa = larger(0.0, kpa - table.max_pressure_kpa);
    if beyond_kpa <= 0.0 {
        return at(kpa);
    }
    let last_kpa = 0.95 * table.max_pressure_kpa;
    let slope = (at(kpa) - at(last_kpa)) / (table.max_pressure_kpa - last_kpa);
    at(kpa) + slope * beyond_kpa
}

fn squared(x: f32) -> f32 {
    x * x
}

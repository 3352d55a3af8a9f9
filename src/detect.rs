//! Contact → verdict: held, slipping, lost, or short of air.
//!
//! The signal is `x`, the residual summed over the fingers, over its value when the hold began. Arm
//! motion moves load from finger to finger but hardly changes the sum.
//!
//! A loss is quick, whatever came before it: a sphere that slides out raises `x` by up to 40 % until its
//! widest section has passed the tips, and then lets it collapse. So `x` is compared with where it was
//! just now, a reference that follows every rise but falls no faster than the hardest arm makes a held
//! object's residual fall. What `x` lacks of it beyond an allowance is summed up, tick by tick (CUSUM,
//! Page 1954): of all detectors with the same rate of false alarms it has the least delay, and it needs no
//! window to be chosen. Two more ways of being lost feed the same sum: a slow collapse, against the
//! plateau; and an object that leaves sideways, which empties one finger while it presses on the others.
//! A gauge that fades looks like an emptying finger, but the other fingers do not feel it.

mod shares;
mod slip;

use shares::Shares;
use slip::Slip;

use crate::FINGERS;
use crate::command::Motion;
use crate::estimate::Contact;
use crate::math::{lag_gain, larger, root, smaller};
use crate::regulate::Air;
use crate::settings::Active;
use crate::units::{Instant, Microstrain};

/// What the detector makes of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// Nothing is held, so nothing can be lost.
    Unarmed,
    /// The object is where it was.
    Holding,
    /// The residual drifts at constant pressure.
    Slipping {
        /// Change of the normalised residual, 1/s.
        rate: f32,
    },
    /// The object is gone.
    Lost {
        /// When the collapse began.
        onset: Instant,
        /// How it showed.
        cause: LossCause,
        /// How far each finger's residual has fallen, as a share of its plateau; none without a usable
        /// gauge.
        evidence: [Option<f32>; FINGERS],
    },
    /// The pressure is going, and the grip with it.
    AirLoss,
}

/// How a loss showed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LossCause {
    /// The sum over the fingers collapsed.
    Collapse,
    /// One finger emptied while the others felt it go.
    OneSided,
    /// Nothing was there any more when the pressure had been changed.
    Missing,
}

/// How what is held is to be watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watch {
    /// What the arm does.
    pub motion: Motion,
    /// Fingers that touched when the hold was recognised.
    pub carrying: [bool; FINGERS],
    /// The pressure is on its way to another set-point, so a residual that drifts is no slip, and air that
    /// lags behind is no air loss.
    pub pressure_changes: bool,
}

/// A latched loss.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loss {
    /// When the collapse began, as estimated.
    pub onset: Instant,
    /// When it was reported.
    pub flagged: Instant,
    /// How it showed.
    pub cause: LossCause,
    /// How far each finger's residual had fallen when it was reported, as a share of its plateau; none
    /// without a usable gauge.
    pub evidence: [Option<f32>; FINGERS],
}

impl Loss {
    /// From the onset to the report, µs.
    pub fn latency_us(&self) -> u64 {
        self.flagged.micros_since(self.onset)
    }
}

/// Averaging of each residual into the plateau that a hold starts from: short against `settle_ms`,
/// long against noise.
const PLATEAU_MS: f32 = 40.0;
/// The plateau follows creep (minutes), but no slip: a sphere that slides by 1 mm in a second is 1 % off.
const REFERENCE_MS: f32 = 5_000.0;
/// The plateau only follows while `x` is this close to one.
const CALM: f32 = 0.03;
/// A hold's plateau follows a rise for this long: four times the fingers' lag of 0.1 s.
const SETTLING_US: u64 = 400_000;
/// A grip that still tightens changes by more before it is a slip.
const SETTLING_SLIP: f32 = 2.0;
/// Averaging of `x` into the level from which a fall counts, and which tells a slip: a third of a collapse.
const LEVEL_MS: f32 = 8.0;
/// A rise of every finger that has got this far ends in a loss: the widest section of a sphere passes the
/// tips at 1.2 to 1.48. Slips that an arm's turn caught again raised the sum to 1.2 and the least of the
/// fingers to 1.06; the way back from there is no loss.
const PASSED: f32 = 1.2;
/// Fall of one finger that counts for nothing. Pushes that an object withstands take up to half of it.
const FINGER_ALLOWANCE: f32 = 0.55;
/// A finger that leaves the object has less than this left; knocks at 60 m/s² leave it more.
const EMPTYING: f32 = 0.5;
/// Fall of the sum that belongs to an object that leaves sideways. Knocks at 60 m/s² that empty a finger by
/// half take 5 %.
const SIDEWAYS: f32 = 0.07;
/// The least of three noisy numbers lies 0.85 standard deviations below them (order statistics of the normal
/// distribution), and looking ahead doubles that.
const FINGER_SIGMAS: f32 = 2.0;
/// Averaging of what a finger has carried lately. An object that has been turned in the grip and is held
/// again is a new start for each finger.
const LATELY_MS: f32 = 1_000.0;
/// An object that turns in the grip lets the other fingers pass through their plateau on the way.
const FELT_TICKS: u16 = 50;
/// A gauge that was away for longer than a spike comes back as a new start of its finger: it may have been
/// repaired, and the object may have been turned meanwhile.
const AWAY_TICKS: u8 = 3;
/// The pressure must be missing this long to be an air loss: ripple is shorter, and 50 ms are allowed.
const AIR_TICKS: u16 = 20;
/// `ln` of the mean ticks between false alarms on pure noise: 10¹² ticks are 32 years at 1 kHz.
const LN_RUN_LENGTH: f32 = 27.6;
const TICKS_PER_S: f32 = 1e6 / crate::TICK_US as f32;

/// What an arm's motion does to an object that is held.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Fastest fall of the reference per second.
    held_fall_per_s: f32,
    /// Fall below the plateau that counts for nothing, however slow.
    slow_allowance: f32,
    /// Quick fall that counts for nothing, beyond that of the settings.
    quick_allowance: f32,
    /// Share of the settings' limit that makes a slip.
    slip: f32,
}

impl Limits {
    const fn of(motion: Motion, fingers: usize) -> Self {
        match (motion, fingers) {
            // Held objects on the simulated arm fall by 3.2/s for 30 ms, and by 10 % in all, in an emergency
            // stop at 20 m/s², by 16 % if the arm rings after it; and by 4.5/s for 10 ms after a knock of
            // 100 m/s². Lost ones fall by 16 to 25/s.
            (Motion::Moving, FINGERS..) => Self {
                held_fall_per_s: 5.0,
                slow_allowance: 0.18,
                quick_allowance: 0.0,
                slip: 1.0,
            },
            // Knocks alone.
            (Motion::Still, FINGERS..) => Self {
                held_fall_per_s: 2.5,
                slow_allowance: 0.1,
                quick_allowance: 0.0,
                slip: 0.5,
            },
            // What the arm does to two fingers from the side, the third does not balance.
            _ => Self {
                held_fall_per_s: 10.0,
                slow_allowance: 0.35,
                quick_allowance: 0.15,
                slip: 4.0,
            },
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Hold {
    since: Instant,
    /// Residual of each finger when the hold began.
    plateau: [f32; FINGERS],
    /// Residual of each finger lately.
    lately: [f32; FINGERS],
    /// Strain of a free finger at that plateau.
    free: Microstrain,
    /// `x`, smoothed.
    level: f32,
    rate: f32,
    /// Where that was just now, but not above one.
    recent: f32,
    /// Share of the emptiest finger, smoothed.
    least: f32,
    /// Every finger has risen so far that there is no way back.
    passed: bool,
    /// Share that the emptiest finger has left of what it had lately, smoothed.
    emptiest: f32,
    /// How much longer the other fingers are taken to feel what the emptiest does.
    felt_ticks: u16,
    evidence: f32,
    onset: Instant,
    slip: Slip,
    /// The pressure has changed since the plateau was taken.
    outdated: bool,
}

/// The detector's memory.
#[derive(Debug, Clone, Copy)]
pub struct Detector {
    plateau: [f32; FINGERS],
    /// Strain of a free finger, averaged like the plateau.
    free: f32,
    /// Ticks since each gauge was usable.
    away: [u8; FINGERS],
    hold: Option<Hold>,
    air_ticks: u16,
    plateau_gain: f32,
    reference_gain: f32,
    lately_gain: f32,
    level_gain: f32,
    /// Variance of the level's noise over that of `x`.
    level_variance: f32,
}

impl Detector {
    /// Nothing held.
    pub fn new() -> Self {
        let level_gain = lag_gain(LEVEL_MS);
        Self {
            plateau: [0.0; FINGERS],
            free: 0.0,
            away: [0; FINGERS],
            hold: None,
            air_ticks: 0,
            plateau_gain: lag_gain(PLATEAU_MS),
            reference_gain: lag_gain(REFERENCE_MS),
            lately_gain: lag_gain(LATELY_MS),
            level_gain,
            level_variance: level_gain / (2.0 - level_gain),
        }
    }

    /// The normalised residual, smoothed; none while nothing is held.
    pub fn level(&self) -> Option<f32> {
        self.hold.as_ref().map(|hold| hold.level)
    }

    /// Judges one tick. `watch` is given while the supervisor believes that something is held; the first such
    /// tick, and the end of a change of the pressure, make the present plateau the reference.
    pub fn step(
        &mut self,
        now: Instant,
        contact: &Contact,
        noise_variance: &[f32; FINGERS],
        air: Air,
        watch: Option<Watch>,
        active: &Active,
    ) -> Verdict {
        for (i, residual) in contact.residual.iter().enumerate() {
            let Some(residual) = residual else {
                self.away[i] = self.away[i].saturating_add(1);
                continue;
            };
            let plateau = &mut self.plateau[i];
            *plateau += self.plateau_gain * (residual.0 - *plateau);
            if self.away[i] == 0 {
                continue;
            }
            if core::mem::take(&mut self.away[i]) >= AWAY_TICKS {
                *plateau = residual.0;
                if let Some(hold) = &mut self.hold {
                    hold.plateau[i] = residual.0;
                    hold.lately[i] = residual.0;
                }
            }
        }
        self.free += self.plateau_gain * (contact.free.0 - self.free);
        let Some(Watch {
            motion,
            carrying,
            pressure_changes,
        }) = watch
        else {
            self.hold = None;
            self.air_ticks = 0;
            return Verdict::Unarmed;
        };
        if pressure_changes {
            self.air_ticks = 0;
        } else if self.air_is_going(air, active) {
            return Verdict::AirLoss;
        }
        // A fall that has begun is judged against the plateau that it began from.
        if let Some(hold) = &self.hold
            && hold.outdated
            && !pressure_changes
            && hold.evidence == 0.0
        {
            self.hold = None;
        }
        if self.hold.is_none() {
            self.hold = Some(self.begin(now, carrying));
        }
        let Some(hold) = &mut self.hold else {
            return Verdict::Unarmed;
        };
        hold.outdated |= pressure_changes;
        let settling = now.micros_since(hold.since) < SETTLING_US;
        if settling {
            // While the fingers follow the last of the pressure, the grip still tightens.
            hold.free.0 = larger(hold.free.0, contact.free.0);
            let plateaus = hold.plateau.iter_mut().zip(self.plateau);
            for ((held, plateau), carries) in plateaus.zip(carrying) {
                if carries {
                    *held = larger(*held, plateau);
                }
            }
        }
        let (Some(shares), Some(lately)) = (
            Shares::of(&hold.plateau, contact, noise_variance),
            Shares::of(&hold.lately, contact, noise_variance),
        ) else {
            return Verdict::Holding;
        };
        let limits = Limits::of(motion, shares.fingers);
        for (lately, residual) in hold.lately.iter_mut().zip(contact.residual) {
            if let Some(residual) = residual {
                *lately += self.lately_gain * (residual.0 - *lately);
            }
        }

        let before = hold.level;
        hold.level += self.level_gain * (shares.sum - hold.level);
        hold.rate += self.level_gain * ((hold.level - before) * TICKS_PER_S - hold.rate);
        hold.least += self.level_gain * (shares.emptiest - hold.least);
        // Neither a higher pressure nor an object that is still being put in is a way past the tips.
        hold.passed =
            !hold.outdated && !settling && (hold.least > PASSED || hold.passed && hold.level > 1.0);
        let reached = match hold.passed {
            true => hold.level,
            false => smaller(hold.level, 1.0),
        };
        let recent = hold.recent - limits.held_fall_per_s / TICKS_PER_S;
        hold.recent = larger(reached, recent);
        hold.emptiest += self.level_gain * (lately.emptiest - hold.emptiest);

        // At a lower pressure a free finger would bend less by so much, so one that is held by an object
        // loses less than that. What it may lose is no evidence.
        let sag = larger(hold.free.0 - contact.free.0, 0.0) * shares.per_ue;
        let slow = 1.0 - shares.others - limits.slow_allowance;
        let quick = hold.recent - shares.sum - active.loss_allowance - limits.quick_allowance;
        // Where the emptiest finger will be one averaging time from now: a push against the grip makes it
        // empty too, but comes to rest.
        let ahead = 2.0 * lately.emptiest - hold.emptiest;
        let mut one_sided = smaller(1.0 - ahead - FINGER_ALLOWANCE, EMPTYING - lately.emptiest);
        if one_sided > 0.0 {
            one_sided -= FINGER_SIGMAS * root(lately.emptiest_variance);
        }
        // What the other fingers do not feel is a gauge that fades.
        hold.felt_ticks = match (lately.others - 1.0).abs() > CALM {
            true => FELT_TICKS,
            false => hold.felt_ticks.saturating_sub(1),
        };
        let felt = hold.felt_ticks > 0;
        // A knock from the side presses on the others almost as much as it takes away.
        let sideways = felt && shares.sum < 1.0 - SIDEWAYS;
        let collapse = larger(quick, slow);
        let (fall, cause) = if sideways && one_sided > collapse {
            (one_sided, LossCause::OneSided)
        } else if felt {
            (collapse, LossCause::Collapse)
        } else {
            (slow, LossCause::Collapse)
        };
        if hold.evidence == 0.0 {
            hold.onset = now;
        }
        // Mean run length of a CUSUM on white noise of variance σ²: exp(2 k h / σ²) (Siegmund 1985).
        let noise_limit = LN_RUN_LENGTH * shares.variance / (2.0 * active.loss_allowance);
        let limit = larger(active.loss_evidence, noise_limit);
        // No single tick, nor two, can be a loss: a finger does not empty so fast, a cable's glitch does.
        let step = smaller(fall - sag, 0.5 * limit);
        hold.evidence = larger(hold.evidence + step, 0.0);
        if hold.evidence > limit {
            return Verdict::Lost {
                onset: hold.onset,
                cause,
                evidence: core::array::from_fn(|i| {
                    let held = hold.plateau[i].max(1.0);
                    contact.residual[i].map(|residual| 1.0 - residual.0 / held)
                }),
            };
        }

        if hold.outdated {
            return Verdict::Holding;
        }
        // White noise of variance σ² through a first-order lag of gain g: σ² g / (2 − g).
        let level_variance = shares.variance * self.level_variance;
        let slip = limits.slip * active.slip;
        let slip = if settling { SETTLING_SLIP * slip } else { slip };
        if hold.slip.step(hold.level, level_variance, slip, sag) {
            return Verdict::Slipping { rate: hold.rate };
        }
        if (hold.level - 1.0).abs() < CALM && hold.evidence == 0.0 {
            for (held, plateau) in hold.plateau.iter_mut().zip(self.plateau) {
                *held += self.reference_gain * (plateau - *held);
            }
            hold.free.0 += self.reference_gain * (contact.free.0 - hold.free.0);
        }
        Verdict::Holding
    }

    /// A hold by these fingers. One that did not touch is no part of it, even if what it felt before still
    /// fades.
    #[inline(never)]
    fn begin(&self, now: Instant, carrying: [bool; FINGERS]) -> Hold {
        let mut plateau = self.plateau;
        for (plateau, carries) in plateau.iter_mut().zip(carrying) {
            if !carries {
                *plateau = 0.0;
            }
        }
        Hold {
            since: now,
            plateau,
            lately: plateau,
            free: Microstrain(self.free),
            level: 1.0,
            rate: 0.0,
            recent: 1.0,
            least: 1.0,
            passed: false,
            emptiest: 1.0,
            felt_ticks: 0,
            evidence: 0.0,
            onset: now,
            slip: Slip::NONE,
            outdated: false,
        }
    }

    fn air_is_going(&mut self, air: Air, active: &Active) -> bool {
        // Without a measurement the count stands still: neither good news nor bad.
        if let Some(measured) = air.measured {
            self.air_ticks = if measured.0 < air.expected.0 - active.air_loss_kpa {
                self.air_ticks.saturating_add(1)
            } else {
                0
            };
        }
        self.air_ticks >= AIR_TICKS
    }
}

impl Default for Detector {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frontend::FrontEnd;
    use crate::settings::Settings;
    use crate::table::{self, FINGER, Range};
    use crate::units::{Degrees, Kilopascals};
    use std::vec::Vec;

    const PLATEAU: f32 = 4_000.0;

    struct Bench {
        detector: Detector,
        active: Active,
        free: Microstrain,
        motion: Motion,
        tick: u64,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                detector: Detector::new(),
                active: Settings::default()
                    .validate(&FrontEnd::REFERENCE, &FINGER)
                    .expect("good settings"),
                free: table::free_strain(&FINGER, Kilopascals(140.0)).0,
                motion: Motion::Moving,
                tick: 0,
            }
        }

        /// One tick with each finger at this share of the plateau.
        fn step(&mut self, shares: [Option<f32>; 3], air: Air, holding: bool) -> Verdict {
            self.tick += 1;
            let contact = Contact {
                residual: shares.map(|share| share.map(|share| Microstrain(share * PLATEAU))),
                touching: [true; 3],
                free: self.free,
                bend: Degrees(0.0),
                range: Range::Inside,
                known: true,
            };
            let now = Instant::from_micros(1_000 * self.tick);
            let noise = [400.0; 3];
            let watch = holding.then_some(Watch {
                motion: self.motion,
                carrying: [true; 3],
                pressure_changes: false,
            });
            self.detector
                .step(now, &contact, &noise, air, watch, &self.active)
        }

        fn hold(&mut self) {
            for _ in 0..500 {
                self.step([Some(1.0); 3], STEADY, false);
            }
            for _ in 0..500 {
                assert_eq!(self.step([Some(1.0); 3], STEADY, true), Verdict::Holding);
            }
        }
    }

    const STEADY: Air = Air {
        measured: Some(Kilopascals(140.0)),
        expected: Kilopascals(140.0),
    };

    /// From 90 % to 10 % in 35 ms, the middle of what a falling object does.
    fn collapse(ms: u64) -> f32 {
        (0.9 - 0.8 * ms as f32 / 35.0).max(0.14)
    }

    #[test]
    fn a_collapse_is_lost_within_5_ms_and_its_onset_is_known() {
        let mut bench = Bench::new();
        bench.hold();
        let start = bench.tick;
        let (ms, onset) = (0..40)
            .find_map(
                |ms| match bench.step([Some(collapse(ms)); 3], STEADY, true) {
                    Verdict::Lost { onset, .. } => Some((ms, onset)),
                    _ => None,
                },
            )
            .expect("a collapse is a loss");
        assert!(ms <= 5, "{ms} ms");
        assert!(onset.micros().abs_diff(1_000 * start) <= 3_000);
    }

    #[test]
    fn a_missing_gauge_changes_nothing() {
        let mut bench = Bench::new();
        bench.hold();
        let lost = (0..40).any(|ms| {
            let share = Some(collapse(ms));
            matches!(
                bench.step([share, None, share], STEADY, true),
                Verdict::Lost { .. }
            )
        });
        assert!(lost);
    }

    #[test]
    fn load_that_moves_from_finger_to_finger_is_not_a_loss() {
        let mut bench = Bench::new();
        bench.hold();
        for tick in 0..2_000 {
            let swing = 0.3 * libm::sinf(tick as f32 * 0.05);
            let shares = [Some(1.0 + swing), Some(1.0 - swing), Some(1.0)];
            assert_eq!(bench.step(shares, STEADY, true), Verdict::Holding);
        }
    }

    #[test]
    fn an_object_that_leaves_sideways_is_lost_before_the_last_finger_knows() {
        let mut bench = Bench::new();
        bench.hold();
        let lost = (0..200).find(|&ms| {
            let gone = Some((1.0 - ms as f32 / 150.0).max(0.3));
            let pressed = Some((1.0 + ms as f32 / 1_000.0).min(1.1));
            matches!(
                bench.step([gone, pressed, pressed], STEADY, true),
                Verdict::Lost { .. }
            )
        });
        assert!(lost.is_some_and(|ms| ms < 100), "{lost:?}");
    }

    #[test]
    fn one_gauge_that_fades_while_the_others_stay_is_not_a_loss() {
        let mut bench = Bench::new();
        bench.hold();
        for ms in 0..1_000 {
            let fading = Some((1.0 - ms as f32 / 3_000.0).max(0.7));
            let verdict = bench.step([fading, Some(1.0), Some(1.0)], STEADY, true);
            assert!(!matches!(verdict, Verdict::Lost { .. }), "{ms} ms");
        }
    }

    #[test]
    fn a_glitch_of_all_gauges_that_is_over_in_two_ticks_is_forgotten() {
        let mut bench = Bench::new();
        bench.hold();
        for tick in 0..1_000 {
            let share = if tick % 100 < 2 { 0.2 } else { 1.0 };
            assert_eq!(bench.step([Some(share); 3], STEADY, true), Verdict::Holding);
        }
    }

    #[test]
    fn a_knock_and_an_emergency_stop_are_no_loss() {
        let mut bench = Bench::new();
        bench.hold();
        // What the simulated arm does to a held sphere: 100 m/s² for 5 ms, and a stop at 20 m/s².
        for (ms, depth, back_ms) in [(12, 0.05, 30), (32, 0.10, 200)] {
            for tick in 0..ms + back_ms {
                let dip = if tick < ms {
                    depth * tick as f32 / ms as f32
                } else {
                    depth * (ms + back_ms - tick) as f32 / back_ms as f32
                };
                let verdict = bench.step([Some(1.0 - dip); 3], STEADY, true);
                assert_eq!(verdict, Verdict::Holding, "{depth} at {tick} ms");
            }
        }
    }

    #[test]
    fn a_slip_that_is_caught_again_is_no_loss_on_its_way_back() {
        let mut bench = Bench::new();
        bench.hold();
        for ms in 0..400 {
            // Up to 20 % in 60 ms, and back in 40.
            let rise = match ms {
                0..60 => 0.2 * ms as f32 / 60.0,
                60..100 => 0.2 * (100 - ms) as f32 / 40.0,
                _ => 0.0,
            };
            let verdict = bench.step([Some(1.0 + rise); 3], STEADY, true);
            assert!(!matches!(verdict, Verdict::Lost { .. }), "{ms} ms");
        }
    }

    #[test]
    fn a_sphere_that_has_passed_the_tips_is_lost_before_its_residual_is_back_at_the_plateau() {
        let mut bench = Bench::new();
        bench.hold();
        let lost = (0..200).find_map(|ms| {
            let share = match ms {
                0..80 => 1.0 + 0.4 * ms as f32 / 80.0,
                _ => 1.4 - (ms - 80) as f32 / 40.0,
            };
            match bench.step([Some(share); 3], STEADY, true) {
                Verdict::Lost { .. } => Some(share),
                _ => None,
            }
        });
        assert!(lost.is_some_and(|share| share > 1.0), "{lost:?}");
    }

    #[test]
    fn a_slip_ends_when_the_object_is_held_again_and_the_next_one_counts_from_there() {
        let mut bench = Bench::new();
        bench.hold();
        let mut starts = Vec::new();
        let mut slipping = false;
        for ms in 0..2_000 {
            let steps = [(100, 0.10), (1_200, 0.12)]
                .map(|(start, rise)| rise * ((ms as f32 - start as f32) / 50.0).clamp(0.0, 1.0));
            let share = Some(1.0 + steps[0] + steps[1]);
            let verdict = bench.step([share; 3], STEADY, true);
            let slips = matches!(verdict, Verdict::Slipping { .. });
            if slips && !slipping {
                starts.push(ms);
            }
            slipping = slips;
        }
        assert!(!slipping);
        assert!(matches!(starts[..], [100..160, 1_200..1_260]), "{starts:?}");
    }

    #[test]
    fn a_rise_at_constant_pressure_is_a_slip() {
        let mut bench = Bench::new();
        bench.hold();
        let slip = (0..150).find_map(|ms| {
            let share = Some(1.0 + 0.2 * ms as f32 / 150.0);
            match bench.step([share; 3], STEADY, true) {
                Verdict::Slipping { rate } => Some(rate),
                _ => None,
            }
        });
        assert!(
            slip.is_some_and(|rate| (0.8..1.8).contains(&rate)),
            "{slip:?}"
        );
    }

    #[test]
    fn at_rest_a_slip_and_a_slow_loss_are_told_sooner_and_a_knock_is_still_none() {
        // A slide of 15 % in 150 ms, and a fall of 20 % in 200 ms.
        let first = |motion, change: fn(f32) -> f32| {
            let mut bench = Bench::new();
            bench.motion = motion;
            bench.hold();
            (0..400).find(|&ms| {
                let share = Some(1.0 + change(ms as f32));
                bench.step([share; 3], STEADY, true) != Verdict::Holding
            })
        };
        for change in [
            |ms: f32| 0.15 * (ms / 150.0).min(1.0),
            |ms: f32| -0.2 * (ms / 200.0).min(1.0),
        ] {
            let moving = first(Motion::Moving, change).expect("a slip or a loss");
            let still = first(Motion::Still, change).expect("a slip or a loss");
            assert!(still + 20 <= moving, "{still} ms, {moving} ms");
        }
        let knock = |ms: f32| match ms {
            0.0..12.0 => -0.05 * ms / 12.0,
            12.0..42.0 => -0.05 * (42.0 - ms) / 30.0,
            _ => 0.0,
        };
        assert_eq!(first(Motion::Still, knock), None);
    }

    #[test]
    fn creep_over_minutes_is_followed_in_silence() {
        let mut bench = Bench::new();
        bench.hold();
        for tick in 0..300_000 {
            let share = Some(1.0 - 0.3 * tick as f32 / 300_000.0);
            assert_eq!(bench.step([share; 3], STEADY, true), Verdict::Holding);
        }
    }

    #[test]
    fn falling_pressure_is_an_air_loss_and_never_a_lost_object() {
        for time_constant in [20.0, 100.0, 400.0] {
            let mut bench = Bench::new();
            bench.hold();
            let (mut inflated, mut lagged) = (140.0, 140.0);
            let mut found = None;
            for ms in 0..2_000 {
                let pressure = 140.0 * libm::expf(-(ms as f32) / time_constant);
                inflated += (pressure - inflated) / 80.0;
                lagged += (inflated - lagged) / 26.0;
                // The grip ends at 95 kPa.
                let share = ((lagged - 95.0) / 45.0f32).max(0.0);
                bench.free = table::free_strain(&FINGER, Kilopascals(lagged)).0;
                let air = Air {
                    measured: Some(Kilopascals(pressure)),
                    expected: Kilopascals(140.0),
                };
                match bench.step([Some(share); 3], air, true) {
                    Verdict::Lost { .. } => panic!("lost after {ms} ms at {time_constant}"),
                    Verdict::AirLoss => {
                        found = Some((ms, pressure));
                        break;
                    }
                    _ => {}
                }
            }
            let (ms, _) = found.expect("an air loss");
            // 6 % of the pressure must be gone first.
            assert!((ms as f32) < 50.0 + 0.06 * time_constant, "{ms} ms");
        }
    }
}

//! Contact → verdict: held, slipping, lost, or short of air.
//!
//! The signal is `x`, the residual summed over the fingers, over its value when the hold began. Arm
//! motion moves load from finger to finger but hardly changes the sum. Loss is a cumulative sum
//! (CUSUM, Page 1954) of how far `x` has fallen beyond an allowance: a fast collapse is reported in
//! milliseconds, a short dip is forgotten again. An object that leaves sideways empties one finger
//! while it presses on the others; that finger's own fall counts too, if the others confirm it.

use crate::FINGERS;
use crate::estimate::Contact;
use crate::settings::{Active, lag_gain};
use crate::units::{Instant, Kilopascals, Microstrain};

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

/// What the regulator knows that bears on the verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Measured pressure, where there is a measurement.
    pub measured: Option<Kilopascals>,
    /// What the commands so far should have given.
    pub expected: Kilopascals,
    /// Pressure that the finger's shape has followed so far.
    pub lagged: Kilopascals,
}

/// Averaging of each residual into the plateau that a hold starts from: short against `settle_ms`,
/// long against noise.
const PLATEAU_MS: f32 = 40.0;
/// The reference follows creep (minutes) and settling (0.3 s), but no slip (50–150 ms to a loss).
const REFERENCE_MS: f32 = 1_000.0;
/// The reference only follows while `x` is this close to one; held objects stay within 2 % at 5 m/s².
const CALM: f32 = 0.03;
/// Fall of one finger that counts for nothing. Held objects take 2 % of a finger's residual at 5 m/s²;
/// the rest is for heavier arms and for objects that turn in the grip.
const FINGER_ALLOWANCE: f32 = 0.45;
/// Averaging of `x` for the slip warning.
const LEVEL_MS: f32 = 20.0;
/// A slip must last this long, longer than the knock of an arm's start.
const SLIP_TICKS: u16 = 30;
/// A slip has ended when `x` is back to this share of its threshold.
const SLIP_END: f32 = 0.5;
/// Residual lost per kilopascal that the finger's pressure has sagged. The contact force of a grip at
/// 140 kPa ends near 95 kPa; a steeper value than 1/45 errs towards calling it air.
const SAG_PER_KPA: f32 = 0.03;
/// A hold's reference follows a rise for this long: four times the fingers' lag of 0.1 s.
const SETTLING_US: u64 = 400_000;
/// The pressure must be missing this long to be an air loss: ripple is shorter, and 50 ms are allowed.
const AIR_TICKS: u16 = 20;
/// `ln` of the mean ticks between false alarms on pure noise: 10¹² ticks are 32 years at 1 kHz.
const LN_RUN_LENGTH: f32 = 27.6;

#[derive(Debug, Clone, Copy)]
struct Hold {
    since: Instant,
    reference: [f32; FINGERS],
    pressure: Kilopascals,
    evidence: f32,
    onset: Instant,
    level: f32,
    rate: f32,
    slip_ticks: u16,
    slipping: bool,
}

/// The detector's memory.
#[derive(Debug, Clone, Copy)]
pub struct Detector {
    plateau: [f32; FINGERS],
    hold: Option<Hold>,
    air_ticks: u16,
    plateau_gain: f32,
    reference_gain: f32,
    level_gain: f32,
}

impl Detector {
    /// Nothing held.
    pub fn new() -> Self {
        Self {
            plateau: [0.0; FINGERS],
            hold: None,
            air_ticks: 0,
            plateau_gain: lag_gain(PLATEAU_MS),
            reference_gain: lag_gain(REFERENCE_MS),
            level_gain: lag_gain(LEVEL_MS),
        }
    }

    /// The normalised residual, smoothed; none while nothing is held.
    pub fn level(&self) -> Option<f32> {
        self.hold.as_ref().map(|hold| hold.level)
    }

    /// Judges one tick. `holding` says whether the supervisor believes that something is held;
    /// the first such tick makes the present plateau the reference.
    pub fn step(
        &mut self,
        now: Instant,
        contact: &Contact,
        noise_variance: &[f32; FINGERS],
        air: Air,
        holding: bool,
        active: &Active,
    ) -> Verdict {
        for (plateau, residual) in self.plateau.iter_mut().zip(contact.residual) {
            if let Some(residual) = residual {
                *plateau += self.plateau_gain * (residual.0 - *plateau);
            }
        }
        if !holding {
            self.hold = None;
            self.air_ticks = 0;
            return Verdict::Unarmed;
        }
        if self.air_is_going(air, active) {
            return Verdict::AirLoss;
        }
        let hold = self.hold.get_or_insert(Hold {
            since: now,
            reference: self.plateau,
            pressure: air.lagged,
            evidence: 0.0,
            onset: now,
            level: 1.0,
            rate: 0.0,
            slip_ticks: 0,
            slipping: false,
        });

        if now.micros_since(hold.since) < SETTLING_US {
            // While the fingers follow the last of the pressure, the grip still tightens.
            hold.pressure = air.lagged;
            for (reference, plateau) in hold.reference.iter_mut().zip(self.plateau) {
                *reference = reference.max(plateau);
            }
        }
        let (mut sum, mut reference, mut variance) = (0.0, 0.0, 0.0);
        let mut emptiest = (f32::MAX, 0.0, 0.0);
        for ((residual, held), noise) in contact
            .residual
            .iter()
            .zip(hold.reference)
            .zip(noise_variance)
        {
            let Some(Microstrain(residual)) = *residual else {
                continue;
            };
            sum += residual;
            reference += held;
            variance += noise;
            let share = residual / held.max(1.0);
            if share < emptiest.0 {
                emptiest = (share, residual, held);
            }
        }
        if reference <= 0.0 {
            // No usable gauge carries any of the grip; the supervisor knows how many gauges are left.
            return Verdict::Holding;
        }
        let x = sum / reference;
        let before = hold.level;
        hold.level += self.level_gain * (x - hold.level);
        hold.rate += self.level_gain * ((hold.level - before) * TICKS_PER_S - hold.rate);

        let sag = (hold.pressure.0 - air.lagged.0).max(0.0) * SAG_PER_KPA;
        let fall = 1.0 - x - active.loss_allowance - sag;
        let (share, finger, finger_reference) = emptiest;
        let others = (sum - finger) / (reference - finger_reference).max(1.0);
        let one_sided = 1.0 - share - FINGER_ALLOWANCE - sag;
        let (fall, cause) = if (others - 1.0).abs() > CALM && one_sided > fall {
            (one_sided, LossCause::OneSided)
        } else {
            (fall, LossCause::Collapse)
        };
        if hold.evidence == 0.0 {
            hold.onset = now;
        }
        hold.evidence = (hold.evidence + fall).max(0.0);
        // Mean run length of a CUSUM on white noise of variance σ²: exp(2 k h / σ²) (Siegmund 1985).
        let noise_limit =
            LN_RUN_LENGTH * variance / (2.0 * active.loss_allowance * reference * reference);
        if hold.evidence > active.loss_evidence.max(noise_limit) {
            return Verdict::Lost {
                onset: hold.onset,
                cause,
                evidence: core::array::from_fn(|i| {
                    contact.residual[i]
                        .map(|residual| 1.0 - residual.0 / hold.reference[i].max(1.0))
                }),
            };
        }

        let off = (hold.level - 1.0).abs();
        let limit = active.slip + sag;
        hold.slip_ticks = if off > limit {
            hold.slip_ticks.saturating_add(1)
        } else {
            0
        };
        if hold.slip_ticks >= SLIP_TICKS {
            hold.slipping = true;
        } else if off < SLIP_END * limit {
            hold.slipping = false;
        }
        if hold.slipping {
            return Verdict::Slipping { rate: hold.rate };
        }
        if off < CALM && hold.evidence == 0.0 {
            for (reference, plateau) in hold.reference.iter_mut().zip(self.plateau) {
                *reference += self.reference_gain * (plateau - *reference);
            }
            hold.pressure.0 += self.reference_gain * (air.lagged.0 - hold.pressure.0);
        }
        Verdict::Holding
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

const TICKS_PER_S: f32 = 1e6 / crate::TICK_US as f32;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frontend::FrontEnd;
    use crate::settings::Settings;
    use crate::table::{FINGER, Range};
    use crate::units::Degrees;

    const PLATEAU: f32 = 4_000.0;

    struct Bench {
        detector: Detector,
        active: Active,
        tick: u64,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                detector: Detector::new(),
                active: Settings::default()
                    .validate(&FrontEnd::REFERENCE, &FINGER)
                    .expect("good settings"),
                tick: 0,
            }
        }

        /// One tick with each finger at this share of the plateau.
        fn step(&mut self, shares: [Option<f32>; 3], air: Air, holding: bool) -> Verdict {
            self.tick += 1;
            let contact = Contact {
                residual: shares.map(|share| share.map(|share| Microstrain(share * PLATEAU))),
                touching: [true; 3],
                bend: Degrees(0.0),
                range: Range::Inside,
            };
            let now = Instant::from_micros(1_000 * self.tick);
            let noise = [400.0; 3];
            self.detector
                .step(now, &contact, &noise, air, holding, &self.active)
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
        lagged: Kilopascals(140.0),
    };

    /// From 90 % to 10 % in 35 ms, the middle of what a falling object does.
    fn collapse(ms: u64) -> f32 {
        (0.9 - 0.8 * ms as f32 / 35.0).max(0.14)
    }

    #[test]
    fn a_collapse_is_lost_within_12_ms_and_its_onset_is_known() {
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
        assert!(ms <= 12, "{ms} ms");
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
    fn a_short_dip_is_forgotten() {
        let mut bench = Bench::new();
        bench.hold();
        for tick in 0..1_000 {
            let share = if tick % 100 < 10 { 0.84 } else { 1.0 };
            assert_eq!(bench.step([Some(share); 3], STEADY, true), Verdict::Holding);
        }
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
                let air = Air {
                    measured: Some(Kilopascals(pressure)),
                    expected: Kilopascals(140.0),
                    lagged: Kilopascals(lagged),
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

//! Five published rules for detecting a loss, as baselines for the controller.
//!
//! They get every advantage: the controller's own residual, summed over the usable fingers and normalised by
//! its mean over the last 40 ms before the hold. They are armed only while the controller holds, and only the
//! first alarm of each hold counts.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use softgrip::FINGERS;
use softgrip::units::Microstrain;

/// A rule. Each gives a score; the object counts as lost when the score exceeds the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baseline {
    /// Fall of the residual sum below its plateau, as a fraction of it.
    Threshold,
    /// The fall within 10 ms.
    Derivative,
    /// The least of the last five falls from tick to tick.
    MinOfFive,
    /// The least of five falls below the plateau, 100 ms apart.
    FiveHits,
    /// Sum of squares about the mean in a window of 64 ms.
    WindowEnergy,
}

/// Number of variants of [`Baseline`].
pub const RULES: usize = 5;

impl Baseline {
    /// Every rule, in the order of the score arrays.
    pub const ALL: [Self; RULES] = [
        Self::Threshold,
        Self::Derivative,
        Self::MinOfFive,
        Self::FiveHits,
        Self::WindowEnergy,
    ];

    /// Name for tables and charts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Threshold => "fixed threshold",
            Self::Derivative => "derivative over 10 ms",
            Self::MinOfFive => "least of five differences",
            Self::FiveHits => "five hits at 100 ms",
            Self::WindowEnergy => "energy in 64 ms",
        }
    }

    /// The threshold that is published, where there is one for a normalised signal.
    pub fn published(self) -> Option<f32> {
        match self {
            Self::Threshold | Self::FiveHits => Some(0.5),
            Self::Derivative | Self::MinOfFive | Self::WindowEnergy => None,
        }
    }

    fn score(self, hold: &Hold) -> f32 {
        // The newest value comes first.
        let x = &hold.window;
        match self {
            Self::Threshold => 1.0 - x[0],
            Self::Derivative => x[10] - x[0],
            Self::MinOfFive => (0..5).map(|k| x[k + 1] - x[k]).fold(f32::MAX, f32::min),
            Self::FiveHits => hold.hits.iter().copied().fold(f32::MAX, f32::min),
            Self::WindowEnergy => {
                let n = WINDOW as f64;
                (hold.square - hold.sum * hold.sum / n).max(0.0) as f32
            }
        }
    }
}

/// Ticks of the energy's window, and of the mean before a hold.
const WINDOW: usize = 64;
const BEFORE: usize = 40;
/// Ticks from one hit to the next.
const HIT_TICKS: u32 = 100;

#[derive(Debug, Clone)]
struct Hold {
    reference: [f32; FINGERS],
    ticks: u32,
    /// The last normalised sums, newest first, and their sum and sum of squares.
    window: VecDeque<f32>,
    sum: f64,
    square: f64,
    hits: [f32; 5],
}

/// All rules side by side.
#[derive(Debug, Clone, Default)]
pub struct Baselines {
    before: VecDeque<[f32; FINGERS]>,
    hold: Option<Hold>,
}

impl Baselines {
    /// Advances by one tick with the residuals, and whether the controller holds. Gives the score of every
    /// rule while they are armed.
    pub fn step(
        &mut self,
        residual: &[Option<Microstrain>; FINGERS],
        armed: bool,
    ) -> Option<[f32; RULES]> {
        if !armed {
            self.hold = None;
            if self.before.len() == BEFORE {
                self.before.pop_back();
            }
            // A gauge without a value has no share in the reference either.
            self.before
                .push_front(residual.map(|r| r.map_or(0.0, |r| r.0)));
            return None;
        }
        let before = &self.before;
        let hold = self.hold.get_or_insert_with(|| Hold::new(before));
        hold.step(residual);
        Some(Baseline::ALL.map(|rule| rule.score(hold)))
    }
}

impl Hold {
    fn new(before: &VecDeque<[f32; FINGERS]>) -> Self {
        let mean =
            |i: usize| before.iter().map(|row| row[i]).sum::<f32>() / before.len().max(1) as f32;
        Self {
            reference: std::array::from_fn(mean),
            ticks: 0,
            window: VecDeque::from([1.0; WINDOW]),
            sum: WINDOW as f64,
            square: WINDOW as f64,
            hits: [f32::MIN; 5],
        }
    }

    fn step(&mut self, residual: &[Option<Microstrain>; FINGERS]) {
        let usable = residual.iter().zip(self.reference);
        let (sum, reference) = usable
            .filter_map(|(residual, reference)| residual.map(|r| (r.0, reference)))
            .fold((0.0, 0.0), |(a, b), (r, reference)| (a + r, b + reference));
        // Without any gauge nothing is known: as before.
        let x = match reference > 0.0 {
            true => sum / reference,
            false => self.window[0],
        };
        let oldest = self.window.pop_back().unwrap_or(x);
        self.window.push_front(x);
        let (new, old) = (f64::from(x), f64::from(oldest));
        self.sum += new - old;
        self.square += new * new - old * old;
        self.ticks += 1;
        if self.ticks.is_multiple_of(HIT_TICKS) {
            self.hits.rotate_right(1);
            self.hits[0] = 1.0 - x;
        }
    }
}

/// The running maximum of a score, stored as its increases: (tick, score).
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Envelope(Vec<(usize, f32)>);

impl Envelope {
    /// Takes the score of a tick.
    pub fn add(&mut self, tick: usize, score: f32) {
        if self.0.last().is_none_or(|&(_, greatest)| score > greatest) {
            self.0.push((tick, score));
        }
    }

    /// The first tick at which the score exceeded a threshold; none if it never did.
    pub fn crossing(&self, threshold: f32) -> Option<usize> {
        let place = self.0.partition_point(|&(_, score)| score <= threshold);
        self.0.get(place).map(|&(tick, _)| tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scores under a course of the residual sum over its plateau, one value per tick.
    fn scores(course: impl Iterator<Item = f32>) -> Vec<[f32; RULES]> {
        let residual = |share: f32| [Some(Microstrain(1_000.0 * share)); FINGERS];
        let mut baselines = Baselines::default();
        for _ in 0..BEFORE {
            assert_eq!(baselines.step(&residual(1.0), false), None);
        }
        course
            .map(|share| baselines.step(&residual(share), true).expect("armed"))
            .collect()
    }

    #[test]
    fn a_plateau_scores_nothing() {
        for score in scores(std::iter::repeat_n(1.0, 1_000)) {
            assert!(score.iter().all(|score| *score < 1e-6), "{score:?}");
        }
    }

    #[test]
    fn each_rule_measures_what_it_is_named_after() {
        // After half a second the sum falls by 2 % per tick to a half.
        let course = (0..1_200).map(|tick| match tick {
            0..500 => 1.0,
            500..525 => 1.0 - 0.02 * (tick - 499) as f32,
            _ => 0.5,
        });
        let scores = scores(course);
        let at = |tick: usize, rule: Baseline| scores[tick][rule as usize];
        assert!((at(510, Baseline::Threshold) - 0.22).abs() < 1e-5);
        assert!((at(515, Baseline::Derivative) - 0.2).abs() < 1e-5);
        assert!((at(515, Baseline::MinOfFive) - 0.02).abs() < 1e-5);
        assert!(at(501, Baseline::MinOfFive).abs() < 1e-5);
        // At most with the fall in its middle: 40 values 0.25 off the mean, which is 2.5, and 24 that are
        // 0.01, 0.03 … 0.23 off it on either side, which is 0.46.
        let energy = (500..600).map(|tick| at(tick, Baseline::WindowEnergy));
        let most = energy.fold(0.0, f32::max);
        assert!((most - 2.96).abs() < 1e-4, "{most}");
        // The fifth hit comes 400 ms after the first.
        assert!(at(998, Baseline::FiveHits) < 0.1);
        assert!((at(999, Baseline::FiveHits) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn an_envelope_knows_when_a_threshold_was_crossed() {
        let mut envelope = Envelope::default();
        for (tick, score) in [(3, 0.1), (4, 0.05), (5, 0.3), (9, 0.2), (12, 0.9)] {
            envelope.add(tick, score);
        }
        assert_eq!(envelope.crossing(0.05), Some(3));
        assert_eq!(envelope.crossing(0.1), Some(5));
        assert_eq!(envelope.crossing(0.5), Some(12));
        assert_eq!(envelope.crossing(0.9), None);
    }
}

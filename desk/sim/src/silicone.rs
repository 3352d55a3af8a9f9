//! How the shape of a finger follows its pressure: silicone lags behind, its inner friction keeps a part of where it
//! came from, and it creeps.
//!
//! The friction is a Prandtl-Ishlinskii operator, rate-independent and without drift:
//!
//! ```text
//! y = (1 − N w) x + w Σ F_j(x),    F_j ← max(x − r_j, min(x + r_j, F_j)),    r_j = j r / N,  j = 1…N
//! ```
//!
//! with `x` the pressure behind the lag and `y` the pressure at which the recipe has the joint torques of now.
//! Once all N play operators have turned, `y` is `x − w Σ r_j` on the way up and `x + w Σ r_j` on the way down. The
//! recipe's curve behind it makes the loop in the bend asymmetric, and closes it at zero pressure, where the
//! curve is flat (Kuhnen, Eur. J. Control 9, 2003: operator and memoryless curve in series; four of them describe
//! the public record of a PneuNet actuator).

use crate::air::Lag;
use crate::gripper::FingerParameters;

/// Play operators of a finger.
const PLAYS: usize = 4;
/// Greatest threshold `r` as a share of the highest pressure: the loop of a full stroke narrows over the last half
/// of it, as measured loops do.
const THRESHOLD: f64 = 0.25;

/// The pressure that a finger's joint torques have followed so far.
#[derive(Debug, Clone, Copy)]
pub struct Silicone {
    inflation: Lag,
    deflation: Lag,
    /// Outputs `F_j`, kPa.
    plays_kpa: [f64; PLAYS],
    /// Thresholds `r_j`, kPa.
    thresholds_kpa: [f64; PLAYS],
    /// Weight `w`.
    weight: f64,
}

impl Silicone {
    /// A finger that has rested without pressure, with a recipe that ends at `max_kpa`.
    pub fn new(hand: &FingerParameters, max_kpa: f64) -> Self {
        let thresholds_kpa =
            std::array::from_fn(|j| THRESHOLD * max_kpa * (j + 1) as f64 / PLAYS as f64);
        let width_kpa = 0.01 * hand.hysteresis_percent * max_kpa;
        Self {
            plays_kpa: [0.0; PLAYS],
            thresholds_kpa,
            weight: width_kpa / (2.0 * thresholds_kpa.iter().sum::<f64>()),
            inflation: Lag::new(1e-3 * hand.inflation_lag_ms),
            deflation: Lag::new(1e-3 * hand.deflation_lag_ms),
        }
    }

    /// Advances by one control tick at this pressure, kPa; gives the pressure at which the recipe has the joint
    /// torques of now, kPa.
    pub fn step(&mut self, pressure_kpa: f64) -> f64 {
        let (lag, other) = if pressure_kpa > self.inflation.value {
            (&mut self.inflation, &mut self.deflation)
        } else {
            (&mut self.deflation, &mut self.inflation)
        };
        let kpa = lag.step(pressure_kpa);
        other.value = kpa;
        self.rub(kpa)
    }

    /// Advances the play operators; gives what they make of a pressure, kPa.
    fn rub(&mut self, kpa: f64) -> f64 {
        let mut left_kpa = 0.0;
        for (play, threshold) in self.plays_kpa.iter_mut().zip(self.thresholds_kpa) {
            *play = play.clamp(kpa - threshold, kpa + threshold);
            left_kpa += *play - kpa;
        }
        kpa + self.weight * left_kpa
    }
}

/// Creep: a share of each quantity that follows it late, as in a standard linear solid.
#[derive(Debug, Clone, Copy)]
pub struct Creep<const N: usize> {
    share: f64,
    lags: [Lag; N],
}

impl<const N: usize> Creep<N> {
    /// Creep from rest, of so many percent in the end, with a time constant, s.
    pub fn new(percent: f64, time_s: f64) -> Self {
        Self {
            share: 0.01 * percent,
            lags: [Lag::new(time_s); N],
        }
    }

    /// Advances by one control tick; gives what creep adds to each quantity.
    pub fn step(&mut self, now: [f64; N]) -> [f64; N] {
        let share = self.share;
        std::array::from_fn(|i| share * self.lags[i].step(now[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::TICK_S;
    use crate::gripper::Gripper;

    const MAX_KPA: f64 = 160.0;

    /// The reference with every effect of silicone off.
    fn ideal() -> FingerParameters {
        let mut hand = Gripper::reference().hand;
        hand.deflation_lag_ms = hand.inflation_lag_ms;
        hand.hysteresis_percent = 0.0;
        hand
    }

    /// Time until a finger at `from_kpa` has gone 63 % of the way to `to_kpa`, ms.
    fn lag_ms(hand: &FingerParameters, from_kpa: f64, to_kpa: f64) -> f64 {
        let mut silicone = Silicone::new(hand, MAX_KPA);
        for _ in 0..5_000 {
            silicone.step(from_kpa);
        }
        let left = |kpa: f64| (kpa - to_kpa) / (from_kpa - to_kpa);
        let ticks = (1..).find(|_| left(silicone.step(to_kpa)) < (-1f64).exp());
        1e3 * TICK_S * f64::from(ticks.unwrap_or(0))
    }

    #[test]
    fn a_finger_inflates_and_deflates_with_its_own_lags() {
        let hand = FingerParameters {
            inflation_lag_ms: 100.0,
            deflation_lag_ms: 300.0,
            ..ideal()
        };
        assert!((lag_ms(&hand, 0.0, 140.0) - 100.0).abs() < 2.0);
        assert!((lag_ms(&hand, 100.0, 140.0) - 100.0).abs() < 2.0);
        assert!((lag_ms(&hand, 140.0, 0.0) - 300.0).abs() < 2.0);
    }

    /// A finger with this hysteresis, and its output once it has come to rest at each of these pressures.
    fn settle(percent: f64, pressures_kpa: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let hand = FingerParameters {
            hysteresis_percent: percent,
            ..ideal()
        };
        let mut silicone = Silicone::new(&hand, MAX_KPA);
        let settled = pressures_kpa
            .into_iter()
            .map(|kpa| (0..3_000).fold(0.0, |_, _| silicone.step(kpa)));
        settled.collect()
    }

    #[test]
    fn the_way_down_is_as_far_from_the_way_up_as_the_parameter_says() {
        let [up, _, down] = settle(5.0, [100.0, 160.0, 70.0])[..] else {
            panic!("three pressures");
        };
        // 5 % of 160 kPa are 8 kPa, half to each side.
        assert!((up - 96.0).abs() < 1e-6 && (down - 74.0).abs() < 1e-6);
    }

    #[test]
    fn a_small_loop_closes_and_leaves_the_large_one_as_it_was() {
        let [first, _, back, _, _, after] =
            settle(5.0, [120.0, 100.0, 120.0, 150.0, 100.0, 120.0])[..]
        else {
            panic!("six pressures");
        };
        assert!((first - back).abs() < 1e-6, "return-point memory");
        assert!(after > back + 0.5, "{after}: on its way back from higher");
    }

    #[test]
    fn without_hysteresis_only_the_pressure_counts() {
        for (kpa, followed) in [150.0, 70.0, 0.0]
            .into_iter()
            .zip(settle(0.0, [150.0, 70.0, 0.0]))
        {
            assert!((kpa - followed).abs() < 1e-6);
        }
    }

    #[test]
    fn creep_comes_and_leaves_with_its_time_constant() {
        let mut creep = Creep::new(10.0, 0.2);
        let mut after_ms = |ms: u32, now: f64| (0..ms).fold(0.0, |_, _| creep.step([now])[0]);
        assert!((after_ms(200, 50.0) - 5.0 * 0.632).abs() < 0.01);
        assert!((after_ms(3_000, 50.0) - 5.0).abs() < 0.01);
        assert!((after_ms(200, 0.0) - 5.0 * 0.368).abs() < 0.01);
    }
}

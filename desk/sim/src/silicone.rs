//! How the shape of a finger follows its pressure: silicone lags behind.

use crate::air::Lag;
use crate::gripper::FingerParameters;

/// The pressure that a finger's joint torques have followed so far.
#[derive(Debug, Clone, Copy)]
pub struct Silicone {
    inflation: Lag,
    deflation: Lag,
}

impl Silicone {
    /// A finger that has rested without pressure.
    pub fn new(hand: &FingerParameters) -> Self {
        Self {
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
        other.value = lag.step(pressure_kpa);
        other.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::TICK_S;
    use crate::gripper::Gripper;

    /// The reference with every effect of silicone off.
    fn ideal() -> FingerParameters {
        let mut hand = Gripper::reference().hand;
        hand.deflation_lag_ms = hand.inflation_lag_ms;
        hand
    }

    /// Time until a finger at `from_kpa` has gone 63 % of the way to `to_kpa`, ms.
    fn lag_ms(hand: &FingerParameters, from_kpa: f64, to_kpa: f64) -> f64 {
        let mut silicone = Silicone::new(hand);
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
}

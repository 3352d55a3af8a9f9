//! Whether a gauge still moves: one that freezes, or that ignores the pressure, is stuck.

use crate::units::{AdcCode, Microstrain};

/// A gauge that always flickers and then shows one code for this long is stuck.
const STUCK_TICKS: u16 = 15;
/// Share of measurements with a new code, averaged over 250 ms, above which a gauge flickers.
const LIVELY: f32 = 0.9;
/// A gauge that shows one code while the free-bend strain moves by this much is stuck, …
const STUCK_FREE_UE: f32 = 1_500.0;
/// … after so many repetitions: at 25 Hz it moves as far between two measurements, which may be alike by chance.
const ALIKE: u16 = 3;

/// How long a gauge has shown its code, and how often it shows a new one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Liveliness {
    last_code: AdcCode,
    unchanged: u16,
    /// Free-bend strain when the code changed last.
    free_at_change: Option<f32>,
    lively: f32,
}

impl Liveliness {
    /// Nothing measured yet.
    pub const NEW: Self = Self {
        last_code: AdcCode(0),
        unchanged: 0,
        free_at_change: None,
        lively: 0.0,
    };

    /// Takes one measurement, with the gain of an average over 250 ms.
    pub fn step(&mut self, code: AdcCode, free_strain: Option<Microstrain>, gain: f32) {
        let free_strain = free_strain.map(|free| free.0);
        if code == self.last_code {
            self.unchanged = self.unchanged.saturating_add(1);
            self.free_at_change = self.free_at_change.or(free_strain);
            // Liveliness is judged on what went before, so a freeze does not wash it out.
            if self.unchanged < 2 {
                self.lively -= gain * self.lively;
            }
        } else {
            self.last_code = code;
            self.unchanged = 0;
            self.free_at_change = free_strain;
            self.lively += gain * (1.0 - self.lively);
        }
    }

    /// Whether it has frozen, or ignores the pressure.
    pub fn is_stuck(&self, free_strain: Option<Microstrain>) -> bool {
        let froze = self.lively > LIVELY && self.unchanged >= STUCK_TICKS;
        let ignored_pressure = match (free_strain, self.free_at_change) {
            (Some(now), Some(then)) => {
                self.unchanged >= ALIKE && (now.0 - then).abs() > STUCK_FREE_UE
            }
            _ => false,
        };
        froze || ignored_pressure
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain of an average over 250 ms, one measurement per tick.
    const GAIN: f32 = 0.004;
    const STEADY: Option<Microstrain> = Some(Microstrain(4_000.0));

    /// 3 010 measurements, of which those with `repeats` show the code of the one before.
    fn measured(repeats: impl Fn(u16) -> bool) -> Liveliness {
        let mut liveliness = Liveliness::NEW;
        let mut code = 30_000;
        for at in 0..3_010 {
            code += u16::from(!repeats(at));
            liveliness.step(AdcCode(code), STEADY, GAIN);
            assert!(!liveliness.is_stuck(STEADY), "at {at}");
        }
        liveliness
    }

    /// After how many measurements alike it is stuck.
    fn freezes_after(mut liveliness: Liveliness, code: AdcCode) -> Option<u16> {
        (1..=1_000).find(|_| {
            liveliness.step(code, STEADY, GAIN);
            liveliness.is_stuck(STEADY)
        })
    }

    #[test]
    fn a_gauge_that_nearly_always_flickers_is_stuck_after_15_measurements_alike() {
        // Three alike in every twelve are one that does not flicker for ten that do: 91 %.
        let lively = measured(|at| at % 12 >= 10);
        assert_eq!(freezes_after(lively, lively.last_code), Some(15));
    }

    #[test]
    fn a_gauge_that_shows_every_code_twice_may_rest_for_ever() {
        let quiet = measured(|at| at % 2 == 1);
        assert_eq!(freezes_after(quiet, quiet.last_code), None);
    }

    #[test]
    fn a_code_that_stays_while_a_free_finger_moves_by_1500_ue_is_stuck() {
        let code = AdcCode(30_000);
        let mut liveliness = Liveliness::NEW;
        for _ in 0..1_000 {
            liveliness.step(code, STEADY, GAIN);
            assert!(!liveliness.is_stuck(STEADY));
        }
        for (free_ue, is_stuck) in [
            (5_490.0, false),
            (5_510.0, true),
            (2_510.0, false),
            (2_490.0, true),
        ] {
            let free = Some(Microstrain(free_ue));
            liveliness.step(code, free, GAIN);
            assert_eq!(liveliness.is_stuck(free), is_stuck, "{free_ue}");
        }
        // A new code is a gauge that moves.
        let free = Some(Microstrain(2_490.0));
        liveliness.step(AdcCode(30_001), free, GAIN);
        assert!(!liveliness.is_stuck(free));
    }

    #[test]
    fn measurements_alike_by_chance_are_not_stuck_however_fast_the_pressure() {
        let mut liveliness = Liveliness::NEW;
        let moves = |step: u16| Some(Microstrain(2_000.0 * f32::from(step)));
        for step in 0..3 {
            liveliness.step(AdcCode(30_000), moves(step), GAIN);
            assert!(!liveliness.is_stuck(moves(step)), "{step}");
        }
        liveliness.step(AdcCode(30_000), moves(3), GAIN);
        assert!(liveliness.is_stuck(moves(3)));
    }

    #[test]
    fn what_a_free_finger_did_before_the_first_pressure_is_unknown() {
        let mut liveliness = Liveliness::NEW;
        let code = AdcCode(30_000);
        liveliness.step(code, None, GAIN);
        liveliness.step(code, None, GAIN);
        assert!(!liveliness.is_stuck(None));
        // The first pressure is where it counts from.
        liveliness.step(code, STEADY, GAIN);
        assert!(!liveliness.is_stuck(STEADY));
        let moved = Some(Microstrain(5_600.0));
        liveliness.step(code, moved, GAIN);
        assert!(liveliness.is_stuck(moved));
    }
}

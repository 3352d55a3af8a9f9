//! Noise of one gauge, from the differences of successive measurements.

use crate::math::lag_gain;

/// Averaging time of noise and liveliness, ms.
const STATISTICS_MS: f32 = 250.0;
/// Averaging time of noise that comes suddenly, ms: long enough not to take 400 µε for a loose contact, short
/// enough to tell one within 20 ms.
const BURST_MS: f32 = 8.0;
/// Averaging time of the noise of the last few ticks, ms.
const JITTER_MS: f32 = 4.0;
/// Noise has suddenly grown when it exceeds its usual variance by this factor: an average over eight samples
/// does so once in ten thousand by itself.
const OUTBREAK: f32 = 4.0;
/// What a finger that snaps free and swings makes of each tick more, µε: 2 700 in 10 ms, 5 200 in 20.
const SWING_UE: f32 = 270.0;
/// What one that snaps off a hard object does, at its fastest, and in all, µε.
const SNAP_UE: f32 = 330.0;
const WHOLE_SNAP_UE: f32 = 4_500.0;

/// Gains of the averages, and what may lie between two measurements.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gains {
    /// Of the averages over [`STATISTICS_MS`].
    pub statistics: f32,
    burst: f32,
    jitter: f32,
    /// What a measurement's noise counts for: noise that stands for so many ticks does not average out
    /// over them.
    weight: f32,
    /// What may add to the largest believable jump between two measurements, µε.
    pub jump_ue: f32,
    /// What a swing may have moved a finger between two measurements, µε, without being noise.
    swing_ue: f32,
}

impl Gains {
    /// For a measurement in every tick.
    pub fn every_tick() -> Self {
        Self {
            statistics: lag_gain(STATISTICS_MS),
            burst: lag_gain(BURST_MS),
            jitter: lag_gain(JITTER_MS),
            weight: 1.0,
            jump_ue: 0.0,
            swing_ue: 0.0,
        }
    }

    /// For measurements that are so many ticks apart. A burst of noise is told by so many measurements,
    /// not by so much time.
    pub fn over(self, spacing: f32) -> Self {
        Self {
            statistics: (spacing * self.statistics).min(1.0),
            weight: spacing,
            jump_ue: (SNAP_UE * (spacing - 1.0)).min(WHOLE_SNAP_UE),
            swing_ue: SWING_UE * (spacing - 1.0),
            ..self
        }
    }
}

/// Noise of one gauge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Mean square of first differences, µε²: twice the variance of white noise.
    difference_variance: f32,
    /// The same over [`BURST_MS`].
    burst_variance: f32,
    /// Mean square of second differences over [`JITTER_MS`], µε²: six times the variance of white noise. A
    /// strain that moves steadily has none.
    jitter_variance: f32,
    last_difference: f32,
}

impl Noise {
    /// Nothing measured yet.
    pub const NONE: Self = Self {
        difference_variance: 0.0,
        burst_variance: 0.0,
        jitter_variance: 0.0,
        last_difference: 0.0,
    };

    /// Variance, µε²; of the last few ticks alone where it has suddenly grown.
    pub fn variance(&self) -> f32 {
        let usual = 0.5 * self.difference_variance;
        match self.jitter_variance > 6.0 * OUTBREAK * usual {
            true => self.jitter_variance / 6.0,
            false => usual,
        }
    }

    /// Variance over the last few milliseconds, µε².
    pub fn burst(&self) -> f32 {
        0.5 * self.burst_variance
    }

    /// Takes the difference of two successive measurements, µε. A gauge that warms up has no bursts.
    pub fn measure(&mut self, difference: f32, warm: bool, gains: &Gains) {
        let square = difference * difference;
        if gains.weight > 1.0 {
            let weighted = gains.weight * square;
            self.difference_variance += gains.statistics * (weighted - self.difference_variance);
            let beyond = (difference.abs() - gains.swing_ue).max(0.0);
            self.measure_burst(beyond * beyond, warm, gains);
            return;
        }
        self.difference_variance += gains.statistics * (square - self.difference_variance);
        // White noise of variance σ² has second differences of variance 6σ². Between measurements that are
        // further apart a loss has them too.
        let second = difference - self.last_difference;
        self.last_difference = difference;
        self.jitter_variance += gains.jitter * (second * second - self.jitter_variance);
        self.measure_burst(square, warm, gains);
    }

    /// Takes the square of a difference into the burst alone.
    pub fn measure_burst(&mut self, square: f32, warm: bool, gains: &Gains) {
        if warm {
            self.burst_variance += gains.burst * (square - self.burst_variance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flicker of ±`ue` for so many ticks, on a strain that moves by `slope` per tick.
    fn flicker(noise: &mut Noise, ue: f32, slope: f32, ticks: u32) {
        let gains = Gains::every_tick();
        for tick in 0..ticks {
            let sign = if tick.is_multiple_of(2) { 1.0 } else { -1.0 };
            noise.measure(2.0 * sign * ue + slope, true, &gains);
        }
    }

    #[test]
    fn the_usual_variance_is_half_the_mean_square_of_the_differences() {
        let mut noise = Noise::NONE;
        flicker(&mut noise, 50.0, 0.0, 5_000);
        // Differences of ±100 µε.
        assert!(
            (noise.variance() - 5_000.0).abs() < 10.0,
            "{}",
            noise.variance()
        );
        assert!((noise.burst() - 5_000.0).abs() < 10.0, "{}", noise.burst());
    }

    #[test]
    fn noise_that_breaks_out_is_known_within_a_few_ticks_and_a_strain_that_moves_is_no_noise() {
        let mut noise = Noise::NONE;
        flicker(&mut noise, 10.0, 0.0, 5_000);
        // A ramp: its first tick has a second difference, the others none.
        let mut ramp = noise;
        flicker(&mut ramp, 10.0, 30.0, 12);
        assert!(ramp.variance() < 2.0 * noise.variance(), "{ramp:?}");
        flicker(&mut noise, 500.0, 0.0, 8);
        // Second differences of 2 000 µε, a sixth of their square, of which two time constants take 86 %.
        assert!(
            (520_000.0..620_000.0).contains(&noise.variance()),
            "{}",
            noise.variance()
        );
    }

    #[test]
    fn noise_that_grows_by_half_is_no_outbreak() {
        let mut noise = Noise::NONE;
        flicker(&mut noise, 10.0, 0.0, 5_000);
        let usual = noise.variance();
        flicker(&mut noise, 15.0, 0.0, 20);
        // 20 ms of 250, of what is 2.25 times as much.
        let grown = noise.variance() / usual;
        assert!((1.05..1.15).contains(&grown), "{grown}");
    }

    #[test]
    fn averages_go_63_percent_of_their_way_in_their_time() {
        // Usual noise in 250 ms, a burst in 8; differences of ±100 µε.
        for (ticks, value) in [
            (250, Noise::variance as fn(&Noise) -> f32),
            (8, Noise::burst),
        ] {
            let mut noise = Noise::NONE;
            flicker(&mut noise, 50.0, 0.0, ticks);
            let share = value(&noise) / 5_000.0;
            assert!((share - 0.632).abs() < 0.01, "{share} after {ticks}");
        }
        // Measurements 20 ms apart take 12.5 of them, in steps of 8 %.
        let gains = Gains::every_tick().over(20.0);
        let mut noise = Noise::NONE;
        for _ in 0..13 {
            noise.measure(100.0, true, &gains);
        }
        let share = noise.variance() / 100_000.0;
        assert!((0.62..0.68).contains(&share), "{share}");
    }

    #[test]
    fn a_gauge_that_warms_up_has_no_bursts() {
        let mut noise = Noise::NONE;
        noise.measure(5_000.0, false, &Gains::every_tick());
        assert_eq!(noise.burst(), 0.0);
        noise.measure(5_000.0, true, &Gains::every_tick());
        assert!(noise.burst() > 1e6);
    }

    #[test]
    fn measurements_further_apart_weigh_more_and_may_differ_by_a_swing() {
        let gains = Gains::every_tick().over(20.0);
        assert_eq!(gains.jump_ue, 4_500.0);
        assert_eq!(Gains::every_tick().over(10.0).jump_ue, 2_970.0);
        // A swing of 19 ticks is no burst, what is beyond it is.
        let mut noise = Noise::NONE;
        noise.measure(19.0 * SWING_UE, true, &gains);
        assert_eq!(noise.burst(), 0.0);
        noise.measure(-19.0 * SWING_UE - 100.0, true, &gains);
        let one = 0.5 * gains.burst * 1e4;
        assert!(
            (noise.burst() / one - 1.0).abs() < 0.01,
            "{}",
            noise.burst()
        );
        // 100 µε in 20 ticks count for twenty times their square.
        let mut noise = Noise::NONE;
        for _ in 0..2_000 {
            noise.measure(100.0, true, &gains);
        }
        assert!(
            (noise.variance() / 100_000.0 - 1.0).abs() < 0.01,
            "{}",
            noise.variance()
        );
    }
}

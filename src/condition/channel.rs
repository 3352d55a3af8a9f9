//! One strain gauge: its strain where it can be trusted, its fault where it cannot.

use super::liveliness::Liveliness;
use super::noise::{Gains, Noise};
use crate::fault::GaugeFault;
use crate::frontend::Amplifier;
use crate::math::root;
use crate::units::{AdcCode, Microstrain};

/// One gauge in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Gauge {
    /// A strain to be trusted, µε, with the zero taken off.
    Valid(Microstrain),
    /// Nothing usable in this tick.
    Missing,
    /// The gauge has failed; latched until acknowledged.
    Failed(GaugeFault),
}

impl Gauge {
    /// The strain, where there is one.
    pub fn strain(self) -> Option<Microstrain> {
        match self {
            Self::Valid(strain) => Some(strain),
            Self::Missing | Self::Failed(_) => None,
        }
    }

    /// Whether the gauge has failed.
    pub fn has_failed(self) -> bool {
        matches!(self, Self::Failed(_))
    }
}

/// A bad value must persist this long to be a fault: shorter is a spike, and 20 ms are allowed.
const PERSIST_TICKS: u16 = 3;
/// A finger that snaps free at high pressure swings beyond the amplifier's range for a moment. It is empty
/// then, which is what its clipped reading says; a loss is told in that time.
const CLIP_TICKS: u16 = 15;
/// Where a free finger shows more than this share of the range, one that is free may leave it: it swings to 1.6 times
/// that when it snaps, and its weight adds 2 800 µε where the wrist is tilted. Its gauge clips, and is no worse for it.
const ROOM: f32 = 0.6;
/// A finger comes there by less than this in a tick, µε, a gauge that breaks by a step. Two measurements differ by this
/// many standard deviations of their noise once in ten million.
const STEP_UE: f32 = 600.0;
const STEP_SIGMAS: f32 = 7.5;
/// Fastest believable change. A lost object lets the strain run at 140 µε per tick (4 200 µε in 30 ms);
/// five sigma of the difference of two readings with 400 µε of noise are 2 800 µε.
const JUMP_UE: f32 = 4_000.0;
/// A gauge may jump for this long after start-up, while amplifiers and filters charge.
const WARM_UP_TICKS: u16 = 100;
/// More noise than this, rms, is a loose contact: three times the noise that the detector is good for.
const NOISY_UE: f32 = 1_200.0;

/// The memory of one gauge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channel {
    /// Raw strain, µε.
    last_valid: Option<f32>,
    seen: u16,
    liveliness: Liveliness,
    noise: Noise,
    suspect: Option<(GaugeFault, u16)>,
    failed: Option<GaugeFault>,
    /// It had failed before this tick.
    latched: bool,
    /// The failure has been acknowledged, and ends with its cause.
    acknowledged: bool,
}

impl Channel {
    /// Nothing measured yet.
    pub const NEW: Self = Self {
        last_valid: None,
        seen: 0,
        liveliness: Liveliness::NEW,
        noise: Noise::NONE,
        suspect: None,
        failed: None,
        latched: false,
        acknowledged: false,
    };

    /// A tick without a frame.
    pub fn missing(&self) -> Gauge {
        match self.failed {
            Some(fault) => Gauge::Failed(fault),
            None => Gauge::Missing,
        }
    }

    /// Variance of the noise, µε².
    pub fn noise_variance(&self) -> f32 {
        self.noise.variance()
    }

    /// A failure from before the last tick has been seen.
    pub fn acknowledge(&mut self) {
        self.acknowledged |= self.latched;
    }

    /// Judges one measurement. `free_strain`: what a free finger would show.
    pub fn step(
        &mut self,
        code: AdcCode,
        Microstrain(raw): Microstrain,
        amplifier: &Amplifier,
        zero_ue: f32,
        free_strain: Option<Microstrain>,
        gains: &Gains,
    ) -> Gauge {
        self.liveliness.step(code, free_strain, gains.statistics);
        self.seen = self.seen.saturating_add(1);
        let jumped = self.seen > WARM_UP_TICKS
            && self
                .last_valid
                .is_some_and(|last| (raw - last).abs() > JUMP_UE + gains.jump_ue);
        let suspicion = self.suspicion(code, raw, jumped, free_strain, amplifier);
        if suspicion.is_none() && self.failed.is_none() {
            self.suspect = None;
            self.measure_noise(raw, gains);
            self.last_valid = Some(raw);
            return Gauge::Valid(Microstrain(raw - zero_ue));
        }
        self.latched = self.failed.is_some();
        match suspicion {
            None | Some(GaugeFault::Noisy) => {
                self.measure_noise(raw, gains);
                self.last_valid = Some(raw);
            }
            // A spike must not pass for noise, but spike after spike must.
            Some(GaugeFault::Jump) => {
                self.noise
                    .measure_burst(JUMP_UE * JUMP_UE, self.is_warm(), gains);
            }
            Some(
                GaugeFault::Open | GaugeFault::Short | GaugeFault::Stuck | GaugeFault::Saturated,
            ) => {}
        }
        self.suspect(suspicion);
        self.verdict(raw, jumped, zero_ue)
    }

    /// A tick without a measurement of its own: what the last one was is what this one is.
    pub fn carry(&self, Microstrain(raw): Microstrain, zero_ue: f32) -> Gauge {
        let jumped = self
            .last_valid
            .is_some_and(|last| (raw - last).abs() > JUMP_UE);
        match (self.failed, self.suspect) {
            (Some(fault), _) => Gauge::Failed(fault),
            (None, Some((GaugeFault::Saturated, _))) if !jumped => {
                Gauge::Valid(Microstrain(raw - zero_ue))
            }
            (None, Some(_)) => Gauge::Missing,
            (None, None) => Gauge::Valid(Microstrain(raw - zero_ue)),
        }
    }

    /// What is wrong with this tick's reading, if anything is.
    fn suspicion(
        &self,
        code: AdcCode,
        raw_ue: f32,
        jumped: bool,
        free_strain: Option<Microstrain>,
        amplifier: &Amplifier,
    ) -> Option<GaugeFault> {
        if code < amplifier.short_below {
            Some(GaugeFault::Short)
        } else if code > amplifier.open_above {
            Some(GaugeFault::Open)
        } else if code < amplifier.linear[0] || code > amplifier.linear[1] {
            // A code that stays is no sign of a gauge that is stuck here.
            (!self.swings_out(raw_ue, free_strain, amplifier)).then_some(GaugeFault::Saturated)
        } else if self.liveliness.is_stuck(free_strain) {
            Some(GaugeFault::Stuck)
        } else if jumped {
            Some(GaugeFault::Jump)
        } else if self.noise.burst() > NOISY_UE * NOISY_UE {
            Some(GaugeFault::Noisy)
        } else {
            None
        }
    }

    /// Whether a gauge that clips has got there with its finger.
    fn swings_out(
        &self,
        raw_ue: f32,
        free_strain: Option<Microstrain>,
        amplifier: &Amplifier,
    ) -> bool {
        let room_ue = ROOM * amplifier.full_scale.0;
        let may_leave = free_strain.is_some_and(|free| free.0 > room_ue);
        let was_saturated = matches!(self.suspect, Some((GaugeFault::Saturated, _)));
        let stepped = self.last_valid.is_none_or(|last| {
            let noise_ue = root(self.noise.variance());
            (raw_ue - last).abs() > STEP_UE + STEP_SIGMAS * noise_ue
        });
        raw_ue > 0.0 && may_leave && !was_saturated && !stepped
    }

    /// Counts for how long something has been wrong; a failure that has been seen ends with its cause.
    fn suspect(&mut self, suspicion: Option<GaugeFault>) {
        self.suspect = match (suspicion, self.suspect) {
            (None, _) => None,
            // Among noise some steps are as large as jumps.
            (Some(_), Some((GaugeFault::Noisy, ticks))) => {
                Some((GaugeFault::Noisy, ticks.saturating_add(1)))
            }
            (Some(fault), Some((_, ticks))) => Some((fault, ticks.saturating_add(1))),
            (Some(fault), None) => Some((fault, 1)),
        };
        if self.acknowledged && self.suspect.is_none() {
            self.failed = None;
            self.latched = false;
            self.acknowledged = false;
        }
    }

    /// What a measurement that is or was suspect is worth.
    fn verdict(&mut self, raw: f32, jumped: bool, zero_ue: f32) -> Gauge {
        if let Some(fault) = self.failed {
            // A jump is from where the gauge is now, so that one that stays where it has jumped to is good.
            self.last_valid = Some(raw);
            return Gauge::Failed(fault);
        }
        let Some((fault, ticks)) = self.suspect else {
            return Gauge::Valid(Microstrain(raw - zero_ue));
        };
        let clips = fault == GaugeFault::Saturated && !jumped;
        if clips && ticks < CLIP_TICKS {
            self.last_valid = Some(raw);
            return Gauge::Valid(Microstrain(raw - zero_ue));
        }
        if ticks < PERSIST_TICKS && fault != GaugeFault::Stuck {
            return Gauge::Missing;
        }
        self.failed = Some(fault);
        self.acknowledged = false;
        Gauge::Failed(fault)
    }

    fn is_warm(&self) -> bool {
        self.seen > WARM_UP_TICKS
    }

    fn measure_noise(&mut self, raw: f32, gains: &Gains) {
        if let Some(last) = self.last_valid {
            self.noise.measure(raw - last, self.is_warm(), gains);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frontend::FrontEnd;

    const FE: FrontEnd = FrontEnd::REFERENCE;

    /// The tick, from one, in which a gauge fails that rises from 17 000 µε by `per_tick_ue` to 25 000, which is more than
    /// its scale has, where a free finger shows `free_ue`.
    fn fails_after(per_tick_ue: f32, free_ue: f32) -> Option<(u32, GaugeFault)> {
        let gains = Gains::every_tick();
        let mut channel = Channel::NEW;
        let mut measure = |ue: f32, free_ue: f32| {
            let code = AdcCode(FE.gauge_code(0, Microstrain(ue)) as u16);
            let [raw, ..] = FE.strains(&[code; 3]);
            let free = Some(Microstrain(free_ue));
            channel.step(code, raw, &FE.amplifier, 0.0, free, &gains)
        };
        for tick in 0..1_000 {
            let flicker = if tick % 2 == 0 { 15.0 } else { -15.0 };
            measure(17_000.0 + flicker, free_ue);
        }
        (1..=400).find_map(|tick| {
            let ue = (17_000.0 + per_tick_ue * tick as f32).min(25_000.0);
            match measure(ue, free_ue) {
                Gauge::Failed(fault) => Some((tick, fault)),
                Gauge::Valid(_) | Gauge::Missing => None,
            }
        })
    }

    #[test]
    fn a_gauge_clips_with_a_finger_that_is_free_at_high_pressure() {
        assert_eq!(fails_after(200.0, 15_000.0), None);
        // At low pressure no finger bends so far: 15 ticks after the first beyond the range.
        let far = fails_after(200.0, 11_000.0);
        assert_eq!(far, Some((16 + 14, GaugeFault::Saturated)));
        // Nor does one by a step.
        let stepped = fails_after(3_500.0, 15_000.0);
        assert_eq!(stepped, Some((15, GaugeFault::Saturated)));
    }
}

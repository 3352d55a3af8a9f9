//! Converter codes → strain, pressure and supply, each either trustworthy or named as what it is.

use crate::FINGERS;
use crate::fault::GaugeFault;
use crate::frontend::FrontEnd;
use crate::math::lag_gain;
use crate::units::{AdcCode, Kilopascals, Microstrain, Volts};

/// What the converter delivered for one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawFrame {
    /// One gauge per finger.
    pub gauges: [AdcCode; FINGERS],
    /// The regulator's pressure monitor.
    pub monitor: AdcCode,
    /// The supply voltage.
    pub supply: AdcCode,
    /// Scans behind these means; zero says that nothing new arrived.
    pub scans: u16,
    /// The converter lost data, so channels may be mixed up.
    pub overrun: bool,
    /// The gauges' codes stand for a tick in which none was measured, as between two rows of a slow trace:
    /// nothing is concluded from how they change. A converter never says so.
    pub carried: bool,
}

/// One gauge in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Gauge {
    /// A strain to be trusted.
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
}

/// The regulator's monitor in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Monitor {
    /// The measured pressure.
    Valid(Kilopascals),
    /// Nothing new in this tick.
    Missing,
    /// Above anything that the monitor can put out.
    TooHigh,
    /// It fell faster than air can leave, so its wire is off; until it is back where it was, or shows what
    /// it should.
    Lost,
}

/// What the models make of one tick before it is measured; each unknown before the first pressure.
#[derive(Debug, Clone, Copy, Default)]
pub struct Expected {
    /// Strain of a free finger.
    pub free_strain: Option<Microstrain>,
    /// What the commands so far should have given.
    pub pressure: Option<Kilopascals>,
}

/// Everything measured in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// One gauge per finger.
    pub gauges: [Gauge; FINGERS],
    /// The pressure.
    pub monitor: Monitor,
    /// The supply, if measured in this tick.
    pub supply: Option<Volts>,
    /// Ticks since the last usable frame.
    pub stale_ticks: u32,
    /// The converter lost data in this tick.
    pub overrun: bool,
}

/// A bad value must persist this long to be a fault: shorter is a spike, and 20 ms are allowed.
const PERSIST_TICKS: u16 = 3;
/// A finger that snaps free at high pressure swings beyond the amplifier's range for a moment. It is empty
/// then, which is what its clipped reading says; a loss is told in that time.
const CLIP_TICKS: u16 = 15;
/// Fastest believable change. A lost object lets the strain run at 140 µε per tick (4 200 µε in 30 ms);
/// five sigma of the difference of two readings with 400 µε of noise are 2 800 µε.
const JUMP_UE: f32 = 4_000.0;
/// That holds for measurements up to so many ticks apart.
const NEAR_TICKS: f32 = 10.0;
/// What a finger that snaps free and swings makes of each tick more, µε: 2 700 in 10 ms, 5 200 in 20.
const SWING_UE: f32 = 270.0;
/// A gauge may jump for this long after start-up, while amplifiers and filters charge.
const WARM_UP_TICKS: u16 = 100;
/// A gauge that always flickers and then shows one code for this long is stuck.
const STUCK_TICKS: u16 = 15;
/// Share of ticks with a new code above which a gauge counts as flickering.
const LIVELY: f32 = 0.9;
/// A gauge that shows one code while the free-bend strain moves by this much is stuck.
const STUCK_FREE_UE: f32 = 1_500.0;
/// More noise than this, rms, is a loose contact: three times the noise that the detector is good for.
const NOISY_UE: f32 = 1_200.0;
/// Averaging time of noise that comes suddenly, ms: long enough not to take 400 µε for `NOISY_UE`, short
/// enough for 20 ms.
const BURST_MS: f32 = 8.0;
/// Averaging time of the noise of the last few ticks, ms.
const JITTER_MS: f32 = 4.0;
/// Noise has suddenly grown when it exceeds its usual variance by this: an average over eight samples
/// does so once in ten thousand by itself.
const OUTBREAK: f32 = 4.0;
/// Fastest believable fall of the pressure in one tick, as a share: a hose that bursts at the gripper empties
/// it with a time constant of some 10 ms, and a wire that comes off lets the input's 3 ms filter empty.
const MONITOR_FALL: f32 = 0.2;
/// What noise may add to that.
const MONITOR_NOISE_KPA: f32 = 5.0;
/// Averaging time of noise and liveliness, ms.
const STATISTICS_MS: f32 = 250.0;

#[derive(Debug, Clone, Copy)]
struct Channel {
    /// Raw strain, µε.
    last_valid: Option<f32>,
    last_code: AdcCode,
    seen: u16,
    unchanged: u16,
    free_at_change: Option<f32>,
    lively: f32,
    difference_variance: f32,
    burst_variance: f32,
    /// Six times that of noise alone: from second differences, which a strain that moves does not
    /// have, over [`JITTER_MS`].
    jitter_variance: f32,
    last_difference: f32,
    suspect: Option<(GaugeFault, u16)>,
    failed: Option<GaugeFault>,
    /// It had failed before this tick.
    latched: bool,
    /// The failure has been acknowledged, and ends with its cause.
    acknowledged: bool,
}

/// The pressure monitor's memory.
#[derive(Debug, Clone, Copy)]
struct MonitorWire {
    last_kpa: Option<f32>,
    fallen_ticks: u16,
}

/// The state behind the readings: fault timers, noise.
#[derive(Debug, Clone, Copy)]
pub struct Conditioner {
    channels: [Channel; FINGERS],
    monitor: MonitorWire,
    gains: Gains,
    stale_ticks: u32,
    /// Ticks that one measurement stands for: one, or more in a slow trace.
    spacing: f32,
}

/// Of the averages over [`STATISTICS_MS`] and [`BURST_MS`].
#[derive(Debug, Clone, Copy)]
struct Gains {
    statistics: f32,
    burst: f32,
    jitter: f32,
    /// What a measurement's noise counts for: noise that stands for so many ticks does not average out
    /// over them.
    weight: f32,
    /// What may add to [`JUMP_UE`] between two measurements, µε.
    jump_ue: f32,
    /// What a swing may have moved a finger between two measurements, µε, without being noise.
    swing_ue: f32,
}

impl Gains {
    /// For measurements that are so many ticks apart. A burst of noise is told by so many measurements,
    /// not by so much time.
    fn over(self, spacing: f32) -> Self {
        Self {
            statistics: (spacing * self.statistics).min(1.0),
            weight: spacing,
            jump_ue: SWING_UE * (spacing - NEAR_TICKS).max(0.0),
            swing_ue: SWING_UE * (spacing - 1.0),
            ..self
        }
    }
}

impl Conditioner {
    /// No faults.
    pub fn new() -> Self {
        let channel = Channel {
            last_valid: None,
            last_code: AdcCode(0),
            seen: 0,
            unchanged: 0,
            free_at_change: None,
            lively: 0.0,
            difference_variance: 0.0,
            burst_variance: 0.0,
            jitter_variance: 0.0,
            last_difference: 0.0,
            suspect: None,
            failed: None,
            latched: false,
            acknowledged: false,
        };
        Self {
            channels: [channel; FINGERS],
            monitor: MonitorWire {
                last_kpa: None,
                fallen_ticks: 0,
            },
            gains: Gains {
                statistics: lag_gain(STATISTICS_MS),
                burst: lag_gain(BURST_MS),
                jitter: lag_gain(JITTER_MS),
                weight: 1.0,
                jump_ue: 0.0,
                swing_ue: 0.0,
            },
            stale_ticks: 0,
            spacing: 1.0,
        }
    }

    /// Turns one frame into readings. `zero_ue` is the offset of each gauge, µε; `expected` is what the
    /// model of the regulator and of a free finger makes of this moment.
    pub fn step(
        &mut self,
        frame: &RawFrame,
        front_end: &FrontEnd,
        zero_ue: [f32; FINGERS],
        expected: Expected,
    ) -> Reading {
        if frame.scans == 0 || frame.overrun {
            self.stale_ticks = self.stale_ticks.saturating_add(1);
            return Reading {
                gauges: core::array::from_fn(|i| match self.channels[i].failed {
                    Some(fault) => Gauge::Failed(fault),
                    None => Gauge::Missing,
                }),
                monitor: Monitor::Missing,
                supply: None,
                stale_ticks: self.stale_ticks,
                overrun: frame.overrun,
            };
        }
        self.stale_ticks = 0;
        let mut gauges = [Gauge::Missing; FINGERS];
        let channels = self.channels.iter_mut().zip(&frame.gauges).zip(zero_ue);
        if frame.carried {
            self.spacing += 1.0;
            for (gauge, ((channel, &code), zero_ue)) in gauges.iter_mut().zip(channels) {
                *gauge = channel.carry(code, front_end, zero_ue);
            }
        } else {
            let slow;
            let gains = if self.spacing > 1.0 {
                slow = self.gains.over(self.spacing);
                self.spacing = 1.0;
                &slow
            } else {
                &self.gains
            };
            let free = expected.free_strain;
            for (gauge, ((channel, &code), zero_ue)) in gauges.iter_mut().zip(channels) {
                *gauge = channel.step(code, front_end, zero_ue, free, gains);
            }
        }
        Reading {
            gauges,
            monitor: self
                .monitor
                .step(frame.monitor, front_end, expected.pressure),
            supply: Some(front_end.supply(frame.supply)),
            stale_ticks: 0,
            overrun: false,
        }
    }

    /// Somebody has seen which gauges had failed before the last tick: each failure ends with its cause, now or later. No clock
    /// starts again.
    pub fn acknowledge(&mut self) {
        for channel in &mut self.channels {
            channel.acknowledged |= channel.latched;
        }
    }

    /// Variance of each gauge's noise, µε², from the differences of successive readings; of the last few
    /// ticks alone where it has suddenly grown.
    pub fn noise_variance(&self) -> [f32; FINGERS] {
        core::array::from_fn(|i| {
            let channel = &self.channels[i];
            let usual = 0.5 * channel.difference_variance;
            match channel.jitter_variance > 6.0 * OUTBREAK * usual {
                true => channel.jitter_variance / 6.0,
                false => usual,
            }
        })
    }
}

impl Default for Conditioner {
    fn default() -> Self {
        Self::new()
    }
}

impl MonitorWire {
    fn step(
        &mut self,
        code: AdcCode,
        front_end: &FrontEnd,
        expected: Option<Kilopascals>,
    ) -> Monitor {
        if code > front_end.monitor_high_above {
            return Monitor::TooHigh;
        }
        let pressure = front_end.pressure(code);
        let fell = |last| pressure.0 < (1.0 - MONITOR_FALL) * last - MONITOR_NOISE_KPA;
        if self.last_kpa.is_some_and(fell) {
            self.fallen_ticks = self.fallen_ticks.saturating_add(1);
            if self.fallen_ticks < PERSIST_TICKS {
                return Monitor::Missing;
            }
            // A wire that is off reads zero, which is right once the air has been let out.
            let right = |expected: Kilopascals| (pressure.0 - expected.0).abs() < MONITOR_NOISE_KPA;
            if !expected.is_some_and(right) {
                return Monitor::Lost;
            }
        }
        self.fallen_ticks = 0;
        self.last_kpa = Some(pressure.0);
        Monitor::Valid(pressure)
    }
}

impl Channel {
    fn step(
        &mut self,
        code: AdcCode,
        front_end: &FrontEnd,
        zero_ue: f32,
        free_strain: Option<Microstrain>,
        gains: &Gains,
    ) -> Gauge {
        self.watch_for_change(code, free_strain, gains.statistics);
        let raw = front_end.strain(code).0;
        self.seen = self.seen.saturating_add(1);
        let jumped = self.seen > WARM_UP_TICKS
            && self
                .last_valid
                .is_some_and(|last| (raw - last).abs() > JUMP_UE + gains.jump_ue);
        let suspicion = self.suspicion(code, raw, jumped, free_strain, front_end);
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
            Some(GaugeFault::Jump) => self.measure_burst(JUMP_UE * JUMP_UE, gains),
            Some(
                GaugeFault::Open | GaugeFault::Short | GaugeFault::Stuck | GaugeFault::Saturated,
            ) => {}
        }
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

    /// What is wrong with this tick's reading, if anything is.
    fn suspicion(
        &self,
        code: AdcCode,
        raw_ue: f32,
        jumped: bool,
        free_strain: Option<Microstrain>,
        front_end: &FrontEnd,
    ) -> Option<GaugeFault> {
        if code < front_end.gauge_short_below {
            Some(GaugeFault::Short)
        } else if code > front_end.gauge_open_above {
            Some(GaugeFault::Open)
        } else if raw_ue.abs() > front_end.gauge_full_scale.0 {
            Some(GaugeFault::Saturated)
        } else if self.is_stuck(free_strain) {
            Some(GaugeFault::Stuck)
        } else if jumped {
            Some(GaugeFault::Jump)
        } else if self.burst_variance > 2.0 * NOISY_UE * NOISY_UE {
            Some(GaugeFault::Noisy)
        } else {
            None
        }
    }

    /// A tick without a measurement of its own: what the last one was is what this one is.
    fn carry(&self, code: AdcCode, front_end: &FrontEnd, zero_ue: f32) -> Gauge {
        let raw = front_end.strain(code).0;
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

    fn measure_noise(&mut self, strain: f32, gains: &Gains) {
        let Some(last) = self.last_valid else {
            return;
        };
        let difference = strain - last;
        let square = difference * difference;
        if gains.weight > 1.0 {
            let weighted = gains.weight * square;
            self.difference_variance += gains.statistics * (weighted - self.difference_variance);
            let beyond = (difference.abs() - gains.swing_ue).max(0.0);
            self.measure_burst(beyond * beyond, gains);
            return;
        }
        self.difference_variance += gains.statistics * (square - self.difference_variance);
        // White noise of variance σ² has second differences of variance 6σ². Between measurements that are
        // further apart a loss has them too.
        let second = difference - self.last_difference;
        self.last_difference = difference;
        self.jitter_variance += gains.jitter * (second * second - self.jitter_variance);
        self.measure_burst(square, gains);
    }

    fn measure_burst(&mut self, square: f32, gains: &Gains) {
        if self.seen > WARM_UP_TICKS {
            self.burst_variance += gains.burst * (square - self.burst_variance);
        }
    }

    fn watch_for_change(&mut self, code: AdcCode, free_strain: Option<Microstrain>, gain: f32) {
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

    fn is_stuck(&self, free_strain: Option<Microstrain>) -> bool {
        let froze = self.lively > LIVELY && self.unchanged >= STUCK_TICKS;
        let ignored_pressure = match (free_strain, self.free_at_change) {
            (Some(now), Some(then)) => self.unchanged > 0 && (now.0 - then).abs() > STUCK_FREE_UE,
            _ => false,
        };
        froze || ignored_pressure
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FE: FrontEnd = FrontEnd::REFERENCE;

    fn frame(gauges_ue: [f32; 3]) -> RawFrame {
        RawFrame {
            gauges: gauges_ue.map(|ue| AdcCode(FE.gauge_code(Microstrain(ue)) as u16)),
            monitor: AdcCode(FE.monitor_code(Kilopascals(100.0)) as u16),
            supply: AdcCode(FE.supply_code(Volts(24.0)) as u16),
            scans: 10,
            overrun: false,
            carried: false,
        }
    }

    /// One tick without an offset, with what a free finger would show, µε.
    fn step(conditioner: &mut Conditioner, frame: &RawFrame, free_ue: f32) -> Reading {
        let expected = Expected {
            free_strain: Some(Microstrain(free_ue)),
            pressure: None,
        };
        conditioner.step(frame, &FE, [0.0; 3], expected)
    }

    /// Steps until finger 0 fails, at most `ticks`; says after how many and how.
    fn fails(
        conditioner: &mut Conditioner,
        ticks: u32,
        free: impl Fn(u32) -> f32,
        make: impl Fn(u32) -> RawFrame,
    ) -> Option<(u32, GaugeFault)> {
        (0..ticks).find_map(|tick| {
            let reading = step(conditioner, &make(tick), free(tick));
            match reading.gauges[0] {
                Gauge::Failed(fault) => Some((tick + 1, fault)),
                Gauge::Valid(_) | Gauge::Missing => None,
            }
        })
    }

    fn flicker(tick: u32) -> f32 {
        if tick.is_multiple_of(2) { 15.0 } else { -15.0 }
    }

    #[test]
    fn codes_become_strain_pressure_and_supply() {
        let mut conditioner = Conditioner::new();
        let reading = step(&mut conditioner, &frame([1_000.0, -500.0, 0.0]), 0.0);
        for (gauge, expected) in reading.gauges.iter().zip([1_000.0, -500.0, 0.0]) {
            let strain = gauge.strain().expect("a good gauge");
            assert!((strain.0 - expected).abs() < 1.0);
        }
        assert!(matches!(reading.monitor, Monitor::Valid(p) if (p.0 - 100.0).abs() < 0.01));
        assert!(reading.supply.is_some_and(|v| (v.0 - 24.0).abs() < 0.01));
    }

    #[test]
    fn open_and_shorted_gauges_fail_in_three_ticks_and_a_saturated_one_within_20_ms() {
        for (code, expected, ticks) in [
            (AdcCode(65_520), GaugeFault::Open, 3),
            (AdcCode(0), GaugeFault::Short, 3),
            (
                AdcCode(FE.gauge_code(Microstrain(20_500.0)) as u16),
                GaugeFault::Saturated,
                15,
            ),
        ] {
            let mut bad = frame([0.0; 3]);
            bad.gauges[0] = code;
            let found = fails(&mut Conditioner::new(), 20, |_| 0.0, |_| bad);
            assert_eq!(found, Some((ticks, expected)));
        }
    }

    #[test]
    fn a_single_spike_is_missing_and_not_a_fault() {
        let mut conditioner = Conditioner::new();
        for tick in 0..200 {
            let spike = if tick == 150 { 9_000.0 } else { 0.0 };
            let reading = step(
                &mut conditioner,
                &frame([spike + flicker(tick), 0.0, 0.0]),
                0.0,
            );
            match reading.gauges[0] {
                Gauge::Missing => assert_eq!(tick, 150),
                Gauge::Valid(_) => assert_ne!(tick, 150),
                Gauge::Failed(fault) => panic!("{fault:?} at {tick}"),
            }
        }
        let found = fails(
            &mut conditioner,
            20,
            |_| 0.0,
            |_| frame([9_000.0, 0.0, 0.0]),
        );
        assert_eq!(found, Some((3, GaugeFault::Jump)));
    }

    #[test]
    fn a_flickering_gauge_that_freezes_is_stuck_within_20_ms() {
        let mut conditioner = Conditioner::new();
        let found = fails(
            &mut conditioner,
            2_000,
            |_| 0.0,
            |tick| frame([flicker(tick), 0.0, 0.0]),
        );
        assert_eq!(found, None);
        let found = fails(
            &mut conditioner,
            2_000,
            |_| 0.0,
            |_| frame([15.0, 0.0, 0.0]),
        );
        assert!(matches!(found, Some((ticks, GaugeFault::Stuck)) if ticks <= 20));
    }

    #[test]
    fn what_lies_between_measurements_is_neither_stuck_nor_noise_and_a_frozen_measurement_is_stuck()
    {
        let mut conditioner = Conditioner::new();
        // One measurement in ten ticks; two in a row are alike now and then, and so is all between them.
        let slow = |frozen: bool| {
            move |tick: u32| {
                let sample = tick / 10;
                let ue = match frozen || sample % 7 < 2 {
                    true => 15.0,
                    false => flicker(sample),
                };
                RawFrame {
                    carried: !tick.is_multiple_of(10),
                    ..frame([ue, 0.0, 0.0])
                }
            }
        };
        assert_eq!(fails(&mut conditioner, 60_000, |_| 0.0, slow(false)), None);
        // Of the steps of 30 µε that four sevenths of the samples make, times ten.
        let variance = conditioner.noise_variance()[0];
        assert!((1_500.0..4_000.0).contains(&variance), "{variance}");
        let alive = |tick: u32| RawFrame {
            carried: !tick.is_multiple_of(10),
            ..frame([flicker(tick / 10), 0.0, 0.0])
        };
        assert_eq!(fails(&mut conditioner, 60_000, |_| 0.0, alive), None);
        let found = fails(&mut conditioner, 1_000, |_| 0.0, slow(true));
        assert!(
            matches!(found, Some((ticks, GaugeFault::Stuck)) if ticks <= 200),
            "{found:?}"
        );
    }

    #[test]
    fn a_quiet_gauge_is_stuck_only_when_it_ignores_the_pressure() {
        let mut conditioner = Conditioner::new();
        let quiet = |_| frame([0.0; 3]);
        assert_eq!(fails(&mut conditioner, 10_000, |_| 0.0, quiet), None);
        let found = fails(&mut conditioner, 1_000, |tick| tick as f32 * 10.0, quiet);
        assert!(matches!(found, Some((_, GaugeFault::Stuck))));
    }

    #[test]
    fn a_gauge_that_turns_noisy_fails_within_20_ms_and_400_ue_do_not() {
        let normal = |seed: u32, rms: f32| {
            // The sum of twelve uniform numbers has a variance of one.
            let mut random = 0x9e37_79b9u32.wrapping_mul(seed + 1);
            let sum: f32 = (0..12)
                .map(|_| {
                    random ^= random << 13;
                    random ^= random >> 17;
                    random ^= random << 5;
                    random as f32 / u32::MAX as f32
                })
                .sum();
            rms * (sum - 6.0)
        };
        let mut conditioner = Conditioner::new();
        let allowed = |tick| frame([normal(tick, 400.0), 0.0, 0.0]);
        assert_eq!(fails(&mut conditioner, 100_000, |_| 0.0, allowed), None);
        let noisy = |tick| frame([normal(tick, 1_800.0), 0.0, 0.0]);
        let found = fails(&mut conditioner, 100, |_| 0.0, noisy);
        assert!(
            matches!(found, Some((ticks, GaugeFault::Noisy)) if ticks <= 20),
            "{found:?}"
        );
    }

    #[test]
    fn a_monitor_that_drops_faster_than_air_is_lost_until_it_is_back_or_shows_what_it_should() {
        let mut conditioner = Conditioner::new();
        let mut monitor = |kpa: f32, expected_kpa: f32| {
            let mut frame = frame([0.0; 3]);
            frame.monitor = AdcCode(FE.monitor_code(Kilopascals(kpa)) as u16);
            let expected = Expected {
                free_strain: None,
                pressure: Some(Kilopascals(expected_kpa)),
            };
            conditioner.step(&frame, &FE, [0.0; 3], expected).monitor
        };
        assert!(matches!(monitor(140.0, 140.0), Monitor::Valid(_)));
        // A spike of two ticks.
        assert_eq!(monitor(0.0, 140.0), Monitor::Missing);
        assert_eq!(monitor(0.0, 140.0), Monitor::Missing);
        // A hose that bursts at the gripper.
        let mut kpa = 140.0;
        while kpa > 1.0 {
            assert!(matches!(monitor(kpa, 140.0), Monitor::Valid(_)), "{kpa}");
            kpa *= 0.9;
        }
        assert!(matches!(monitor(140.0, 140.0), Monitor::Valid(_)));
        // A wire that comes off, through the filter of the input.
        for (kpa, expected) in [
            (100.0, Monitor::Missing),
            (72.0, Monitor::Missing),
            (51.0, Monitor::Lost),
        ] {
            assert_eq!(monitor(kpa, 140.0), expected);
        }
        assert_eq!(monitor(0.0, 140.0), Monitor::Lost);
        // Once the air has been let out, zero is what it should show.
        assert_eq!(monitor(0.0, 20.0), Monitor::Lost);
        assert!(matches!(monitor(0.0, 3.0), Monitor::Valid(_)));
    }

    #[test]
    fn acknowledging_clears_a_gauge_that_works_again_and_no_other() {
        let open = {
            let mut open = frame([0.0; 3]);
            open.gauges[0] = AdcCode(65_520);
            open
        };
        let mut conditioner = Conditioner::new();
        let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
        assert_eq!(found, Some((3, GaugeFault::Open)));
        // Repaired, it stays failed until somebody has seen it.
        let good = frame([0.0; 3]);
        let reading = step(&mut conditioner, &good, 0.0);
        assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
        conditioner.acknowledge();
        let reading = step(&mut conditioner, &good, 0.0);
        assert!(matches!(reading.gauges[0], Gauge::Valid(_)));
        // Acknowledged while it is still broken, it comes back when it is repaired.
        let found = fails(&mut conditioner, 5, |_| 0.0, |_| open);
        assert_eq!(found, Some((3, GaugeFault::Open)));
        step(&mut conditioner, &open, 0.0);
        conditioner.acknowledge();
        let reading = step(&mut conditioner, &open, 0.0);
        assert_eq!(reading.gauges[0], Gauge::Failed(GaugeFault::Open));
        let reading = step(&mut conditioner, &good, 0.0);
        assert!(matches!(reading.gauges[0], Gauge::Valid(_)));
    }

    #[test]
    fn a_frozen_gauge_is_stuck_in_its_time_however_often_somebody_acknowledges() {
        let mut conditioner = Conditioner::new();
        for tick in 0..2_000 {
            step(&mut conditioner, &frame([flicker(tick), 0.0, 0.0]), 0.0);
        }
        let stuck = (0..20).find(|_| {
            conditioner.acknowledge();
            let reading = step(&mut conditioner, &frame([15.0, 0.0, 0.0]), 0.0);
            reading.gauges[0] == Gauge::Failed(GaugeFault::Stuck)
        });
        assert!(stuck.is_some());
    }

    #[test]
    fn a_stale_or_overrun_frame_gives_nothing() {
        let mut conditioner = Conditioner::new();
        for bad in [
            RawFrame {
                scans: 0,
                ..frame([0.0; 3])
            },
            RawFrame {
                overrun: true,
                ..frame([0.0; 3])
            },
        ] {
            let reading = step(&mut conditioner, &bad, 0.0);
            assert_eq!(reading.gauges, [Gauge::Missing; 3]);
            assert_eq!(reading.monitor, Monitor::Missing);
        }
        let reading = step(&mut conditioner, &frame([0.0; 3]), 0.0);
        assert_eq!(reading.stale_ticks, 0);
    }
}

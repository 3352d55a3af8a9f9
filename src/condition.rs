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
    /// It fell faster than air can leave, so its wire is off; until it is back, or the faults are cleared.
    Lost,
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

/// How a tare went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TareResult {
    /// The offsets are in use.
    Done,
    /// A gauge was missing, failed or further from zero than any bridge's unbalance.
    Rejected,
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
/// Fastest believable fall of the pressure in one tick, as a share: a hose that bursts at the gripper empties
/// it with a time constant of some 10 ms, and a wire that comes off lets the input's 3 ms filter empty.
const MONITOR_FALL: f32 = 0.2;
/// What noise may add to that.
const MONITOR_NOISE_KPA: f32 = 5.0;
/// Averaging time of a tare.
const TARE_TICKS: u32 = 200;
/// Largest offset that a tare accepts, µε: 10 % of full scale.
const TARE_LIMIT_UE: f32 = 2_000.0;
/// Averaging time of noise and liveliness, ms.
const STATISTICS_MS: f32 = 250.0;

#[derive(Debug, Clone, Copy)]
struct Channel {
    offset: f32,
    last_valid: Option<f32>,
    last_code: AdcCode,
    seen: u16,
    unchanged: u16,
    free_at_change: Option<f32>,
    lively: f32,
    difference_variance: f32,
    burst_variance: f32,
    suspect: Option<(GaugeFault, u16)>,
    failed: Option<GaugeFault>,
}

/// The pressure monitor's memory.
#[derive(Debug, Clone, Copy)]
struct MonitorWire {
    last_kpa: Option<f32>,
    fallen_ticks: u16,
}

#[derive(Debug, Clone, Copy)]
struct Tare {
    sum: [f32; FINGERS],
    ticks: u32,
}

/// The state behind the readings: offsets, fault timers, noise.
#[derive(Debug, Clone, Copy)]
pub struct Conditioner {
    channels: [Channel; FINGERS],
    monitor: MonitorWire,
    tare: Option<Tare>,
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
    /// No tare, no faults.
    pub fn new() -> Self {
        let channel = Channel {
            offset: 0.0,
            last_valid: None,
            last_code: AdcCode(0),
            seen: 0,
            unchanged: 0,
            free_at_change: None,
            lively: 0.0,
            difference_variance: 0.0,
            burst_variance: 0.0,
            suspect: None,
            failed: None,
        };
        Self {
            channels: [channel; FINGERS],
            monitor: MonitorWire {
                last_kpa: None,
                fallen_ticks: 0,
            },
            tare: None,
            gains: Gains {
                statistics: lag_gain(STATISTICS_MS),
                burst: lag_gain(BURST_MS),
                weight: 1.0,
                jump_ue: 0.0,
                swing_ue: 0.0,
            },
            stale_ticks: 0,
            spacing: 1.0,
        }
    }

    /// Turns one frame into readings. `free_strain` is what a free finger shows at this moment, once that
    /// is known.
    pub fn step(
        &mut self,
        frame: &RawFrame,
        front_end: &FrontEnd,
        free_strain: Option<Microstrain>,
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
        let channels = self.channels.iter_mut().zip(&frame.gauges);
        if frame.carried {
            self.spacing += 1.0;
            for (gauge, (channel, &code)) in gauges.iter_mut().zip(channels) {
                *gauge = channel.carry(code, front_end);
            }
        } else {
            let gains = self.gains.over(self.spacing);
            self.spacing = 1.0;
            for (gauge, (channel, &code)) in gauges.iter_mut().zip(channels) {
                *gauge = channel.step(code, front_end, free_strain, gains);
            }
        }
        Reading {
            gauges,
            monitor: self.monitor.step(frame.monitor, front_end),
            supply: Some(front_end.supply(frame.supply)),
            stale_ticks: 0,
            overrun: false,
        }
    }

    /// Starts averaging for new offsets.
    pub fn start_tare(&mut self) {
        self.tare = Some(Tare {
            sum: [0.0; FINGERS],
            ticks: 0,
        });
    }

    /// Abandons a running tare; offsets stay.
    pub fn cancel_tare(&mut self) {
        self.tare = None;
    }

    /// Feeds a running tare; says once how it went.
    pub fn tare_step(&mut self, reading: &Reading) -> Option<TareResult> {
        let tare = self.tare.as_mut()?;
        for (sum, gauge) in tare.sum.iter_mut().zip(reading.gauges) {
            match gauge.strain() {
                Some(strain) => *sum += strain.0,
                None => {
                    self.tare = None;
                    return Some(TareResult::Rejected);
                }
            }
        }
        tare.ticks = tare.ticks.saturating_add(1);
        if tare.ticks < TARE_TICKS {
            return None;
        }
        let offsets: [f32; FINGERS] =
            core::array::from_fn(|i| self.channels[i].offset + tare.sum[i] / TARE_TICKS as f32);
        self.tare = None;
        if offsets.iter().any(|offset| offset.abs() > TARE_LIMIT_UE) {
            return Some(TareResult::Rejected);
        }
        for (channel, offset) in self.channels.iter_mut().zip(offsets) {
            channel.offset = offset;
            channel.last_valid = None;
        }
        Some(TareResult::Done)
    }

    /// Forgets latched faults of gauges and monitor; one that persists is found again.
    pub fn clear_faults(&mut self) {
        self.monitor.last_kpa = None;
        self.monitor.fallen_ticks = 0;
        for channel in &mut self.channels {
            channel.failed = None;
            channel.suspect = None;
            channel.last_valid = None;
            channel.unchanged = 0;
            channel.burst_variance = 0.0;
        }
    }

    /// Variance of each gauge's noise, µε², from the differences of successive readings.
    pub fn noise_variance(&self) -> [f32; FINGERS] {
        core::array::from_fn(|i| 0.5 * self.channels[i].difference_variance)
    }
}

impl Default for Conditioner {
    fn default() -> Self {
        Self::new()
    }
}

impl MonitorWire {
    fn step(&mut self, code: AdcCode, front_end: &FrontEnd) -> Monitor {
        if code > front_end.monitor_high_above {
            return Monitor::TooHigh;
        }
        let pressure = front_end.pressure(code);
        let fell = |last| pressure.0 < (1.0 - MONITOR_FALL) * last - MONITOR_NOISE_KPA;
        if self.last_kpa.is_some_and(fell) {
            self.fallen_ticks = self.fallen_ticks.saturating_add(1);
            return if self.fallen_ticks < PERSIST_TICKS {
                Monitor::Missing
            } else {
                Monitor::Lost
            };
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
        free_strain: Option<Microstrain>,
        gains: Gains,
    ) -> Gauge {
        if let Some(fault) = self.failed {
            return Gauge::Failed(fault);
        }
        self.watch_for_change(code, free_strain, gains.statistics);
        let raw = front_end.strain(code).0;
        let strain = raw - self.offset;
        self.seen = self.seen.saturating_add(1);
        let jumped = self.seen > WARM_UP_TICKS
            && self
                .last_valid
                .is_some_and(|last| (strain - last).abs() > JUMP_UE + gains.jump_ue);
        let suspicion = if code < front_end.gauge_short_below {
            Some(GaugeFault::Short)
        } else if code > front_end.gauge_open_above {
            Some(GaugeFault::Open)
        } else if raw.abs() > front_end.gauge_full_scale.0 {
            Some(GaugeFault::Saturated)
        } else if self.is_stuck(free_strain) {
            self.failed = Some(GaugeFault::Stuck);
            return Gauge::Failed(GaugeFault::Stuck);
        } else if jumped {
            Some(GaugeFault::Jump)
        } else if self.burst_variance > 2.0 * NOISY_UE * NOISY_UE {
            Some(GaugeFault::Noisy)
        } else {
            None
        };
        let Some(fault) = suspicion else {
            self.suspect = None;
            self.measure_noise(strain, gains);
            self.last_valid = Some(strain);
            return Gauge::Valid(Microstrain(strain));
        };
        match fault {
            GaugeFault::Noisy => {
                self.measure_noise(strain, gains);
                self.last_valid = Some(strain);
            }
            // A spike must not pass for noise, but spike after spike must.
            GaugeFault::Jump => self.measure_burst(JUMP_UE * JUMP_UE, gains),
            GaugeFault::Open | GaugeFault::Short | GaugeFault::Stuck | GaugeFault::Saturated => {}
        }
        let (fault, ticks) = match self.suspect {
            // Among noise some steps are as large as jumps.
            Some((GaugeFault::Noisy, ticks)) => (GaugeFault::Noisy, ticks.saturating_add(1)),
            Some((_, ticks)) => (fault, ticks.saturating_add(1)),
            None => (fault, 1),
        };
        self.suspect = Some((fault, ticks));
        let clips = fault == GaugeFault::Saturated && !jumped;
        if clips && ticks < CLIP_TICKS {
            self.last_valid = Some(strain);
            return Gauge::Valid(Microstrain(strain));
        }
        if ticks < PERSIST_TICKS {
            return Gauge::Missing;
        }
        self.failed = Some(fault);
        Gauge::Failed(fault)
    }

    /// A tick without a measurement of its own: what the last one was is what this one is.
    fn carry(&self, code: AdcCode, front_end: &FrontEnd) -> Gauge {
        let strain = front_end.strain(code).0 - self.offset;
        let jumped = self
            .last_valid
            .is_some_and(|last| (strain - last).abs() > JUMP_UE);
        match (self.failed, self.suspect) {
            (Some(fault), _) => Gauge::Failed(fault),
            (None, Some((GaugeFault::Saturated, _))) if !jumped => {
                Gauge::Valid(Microstrain(strain))
            }
            (None, Some(_)) => Gauge::Missing,
            (None, None) => Gauge::Valid(Microstrain(strain)),
        }
    }

    fn measure_noise(&mut self, strain: f32, gains: Gains) {
        let Some(last) = self.last_valid else {
            return;
        };
        let square = (strain - last) * (strain - last);
        let weighted = gains.weight * square;
        self.difference_variance += gains.statistics * (weighted - self.difference_variance);
        let beyond = ((strain - last).abs() - gains.swing_ue).max(0.0);
        self.measure_burst(beyond * beyond, gains);
    }

    fn measure_burst(&mut self, square: f32, gains: Gains) {
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

    /// Steps until finger 0 fails, at most `ticks`; says after how many and how.
    fn fails(
        conditioner: &mut Conditioner,
        ticks: u32,
        free: impl Fn(u32) -> f32,
        make: impl Fn(u32) -> RawFrame,
    ) -> Option<(u32, GaugeFault)> {
        (0..ticks).find_map(|tick| {
            let reading = conditioner.step(&make(tick), &FE, Some(Microstrain(free(tick))));
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
        let reading = conditioner.step(&frame([1_000.0, -500.0, 0.0]), &FE, Some(Microstrain(0.0)));
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
            let reading = conditioner.step(
                &frame([spike + flicker(tick), 0.0, 0.0]),
                &FE,
                Some(Microstrain(0.0)),
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
    fn a_monitor_that_drops_faster_than_air_is_lost_until_it_is_back_or_cleared() {
        let mut conditioner = Conditioner::new();
        let mut monitor = |kpa: f32, clear: bool| {
            if clear {
                conditioner.clear_faults();
            }
            let mut frame = frame([0.0; 3]);
            frame.monitor = AdcCode(FE.monitor_code(Kilopascals(kpa)) as u16);
            conditioner.step(&frame, &FE, None).monitor
        };
        assert!(matches!(monitor(140.0, false), Monitor::Valid(_)));
        // A spike of two ticks.
        assert_eq!(monitor(0.0, false), Monitor::Missing);
        assert_eq!(monitor(0.0, false), Monitor::Missing);
        // A hose that bursts at the gripper.
        let mut kpa = 140.0;
        while kpa > 1.0 {
            assert!(matches!(monitor(kpa, false), Monitor::Valid(_)), "{kpa}");
            kpa *= 0.9;
        }
        assert!(matches!(monitor(140.0, false), Monitor::Valid(_)));
        // A wire that comes off, through the filter of the input.
        for (kpa, expected) in [
            (100.0, Monitor::Missing),
            (72.0, Monitor::Missing),
            (51.0, Monitor::Lost),
        ] {
            assert_eq!(monitor(kpa, false), expected);
        }
        assert_eq!(monitor(0.0, false), Monitor::Lost);
        assert!(matches!(monitor(0.0, true), Monitor::Valid(_)));
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
            let reading = conditioner.step(&bad, &FE, Some(Microstrain(0.0)));
            assert_eq!(reading.gauges, [Gauge::Missing; 3]);
            assert_eq!(reading.monitor, Monitor::Missing);
        }
        let reading = conditioner.step(&frame([0.0; 3]), &FE, Some(Microstrain(0.0)));
        assert_eq!(reading.stale_ticks, 0);
    }

    #[test]
    fn a_tare_takes_the_mean_away_and_refuses_a_strained_gauge() {
        let mut conditioner = Conditioner::new();
        let tare = |conditioner: &mut Conditioner, ue: f32| {
            conditioner.start_tare();
            (0..1_000).find_map(|tick| {
                let frame = frame([ue + flicker(tick), -200.0, 0.0]);
                let reading = conditioner.step(&frame, &FE, Some(Microstrain(0.0)));
                conditioner.tare_step(&reading)
            })
        };
        assert_eq!(tare(&mut conditioner, 300.0), Some(TareResult::Done));
        let reading = conditioner.step(&frame([300.0, -200.0, 0.0]), &FE, Some(Microstrain(0.0)));
        for gauge in reading.gauges {
            assert!(gauge.strain().is_some_and(|strain| strain.0.abs() < 1.0));
        }
        assert_eq!(tare(&mut conditioner, 3_000.0), Some(TareResult::Rejected));
    }
}

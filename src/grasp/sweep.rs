//! The free-bend sweep: what the mounted fingers do at each pressure with nothing in the grip.
//!
//! The pressure goes up in steps and waits at each until the fingers rest, and the same way down where they are free. The way up is a finger's curve, the difference of both its hysteresis, and how the strain comes
//! behind the pressure its lags. [`fit`] makes stiffness and gain of each finger of it.

mod fit;

use fit::{Fit, Knee, LEVELS, Level, Progress as Fitting, strain_ue};

use super::situation::Situation;
use crate::air::REACHED_KPA;
use crate::command::SweepFault;
use crate::estimate::{Calibration, loop_share};
use crate::math::larger;
use crate::table::FingerTable;
use crate::units::{FINGERS, Kilopascals, TICK_US};

/// The first is this share of the highest: below, fingers hardly strain, and so large a rise tells the regulator's delay.
const FIRST: f32 = 0.3;
/// Ticks of one mean: ten periods of 50 Hz and twelve of 60 Hz.
const WINDOW_TICKS: u16 = 200;
/// Means at one stop, so that a sweep takes 55 s at the most.
const MOST_WINDOWS: u8 = 11;
/// A gauge with this noise, µε rms, lets no finger rest: after so many means the way there has ended, and this mean goes on
/// to the last. A finger with a lag of 400 ms then seems 56 ms faster, which is what noise would make of it.
const LOUD_UE: f32 = 150.0;
const MOVED_WINDOWS: u8 = 8;
/// The fingers rest when two means differ by less than this share of the table's last free strain.
const RESTS: f32 = 0.000_2;
/// A pressure that ends further from where it should be belongs to a regulator without air, or that leaks.
const OFF_KPA: f32 = 8.0;
/// A gauge with more noise than this, µε rms, tells no loss, and no curve.
const NOISE_UE: f32 = 400.0;
/// Stops at which one has; the estimate of a sound one jumps now and then.
const NOISY_STOPS: u8 = 3;
/// Before they have closed this far, as a share of the highest pressure, no fingers meet: lags are measured up to there.
const BEFORE_MEETING: f32 = 0.5;
/// A way down tells hysteresis where it is at least this share of the loop.
const TURNED: f32 = 0.3;

/// A mean of what has been measured more than once.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f32,
    count: f32,
}

impl Mean {
    fn add(&mut self, value: f32) {
        self.sum += value;
        self.count += 1.0;
    }

    fn value(&self) -> Option<f32> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}

/// What the sweep wants next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Progress {
    /// This pressure.
    At(Kilopascals),
    /// It is over.
    Ended(Result<Calibration, SweepFault>),
}

/// A sweep that is running.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sweep {
    max_kpa: f32,
    /// Where the pressure is, from the first level above rest on; none at rest.
    at: Option<usize>,
    rises: bool,
    windows: u8,
    ticks: u16,
    sums: Level,
    /// The sums are not of one mean alone any more.
    goes_on: bool,
    /// Of the present stop, and of the one before.
    last: Option<Level>,
    before: Level,
    /// Where the fingers have met on their way up.
    knee: Option<Knee>,
    noisy_stops: u8,
    /// Sums of pressure and strain since the stop began, beyond the stop before, …
    area: Level,
    zero_ue: [f32; FINGERS],
    levels: [Level; LEVELS],
    /// Lag of a finger while the pressure rises and while it falls, ticks.
    lag_ticks: [Mean; 2],
    /// Pressures between the ways up and down with the same strain.
    hysteresis_kpa: Mean,
    fit: Option<Fit>,
}

impl Sweep {
    /// At rest, about to go up to this pressure.
    pub fn begins(max: Kilopascals) -> Self {
        Self {
            max_kpa: max.0,
            at: None,
            rises: true,
            windows: 0,
            ticks: 0,
            sums: Level::default(),
            goes_on: false,
            last: None,
            before: Level::default(),
            knee: None,
            noisy_stops: 0,
            area: Level::default(),
            zero_ue: [0.0; FINGERS],
            levels: [Level::default(); LEVELS],
            lag_ticks: [Mean::default(); 2],
            hysteresis_kpa: Mean::default(),
            fit: None,
        }
    }

    /// Takes one tick.
    // Not inlined: a tick of a sweep is no tick of a grip.
    #[inline(never)]
    pub fn step(&mut self, situation: &Situation, table: &FingerTable) -> Progress {
        if let Some(fit) = &mut self.fit {
            return match fit.step(&self.levels, table) {
                Fitting::Goes => Progress::At(Kilopascals(0.0)),
                Fitting::Ended(result) => Progress::Ended(result),
            };
        }
        match self.measure(situation, table) {
            Ok(()) => Progress::At(Kilopascals(self.max_kpa * self.share())),
            Err(fault) => Progress::Ended(Err(fault)),
        }
    }

    /// Where the pressure is to be, as a share of the highest.
    fn share(&self) -> f32 {
        self.at.map_or(0.0, |level| {
            FIRST + (1.0 - FIRST) * level as f32 / (LEVELS - 1) as f32
        })
    }

    fn measure(&mut self, situation: &Situation, table: &FingerTable) -> Result<(), SweepFault> {
        let reading = situation.reading;
        if reading.gauges.iter().any(|gauge| gauge.has_failed()) {
            return Err(SweepFault::Gauge);
        }
        let Some(strain_ue) = reading.strains() else {
            // A spike, or a tick without data: the next one counts.
            return Ok(());
        };
        let Some(pressure) = situation.air.measured else {
            return Ok(());
        };
        if situation.contact.mean.is_none() {
            // Such gauges tell contact alone, and nothing of a free bend.
            return Err(SweepFault::Gauge);
        }
        let moves = match self.goes_on {
            true => 0.0,
            false => 1.0,
        };
        self.sums.kpa += pressure.0;
        self.area.kpa += moves * (pressure.0 - self.before.kpa);
        let sums = self.sums.strain_ue.iter_mut().zip(&mut self.area.strain_ue);
        for ((sum, area), (strain, before)) in
            sums.zip(strain_ue.into_iter().zip(self.before.strain_ue))
        {
            *sum += strain;
            *area += moves * (strain - before);
        }
        self.ticks = self.ticks.saturating_add(1);
        if !self.ticks.is_multiple_of(WINDOW_TICKS) {
            return Ok(());
        }
        let exceeds = |ue: f32| {
            reading
                .noise_variance
                .iter()
                .any(|&variance| variance > ue * ue)
        };
        // While the fingers move, their noise is not known.
        if self.window(table, exceeds(LOUD_UE))? && exceeds(NOISE_UE) {
            self.noisy_stops = self.noisy_stops.saturating_add(1);
        }
        match self.noisy_stops >= NOISY_STOPS {
            true => Err(SweepFault::Noise),
            false => Ok(()),
        }
    }

    /// One mean more; says whether it was the last one of its stop.
    fn window(&mut self, table: &FingerTable, is_loud: bool) -> Result<bool, SweepFault> {
        let share = 1.0 / f32::from(self.ticks);
        let window = Level {
            kpa: share * self.sums.kpa,
            strain_ue: self.sums.strain_ue.map(|sum| share * sum),
        };
        self.windows = self.windows.saturating_add(1);
        let went_on = self.goes_on;
        self.goes_on |= is_loud && self.windows >= MOVED_WINDOWS;
        if !self.goes_on {
            self.sums = Level::default();
            self.ticks = 0;
        }
        let target_kpa = self.max_kpa * self.share();
        let still_ue = FINGERS as f32 * RESTS * strain_ue(table, self.max_kpa);
        let rests = self.last.is_some_and(|last| {
            !went_on
                && (window.sum_ue() - last.sum_ue()).abs() < still_ue
                && (window.kpa - last.kpa).abs() < 0.1 * REACHED_KPA
                && (window.kpa - target_kpa).abs() < REACHED_KPA
        });
        self.last = Some(window);
        if !rests && self.windows < MOST_WINDOWS {
            return Ok(false);
        }
        if (window.kpa - target_kpa).abs() > OFF_KPA {
            return Err(SweepFault::Pressure);
        }
        let ended = self.take(window, table)?;
        self.before = window;
        self.area = Level::default();
        self.sums = Level::default();
        self.ticks = 0;
        self.last = None;
        self.windows = 0;
        self.goes_on = false;
        if ended {
            self.fit = Some(self.found());
        }
        Ok(true)
    }

    /// What the fingers show at a stop, and the way to the next; says whether it was the last one.
    fn take(&mut self, window: Level, table: &FingerTable) -> Result<bool, SweepFault> {
        let Some(index) = self.at else {
            self.zero_ue = window.strain_ue;
            self.at = Some(0);
            return Ok(false);
        };
        let from_rest = index == 0 && self.rises;
        if !from_rest && self.share() <= BEFORE_MEETING {
            self.time(window);
        }
        let mut strain_ue = window.strain_ue;
        for (strain, zero) in strain_ue.iter_mut().zip(self.zero_ue) {
            *strain -= zero;
        }
        let here = Level {
            kpa: window.kpa,
            strain_ue,
        };
        if !self.rises {
            self.add_way_down(index, here, table);
            self.at = index.checked_sub(1);
            return Ok(self.at.is_none());
        }
        if let Some(level) = self.levels.get_mut(index) {
            *level = here;
        }
        if self.knee.is_none() {
            let so_far = self.levels.get(..=index).unwrap_or(&self.levels);
            self.knee = Knee::of(so_far, table)?;
        }
        let next = index.saturating_add(1);
        self.rises = next < LEVELS;
        self.at = match self.rises {
            true => Some(next),
            // What they do on their way down is of interest where they are free.
            false => self.knee.map_or(index, |knee| knee.free).checked_sub(1),
        };
        Ok(self.at.is_none())
    }

    /// What the fingers show on their way down, against what they did on their way up.
    fn add_way_down(&mut self, index: usize, here: Level, table: &FingerTable) {
        let Some(level) = self.levels.get(index) else {
            return;
        };
        let kpa = level.kpa;
        let share = loop_share(self.top_kpa() - kpa, table.max_pressure_kpa);
        // Strain per pressure as the table has it, and as much more as these fingers strain.
        let at = |kpa: f32| strain_ue(table, kpa);
        let middle_ue = 0.5 * (level.sum_ue() + here.sum_ue());
        let per_kpa = 0.5 * (at(kpa + 1.0) - at(kpa - 1.0)) * middle_ue / larger(at(kpa), 1.0);
        if share >= TURNED && per_kpa > 0.0 {
            let wider_kpa = (here.sum_ue() - level.sum_ue()) / per_kpa + level.kpa - here.kpa;
            self.hysteresis_kpa.add(wider_kpa / share);
        }
    }

    /// Highest pressure so far, kPa.
    fn top_kpa(&self) -> f32 {
        self.levels
            .iter()
            .fold(0.0, |top, level| larger(top, level.kpa))
    }

    /// All has been seen.
    fn found(&mut self) -> Fit {
        let hysteresis_kpa = larger(0.0, self.hysteresis_kpa.value().unwrap_or(0.0));
        for level in &mut self.levels {
            // A way up from rest comes half a loop behind the middle of it, which the table means.
            level.kpa -= 0.5 * hysteresis_kpa;
        }
        let lags_ms = self.lag_ticks.map(|lag| {
            let ticks = lag.value().unwrap_or(0.0);
            ticks * (TICK_US as f32 * 1e-3)
        });
        Fit::of(self.knee, hysteresis_kpa, lags_ms)
    }

    /// How far the strain came behind the pressure on the way to this stop: the area between both, each as a share of
    /// its step (Åström and Hägglund, Advanced PID Control, 2006, chapter 2: average residence time).
    fn time(&mut self, window: Level) {
        let pressure_kpa = window.kpa - self.before.kpa;
        let strain_ue = window.sum_ue() - self.before.sum_ue();
        if pressure_kpa.abs() < REACHED_KPA || strain_ue * pressure_kpa <= 0.0 {
            return;
        }
        let ticks = self.area.kpa / pressure_kpa - self.area.sum_ue() / strain_ue;
        let [up, down] = &mut self.lag_ticks;
        match self.rises {
            true => up.add(ticks),
            false => down.add(ticks),
        }
    }
}

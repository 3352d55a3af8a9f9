//! The free-bend sweep: what the mounted fingers do at each pressure with nothing in the grip.
//!
//! The pressure goes up and down in steps and waits at each until the fingers rest. The mean of both ways is a finger's
//! curve, their difference its hysteresis, and how the strain comes behind the pressure its lags. Fingers that meet leave
//! their curves together; what they do before tells stiffness and gain of each ([`fit`]), and where they meet is
//! learned, too.

mod fit;

use fit::{Fit, Progress as Fitting};

use super::Situation;
use crate::air::{FOLLOWING_KPA, REACHED_KPA};
use crate::command::SweepFault;
use crate::condition::Gauge;
use crate::estimate::Calibration;
use crate::table::{self, FingerTable};
use crate::units::{FINGERS, Kilopascals, TICK_US};

/// Pressures of the sweep beside zero.
const LEVELS: usize = 12;
/// The first is this share of the highest: below, fingers hardly strain, and so large a rise tells the regulator's delay.
const FIRST: f32 = 0.3;
/// The way up, the way down, and rest at both ends.
const STOPS: u8 = 2 * LEVELS as u8 + 1;
/// Ticks of one mean: ten periods of 50 Hz and twelve of 60 Hz.
const WINDOW_TICKS: u16 = 200;
/// Means at one stop, so that a sweep takes 55 s at the most.
const MOST_WINDOWS: u8 = 11;
/// The fingers rest when two means differ by less than this share of the table's last free strain.
const RESTS: f32 = 0.001;
/// A gauge with more noise than this, µε rms, tells no loss, and no curve.
const NOISE_UE: f32 = 400.0;
/// Before they have closed this far, as a share of the highest pressure, no fingers meet: lags are measured up to there, …
const BEFORE_MEETING: f32 = 0.5;
/// … and hysteresis on a way down that began this share above.
const TURNED: f32 = 0.5;

/// Means over one window.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    kpa: f32,
    strain_ue: [f32; FINGERS],
}

impl Window {
    fn sum_ue(&self) -> f32 {
        self.strain_ue.iter().sum()
    }
}

/// One pressure, and what the fingers show there: the mean of both ways.
#[derive(Debug, Clone, Copy, Default)]
struct Level {
    kpa: f32,
    strain_ue: [f32; FINGERS],
}

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
    stop: u8,
    windows: u8,
    ticks: u16,
    sums: Window,
    /// Of the present stop, and of the one before.
    last: Option<Window>,
    before: Window,
    /// Sums of pressure and strain since the stop began, beyond the stop before, …
    area: Window,
    area_ticks: f32,
    zero_ue: [f32; FINGERS],
    levels: [Level; LEVELS],
    /// Lag of a finger while the pressure rises and while it falls, ticks.
    lag_ticks: [Mean; 2],
    /// Pressures between the ways up and down with the same strain.
    hysteresis_kpa: Mean,
    fit: Option<Fit>,
}

/// Pressure of a stop, as a share of the highest, and the level's number.
fn stop_at(stop: u8) -> (f32, Option<usize>) {
    let stop = usize::from(stop);
    let level = match stop <= LEVELS {
        true => stop,
        false => (2 * LEVELS).saturating_sub(stop),
    };
    match level.checked_sub(1) {
        Some(level) => {
            let share = FIRST + (1.0 - FIRST) * level as f32 / (LEVELS - 1) as f32;
            (share, Some(level))
        }
        None => (0.0, None),
    }
}

impl Sweep {
    /// At rest, about to go up to this pressure.
    pub fn begins(max: Kilopascals) -> Self {
        Self {
            max_kpa: max.0,
            stop: 0,
            windows: 0,
            ticks: 0,
            sums: Window::default(),
            last: None,
            before: Window::default(),
            area: Window::default(),
            area_ticks: 0.0,
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
            Ok(()) => Progress::At(Kilopascals(self.max_kpa * stop_at(self.stop).0)),
            Err(fault) => Progress::Ended(Err(fault)),
        }
    }

    fn measure(&mut self, situation: &Situation, table: &FingerTable) -> Result<(), SweepFault> {
        let reading = situation.reading;
        if reading.gauges.iter().any(|gauge| gauge.has_failed()) {
            return Err(SweepFault::Gauge);
        }
        let [Some(a), Some(b), Some(c)] = reading.gauges.map(Gauge::strain) else {
            // A spike, or a tick without data: the next one counts.
            return Ok(());
        };
        let Some(pressure) = situation.air.measured else {
            return Ok(());
        };
        let strain_ue = [a.0, b.0, c.0];
        self.sums.kpa += pressure.0;
        self.area.kpa += pressure.0 - self.before.kpa;
        let sums = self.sums.strain_ue.iter_mut().zip(&mut self.area.strain_ue);
        for ((sum, area), (strain, before)) in
            sums.zip(strain_ue.into_iter().zip(self.before.strain_ue))
        {
            *sum += strain;
            *area += strain - before;
        }
        self.area_ticks += 1.0;
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks < WINDOW_TICKS {
            return Ok(());
        }
        if reading.noise_variance.iter().any(|&v| v > NOISE_UE * NOISE_UE) {
            return Err(SweepFault::Noise);
        }
        self.window(table)
    }

    /// One mean more; the last one at a stop ends it.
    fn window(&mut self, table: &FingerTable) -> Result<(), SweepFault> {
        let share = 1.0 / f32::from(WINDOW_TICKS);
        let window = Window {
            kpa: share * self.sums.kpa,
            strain_ue: self.sums.strain_ue.map(|sum| share * sum),
        };
        self.sums = Window::default();
        self.ticks = 0;
        self.windows = self.windows.saturating_add(1);
        let target_kpa = self.max_kpa * stop_at(self.stop).0;
        let still_ue = FINGERS as f32 * RESTS * table::free_strain(table, Kilopascals(self.max_kpa)).0.0;
        let rests = self.last.is_some_and(|last| {
            (window.sum_ue() - last.sum_ue()).abs() < still_ue
                && (window.kpa - last.kpa).abs() < 0.1 * REACHED_KPA
                && (window.kpa - target_kpa).abs() < REACHED_KPA
        });
        self.last = Some(window);
        if !rests && self.windows < MOST_WINDOWS {
            return Ok(());
        }
        if (window.kpa - target_kpa).abs() > FOLLOWING_KPA {
            return Err(SweepFault::Pressure);
        }
        self.take(window, table);
        self.before = window;
        self.area = Window::default();
        self.area_ticks = 0.0;
        self.last = None;
        self.windows = 0;
        self.stop = self.stop.saturating_add(1);
        if self.stop >= STOPS {
            let hysteresis_kpa = self.hysteresis_kpa.value().unwrap_or(0.0);
            let lags_ms = self.lag_ticks.map(|lag| {
                let ticks = lag.value().unwrap_or(0.0);
                ticks * (TICK_US as f32 * 1e-3)
            });
            self.fit = Some(Fit::of(&self.levels, hysteresis_kpa, lags_ms, table)?);
        }
        Ok(())
    }

    /// What the fingers show at a stop.
    fn take(&mut self, window: Window, table: &FingerTable) {
        let (share, level) = stop_at(self.stop);
        let Some(index) = level else {
            if self.stop == 0 {
                self.zero_ue = window.strain_ue;
            }
            return;
        };
        let rises = usize::from(self.stop) <= LEVELS;
        if self.stop > 1 && share <= BEFORE_MEETING {
            self.time(window, rises);
        }
        let Some(level) = self.levels.get_mut(index) else {
            return;
        };
        let mut strain_ue = window.strain_ue;
        for (strain, zero) in strain_ue.iter_mut().zip(self.zero_ue) {
            *strain -= zero;
        }
        if rises {
            *level = Level {
                kpa: window.kpa,
                strain_ue,
            };
            return;
        }
        let (mut wider_ue, mut slope) = (0.0, 0.0);
        for (mean, strain) in level.strain_ue.iter_mut().zip(strain_ue) {
            wider_ue += strain - *mean;
            *mean = 0.5 * (*mean + strain);
            slope += *mean;
        }
        let fell_kpa = level.kpa - window.kpa;
        level.kpa = 0.5 * (level.kpa + window.kpa);
        if share <= 1.0 - TURNED {
            // Strain per pressure as the table has it, and as much more as these fingers strain.
            let at = |kpa: f32| table::free_strain(table, Kilopascals(kpa)).0.0;
            let per_kpa = (at(level.kpa + 1.0) - at(level.kpa - 1.0)) / 2.0;
            let per_kpa = per_kpa * slope / at(level.kpa).max(1.0);
            if per_kpa > 0.0 {
                self.hysteresis_kpa.add(wider_ue / per_kpa + fell_kpa);
            }
        }
    }

    /// How far the strain came behind the pressure on the way to this stop: the area between both, each as a share of
    /// its step (Åström and Hägglund, Advanced PID Control, 2006, chapter 2: average residence time).
    fn time(&mut self, window: Window, rises: bool) {
        let pressure_kpa = window.kpa - self.before.kpa;
        let strain_ue = window.sum_ue() - self.before.sum_ue();
        if pressure_kpa.abs() < REACHED_KPA || strain_ue * pressure_kpa <= 0.0 {
            return;
        }
        let ticks = self.area.kpa / pressure_kpa - self.area.sum_ue() / strain_ue;
        let [up, down] = &mut self.lag_ticks;
        match rises {
            true => up.add(ticks),
            false => down.add(ticks),
        }
    }
}

//! Zero of each gauge: the tare on command, and tracking of slow drift while the fingers are surely free.
//!
//! Drift of the zero is the most common complaint about strain-gauge amplifiers, and a zero that has
//! wandered by the contact threshold turns an empty close into a hold. So the zero follows the gauge
//! while the gripper rests open, without pressure and without contact: no faster than 100 µε/s, and by no
//! more than 1000 µε since the last tare. Beyond that a tare is asked for.

use crate::command::TareFault;
use crate::condition::{Monitor, Reading};
use crate::estimate::{Contact, OPEN_KPA};
use crate::units::{FINGERS, Microstrain, TICK_US};

/// Length of a tare, ticks: ten periods of 50 Hz and twelve of 60 Hz, so that hum averages out.
const TARE_TICKS: u16 = 200;
/// Largest offset that a tare accepts, µε: 10 % of full scale, more than the unbalance of any bridge.
const TARE_LIMIT_UE: f32 = 2_000.0;
/// Noise, µε rms, up to which a tare is accepted: what the detector is specified for.
const TARE_NOISE_UE: f32 = 400.0;
/// Difference between the halves of a tare that is accepted as steady, µε, beyond what noise explains:
/// 6 % of the contact threshold.
const TARE_DRIFT_UE: f32 = 30.0;
/// Standard deviations of that difference that noise is granted.
const TARE_SIGMAS: f32 = 4.0;
/// The fingers count as settled after this time at rest, ticks: five time constants of their swing.
const SETTLED_TICKS: u16 = 300;
/// Fastest drift that is followed, µε/s. A warming amplifier drifts by some 20.
const RATE_UE_PER_S: f32 = 100.0;
/// Largest drift that is followed, µε: half of what a tare may take away.
const TRACKED_UE: f32 = 1_000.0;
/// Averaging of the strain at rest, ms: 400 µε of noise move the zero by 9 µε.
const TRACKING_MS: f32 = 1_000.0;
/// A contact that lasts this long at rest is as likely a zero that has moved under pressure, ticks.
const LEANING_TICKS: u16 = 10_000;

/// How a tare ended.
pub type TareResult = Result<(), TareFault>;

/// What has become of the zero in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ZeroReport {
    /// How a tare ended in this tick.
    pub tare: Option<TareResult>,
    /// A tare is running.
    pub taring: bool,
    /// The zero is no longer known, so a tare is asked for.
    pub tare_due: bool,
}

/// The zero of one gauge.
#[derive(Debug, Clone, Copy)]
struct Offset {
    /// What the last tare measured, µε.
    tared_ue: f32,
    /// What tracking has added since, µε.
    drift_ue: f32,
    /// Raw strain of the finger at rest, µε, as it was first seen or last tared, with the drift since.
    rest_ue: f32,
}

/// One gauge in a tare. Strains count from the first one, which keeps the sums small.
#[derive(Debug, Clone, Copy, Default)]
struct Course {
    first_ue: f32,
    early: Half,
    late: Half,
}

/// Sums of one half of a tare.
#[derive(Debug, Clone, Copy, Default)]
struct Half {
    sum: f32,
    squares: f32,
}

/// A tare that is running.
#[derive(Debug, Clone, Copy, Default)]
struct Tare {
    courses: [Course; FINGERS],
    ticks: u16,
}

/// The zero of every gauge.
#[derive(Debug, Clone, Copy)]
pub struct Zero {
    offsets: [Offset; FINGERS],
    tare: Option<Tare>,
    rest_ticks: u16,
    /// Ticks behind each `rest_ue`, up to `TARE_TICKS`.
    learned_ticks: u16,
    leaning_ticks: u16,
    /// A gauge has drifted as far as is tracked.
    used_up: bool,
}

impl Zero {
    /// As an earlier tare has measured it.
    pub fn starting_at(tare_ue: [f32; FINGERS]) -> Self {
        Self {
            offsets: tare_ue.map(|tared_ue| Offset {
                tared_ue,
                drift_ue: 0.0,
                rest_ue: tared_ue,
            }),
            tare: None,
            rest_ticks: 0,
            learned_ticks: 0,
            leaning_ticks: 0,
            used_up: false,
        }
    }

    /// What the last tare measured, for a start from there.
    pub fn tare_ue(&self) -> [f32; FINGERS] {
        self.offsets.map(|offset| offset.tared_ue)
    }

    /// What is to be subtracted from the raw strain of each gauge, µε.
    pub fn offsets_ue(&self) -> [f32; FINGERS] {
        self.offsets.map(|offset| offset.tared_ue + offset.drift_ue)
    }

    /// What tracking has added since the last tare.
    pub fn drift(&self) -> [Microstrain; FINGERS] {
        self.offsets.map(|offset| Microstrain(offset.drift_ue))
    }

    /// Tracking is used up, or a finger has leaned on something, or seems to, for long: the zero is no
    /// longer known.
    fn tare_is_due(&self) -> bool {
        self.used_up || self.leaning_ticks >= LEANING_TICKS
    }

    /// One tick: tracks the zero, or feeds a running tare and says once how it ended. `idle`: the gripper
    /// is open and nothing is asked of it; `start`: a tare begins.
    pub fn step(
        &mut self,
        reading: &Reading,
        contact: &Contact,
        idle: bool,
        start: bool,
        contact_ue: f32,
    ) -> ZeroReport {
        if start {
            self.tare = Some(Tare::default());
        }
        let tare = self.advance(reading, contact, idle, contact_ue);
        ZeroReport {
            tare,
            taring: self.tare.is_some(),
            tare_due: self.tare_is_due(),
        }
    }

    fn advance(
        &mut self,
        reading: &Reading,
        contact: &Contact,
        idle: bool,
        contact_ue: f32,
    ) -> Option<TareResult> {
        if !idle && self.tare.is_none() {
            self.rest_ticks = 0;
            self.leaning_ticks = 0;
            return None;
        }
        let open = matches!(reading.monitor, Monitor::Valid(pressure) if pressure.0 < OPEN_KPA);
        if self.tare.is_some() {
            return self.tare_step(reading, idle, open, contact_ue);
        }
        // A tick without data is no news.
        if matches!(reading.monitor, Monitor::Missing) {
            return None;
        }
        if !open {
            self.rest_ticks = 0;
            self.leaning_ticks = 0;
            return None;
        }
        self.rest_ticks = self.rest_ticks.saturating_add(1);
        if self.rest_ticks >= SETTLED_TICKS {
            self.track(reading, contact);
        }
        None
    }

    #[inline(never)]
    fn track(&mut self, reading: &Reading, contact: &Contact) {
        self.leaning_ticks = match contact.touching_count() {
            0 => 0,
            _ => self.leaning_ticks.saturating_add(1),
        };
        const TICK_MS: f32 = TICK_US as f32 * 1e-3;
        const MOST_UE: f32 = RATE_UE_PER_S * TICK_MS * 1e-3;
        let learning = self.learned_ticks < TARE_TICKS;
        if learning {
            self.learned_ticks = self.learned_ticks.saturating_add(1);
        }
        let share = 1.0 / f32::from(self.learned_ticks.max(1));
        let fingers = reading.gauges.iter().zip(contact.touching);
        for (offset, (gauge, touching)) in self.offsets.iter_mut().zip(fingers) {
            let Some(strain) = gauge.strain() else {
                continue;
            };
            if learning {
                let raw = strain.0 + offset.tared_ue + offset.drift_ue;
                offset.rest_ue += share * (raw - offset.rest_ue);
            }
            if touching {
                continue;
            }
            let step = (strain.0 * (TICK_MS / TRACKING_MS)).clamp(-MOST_UE, MOST_UE);
            let drift = (offset.drift_ue + step).clamp(-TRACKED_UE, TRACKED_UE);
            if !learning {
                offset.rest_ue += drift - offset.drift_ue;
            }
            offset.drift_ue = drift;
            self.used_up |= drift.abs() >= TRACKED_UE;
        }
    }

    #[inline(never)]
    fn tare_step(
        &mut self,
        reading: &Reading,
        idle: bool,
        open: bool,
        contact_ue: f32,
    ) -> Option<TareResult> {
        let mut tare = self.tare.take()?;
        if !idle {
            return Some(Err(TareFault::Interrupted));
        }
        if reading.gauges.iter().any(|gauge| gauge.has_failed()) {
            return Some(Err(TareFault::Gauge));
        }
        let Some(strain_ue) = reading.strains() else {
            // A spike, or a tick without data: the next one counts.
            self.tare = Some(tare);
            return None;
        };
        if !open {
            return Some(Err(TareFault::Pressure));
        }
        if !tare.add(strain_ue) {
            self.tare = Some(tare);
            return None;
        }
        Some(self.finish(&tare, contact_ue))
    }

    fn finish(&mut self, tare: &Tare, contact_ue: f32) -> TareResult {
        let mut measured = [0.0; FINGERS];
        let due = self.tare_is_due();
        let courses = self.offsets.iter().zip(&tare.courses);
        for (measured, (offset, course)) in measured.iter_mut().zip(courses) {
            let (mean, drift, variance) = course.statistics();
            if variance > TARE_NOISE_UE * TARE_NOISE_UE {
                return Err(TareFault::Noise);
            }
            // Compared squared: no root is needed. Each half's mean has the variance σ²/100.
            let beyond = drift.abs() - TARE_DRIFT_UE;
            let noise = TARE_SIGMAS * TARE_SIGMAS * 4.0 / f32::from(TARE_TICKS) * variance;
            if beyond > 0.0 && beyond * beyond > noise {
                return Err(TareFault::Drift);
            }
            *measured = offset.tared_ue + offset.drift_ue + mean;
            if measured.abs() > TARE_LIMIT_UE {
                return Err(TareFault::OutOfRange);
            }
            // Something in the grip bends a finger back, below the zero that it had at rest.
            let pressed = offset.rest_ue - *measured > contact_ue;
            if pressed && !due && self.learned_ticks >= TARE_TICKS {
                return Err(TareFault::Contact);
            }
        }
        for (offset, measured) in self.offsets.iter_mut().zip(measured) {
            *offset = Offset {
                tared_ue: measured,
                drift_ue: 0.0,
                rest_ue: measured,
            };
        }
        self.learned_ticks = TARE_TICKS;
        self.leaning_ticks = 0;
        self.used_up = false;
        Ok(())
    }
}

impl Tare {
    /// Takes one tick's strains, µε; says whether that was the last one.
    fn add(&mut self, strain_ue: [f32; FINGERS]) -> bool {
        let is_first = self.ticks == 0;
        let is_early = self.ticks < TARE_TICKS / 2;
        for (course, strain_ue) in self.courses.iter_mut().zip(strain_ue) {
            if is_first {
                course.first_ue = strain_ue;
            }
            let strain = strain_ue - course.first_ue;
            let half = match is_early {
                true => &mut course.early,
                false => &mut course.late,
            };
            half.sum += strain;
            half.squares += strain * strain;
        }
        self.ticks = self.ticks.saturating_add(1);
        self.ticks >= TARE_TICKS
    }
}

impl Course {
    /// Mean, difference of the halves' means, and variance about them.
    fn statistics(&self) -> (f32, f32, f32) {
        const N: f32 = (TARE_TICKS / 2) as f32;
        let (early, late) = (self.early.sum / N, self.late.sum / N);
        let squares = (self.early.squares + self.late.squares) / N;
        let variance = 0.5 * (squares - early * early - late * late);
        let mean = self.first_ue + 0.5 * (early + late);
        (mean, late - early, variance.max(0.0))
    }
}

impl Default for Zero {
    fn default() -> Self {
        Self::starting_at([0.0; FINGERS])
    }
}

#[cfg(test)]
mod tests;

//! Readings → contact: what the fingers feel beyond their free bending.
//!
//! The contact residual is `r = ε_free(p) − ε`: zero on approach, a ramp while closing, a plateau
//! while holding, near zero after a loss or a release. The raw strain is no use for that: when an
//! object falls at held pressure it dips and then rises, because the finger is free to bend further.

use crate::condition::{Gauge, Monitor, Reading};
use crate::math::lag_gain;
use crate::range::{SettingsError, within};
use crate::table::{self, FingerTable, Range};
use crate::units::{Degrees, FINGERS, Kilopascals, Microstrain, TICK_US};

/// What the gauges see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GaugeSense {
    /// Bending: strain follows the finger's curvature, contact takes some of it away.
    Bend,
    /// Contact alone: no strain while the finger bends freely, as in the paper's figures 25–28.
    Contact,
}

/// What is known of the fingers beyond their table, and what counts as contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time constant of a finger's inflation, pressure to joint torque.
    pub inflation_lag_ms: f32,
    /// Natural frequency of a finger's bending, joint torque to curvature.
    pub bending_hz: f32,
    /// Damping ratio of a finger's bending.
    pub bending_damping: f32,
    /// What the gauges see.
    pub gauge_sense: GaugeSense,
    /// Measured free-bend strain over the table's, per finger: the result of a calibration.
    pub free_bend_gain: [f32; FINGERS],
    /// A finger touches when its residual exceeds this …
    pub contact_ue: f32,
    /// … plus this share of the free-bend strain, which the table may be wrong by.
    pub contact_percent: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            // Fitted to free closes and openings of the simulated finger: 0.003 rad at worst, where
            // two first-order lags leave 0.04.
            inflation_lag_ms: 80.0,
            bending_hz: 5.9,
            bending_damping: 0.45,
            gauge_sense: GaugeSense::Bend,
            free_bend_gain: [1.0; FINGERS],
            contact_ue: 500.0,
            contact_percent: 5.0,
        }
    }
}

impl Settings {
    pub(crate) fn validate(&self) -> Result<Active, SettingsError> {
        let inflation_lag_ms = within("inflation_lag_ms", self.inflation_lag_ms, 1.0, 1_000.0)?;
        let bending_hz = within("bending_hz", self.bending_hz, 0.1, 50.0)?;
        let damping = within("bending_damping", self.bending_damping, 0.1, 2.0)?;
        let [a, b, c] = self.free_bend_gain;
        let omega_dt = core::f32::consts::TAU * bending_hz * TICK_US as f32 * 1e-6;
        Ok(Active {
            inflation_gain: lag_gain(inflation_lag_ms),
            bending: [omega_dt * omega_dt, 2.0 * damping * omega_dt],
            gauge_sense: self.gauge_sense,
            free_bend_gain: [
                within("free_bend_gain[0]", a, 0.5, 2.0)?,
                within("free_bend_gain[1]", b, 0.5, 2.0)?,
                within("free_bend_gain[2]", c, 0.5, 2.0)?,
            ],
            contact_ue: within("contact_ue", self.contact_ue, 1.0, 20_000.0)?,
            contact_fraction: 0.01 * within("contact_percent", self.contact_percent, 0.0, 50.0)?,
        })
    }
}

/// The settings in the form that the control tick uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) inflation_gain: f32,
    /// `(ω dt)²` and `2 ζ ω dt` of the bending.
    pub(crate) bending: [f32; 2],
    pub(crate) gauge_sense: GaugeSense,
    pub(crate) free_bend_gain: [f32; FINGERS],
    pub(crate) contact_ue: f32,
    pub(crate) contact_fraction: f32,
}

/// What the fingers feel in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Contact residual of each finger whose gauge was usable.
    pub residual: [Option<Microstrain>; FINGERS],
    /// Fingers that touch something.
    pub touching: [bool; FINGERS],
    /// What the gauge of a free finger would show.
    pub free: Microstrain,
    /// Bend: angle of a free finger's last link at the mean measured strain.
    pub bend: Degrees,
    /// Whether the pressure was inside the table.
    pub range: Range,
    /// The pressure has been known for so long that the finger's shape is, too.
    pub known: bool,
}

impl Contact {
    /// Fingers that touch something.
    pub fn touching_count(&self) -> usize {
        count(self.touching)
    }

    /// Fingers whose gauge was usable.
    pub fn usable_count(&self) -> usize {
        count(self.residual.map(|residual| residual.is_some()))
    }
}

/// How many of the fingers. `Iterator::count` brings a panic for more than a `usize` can count.
fn count(fingers: [bool; FINGERS]) -> usize {
    fingers
        .into_iter()
        .fold(0, |sum: usize, finger| sum.saturating_add(finger.into()))
}

/// Below this the fingers are open: the monitor's own error is ±2 kPa and the finger moves by less
/// than half a degree.
pub(crate) const OPEN_KPA: f32 = 6.0;
/// Contact, once made, is kept down to this share of its threshold.
const RELEASE_SHARE: f32 = 0.6;
/// Contact must come or go for this long: longer than a spike, shorter than anything that matters.
const DEBOUNCE_TICKS: u8 = 5;

/// The pressure may be unknown for this long before the shape that follows it is: a quarter of its lag.
const BLIND_TICKS: u16 = 20;
/// The shape has then to be waited for: five time constants of the finger's lag.
const KNOWN_AFTER_TICKS: u16 = 500;

/// The finger behind the pressure: the air's first-order lag, then the finger's swing.
#[derive(Debug, Clone, Copy)]
struct Lag {
    inflated_kpa: f32,
    bent_kpa: f32,
    rate_kpa: f32,
}

impl Lag {
    fn step(&mut self, pressure: Kilopascals, active: &Active) {
        self.inflated_kpa += active.inflation_gain * (pressure.0 - self.inflated_kpa);
        // Semi-implicit Euler: stable up to ω dt = 2, and the settings end at 0.3.
        let [stiffness, damping] = active.bending;
        self.rate_kpa += stiffness * (self.inflated_kpa - self.bent_kpa) - damping * self.rate_kpa;
        self.bent_kpa += self.rate_kpa;
    }
}

/// Whether one finger touches, debounced.
#[derive(Debug, Clone, Copy, Default)]
struct Touch {
    touching: bool,
    against: u8,
}

impl Touch {
    fn step(&mut self, residual: f32, threshold: f32) {
        let level = if self.touching {
            RELEASE_SHARE * threshold
        } else {
            threshold
        };
        if (residual > level) == self.touching {
            self.against = 0;
            return;
        }
        self.against = self.against.saturating_add(1);
        if self.against >= DEBOUNCE_TICKS {
            self.touching = !self.touching;
            self.against = 0;
        }
    }
}

/// The finger's lag behind the pressure, and the touch of each finger.
#[derive(Debug, Clone, Copy)]
pub struct Estimator {
    /// Unknown before the first measurement.
    lag: Option<Lag>,
    blind_ticks: u16,
    unknown_ticks: u16,
    touches: [Touch; FINGERS],
    bend: Degrees,
    /// What the gauge of a free finger shows; unknown before the first pressure.
    free: Option<Microstrain>,
}

impl Estimator {
    /// Fingers at rest at the first pressure that will be measured.
    pub fn new() -> Self {
        Self {
            lag: None,
            blind_ticks: 0,
            unknown_ticks: 0,
            touches: [Touch::default(); FINGERS],
            bend: Degrees(0.0),
            free: None,
        }
    }

    /// The pressure that the finger's shape has followed so far.
    pub fn lagged_pressure(&self) -> Kilopascals {
        Kilopascals(self.lag.map_or(0.0, |lag| lag.bent_kpa))
    }

    /// What the gauge of a free finger should show now; unknown before the first pressure.
    pub fn free_strain(&self) -> Option<Microstrain> {
        self.free
    }

    /// Estimates contact from one tick's readings.
    pub fn step(&mut self, reading: &Reading, table: &FingerTable, active: &Active) -> Contact {
        if let Monitor::Valid(pressure) = reading.monitor {
            let lag = self.lag.get_or_insert(Lag {
                inflated_kpa: pressure.0,
                bent_kpa: pressure.0,
                rate_kpa: 0.0,
            });
            lag.step(pressure, active);
            self.unknown_ticks = match core::mem::take(&mut self.blind_ticks) {
                BLIND_TICKS.. => KNOWN_AFTER_TICKS,
                _ => self.unknown_ticks.saturating_sub(1),
            };
        } else {
            self.blind_ticks = self.blind_ticks.saturating_add(1);
        }
        let pressure = self.lagged_pressure();
        let (free, range) = table::free_strain(table, pressure);
        self.free = self.lag.map(|_| match active.gauge_sense {
            GaugeSense::Bend => free,
            GaugeSense::Contact => Microstrain(0.0),
        });
        let threshold = active.contact_ue + active.contact_fraction * free.0;

        let mut residual = [None; FINGERS];
        let (mut strain_sum, mut strains) = (0.0, 0.0);
        let fingers = reading.gauges.iter().zip(active.free_bend_gain);
        let results = residual.iter_mut().zip(&mut self.touches);
        for ((gauge, gain), (slot, touch)) in fingers.zip(results) {
            let strain = match *gauge {
                Gauge::Valid(strain) => strain,
                Gauge::Missing => continue,
                // What has failed feels nothing: a finger must not be taken to touch for ever.
                Gauge::Failed(_) => {
                    *touch = Touch::default();
                    continue;
                }
            };
            let value = match active.gauge_sense {
                GaugeSense::Bend => gain * free.0 - strain.0,
                GaugeSense::Contact => strain.0,
            };
            *slot = Some(Microstrain(value));
            touch.step(value, threshold);
            strain_sum += strain.0 / gain;
            strains += 1.0;
        }
        if strains > 0.0 && active.gauge_sense == GaugeSense::Bend {
            let (pressure, _) =
                table::pressure_for_strain(table, Microstrain(strain_sum / strains));
            self.bend = table::bend(table, pressure).0;
        } else if active.gauge_sense == GaugeSense::Contact {
            // Such a gauge cannot see bending; the free bend is the best that is known.
            self.bend = table::bend(table, pressure).0;
        }
        Contact {
            residual,
            touching: self.touches.map(|touch| touch.touching),
            free,
            bend: self.bend,
            range,
            known: self.blind_ticks < BLIND_TICKS && self.unknown_ticks == 0,
        }
    }
}

impl Default for Estimator {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::FINGER;
    use crate::units::Volts;

    fn reading(pressure: f32, strain: [f32; 3]) -> Reading {
        Reading {
            gauges: strain.map(|ue| Gauge::Valid(Microstrain(ue))),
            monitor: Monitor::Valid(Kilopascals(pressure)),
            noise_variance: [400.0; 3],
            supply: Some(Volts(24.0)),
            rail_is_off: false,
            stale_ticks: 0,
            overrun: false,
        }
    }

    fn active(settings: Settings) -> Active {
        settings.validate().expect("good settings")
    }

    fn settle(estimator: &mut Estimator, active: &Active, reading: &Reading) -> Contact {
        let mut contact = estimator.step(reading, &FINGER, active);
        for _ in 0..2_000 {
            contact = estimator.step(reading, &FINGER, active);
        }
        contact
    }

    #[test]
    fn a_free_finger_has_no_residual_and_a_blocked_one_has() {
        let active = active(Settings::default());
        let mut estimator = Estimator::new();
        let free = table::free_strain(&FINGER, Kilopascals(140.0)).0.0;
        let contact = settle(
            &mut estimator,
            &active,
            &reading(140.0, [free, free - 4_000.0, free - 4_000.0]),
        );
        assert_eq!(contact.touching, [false, true, true]);
        assert!(contact.residual[0].is_some_and(|r| r.0.abs() < 1.0));
        assert!(contact.residual[1].is_some_and(|r| (r.0 - 4_000.0).abs() < 1.0));
        assert_eq!(contact.range, Range::Inside);
    }

    #[test]
    fn the_bend_of_a_free_finger_is_the_tables() {
        let active = active(Settings::default());
        let mut estimator = Estimator::new();
        let free = table::free_strain(&FINGER, Kilopascals(100.0)).0.0;
        let contact = settle(&mut estimator, &active, &reading(100.0, [free; 3]));
        let (bend, _) = table::bend(&FINGER, Kilopascals(100.0));
        assert!((contact.bend.0 - bend.0).abs() < 0.05);
    }

    #[test]
    fn a_failed_gauge_leaves_a_gap_and_not_a_number() {
        let active = active(Settings::default());
        let mut estimator = Estimator::new();
        let mut reading = reading(0.0, [0.0; 3]);
        reading.gauges[1] = Gauge::Missing;
        let contact = estimator.step(&reading, &FINGER, &active);
        assert_eq!(contact.residual[1], None);
        assert_eq!(contact.usable_count(), 2);
    }

    #[test]
    fn a_gauge_that_feels_contact_alone_is_its_own_residual() {
        let active = active(Settings {
            gauge_sense: GaugeSense::Contact,
            ..Settings::default()
        });
        let mut estimator = Estimator::new();
        let contact = settle(
            &mut estimator,
            &active,
            &reading(140.0, [3_000.0, 0.0, 0.0]),
        );
        assert_eq!(contact.touching, [true, false, false]);
        assert_eq!(contact.residual[0], Some(Microstrain(3_000.0)));
    }
}

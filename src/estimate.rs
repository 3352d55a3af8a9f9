//! Readings → contact: what the fingers feel beyond their free bending.
//!
//! The contact residual is `r = ε_free(p) − ε`: zero on approach, a ramp while closing, a plateau
//! while holding, near zero after a loss or a release. The raw strain is no use for that: when an
//! object falls at held pressure it dips and then rises, because the finger is free to bend further.

mod calibration;
pub mod casting;
mod silicone;

pub use casting::Casting;
use silicone::Silicone;

pub use calibration::Calibration;
pub use silicone::Settings as SiliconeSettings;
pub(crate) use silicone::loop_share;

use crate::condition::{Gauge, Monitor, Reading};
use crate::math::{larger, smaller};
use crate::table::{self, FingerTable, Range};
use crate::units::{Degrees, FINGERS, Kilopascals, Microstrain};

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
    /// How their shape follows the pressure.
    pub silicone: SiliconeSettings,
    /// What the gauges see.
    pub gauge_sense: GaugeSense,
    /// Strain of each finger's gauge over the table's, at the same bend: gain of the gauge and its place.
    pub free_bend_gain: [f32; FINGERS],
    /// Stiffness of each finger over the recipe's: it bends at so many times the pressure.
    pub stiffness: [f32; FINGERS],
    /// Pressure at which the recipe's fingers would be bent as far as these are when they meet on the gripper's axis;
    /// 0 where the table's own is to be used.
    pub meeting_kpa: f32,
    /// Free fingers that close until they meet lack less than this share of the strain that they show there; an object
    /// makes them lack more.
    pub empty_percent: f32,
    /// Fingers that bend on beyond where they meet, and have less than this share of a free finger's strain, bend around
    /// something small; others pass one another.
    pub around_percent: f32,
    /// A finger touches when its residual exceeds this …
    pub contact_ue: f32,
    /// … plus this share of the free-bend strain, which the table may be wrong by.
    pub contact_percent: f32,
}

impl GaugeSense {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 2] = [Self::Bend, Self::Contact];
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            silicone: SiliconeSettings::default(),
            gauge_sense: GaugeSense::Bend,
            free_bend_gain: [1.0; FINGERS],
            stiffness: [1.0; FINGERS],
            meeting_kpa: 0.0,
            // Of 656 random grasps in another engine, each with twelve kinds of noise, 10 % of error in the gains and an
            // open gauge, 97 % of the empty closes lacked less, and 0.2 % of the grips of objects wider than 56 mm.
            // Narrower spheres lie in the cage of fingers that meet, and hold nothing up.
            empty_percent: 4.0,
            around_percent: calibration::AROUND_PERCENT,
            contact_ue: 500.0,
            contact_percent: calibration::CONTACT_PERCENT,
        }
    }
}

impl Settings {
    /// Of settings that are in their ranges, for fingers of this table.
    pub(crate) fn active(&self, table: &FingerTable) -> Active {
        Active {
            silicone: silicone::Active::of(&self.silicone, table.max_pressure_kpa),
            gauge_sense: self.gauge_sense,
            castings: core::array::from_fn(|i| {
                Casting::of(table, self.free_bend_gain[i], self.stiffness[i])
            }),
            per_free_ue: casting::per_free_ue(table),
            meeting: Meeting::of(self, table),
            contact_ue: self.contact_ue,
            contact_fraction: 0.01 * self.contact_percent,
        }
    }
}

/// The settings in the form that the control tick uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    pub(crate) silicone: silicone::Active,
    pub(crate) gauge_sense: GaugeSense,
    pub(crate) castings: [Casting; FINGERS],
    /// One over the table's free strain at its end, 1/µε.
    pub(crate) per_free_ue: f32,
    /// None where free fingers do not meet.
    pub(crate) meeting: Option<Meeting>,
    pub(crate) contact_ue: f32,
    pub(crate) contact_fraction: f32,
}

/// An empty close of fingers that meet, as their mean strain shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Meeting {
    /// What a free finger of the recipe shows where the fingers meet, µε.
    pub strain_ue: f32,
    /// The fingers lack less than this on their way there, µε.
    pub lacks_at_most_ue: f32,
    /// Beyond, those with less than this share of a free finger's strain bend around something.
    pub around: f32,
}

impl Meeting {
    /// At a pressure that is set, or at the table's.
    fn of(settings: &Settings, table: &FingerTable) -> Option<Self> {
        let kpa = match settings.meeting_kpa > 0.0 {
            true => settings.meeting_kpa,
            false => table.meeting_kpa?,
        };
        let strain_ue = table::free_strain(table, Kilopascals(kpa)).0.0;
        Some(Self {
            strain_ue,
            lacks_at_most_ue: 0.01 * settings.empty_percent * strain_ue,
            around: 0.01 * settings.around_percent,
        })
    }
}

/// What the fingers feel in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Contact residual of each finger whose gauge was usable.
    pub residual: [Option<Microstrain>; FINGERS],
    /// Fingers that touch something.
    pub touching: [bool; FINGERS],
    /// Mean strain over the fingers, each as the recipe's would show it, where the gauges see bending and any is usable.
    pub mean: Option<Microstrain>,
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
pub const OPEN_KPA: f32 = 6.0;
/// Contact, once made, is kept down to this share of its threshold.
const RELEASE_SHARE: f32 = 0.6;
/// Contact must come or go for this long: longer than a spike, shorter than anything that matters.
const DEBOUNCE_TICKS: u8 = 5;

/// The pressure may be unknown for this long before the shape that follows it is: a quarter of its lag.
const BLIND_TICKS: u16 = 20;
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

/// What changes slowly is found in turns: the bend, and what each casting makes of a strain.
const TURNS: u8 = 4;

/// The shape of a free finger, and the touch of each finger.
#[derive(Debug, Clone, Copy)]
pub struct Estimator {
    /// Unknown before the first measurement.
    silicone: Option<Silicone>,
    blind_ticks: u16,
    unknown_ticks: u16,
    touches: [Touch; FINGERS],
    bend: Degrees,
    /// Whose turn it is: the bend's at one, then each finger's.
    turn: u8,
    /// What the gauge of a free finger shows; unknown before the first pressure.
    free: Option<Microstrain>,
    /// Strain of each finger over the recipe's at the strain of now, and one over that at the mean measured one: of one
    /// finger in a tick, for they change slowly.
    ratios: [f32; FINGERS],
    recipes: [f32; FINGERS],
    /// Mean strain of the last tick, µε.
    mean_ue: f32,
}

impl Estimator {
    /// Fingers at rest at the first pressure that will be measured.
    pub fn new() -> Self {
        Self {
            silicone: None,
            blind_ticks: 0,
            unknown_ticks: 0,
            touches: [Touch::default(); FINGERS],
            bend: Degrees(0.0),
            turn: 0,
            free: None,
            ratios: [1.0; FINGERS],
            recipes: [1.0; FINGERS],
            mean_ue: 0.0,
        }
    }

    /// The pressure that the finger's shape has followed so far.
    pub fn lagged_pressure(&self) -> Kilopascals {
        self.silicone
            .map_or(Kilopascals(0.0), |silicone| silicone.pressure())
    }

    /// What the gauge of a free finger should show now; unknown before the first pressure.
    pub fn free_strain(&self) -> Option<Microstrain> {
        self.free
    }

    /// Estimates contact from one tick's readings.
    pub fn step(&mut self, reading: &Reading, table: &FingerTable, active: &Active) -> Contact {
        if let Monitor::Valid(pressure) = reading.monitor {
            let model = &active.silicone;
            let at_rest = || Silicone::at_rest(pressure, model);
            let silicone = self.silicone.get_or_insert_with(at_rest);
            silicone.step(pressure, model);
            self.unknown_ticks = match core::mem::take(&mut self.blind_ticks) {
                BLIND_TICKS.. => active.silicone.known_after_ticks,
                _ => self.unknown_ticks.saturating_sub(1),
            };
        } else {
            self.blind_ticks = self.blind_ticks.saturating_add(1);
        }
        let pressure = self.lagged_pressure();
        let (free, range) = table::free_strain(table, pressure);
        self.free = self.silicone.map(|_| match active.gauge_sense {
            GaugeSense::Bend => free,
            GaugeSense::Contact => Microstrain(0.0),
        });
        let threshold = active.contact_ue + active.contact_fraction * free.0;
        let mut residual = [None; FINGERS];
        let (mut strain_sum, mut strains) = (0.0, 0.0);
        let mut mean = None;
        self.turn = self.turn.wrapping_add(1) % TURNS;
        self.take_casting(free, active);
        let fingers = reading
            .gauges
            .iter()
            .zip(self.ratios.iter().zip(&self.recipes));
        let results = residual.iter_mut().zip(&mut self.touches);
        for ((gauge, (ratio, recipes)), (slot, touch)) in fingers.zip(results) {
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
                GaugeSense::Bend => ratio * free.0 - strain.0,
                GaugeSense::Contact => strain.0,
            };
            *slot = Some(Microstrain(value));
            touch.step(value, threshold);
            strain_sum += strain.0 * recipes;
            strains += 1.0;
        }
        if strains > 0.0 && active.gauge_sense == GaugeSense::Bend {
            self.mean_ue = strain_sum / strains;
            mean = Some(Microstrain(self.mean_ue));
        }
        // For those who look; its search is a thirtieth of a tick.
        if self.turn == 1 {
            self.bend = match (mean, active.gauge_sense) {
                (Some(strain), _) => table::bend_for_strain(table, strain),
                // Such a gauge cannot see bending; the free bend is the best that is known.
                (None, GaugeSense::Contact) => table::bend(table, pressure).0,
                (None, GaugeSense::Bend) => self.bend,
            };
        }
        Contact {
            residual,
            touching: self.touches.map(|touch| touch.touching),
            mean,
            free,
            bend: self.bend,
            range,
            known: self.blind_ticks < BLIND_TICKS && self.unknown_ticks == 0,
        }
    }

    /// What the casting of the finger in turn makes of the strains of now.
    fn take_casting(&mut self, free: Microstrain, active: &Active) {
        let finger = usize::from(self.turn.wrapping_sub(2) % TURNS);
        if let (Some(casting), Some(ratio), Some(recipes)) = (
            active.castings.get(finger),
            self.ratios.get_mut(finger),
            self.recipes.get_mut(finger),
        ) {
            *ratio = casting.ratio(active.per_free_ue * free.0);
            let bent = larger(0.0, smaller(1.0, active.per_free_ue * self.mean_ue));
            *recipes = 1.0 / casting.ratio(bent);
        }
    }
}

impl Default for Estimator {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;

//! What a free-bend sweep has found of the mounted fingers, and what becomes of it in the settings.

use softgrip_settings::Values;

use crate::math::{larger, smaller};
use crate::table::FingerTable;
use crate::units::{FINGERS, Kilopascals};

/// Numbers of the settings of which a sweep may leave what is set.
const REGULATOR_LAG: u16 = 110;
const SLIP: u16 = 302;

/// What a sweep has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Strain of each gauge over the table's at the same bend.
    pub gain: [f32; FINGERS],
    /// Stiffness of each finger over the recipe's.
    pub stiffness: [f32; FINGERS],
    /// Pressure at which the recipe's finger is bent as these are where they meet; none if they do not.
    pub meeting: Option<Kilopascals>,
    /// Least share of a free finger's strain that the fingers have on the average, once they bend further than where they
    /// meet: they pass one another.
    pub passing_share: f32,
    /// Pressures at which a finger has the same shape on its way up and down are so far apart, kPa.
    pub hysteresis_kpa: f32,
    /// Lags of the fingers behind the pressure, rising and falling, without their swing, ms.
    pub lag_ms: [f32; 2],
    /// Delay of the regulator behind the set-point, ms, where a rise has told another one than the settings do.
    pub regulator_ms: Option<f32>,
    /// Largest difference between the free fingers and what is now expected of them, percent of full scale.
    pub error_percent: f32,
}

/// Fingers that bend on beyond where they meet and have less than this share of a free finger's strain bend around
/// something, percent: the default of the setting.
pub(super) const AROUND_PERCENT: f32 = 75.0;

/// The same after a sweep in which no finger has passed another. In a fast close they may, with 70 % of a free finger's
/// strain: one of 3000 closes did. Objects of 31 to 60 mm never bent them that far.
const UNPASSED_PERCENT: f32 = 65.0;

/// What swept fingers lack at most of the strain with which they meet, percent: more than others may, because what they
/// lack is no error of the table any more. What is left is the error of the lag: with 300 µε of noise a sweep finds 68 to 107 ms
/// where there are 80, and fast closes lack up to 9. Spheres and cylinders of 64 to 70 mm make them lack 31 or
/// more, those from 59 mm on 20.
const EMPTY_PERCENT: f32 = 15.0;

/// A slip after a sweep, percent of the plateau, where the settings say what they do by default. What their own weight takes
/// from the fingers' bend passed for contact before, and does not after a sweep: 4500 to 10 500 µε of plateau are left of
/// 6000 to 12 500, and what an arm's motion changes of them is a larger share. In the 45 h of docs/calibration.md the
/// default gives 22 false slips, this no more than the recipe has.
const SLIP_PERCENT: f32 = 8.5;
const DEFAULT_SLIP_PERCENT: f32 = 7.0;

/// Share of full scale by which a table may be wrong, percent, whatever a fit says: the default of the setting.
pub(super) const CONTACT_PERCENT: f32 = 5.0;

/// Settings that a sweep states.
const STATED: usize = 9 + 2 * FINGERS;

impl Calibration {
    /// The settings that it stands for, by number, for [`Settings::with`](crate::settings::Settings::with). A curve that is
    /// known less well than the defaults take for granted makes contact of a larger residual. Of what is set `now`, the
    /// regulator's delay stays where nothing new was learned, and what makes a slip where it is not the default.
    pub fn stated(&self, now: &Values, table: &FingerTable) -> [(u16, f32); STATED] {
        let [up_ms, down_ms] = self.lag_ms.map(|ms| larger(1.0, smaller(ms, 5_000.0)));
        // A fast close does it by up to a quarter less than the slow one of the sweep.
        let passing_percent = 100.0 * self.passing_share - 30.0;
        let [regulator_ms, slip_percent] = [REGULATOR_LAG, SLIP].map(|n| now.get(n).unwrap_or(0.0));
        let slip_percent = match slip_percent == DEFAULT_SLIP_PERCENT {
            true => SLIP_PERCENT,
            false => slip_percent,
        };
        let hysteresis = 100.0 * self.hysteresis_kpa / table.max_pressure_kpa;
        let mut stated = [(0, 0.0); STATED];
        let mut put = |at: usize, number: u16, value: f32| {
            if let Some(place) = stated.get_mut(at) {
                *place = (number, value);
            }
        };
        let regulator_ms = self.regulator_ms.unwrap_or(regulator_ms);
        let contact_percent = larger(CONTACT_PERCENT, 2.0 * self.error_percent);
        let meeting_kpa = self.meeting.map_or(0.0, |pressure| pressure.0);
        let around_percent = larger(0.0, smaller(UNPASSED_PERCENT, passing_percent));
        put(0, REGULATOR_LAG, regulator_ms);
        put(1, 202, contact_percent);
        put(2, 240, meeting_kpa);
        put(3, 241, EMPTY_PERCENT);
        put(4, 242, around_percent);
        put(5, 250, up_ms);
        put(6, 251, down_ms);
        put(7, 252, larger(0.0, smaller(hysteresis, 25.0)));
        put(8, SLIP, slip_percent);
        let fingers = self.gain.iter().zip(&self.stiffness);
        for (finger, (gain, stiffness)) in (0..FINGERS).zip(fingers) {
            put(9 + finger, 220 + finger as u16, *gain);
            put(9 + FINGERS + finger, 230 + finger as u16, *stiffness);
        }
        stated
    }
}

//! The values of all settings.

use crate::error::SettingsError;
use crate::field::{Limit, smaller};
use crate::fields::{COUNT, FIELDS};

/// The range of every setting, in the order of [`FIELDS`].
pub static LIMITS: [Limit; COUNT] = limits();

const fn limits() -> [Limit; COUNT] {
    let mut limits = [FIELDS[0].limit(); COUNT];
    let mut i = 0;
    while i < COUNT {
        limits[i] = FIELDS[i].limit();
        i += 1;
    }
    limits
}

// Settings whose range, or whose default, depends on others or on the finger.
const MAX_PRESSURE: usize = place(100);
const SLEW: usize = place(101);
const CONTACT: usize = place(201);
const AIR_LOSS: usize = place(303);
const GRIP_PRESSURE: usize = place(400);
const REGRIP_RAISE: usize = place(408);
const FULL_SCALE: usize = place(630);

/// The place of a setting in [`FIELDS`], for a number that is known when the program is compiled.
///
/// # Panics
/// If there is no setting of this number.
pub const fn place(number: u16) -> usize {
    let mut i = 0;
    while FIELDS[i].number != number {
        i += 1;
    }
    i
}

/// The values of all settings, in the order of [`FIELDS`]; a choice is its place in the list of its words. Each is in
/// its own range; [`Values::problems`] tells whether they go together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values([f32; COUNT]);

impl Values {
    /// The defaults, for a finger that is good for 160 kPa.
    pub const DEFAULT: Self = {
        let mut values = [0.0; COUNT];
        let mut i = 0;
        while i < COUNT {
            values[i] = FIELDS[i].default;
            i += 1;
        }
        Self(values)
    };

    /// The defaults for a finger whose table ends at `table_kpa`: what is a pressure, or strain of contact, in
    /// proportion to what its table and the regulator reach, and never above [`Values::DEFAULT`].
    ///
    /// `free_ue` is the strain of a free finger at the highest pressure, [`Values::highest_kpa`]. It tells how far the
    /// finger bends; noise and errors of the electronics do not shrink with it, so contact and loss of air keep a
    /// floor. Times, shares and lags stay: a table does not tell them.
    pub const fn for_finger(table_kpa: f32, free_ue: f32) -> Self {
        /// Of the highest pressure: 140 of 160 kPa. One regrip takes the rest.
        const GRIP: f32 = 0.875;
        /// Of free strain at the highest pressure: below what half the default finger's bend would give.
        const CONTACT_SHARE: f32 = 0.04;
        /// Five times the noise of a decent amplifier, ten codes of the converter.
        const LEAST_CONTACT_UE: f32 = 100.0;
        /// Twice what a regulator of 200 kPa may be wrong by, ±1 % of full scale.
        const LEAST_AIR_LOSS_KPA: f32 = 4.0;

        let Self(mut values) = Self::DEFAULT;
        let max_kpa = Self::DEFAULT.highest_kpa(table_kpa);
        let share = max_kpa / values[MAX_PRESSURE];
        values[MAX_PRESSURE] = max_kpa;
        // The whole stroke takes as long as the default's.
        values[SLEW] *= share;
        // What is the least that may be set.
        values[GRIP_PRESSURE] = (GRIP * max_kpa).max(1.0);
        values[REGRIP_RAISE] = (1.0 - GRIP) * max_kpa;
        values[CONTACT] = (CONTACT_SHARE * free_ue).clamp(LEAST_CONTACT_UE, values[CONTACT]);
        values[AIR_LOSS] = (share * values[AIR_LOSS]).max(LEAST_AIR_LOSS_KPA);
        Self(values)
    }

    /// The values in the order of [`FIELDS`].
    pub const fn all(&self) -> &[f32; COUNT] {
        &self.0
    }

    /// The value of a setting; none if there is no setting of this number.
    // Never inlined: where the compiler knows the values it would write a comparison for each. So below.
    #[inline(never)]
    pub fn get(&self, number: u16) -> Option<f32> {
        let mut all = LIMITS.iter().zip(&self.0);
        all.find(|(limit, _)| limit.number == number)
            .map(|(_, value)| *value)
    }

    /// Sets what is in its range.
    ///
    /// # Errors
    /// If it is not, or if there is no setting of this number; nothing is changed then. What finger, regulator and
    /// other settings allow is left to [`Values::problems`].
    #[inline(never)]
    pub const fn set(&mut self, number: u16, value: f32) -> Result<(), SettingsError> {
        let mut place = 0;
        while place < COUNT {
            let limit = &LIMITS[place];
            if limit.number == number {
                if !limit.allows(value) {
                    return Err(SettingsError::of(limit, value));
                }
                self.0[place] = value;
                return Ok(());
            }
            place += 1;
        }
        Err(SettingsError {
            number,
            value,
            min: f32::NAN,
            max: f32::NAN,
        })
    }

    /// These values with what somebody states, for a finger whose table ends at `table_kpa`. Pressures that are not
    /// stated go no higher than those that are.
    ///
    /// # Errors
    /// As [`Values::set`].
    pub const fn with(
        mut self,
        stated: &[(u16, f32)],
        table_kpa: f32,
    ) -> Result<Self, SettingsError> {
        // What is stated is not bent to fit, so it is set once more.
        let mut round = 0;
        while round < 2 {
            let mut i = 0;
            while i < stated.len() {
                let (number, value) = stated[i];
                if let Err(error) = self.set(number, value) {
                    return Err(error);
                }
                i += 1;
            }
            if round == 0 {
                self.fit(table_kpa);
            }
            round += 1;
        }
        Ok(self)
    }

    /// Above the table nothing is known of the finger, above the regulator's full scale nothing can be commanded, kPa.
    const fn ceiling_kpa(&self, table_kpa: f32) -> f32 {
        smaller(table_kpa, self.0[FULL_SCALE])
    }

    /// The highest pressure of a command, for a finger whose table ends at `table_kpa`, kPa.
    pub const fn highest_kpa(&self, table_kpa: f32) -> f32 {
        smaller(self.0[MAX_PRESSURE], self.ceiling_kpa(table_kpa))
    }

    /// Lowers the pressures to what finger, regulator and each other allow.
    pub(crate) const fn fit(&mut self, table_kpa: f32) {
        let ceiling_kpa = self.ceiling_kpa(table_kpa);
        let max_kpa = self.highest_kpa(table_kpa);
        let values = &mut self.0;
        values[MAX_PRESSURE] = max_kpa;
        values[GRIP_PRESSURE] = smaller(values[GRIP_PRESSURE], max_kpa);
        values[REGRIP_RAISE] = smaller(values[REGRIP_RAISE], ceiling_kpa);
    }

    /// Every setting that is out of its range, for a finger whose table ends at `table_kpa`, in the order of the
    /// numbers.
    pub fn problems(self, table_kpa: f32) -> impl Iterator<Item = SettingsError> {
        let ceiling_kpa = self.ceiling_kpa(table_kpa);
        let max_kpa = self.0[MAX_PRESSURE];
        // No index and no count that could go wrong: a request on the bus comes by here.
        let values = (0..COUNT).zip(LIMITS.iter().zip(self.0));
        values.filter_map(move |(place, (limit, value))| {
            let limit = match place {
                MAX_PRESSURE | REGRIP_RAISE => limit.up_to(ceiling_kpa),
                GRIP_PRESSURE => limit.up_to(max_kpa),
                _ => *limit,
            };
            (!limit.allows(value)).then(|| SettingsError::of(&limit, value))
        })
    }

    /// The first of the problems.
    // Once in the image, for whoever only wants to know whether there is any.
    #[inline(never)]
    pub fn first_problem(&self, table_kpa: f32) -> Option<SettingsError> {
        self.problems(table_kpa).next()
    }

    /// Every value as it is, valid or not.
    pub const fn from_all(values: [f32; COUNT]) -> Self {
        Self(values)
    }
}

#[cfg(test)]
mod tests;

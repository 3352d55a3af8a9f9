//! Typed fields ↔ values by number.

use softgrip_settings::{COUNT, Values, per_finger};

use super::tree::Settings;
use crate::estimate::GaugeSense;
use crate::grasp::{OnFault, OnLoss};
use crate::io::{Baud, Level};

/// Where a setting is kept.
enum Leaf<'a> {
    Number(&'a mut f32),
    GaugeSense(&'a mut GaugeSense),
    OnFault(&'a mut OnFault),
    OnLoss(&'a mut OnLoss),
    Level(&'a mut Level),
    Whole(&'a mut u8),
    Baud(&'a mut Baud),
}

impl Leaf<'_> {
    /// Its value; a choice's is its place in the list of its words.
    fn get(&self) -> f32 {
        match self {
            Self::Number(number) => **number,
            Self::GaugeSense(sense) => f32::from(**sense as u8),
            Self::OnFault(on_fault) => f32::from(**on_fault as u8),
            Self::OnLoss(on_loss) => f32::from(**on_loss as u8),
            Self::Level(level) => f32::from(**level as u8),
            Self::Whole(number) => f32::from(**number),
            Self::Baud(baud) => f32::from(**baud as u8),
        }
    }

    /// Takes a value. A choice that there is not changes nothing.
    fn put(self, value: f32) {
        match self {
            Self::Number(place) => *place = value,
            Self::GaugeSense(place) => choose(place, value, &GaugeSense::ALL),
            Self::OnFault(place) => choose(place, value, &OnFault::ALL),
            Self::OnLoss(place) => choose(place, value, &OnLoss::ALL),
            Self::Level(place) => choose(place, value, &Level::ALL),
            Self::Whole(place) => *place = value as u8,
            Self::Baud(place) => choose(place, value, &Baud::ALL),
        }
    }
}

fn choose<T: Copy>(place: &mut T, value: f32, all: &[T]) {
    if let Some(chosen) = all.get(value as usize) {
        *place = *chosen;
    }
}

impl Settings {
    /// Every setting with its number, in the order of [`FIELDS`](softgrip_settings::FIELDS).
    // Inlined, so that an image has one move for each and no numbers.
    #[inline(always)]
    #[rustfmt::skip]
    fn each(&mut self, mut visit: impl FnMut(u16, Leaf)) {
        use Leaf::Number;
        visit(100, Number(&mut self.regulator.max_pressure_kpa));
        visit(101, Number(&mut self.regulator.slew_kpa_per_s));
        visit(110, Number(&mut self.air.regulator_lag_ms));
        visit(111, Number(&mut self.air.following_kpa));
        visit(200, Leaf::GaugeSense(&mut self.finger.gauge_sense));
        visit(201, Number(&mut self.finger.contact_ue));
        visit(202, Number(&mut self.finger.contact_percent));
        for (number, value) in per_finger(220).into_iter().zip(&mut self.finger.free_bend_gain) {
            visit(number, Number(value));
        }
        for (number, value) in per_finger(230).into_iter().zip(&mut self.finger.stiffness) {
            visit(number, Number(value));
        }
        visit(240, Number(&mut self.finger.meeting_kpa));
        visit(241, Number(&mut self.finger.empty_percent));
        visit(242, Number(&mut self.finger.around_percent));
        visit(250, Number(&mut self.finger.silicone.inflation_lag_ms));
        visit(251, Number(&mut self.finger.silicone.deflation_lag_ms));
        visit(252, Number(&mut self.finger.silicone.hysteresis_percent));
        visit(253, Number(&mut self.finger.silicone.creep_percent));
        visit(254, Number(&mut self.finger.silicone.creep_time_s));
        visit(255, Number(&mut self.finger.silicone.bending_hz));
        visit(256, Number(&mut self.finger.silicone.bending_damping));
        visit(300, Number(&mut self.detection.loss_allowance_percent));
        visit(301, Number(&mut self.detection.loss_evidence_percent_ms));
        visit(302, Number(&mut self.detection.slip_percent));
        visit(303, Number(&mut self.detection.air_loss_kpa));
        visit(400, Number(&mut self.grip.grip_pressure_kpa));
        visit(401, Number(&mut self.grip.settle_ms));
        visit(402, Number(&mut self.grip.lift_margin_percent));
        visit(403, Number(&mut self.grip.not_following_ms));
        visit(404, Number(&mut self.grip.supply_min_v));
        visit(405, Number(&mut self.grip.host_timeout_ms));
        visit(406, Leaf::OnFault(&mut self.grip.on_fault));
        visit(407, Leaf::OnLoss(&mut self.grip.on_loss));
        visit(408, Number(&mut self.grip.regrip_raise_kpa));
        for (number, value) in per_finger(500).into_iter().zip(&mut self.gauge.gain) {
            visit(number, Number(value));
        }
        for (number, value) in per_finger(510).into_iter().zip(&mut self.gauge.tare_ue) {
            visit(number, Number(value));
        }
        visit(600, Number(&mut self.front_end.gauge_zero_v));
        visit(601, Number(&mut self.front_end.gauge_full_scale_v));
        visit(602, Number(&mut self.front_end.gauge_full_scale_ue));
        visit(603, Number(&mut self.front_end.gauge_short_below_v));
        visit(604, Number(&mut self.front_end.gauge_open_above_v));
        visit(610, Number(&mut self.front_end.monitor_full_scale_v));
        visit(611, Number(&mut self.front_end.monitor_high_above_v));
        visit(620, Number(&mut self.front_end.supply_divider));
        visit(630, Number(&mut self.front_end.regulator_full_scale_kpa));
        visit(631, Number(&mut self.front_end.command_full_scale_v));
        visit(632, Number(&mut self.front_end.command_zero_v));
        visit(700, Leaf::Level(&mut self.io.grip));
        visit(701, Leaf::Level(&mut self.io.release));
        visit(710, Leaf::Level(&mut self.io.holding));
        visit(711, Leaf::Level(&mut self.io.lost));
        visit(800, Number(&mut self.telemetry.period_ms));
        visit(900, Leaf::Whole(&mut self.bus.id));
        visit(901, Leaf::Baud(&mut self.bus.baud));
    }

    /// The settings with these values.
    pub fn of(values: &Values) -> Self {
        let mut settings = Self::default();
        let mut values = values.all().iter();
        settings.each(|_, leaf| {
            if let Some(value) = values.next() {
                leaf.put(*value);
            }
        });
        settings
    }

    /// Their values by number.
    pub fn values(&self) -> Values {
        let mut copy = *self;
        let mut values = [0.0; COUNT];
        let mut places = values.iter_mut();
        copy.each(|_, leaf| {
            if let Some(place) = places.next() {
                *place = leaf.get();
            }
        });
        Values::from_all(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrip_settings::FIELDS;
    use std::vec::Vec;

    #[test]
    fn every_field_of_the_table_is_one_typed_field_and_has_its_default() {
        let mut numbers = Vec::new();
        Settings::default().each(|number, _| numbers.push(number));
        assert_eq!(numbers, FIELDS.map(|field| field.number));
        assert_eq!(Settings::default().values(), Values::DEFAULT);
        let mut seen = Vec::from([Settings::default()]);
        for field in &FIELDS {
            let limit = field.limit();
            let end = match limit.max == field.default {
                true => limit.min,
                false => limit.max,
            };
            let mut values = Values::DEFAULT;
            values.set(field.number, end).expect("an end of its range");
            let settings = Settings::of(&values);
            assert_eq!(settings.values(), values, "{}", field.name);
            assert!(!seen.contains(&settings), "{}", field.name);
            seen.push(settings);
        }
    }

    #[test]
    fn a_typed_field_has_the_name_of_its_row() {
        let mut settings = Settings::default();
        settings.finger.silicone.creep_percent = 7.0;
        settings.grip.on_loss = OnLoss::Regrip;
        settings.gauge.gain[1] = 1.5;
        let changed = |field: &&softgrip_settings::Field| {
            settings.values().get(field.number) != Some(field.default)
        };
        let names: Vec<&str> = FIELDS.iter().filter(changed).map(|f| f.name).collect();
        assert_eq!(
            names,
            [
                "finger.silicone.creep_percent",
                "grip.on_loss",
                "gauge.gain[1]"
            ]
        );
        for field in &FIELDS {
            let softgrip_settings::Kind::Choice(words) = field.kind else {
                continue;
            };
            for (place, word) in words.iter().enumerate() {
                let mut values = Values::DEFAULT;
                values.set(field.number, place as f32).expect("a choice");
                let chosen = Settings::of(&values);
                let debug = match field.number {
                    200 => std::format!("{:?}", chosen.finger.gauge_sense),
                    406 => std::format!("{:?}", chosen.grip.on_fault),
                    700 => std::format!("{:?}", chosen.io.grip),
                    701 => std::format!("{:?}", chosen.io.release),
                    710 => std::format!("{:?}", chosen.io.holding),
                    711 => std::format!("{:?}", chosen.io.lost),
                    901 => std::format!("{}", chosen.bus.baud.bits_per_s()),
                    407 => std::format!("{:?}", chosen.grip.on_loss),
                    other => panic!("{other}: no word is known for it"),
                };
                assert_eq!(debug.to_lowercase(), *word);
            }
        }
    }
}

//! The one table of what is told of a gripper: recordings, CSV files, the reading by registers and the manual's page
//! follow from it.

use bus::robot::Item;
use softgrip::FINGERS;

use crate::observation::Observation;

/// States by their numbers (`docs/registers.md`).
pub const STATES: [&str; 8] = [
    "starting",
    "idle",
    "closing",
    "holding",
    "empty",
    "releasing",
    "fault",
    "sweeping",
];

/// Causes of a loss by their numbers (`docs/registers.md`).
pub const CAUSES: [&str; 4] = ["none", "collapse", "one_sided", "missing"];

/// One value of an [`Observation`].
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Its name, with its unit at the end.
    pub name: &'static str,
    /// Its unit; empty for one without.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Its number in a recording. It never changes, and never means something else.
    pub number: u32,
    /// What it can be.
    pub kind: Kind,
    /// Where a robot on the bus finds it.
    pub register: Origin,
    /// Where it is in an observation.
    pub place: fn(&mut Observation) -> Place<'_>,
}

/// What a value can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number of double precision.
    Double,
    /// A number of single precision.
    Float,
    /// A whole number.
    Whole,
    /// Yes or no.
    Flag,
    /// One of these words; as a number its place among them.
    Choice(&'static [&'static str]),
}

/// A value in an observation; none where it is not known.
#[derive(Debug)]
pub enum Place<'a> {
    /// Of [`Kind::Double`].
    Double(&'a mut Option<f64>),
    /// Of [`Kind::Float`].
    Float(&'a mut Option<f32>),
    /// Of [`Kind::Whole`] and [`Kind::Choice`].
    Whole(&'a mut Option<u16>),
    /// Of [`Kind::Flag`].
    Flag(&'a mut Option<bool>),
}

/// Where a value is found among the registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// Nowhere.
    Nowhere,
    /// In this register of the item's, in so many parts of the field's unit.
    Register {
        /// The row of the map.
        item: Item,
        /// The register within it.
        offset: u16,
        /// Parts of the unit.
        parts: f32,
    },
    /// In this bit of the item's register.
    Bit {
        /// The row of the map.
        item: Item,
        /// The bit, from the lowest.
        bit: u16,
    },
}

const NOWHERE: Origin = Origin::Nowhere;

const fn at(item: Item, offset: u16, parts: f32) -> Origin {
    Origin::Register {
        item,
        offset,
        parts,
    }
}

const fn bit(item: Item, bit: u16) -> Origin {
    Origin::Bit { item, bit }
}

const fn field(
    number: u32,
    name: &'static str,
    unit: &'static str,
    kind: Kind,
    register: Origin,
    place: fn(&mut Observation) -> Place<'_>,
    meaning: &'static str,
) -> Field {
    Field {
        name,
        unit,
        meaning,
        number,
        kind,
        register,
        place,
    }
}

use Item::{
    Bend, Drift, Fault, Flags, GaugeFault, Level, LossCause, LossEvidence, LossLatency, Margin,
    Noise, Pressure, Residual, SetPoint, State, Touching, Uptime,
};
use Kind::{Choice, Double, Flag, Float, Whole};

/// Every value, in the order of the columns of a CSV file. The first ones are those of a trace.
pub const FIELDS: [Field; COUNT] = of_this_gripper();

/// Of [`ALL`], those of the third and of the fourth finger.
const THIRD: [u32; 7] = [4, 18, 21, 24, 27, 30, 35];
const FOURTH: [u32; 7] = [36, 37, 38, 39, 40, 41, 42];
/// Fingers that a gripper has at most.
const MOST_FINGERS: usize = 4;
const COUNT: usize = ALL.len() - THIRD.len() * (MOST_FINGERS - FINGERS);

const fn is_among(number: u32, numbers: &[u32]) -> bool {
    let mut i = 0;
    while i < numbers.len() {
        if numbers[i] == number {
            return true;
        }
        i += 1;
    }
    false
}

const fn of_this_gripper() -> [Field; COUNT] {
    let mut fields = [ALL[0]; COUNT];
    let (mut from, mut to) = (0, 0);
    while from < ALL.len() {
        let number = ALL[from].number;
        let of_nobody = FINGERS < 3 && is_among(number, &THIRD);
        if !of_nobody && (FINGERS > 3 || !is_among(number, &FOURTH)) {
            fields[to] = ALL[from];
            to += 1;
        }
        from += 1;
    }
    fields
}

fn strain_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Float(&mut o.strain_ue[FINGER])
}

fn touching_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Flag(&mut o.touching[FINGER])
}

fn residual_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Float(&mut o.residual_ue[FINGER])
}

fn noise_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Float(&mut o.noise_ue[FINGER])
}

fn drift_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Float(&mut o.drift_ue[FINGER])
}

fn gauge_fault_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Whole(&mut o.gauge_fault[FINGER])
}

fn loss_evidence_of<const FINGER: usize>(o: &mut Observation) -> Place<'_> {
    Place::Float(&mut o.loss_evidence[FINGER])
}

/// Those of a gripper with as many fingers as there may be.
#[rustfmt::skip]
const ALL: [Field; 42] = [
    field(1, "t_s", "s", Double, at(Uptime, 0, 1e3), |o| Place::Double(&mut o.t_s), "Time since the gripper's start"),
    field(2, "strain1_ue", "µε", Float, NOWHERE, strain_of::<0>, "Strain of the gauge less its tare, finger 1"),
    field(3, "strain2_ue", "µε", Float, NOWHERE, strain_of::<1>, "The same, finger 2"),
    field(4, "strain3_ue", "µε", Float, NOWHERE, strain_of::<2>, "The same, finger 3"),
    field(36, "strain4_ue", "µε", Float, NOWHERE, strain_of::<3>, "The same, finger 4"),
    field(5, "pressure_kpa", "kPa", Float, at(Pressure, 0, 10.0), |o| Place::Float(&mut o.pressure_kpa), "Measured pressure"),
    field(6, "setpoint_kpa", "kPa", Float, at(SetPoint, 0, 10.0), |o| Place::Float(&mut o.setpoint_kpa), "Where the pressure is to be now: what was asked for, reached at the slew of the settings"),
    field(7, "commanded_kpa", "kPa", Float, NOWHERE, |o| Place::Float(&mut o.commanded_kpa), "What the regulator is told: the set-point with the correction of its error"),
    field(8, "state", "", Choice(&STATES), at(State, 0, 1.0), |o| Place::Whole(&mut o.state), "Where the gripper is"),
    field(9, "fault", "", Whole, at(Fault, 0, 1.0), |o| Place::Whole(&mut o.fault), "Number of the latched fault (faults.md), 0 for none"),
    field(10, "holding", "", Flag, bit(Flags, 0), |o| Place::Flag(&mut o.holding), "Something is held"),
    field(11, "lost", "", Flag, bit(Flags, 1), |o| Place::Flag(&mut o.lost), "A loss is latched"),
    field(12, "tare_due", "", Flag, bit(Flags, 2), |o| Place::Flag(&mut o.tare_due), "A tare is asked for"),
    field(13, "bend_deg", "°", Float, at(Bend, 0, 10.0), |o| Place::Float(&mut o.bend_deg), "Estimated bend of the fingers"),
    field(14, "level", "", Float, at(Level, 0, 1e3), |o| Place::Float(&mut o.level), "While something is held: summed contact residual over its plateau"),
    field(15, "margin", "", Float, at(Margin, 0, 1e3), |o| Place::Float(&mut o.margin), "While a payload is held: lift beyond its load, as a share of it"),
    field(16, "touching1", "", Flag, bit(Touching, 0), touching_of::<0>, "Finger 1 touches"),
    field(17, "touching2", "", Flag, bit(Touching, 1), touching_of::<1>, "Finger 2 touches"),
    field(18, "touching3", "", Flag, bit(Touching, 2), touching_of::<2>, "Finger 3 touches"),
    field(37, "touching4", "", Flag, bit(Touching, 3), touching_of::<3>, "Finger 4 touches"),
    field(19, "residual1_ue", "µε", Float, at(Residual, 0, 1.0), residual_of::<0>, "Contact residual: strain of the free finger less that of this one, finger 1"),
    field(20, "residual2_ue", "µε", Float, at(Residual, 1, 1.0), residual_of::<1>, "The same, finger 2"),
    field(21, "residual3_ue", "µε", Float, at(Residual, 2, 1.0), residual_of::<2>, "The same, finger 3"),
    field(38, "residual4_ue", "µε", Float, at(Residual, 3, 1.0), residual_of::<3>, "The same, finger 4"),
    field(22, "noise1_ue", "µε", Float, at(Noise, 0, 10.0), noise_of::<0>, "Noise of the gauge, rms, finger 1"),
    field(23, "noise2_ue", "µε", Float, at(Noise, 1, 10.0), noise_of::<1>, "The same, finger 2"),
    field(24, "noise3_ue", "µε", Float, at(Noise, 2, 10.0), noise_of::<2>, "The same, finger 3"),
    field(39, "noise4_ue", "µε", Float, at(Noise, 3, 10.0), noise_of::<3>, "The same, finger 4"),
    field(25, "drift1_ue", "µε", Float, at(Drift, 0, 1.0), drift_of::<0>, "How far the zero of the gauge has been tracked since the last tare, finger 1"),
    field(26, "drift2_ue", "µε", Float, at(Drift, 1, 1.0), drift_of::<1>, "The same, finger 2"),
    field(27, "drift3_ue", "µε", Float, at(Drift, 2, 1.0), drift_of::<2>, "The same, finger 3"),
    field(40, "drift4_ue", "µε", Float, at(Drift, 3, 1.0), drift_of::<3>, "The same, finger 4"),
    field(28, "gauge_fault1", "", Whole, at(GaugeFault, 0, 1.0), gauge_fault_of::<0>, "Number of what has failed of the gauge (faults.md), 0 for nothing, finger 1"),
    field(29, "gauge_fault2", "", Whole, at(GaugeFault, 1, 1.0), gauge_fault_of::<1>, "The same, finger 2"),
    field(30, "gauge_fault3", "", Whole, at(GaugeFault, 2, 1.0), gauge_fault_of::<2>, "The same, finger 3"),
    field(41, "gauge_fault4", "", Whole, at(GaugeFault, 3, 1.0), gauge_fault_of::<3>, "The same, finger 4"),
    field(31, "loss_cause", "", Choice(&CAUSES), at(LossCause, 0, 1.0), |o| Place::Whole(&mut o.loss_cause), "How the latched loss showed"),
    field(32, "loss_latency_ms", "ms", Float, at(LossLatency, 0, 10.0), |o| Place::Float(&mut o.loss_latency_ms), "From the onset of the latched loss to its report"),
    field(33, "loss_evidence1", "", Float, at(LossEvidence, 0, 1e3), loss_evidence_of::<0>, "How far the residual had fallen then, as a share of its plateau, finger 1"),
    field(34, "loss_evidence2", "", Float, at(LossEvidence, 1, 1e3), loss_evidence_of::<1>, "The same, finger 2"),
    field(35, "loss_evidence3", "", Float, at(LossEvidence, 2, 1e3), loss_evidence_of::<2>, "The same, finger 3"),
    field(42, "loss_evidence4", "", Float, at(LossEvidence, 3, 1e3), loss_evidence_of::<3>, "The same, finger 4"),
];

impl Field {
    /// The value as text, as in a CSV file: a choice by its word, a flag as 0 or 1; empty where it is not known.
    pub fn text(&self, observation: &mut Observation) -> String {
        match (self.kind, (self.place)(observation)) {
            (Choice(words), Place::Whole(Some(number))) => match words.get(usize::from(*number)) {
                Some(word) => (*word).into(),
                None => number.to_string(),
            },
            (_, Place::Double(Some(value))) => format!("{value:.6}"),
            (_, Place::Float(Some(value))) => value.to_string(),
            (_, Place::Whole(Some(value))) => value.to_string(),
            (_, Place::Flag(Some(value))) => u8::from(*value).to_string(),
            _ => String::new(),
        }
    }
}

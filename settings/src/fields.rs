//! The one table of all settings.

use softgrip_table::FINGERS;

use crate::field::{Field, Kind};

/// Every setting, in the order of their numbers; those of a table in the file follow one another.
///
/// A setting is added by a row here, a field in the stage that uses it, and a line of `each` in
/// `src/settings/leaves.rs`. A number that was ever released is not used again.
pub const FIELDS: [Field; COUNT] = of_this_gripper();

/// The first numbers of those that there are one of for each finger.
const PER_FINGER: [u16; 4] = [220, 230, 500, 510];
/// Fingers that a gripper has at most.
const MOST_FINGERS: usize = 4;
/// Number of settings.
pub const COUNT: usize = ALL.len() - PER_FINGER.len() * (MOST_FINGERS - FINGERS);

/// The numbers of a setting of each finger, from that of the first.
pub const fn per_finger(first: u16) -> [u16; FINGERS] {
    let mut numbers = [first; FINGERS];
    let mut finger = 0;
    while finger < FINGERS {
        numbers[finger] += finger as u16;
        finger += 1;
    }
    numbers
}

/// Whether a gripper of so many fingers as this has a setting.
const fn exists(number: u16) -> bool {
    let mut i = 0;
    while i < PER_FINGER.len() {
        let first = PER_FINGER[i];
        if number >= first + FINGERS as u16 && number < first + MOST_FINGERS as u16 {
            return false;
        }
        i += 1;
    }
    true
}

const fn of_this_gripper() -> [Field; COUNT] {
    let mut fields = [ALL[0]; COUNT];
    let (mut from, mut to) = (0, 0);
    while from < ALL.len() {
        if exists(ALL[from].number) {
            fields[to] = ALL[from];
            to += 1;
        }
        from += 1;
    }
    fields
}

/// Those of a gripper with as many fingers as there may be.
#[rustfmt::skip]
const ALL: [Field; 64] = [
    of(100, "regulator.max_pressure_kpa", "kPa", 1.0, 1_000.0, 160.0, "No command and no grip goes above; nor may this go above what the finger's table and the regulator reach"),
    of(101, "regulator.slew_kpa_per_s", "kPa/s", 1.0, 10_000.0, 400.0, "Steepest change of the commanded pressure"),
    of(110, "air.regulator_lag_ms", "ms", 1.0, 1_000.0, 75.0, "Time constant of the regulator, command to pressure"),
    of(111, "air.following_kpa", "kPa", 1.0, 50.0, 8.0, "The pressure follows while it is within this of what the command should give"),

    choice(200, "finger.gauge_sense", &["bend", "contact"], 0, "What the gauges see: the finger's bending, which contact takes from, or contact alone"),
    of(201, "finger.contact_ue", "µε", 1.0, 20_000.0, 500.0, "A finger touches when its residual exceeds this and the share below"),
    of(202, "finger.contact_percent", "%", 0.0, 50.0, 5.0, "Share of the free-bend strain by which the table may be wrong"),
    of(220, "finger.free_bend_gain[0]", "", 0.5, 2.0, 1.0, FREE_BEND),
    of(221, "finger.free_bend_gain[1]", "", 0.5, 2.0, 1.0, FREE_BEND),
    of(222, "finger.free_bend_gain[2]", "", 0.5, 2.0, 1.0, FREE_BEND),
    of(223, "finger.free_bend_gain[3]", "", 0.5, 2.0, 1.0, FREE_BEND),
    of(230, "finger.stiffness[0]", "", 0.7, 1.5, 1.0, STIFFNESS),
    of(231, "finger.stiffness[1]", "", 0.7, 1.5, 1.0, STIFFNESS),
    of(232, "finger.stiffness[2]", "", 0.7, 1.5, 1.0, STIFFNESS),
    of(233, "finger.stiffness[3]", "", 0.7, 1.5, 1.0, STIFFNESS),
    of(240, "finger.meeting_kpa", "kPa", 0.0, 1_000.0, 0.0, "Pressure at which the recipe's free fingers would bend as far as these do when they meet; 0: as the table says"),
    of(241, "finger.empty_percent", "%", 0.1, 50.0, 4.0, "Fingers that close on nothing until they meet lack less of the strain that they show there"),
    of(242, "finger.around_percent", "%", 0.0, 100.0, 75.0, "Fingers that bend on beyond where they meet with less than this share of a free finger's strain bend around something small"),
    of(250, "finger.silicone.inflation_lag_ms", "ms", 1.0, 5_000.0, 80.0, "Time constant of a finger's inflation, pressure to joint torque"),
    of(251, "finger.silicone.deflation_lag_ms", "ms", 1.0, 5_000.0, 80.0, "The same while the pressure falls"),
    of(252, "finger.silicone.hysteresis_percent", "%", 0.0, 25.0, 0.0, "How far apart the pressures of the same shape are on the way up and down, in percent of the table's highest pressure"),
    of(253, "finger.silicone.creep_percent", "%", 0.0, 25.0, 0.0, "So much of the shape follows late, beyond the table's"),
    of(254, "finger.silicone.creep_time_s", "s", 0.1, 600.0, 30.0, "Time constant of the creep"),
    of(255, "finger.silicone.bending_hz", "Hz", 0.1, 50.0, 5.9, "Natural frequency of a finger's bending"),
    of(256, "finger.silicone.bending_damping", "", 0.1, 2.0, 0.45, "Damping ratio of a finger's bending"),

    of(300, "detection.loss_allowance_percent", "%", 1.0, 50.0, 5.0, "Loss: fall of the summed residual, in percent of its plateau, that counts for nothing"),
    of(301, "detection.loss_evidence_percent_ms", "%·ms", 1.0, 10_000.0, 8.0, "Loss: fall beyond the allowance times its duration at which the object is gone"),
    of(302, "detection.slip_percent", "%", 1.0, 50.0, 7.0, "Slip: change of the summed residual at constant pressure, in percent of its plateau"),
    of(303, "detection.air_loss_kpa", "kPa", 1.0, 100.0, 8.0, "The air is going when the pressure lies this far below what the command should give"),

    of(400, "grip.grip_pressure_kpa", "kPa", 1.0, 1_000.0, 140.0, "Pressure of a grip that names none; at most regulator.max_pressure_kpa"),
    of(401, "grip.settle_ms", "ms", 0.0, 10_000.0, 150.0, "From reaching the set-point to judging whether something is held"),
    of(402, "grip.lift_margin_percent", "%", 0.0, 1_000.0, 20.0, "Lift that a grip for a payload must have beyond the payload's load"),
    of(403, "grip.not_following_ms", "ms", 10.0, 10_000.0, 300.0, "A longer deviation of the pressure from what the command should give is a fault"),
    of(404, "grip.supply_min_v", "V", 0.0, 30.0, 20.4, "Lowest supply voltage"),
    of(405, "grip.host_timeout_ms", "ms", 0.0, 60_000.0, 0.0, "The robot must say something this often while the fingers are closed or closing; 0 if it need not"),
    choice(406, "grip.on_fault", &["vent", "hold"], 1, "What the outputs do in a fault that leaves a choice"),
    choice(407, "grip.on_loss", &["hold", "vent", "regrip"], 0, "What the fingers do once the object is gone"),
    of(408, "grip.regrip_raise_kpa", "kPa", 0.0, 1_000.0, 20.0, "How much harder they close then, as far as the limit allows"),

    of(500, "gauge.gain[0]", "", 0.5, 2.0, 1.0, GAIN),
    of(501, "gauge.gain[1]", "", 0.5, 2.0, 1.0, GAIN),
    of(502, "gauge.gain[2]", "", 0.5, 2.0, 1.0, GAIN),
    of(503, "gauge.gain[3]", "", 0.5, 2.0, 1.0, GAIN),
    of(510, "gauge.tare_ue[0]", "µε", -2_000.0, 2_000.0, 0.0, TARE),
    of(511, "gauge.tare_ue[1]", "µε", -2_000.0, 2_000.0, 0.0, TARE),
    of(512, "gauge.tare_ue[2]", "µε", -2_000.0, 2_000.0, 0.0, TARE),
    of(513, "gauge.tare_ue[3]", "µε", -2_000.0, 2_000.0, 0.0, TARE),

    of(600, "front_end.gauge_zero_v", "V", 0.5, 2.8, 1.657, "Output of a gauge's amplifier without strain"),
    of(601, "front_end.gauge_full_scale_v", "V", 0.1, 1.6, 1.212, "By so much it differs from that at full scale"),
    of(602, "front_end.gauge_full_scale_ue", "µε", 100.0, 100_000.0, 20_000.0, "Strain at full scale, up to which a gauge is measured, either way"),
    of(603, "front_end.gauge_short_below_v", "V", 0.0, 1.0, 0.1, "Below this a gauge is shorted"),
    of(604, "front_end.gauge_open_above_v", "V", 2.0, 3.3, 3.2, "Above this a gauge is open"),
    of(610, "front_end.monitor_full_scale_v", "V", 0.5, 3.29, 3.006, "The regulator's monitor at its full scale, as it arrives at the converter"),
    of(611, "front_end.monitor_high_above_v", "V", 0.5, 3.3, 3.2, "Above this the monitor's wire carries something else than its signal"),
    of(620, "front_end.supply_divider", "", 1.0, 50.0, 11.0, "Supply voltage over that at the converter"),
    of(630, "front_end.regulator_full_scale_kpa", "kPa", 10.0, 1_000.0, 200.0, "Full scale of the regulator, for command and monitor"),
    of(631, "front_end.command_full_scale_v", "V", 0.5, 3.29, 3.0, "The converter's output that commands full scale"),
    of(632, "front_end.command_zero_v", "V", 0.0, 0.45, 0.302, "The converter's output up to which nothing is commanded"),

    choice(700, "io.grip", ON, 0, "Level at which the input GRIP is on"),
    choice(701, "io.release", ON, 0, "Level at which the input RELEASE is on"),
    choice(710, "io.holding", ON, 0, "Level at which the output HOLDING is on"),
    choice(711, "io.lost", ON, 0, "Level at which the output LOST is on"),

    of(800, "telemetry.period_ms", "ms", 1.0, 50.0, 20.0, "Time between two snapshots"),

    whole(900, "bus.id", 1, 247, 9, "Id of the gripper on the bus; from the next start on"),
    choice(901, "bus.baud", BAUD, 4, "Bits per second on the bus; from the next start on"),
];

const BAUD: &[&str] = &["9600", "19200", "38400", "57600", "115200", "230400"];
const ON: &[&str] = &["high", "low"];
const GAIN: &str = "Strain of each gauge over what the front end's full scale makes of it";
const TARE: &str = "Strain that each gauge shows at rest, as the last tare measured it";
const FREE_BEND: &str = "Measured free-bend strain over the table's, for each finger";
const STIFFNESS: &str =
    "Stiffness of the finger over the recipe's: it bends at so many times the pressure";

const fn of(
    number: u16,
    name: &'static str,
    unit: &'static str,
    min: f32,
    max: f32,
    default: f32,
    sentence: &'static str,
) -> Field {
    Field {
        number,
        name,
        unit,
        kind: Kind::Number { min, max },
        default,
        sentence,
    }
}

const fn whole(
    number: u16,
    name: &'static str,
    min: u8,
    max: u8,
    default: u8,
    sentence: &'static str,
) -> Field {
    Field {
        number,
        name,
        unit: "",
        kind: Kind::Whole { min, max },
        default: default as f32,
        sentence,
    }
}

const fn choice(
    number: u16,
    name: &'static str,
    words: &'static [&'static str],
    default: u8,
    sentence: &'static str,
) -> Field {
    Field {
        number,
        name,
        unit: "",
        kind: Kind::Choice(words),
        default: default as f32,
        sentence,
    }
}

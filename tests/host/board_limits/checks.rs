//! What each check of the bring-up list shows, by circuit, and with which wrong parts.

use super::parts::*;
use super::{FE, Range, range};
use softgrip::frontend::{RAIL as NOMINAL_RAIL, rail, rail_factor};
use softgrip::units::{AdcCode, DacCode, Kilopascals, Millivolts};

/// One row of the table.
pub struct Check {
    pub name: &'static str,
    /// Last digit that the page gives.
    pub step: f64,
    pub good: Range,
    /// What it is said to find, and what such a board shows.
    pub wrong: Vec<(&'static str, Range)>,
}

/// All that are computed, in the order of the page.
pub fn checks() -> Vec<Check> {
    vec![
        rail_by_meter(),
        rail_told(),
        test_plug(),
        shunt(),
        unplugged(),
        grounded(),
        gauge_at_rest("gauge at rest, two active gauges", GAUGE, TWO_GAUGES_GAIN),
        gauge_at_rest("gauge at rest, one active gauge", BRIDGE, ONE_GAUGE_GAIN),
        noise(),
        monitor_zero(),
        monitor_span(),
        supply(),
        command_zero(),
        command_span(),
        command_in_reset(),
    ]
}

/// Code of a share of the rail.
fn code(share: f64, converter: f64) -> f64 {
    (65_536.0 * share + converter).clamp(0.0, 65_520.0)
}

/// The voltage of a node that resistors tie to voltages, each `(volts, ohms)`, and into which a current flows.
fn node<const N: usize>(ties: [(f64, f64); N], amperes: f64) -> f64 {
    let current: f64 = ties.iter().map(|(volts, ohms)| volts / ohms).sum();
    let conductance: f64 = ties.iter().map(|(_, ohms)| 1.0 / ohms).sum();
    (current + amperes) / conductance
}

fn rail_by_meter() -> Check {
    Check {
        name: "3.3 V rail, V, by meter",
        step: 0.01,
        good: range([RAIL, METER], |[rail, meter]| rail * meter),
        wrong: vec![],
    }
}

/// The rail that the chip tells, mV.
fn told([rail_v, reference, factory, drift, converter]: [f64; 5]) -> f64 {
    let calibrated = 4096.0 * reference / factory;
    let now = code((reference + drift) / rail_v, converter);
    f64::from(rail(AdcCode(now.round() as u16), calibrated.round() as u16).0)
}

fn rail_told() -> Check {
    let parts = [
        RAIL,
        REFERENCE,
        FACTORY_RAIL,
        REFERENCE_DRIFT,
        CONVERTER,
        METER,
    ];
    Check {
        name: "`rail` less the meter's, mV",
        step: 1.0,
        good: range(
            parts,
            |[rail, reference, factory, drift, converter, meter]| {
                told([rail, reference, factory, drift, converter]) - 1e3 * rail * meter
            },
        ),
        wrong: vec![],
    }
}

fn test_plug() -> Check {
    let shown = |upper, lower, pull_up| bridge(upper, lower, TWO_GAUGES_GAIN, pull_up);
    Check {
        name: "gauge, test plug, code",
        step: 10.0,
        good: shown(HALVING, HALVING, PULL_UP),
        wrong: vec![
            (
                "22 kΩ as pull-up",
                shown(HALVING, HALVING, resistor(22e3, 1.0)),
            ),
            ("EXC open", shown(OPEN, HALVING, PULL_UP)),
            ("GND open", shown(HALVING, OPEN, PULL_UP)),
        ],
    }
}

/// What a resistor across the plug's upper one adds.
fn shunt() -> Check {
    let shown = |gain| {
        let parts = [HALVING, HALVING, SHUNT, gain, AMPLIFIER_GAIN, CONVERTER];
        range(parts, |[upper, lower, shunt, gain, factor, converter]| {
            let middle = |upper: f64| lower / (upper + lower);
            let shunted = upper * shunt / (upper + shunt);
            let signal = middle(shunted) - middle(upper);
            code((1.0 + 100e3 / gain) * factor * signal, converter)
        })
    };
    Check {
        name: "gauge, 100 kΩ across the plug's upper resistor, codes more",
        step: 10.0,
        good: shown(TWO_GAUGES_GAIN),
        wrong: vec![
            ("576 Ω for the gain", shown(resistor(576.0, 0.1))),
            ("57.6 kΩ for the gain", shown(resistor(57.6e3, 0.1))),
            ("no resistor for the gain", shown(OPEN)),
            ("the resistor for one active gauge", shown(ONE_GAUGE_GAIN)),
        ],
    }
}

fn unplugged() -> Check {
    Check {
        name: "gauge, unplugged, code",
        step: 10.0,
        good: open_wire(),
        wrong: vec![],
    }
}

/// The amplifier at its upper end.
pub fn open_wire() -> Range {
    let parts = [AMPLIFIER_SWING, FILTER, LEAKAGE, CONVERTER];
    range(parts, |[swing, filter, leakage, converter]| {
        code((3.3 - swing + filter * leakage) / 3.3, converter)
    })
}

fn grounded() -> Check {
    Check {
        name: "gauge, SIG to GND at the plug, code",
        step: 10.0,
        good: shorted_wire(),
        wrong: vec![],
    }
}

/// The amplifier at its lower end.
pub fn shorted_wire() -> Range {
    let parts = [AMPLIFIER_SWING, FILTER, LEAKAGE, CONVERTER];
    range(parts, |[swing, filter, leakage, converter]| {
        code((swing + filter * leakage) / 3.3, converter)
    })
}

/// `other`: the bridge's upper arm, a gauge or a resistor.
fn gauge_at_rest(name: &'static str, other: Part, gain: Part) -> Check {
    let shown = |upper, lower| bridge(upper, lower, gain, PULL_UP);
    Check {
        name,
        step: 10.0,
        good: shown(other, GAUGE),
        wrong: vec![
            ("upper arm open", shown(OPEN, GAUGE)),
            ("upper arm shorted", shown(SHORTED, GAUGE)),
            ("lower arm open", shown(other, OPEN)),
            ("lower arm shorted", shown(other, SHORTED)),
            ("350 Ω in one arm", shown(other, resistor(350.0, 0.3))),
        ],
    }
}

/// The code of a bridge at rest: its middle against half of the reference, both by followers.
pub fn bridge(upper: Part, lower: Part, gain: Part, pull_up: Part) -> Range {
    let parts = [
        upper,
        lower,
        pull_up,
        HALVES,
        FOLLOWER_OFFSET,
        FOLLOWER_OFFSET,
        gain,
        AMPLIFIER_GAIN,
        AMPLIFIER_OFFSET,
        FILTER,
        LEAKAGE,
        CONVERTER,
    ];
    range(
        parts,
        |[
            upper,
            lower,
            pull_up,
            halves,
            excitation,
            reference,
            gain,
            factor,
            offset,
            filter,
            leakage,
            converter,
        ]| {
            let half = 3.3 / (1.0 + halves) + reference;
            let middle = node(
                [(3.3 + excitation, upper), (0.0, lower), (3.3, pull_up)],
                0.0,
            );
            let output = half + (1.0 + 100e3 / gain) * factor * (middle - half + offset);
            let swing = AMPLIFIER_SWING.value;
            code(
                (output.clamp(swing, 3.3 - swing) + filter * leakage) / 3.3,
                converter,
            )
        },
    )
}

/// Of one active gauge, whose gain is the higher one.
fn noise() -> Check {
    let shown = |hum_v| {
        let parts = [CONVERTER_NOISE, AMPLIFIER_NOISE, NOISE_ESTIMATE, hum_v];
        range(parts, |[converter, amplifier, estimate, hum]| {
            let gain = 1.0 + 100e3 / ONE_GAUGE_GAIN.value;
            let amplifier = gain * amplifier * 65_536.0 / 3.3;
            // Seven scans, at worst. They hardly average out hum, nor what the bridge's filter has left.
            let one = (16.0 * converter / 7f64.sqrt()).hypot(amplifier);
            let codes = one.hypot(hum * 65_536.0 / 3.3);
            estimate * codes * f64::from(FE.gauge_ue_per_code[0])
        })
    };
    Check {
        name: "noise of each gauge, µε rms",
        step: 0.1,
        good: shown(exactly(0.0)),
        wrong: vec![("1 mV rms of interference at the pin", shown(exactly(1e-3)))],
    }
}

/// Pressure that is told with so much at the connector, kPa.
fn pressure(at_connector: Part, upper: Part, lower: Part) -> Range {
    let parts = [
        RAIL,
        REFERENCE,
        FACTORY_RAIL,
        REFERENCE_DRIFT,
        CONVERTER,
        at_connector,
        upper,
        lower,
        LEAKAGE,
        CLAMP,
        CONVERTER,
    ];
    range(
        parts,
        |[
            rail,
            reference,
            factory,
            drift,
            at_reference,
            volts,
            upper,
            lower,
            leakage,
            clamp,
            converter,
        ]| {
            let pin = node([(volts, upper), (0.0, lower)], leakage + clamp);
            let seen = FE.pressure(AdcCode(code(pin / rail, converter).round() as u16));
            let told = told([rail, reference, factory, drift, at_reference]);
            f64::from(rail_factor(Millivolts(told as u16)) * seen.0)
        },
    )
}

fn monitor_zero() -> Check {
    Check {
        name: "monitor, connector grounded, kPa",
        step: 0.1,
        good: pressure(exactly(0.0), MONITOR_UPPER, MONITOR_LOWER),
        wrong: vec![],
    }
}

fn monitor_span() -> Check {
    let shown = |upper, lower| pressure(around(5.0, 0.005), upper, lower);
    Check {
        name: "monitor, 5.00 V at the connector, kPa",
        step: 0.1,
        good: shown(MONITOR_UPPER, MONITOR_LOWER),
        wrong: vec![
            (
                "69.8 kΩ and 30 kΩ swapped",
                shown(MONITOR_LOWER, MONITOR_UPPER),
            ),
            ("69.8 kΩ open", shown(OPEN, MONITOR_LOWER)),
            ("30 kΩ open", shown(MONITOR_UPPER, OPEN)),
            ("the supply's divider", shown(SUPPLY_UPPER, SUPPLY_LOWER)),
        ],
    }
}

fn supply() -> Check {
    let shown = |upper, lower| {
        let parts = [RAIL, METER, upper, lower, LEAKAGE, CLAMP, CONVERTER];
        range(
            parts,
            |[rail, meter, upper, lower, leakage, clamp, converter]| {
                let pin = node([(24.0 * meter, upper), (0.0, lower)], leakage + clamp);
                code(pin / rail, converter)
            },
        )
    };
    Check {
        name: "supply, 24.0 V, code",
        step: 10.0,
        good: shown(SUPPLY_UPPER, SUPPLY_LOWER),
        wrong: vec![
            (
                "100 kΩ and 10 kΩ swapped",
                shown(SUPPLY_LOWER, SUPPLY_UPPER),
            ),
            (
                "1 kΩ for the 10 kΩ",
                shown(SUPPLY_UPPER, resistor(1e3, 1.0)),
            ),
            ("100 kΩ open", shown(OPEN, SUPPLY_LOWER)),
            ("10 kΩ open", shown(SUPPLY_UPPER, OPEN)),
            ("the monitor's divider", shown(MONITOR_UPPER, MONITOR_LOWER)),
        ],
    }
}

/// Command at the connector, V, where the pin has so many volts: what it is multiplied by, less its share of the
/// reference.
fn amplified(
    pin: f64,
    rail: f64,
    [feedback, ground, reference]: [f64; 3],
    offset: f64,
    swing: f64,
) -> f64 {
    let gain = 1.0 + feedback / ground + feedback / reference;
    (gain * (pin + offset) - rail * feedback / reference).clamp(swing, 12.0)
}

/// Command at the connector, V, of a code of the converter. The loop closes at the connector, so no load shows.
fn command(code: f64, [feedback, ground, reference]: [Part; 3]) -> Range {
    let parts = [
        RAIL,
        DAC_GAIN,
        DAC_OFFSET,
        DAC_STEPS,
        DAC_LOW,
        COMMAND_OFFSET,
        feedback,
        ground,
        reference,
        COMMAND_SWING,
    ];
    range(
        parts,
        |[
            rail,
            gain,
            offset,
            steps,
            low,
            amplifier,
            feedback,
            ground,
            reference,
            swing,
        ]| {
            let pin = (rail * (gain * code + steps) / 4096.0 + offset).max(low);
            amplified(pin, rail, [feedback, ground, reference], amplifier, swing)
        },
    )
}

const LOOP: [Part; 3] = [FEEDBACK, TO_GROUND, TO_REFERENCE];

fn command_zero() -> Check {
    Check {
        name: "command at rest, regulator unplugged, V",
        step: 0.01,
        good: command(0.0, LOOP),
        wrong: vec![],
    }
}

/// The code of 140 kPa, which is 7 V.
fn command_span() -> Check {
    let DacCode(at) = FE.command(Kilopascals(140.0));
    let shown = |parts| command(f64::from(at), parts);
    Check {
        name: "command while holding at 140 kPa, V",
        step: 0.01,
        good: shown(LOOP),
        wrong: vec![
            ("no 8.45 kΩ", shown([FEEDBACK, OPEN, TO_REFERENCE])),
            ("no 20 kΩ", shown([OPEN, TO_GROUND, TO_REFERENCE])),
            (
                "8.45 kΩ and 20 kΩ swapped",
                shown([TO_GROUND, FEEDBACK, TO_REFERENCE]),
            ),
        ],
    }
}

/// The pin floats and leaks.
fn command_in_reset() -> Check {
    let parts = [
        RAIL,
        LEAKAGE,
        PULL_DOWN,
        COMMAND_OFFSET,
        FEEDBACK,
        TO_GROUND,
        TO_REFERENCE,
        COMMAND_SWING,
    ];
    Check {
        name: "command, reset held down, V",
        step: 0.01,
        good: range(
            parts,
            |[
                rail,
                leakage,
                down,
                offset,
                feedback,
                ground,
                reference,
                swing,
            ]| {
                let resistors = [feedback, ground, reference];
                amplified(leakage * down, rail, resistors, offset, swing)
            },
        ),
        wrong: vec![],
    }
}

/// The highest code of the monitor at this pressure, at the lowest rail that is no fault.
pub fn highest_monitor_code(pressure: Kilopascals) -> f64 {
    let rail = 0.95 * f64::from(NOMINAL_RAIL.0) / 1e3;
    let volts = 10.0 * f64::from(pressure.0) / f64::from(FE.regulator_full_scale.0);
    let parts = [MONITOR_UPPER, MONITOR_LOWER, LEAKAGE, CLAMP, CONVERTER];
    let shown = range(parts, |[upper, lower, leakage, clamp, converter]| {
        let pin = node([(volts, upper), (0.0, lower)], leakage + clamp);
        code(pin / rail, converter)
    });
    shown.high
}

/// How far off the chip tells a good rail at most, mV.
pub fn rail_told_off() -> f64 {
    let parts = [RAIL, REFERENCE, FACTORY_RAIL, REFERENCE_DRIFT, CONVERTER];
    let off = range(parts, told);
    let nominal = f64::from(NOMINAL_RAIL.0);
    (off.high - nominal).max(nominal - off.low)
}

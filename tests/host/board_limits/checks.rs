//! What each check of the bring-up list shows, by circuit, and with which wrong parts.

use super::parts::*;
use super::{FE, Range, range};
use softgrip::frontend::{RAIL as NOMINAL_RAIL, rail, rail_factor};
use softgrip::units::{AdcCode, Kilopascals, Millivolts};

/// Gain of the amplifier: 20 000 µε make 1.5 V with a gauge factor of 2.
pub const TWO_GAUGES_GAIN: f64 = 22.7;
pub const ONE_GAUGE_GAIN: f64 = 45.5;

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
        halved_rail(),
        open_filter(),
        grounded_filter(),
        gauge_at_rest("gauge at rest, two active gauges", GAUGE, TWO_GAUGES_GAIN),
        gauge_at_rest("gauge at rest, one active gauge", BRIDGE, ONE_GAUGE_GAIN),
        noise(),
        monitor_zero(),
        monitor_span(),
        supply(),
        command_zero(),
        command_span(),
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

fn halved_rail() -> Check {
    let shown = |filter, pull_up| {
        let parts = [filter, pull_up, HALVING, HALVING, LEAKAGE, CONVERTER];
        range(
            parts,
            |[filter, pull_up, upper, lower, leakage, converter]| {
                // Two resistors are one of both in parallel at what they divide.
                let divided = lower / (upper + lower);
                let source = upper * lower / (upper + lower);
                let volts = node([(3.3 * divided, source + filter), (3.3, pull_up)], leakage);
                code(volts / 3.3, converter)
            },
        )
    };
    Check {
        name: "gauge, half the rail at the filter, code",
        step: 10.0,
        good: shown(FILTER, PULL_UP),
        wrong: vec![
            ("no pull-up", shown(FILTER, OPEN)),
            ("1 kΩ as pull-up", shown(FILTER, resistor(1e3, 1.0))),
            ("1 MΩ as pull-up", shown(FILTER, resistor(1e6, 1.0))),
            ("filter and pull-up swapped", shown(PULL_UP, FILTER)),
            ("10 kΩ as filter", shown(resistor(10e3, 1.0), PULL_UP)),
            ("no filter", shown(OPEN, PULL_UP)),
        ],
    }
}

fn open_filter() -> Check {
    Check {
        name: "gauge, nothing at the filter, code",
        step: 10.0,
        good: pin_without_source(PULL_UP),
        wrong: vec![],
    }
}

/// The code of a filter without an amplifier, or with a broken wire to it.
pub fn pin_without_source(pull_up: Part) -> Range {
    range(
        [pull_up, LEAKAGE, CONVERTER],
        |[pull_up, leakage, converter]| {
            code(node([(3.3, pull_up)], leakage).min(3.3) / 3.3, converter)
        },
    )
}

fn grounded_filter() -> Check {
    Check {
        name: "gauge, filter grounded, code",
        step: 10.0,
        good: pin_at(exactly(0.0), PULL_UP),
        wrong: vec![
            (
                "10 kΩ as pull-up",
                pin_at(exactly(0.0), resistor(10e3, 1.0)),
            ),
            ("no pull-up", pin_at(exactly(0.0), OPEN)),
        ],
    }
}

/// The code while the amplifier puts out so many volts.
pub fn pin_at(volts: Part, pull_up: Part) -> Range {
    let parts = [volts, FILTER, pull_up, LEAKAGE, CONVERTER];
    range(parts, |[volts, filter, pull_up, leakage, converter]| {
        code(
            node([(volts, filter), (3.3, pull_up)], leakage) / 3.3,
            converter,
        )
    })
}

/// `other`: the bridge's other arm, a gauge or a resistor.
fn gauge_at_rest(name: &'static str, other: Part, gain: f64) -> Check {
    let shown = |upper, lower| bridge(upper, lower, gain);
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

/// The code of a bridge at rest, of whose arm the middle goes to the amplifier. Its reference is the rail
/// halved by two resistors.
pub fn bridge(upper: Part, lower: Part, gain: f64) -> Range {
    let parts = [
        upper,
        lower,
        BRIDGE,
        BRIDGE,
        AMPLIFIER_GAIN,
        AMPLIFIER_OFFSET,
        FILTER,
        PULL_UP,
        LEAKAGE,
        CONVERTER,
    ];
    range(
        parts,
        |[
            upper,
            lower,
            up,
            down,
            factor,
            offset,
            filter,
            pull_up,
            leakage,
            converter,
        ]| {
            let middle = 3.3 * down / (up + down);
            let signal = 3.3 * lower / (upper + lower) - middle + offset;
            let output = (middle + gain * factor * signal).clamp(0.0, 3.3);
            let volts = node([(output, filter), (3.3, pull_up)], leakage);
            code(volts / 3.3, converter)
        },
    )
}

/// Of one active gauge, whose gain is the higher one.
fn noise() -> Check {
    let shown = |hum_v| {
        let parts = [CONVERTER_NOISE, AMPLIFIER_NOISE, NOISE_ESTIMATE, hum_v];
        range(parts, |[converter, amplifier, estimate, hum]| {
            let amplifier = ONE_GAUGE_GAIN * amplifier * 65_536.0 / 3.3;
            // Seven scans, at worst. They hardly average out hum.
            let one = (16.0 * converter).hypot(amplifier) / 7f64.sqrt();
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
                "70 kΩ and 30 kΩ swapped",
                shown(MONITOR_LOWER, MONITOR_UPPER),
            ),
            ("70 kΩ open", shown(OPEN, MONITOR_LOWER)),
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

/// Command at the connector, V, of a code of the converter.
fn command(code: f64, load: Part, upper: Part, lower: Part) -> Range {
    let parts = [
        RAIL,
        DAC_GAIN,
        DAC_OFFSET,
        DAC_STEPS,
        DAC_RESISTANCE,
        LEAKAGE,
        PULL_DOWN,
        COMMAND_OFFSET,
        upper,
        lower,
        COMMAND_SWING,
        SERIES,
        load,
    ];
    range(
        parts,
        |[
            rail,
            gain,
            offset,
            steps,
            source,
            leakage,
            down,
            amplifier,
            upper,
            lower,
            swing,
            series,
            load,
        ]| {
            let converter = rail * (gain * code + steps) / 4096.0 + offset;
            // Of zero ohms nothing is divided.
            let pin = node([(converter, source.max(1e-3)), (0.0, down)], leakage).max(0.0);
            let output = (1.0 + upper / lower) * (pin + amplifier);
            output.clamp(swing, 12.0) / (1.0 + series * load)
        },
    )
}

fn command_zero() -> Check {
    Check {
        name: "command at rest, regulator unplugged, V",
        step: 0.01,
        good: command(0.0, exactly(0.0), FEEDBACK_UPPER, FEEDBACK_LOWER),
        wrong: vec![],
    }
}

/// 140 kPa is 7 V, of which a thousand codes are a part.
fn command_span() -> Check {
    let at = 2_607.0;
    let shown = |upper, lower| {
        let volts = command(at, REGULATOR_INPUT, upper, lower);
        let per_thousand = |v: f64| v * 1e3 / at;
        Range {
            value: per_thousand(volts.value),
            low: per_thousand(volts.low),
            high: per_thousand(volts.high),
            rss: per_thousand(volts.rss),
        }
    };
    Check {
        name: "command while holding at 140 kPa, V per 1000 codes",
        step: 0.01,
        good: shown(FEEDBACK_UPPER, FEEDBACK_LOWER),
        wrong: vec![
            ("7:3 as 3:7", shown(FEEDBACK_LOWER, FEEDBACK_UPPER)),
            ("7 open", shown(exactly(1e6), FEEDBACK_LOWER)),
            ("3 open", shown(FEEDBACK_UPPER, OPEN)),
        ],
    }
}

/// What may leak out of the DAC's pin in reset so that the command stays below so many volts on every board, A.
pub fn leakage_in_reset(volts: f64) -> f64 {
    let gain = 1.0 + FEEDBACK_UPPER.high / FEEDBACK_LOWER.low;
    (volts / gain - COMMAND_OFFSET.high) / PULL_DOWN.high
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

//! The parts of the shield (`hardware/bom.csv`): value, tolerance, and where the tolerance comes from.

/// A value and the range in which a good part lies, in volts, ohms, amperes, or as a share.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

pub const fn within(low: f64, value: f64, high: f64) -> Part {
    Part { value, low, high }
}

/// A value, give or take `by`.
pub const fn around(value: f64, by: f64) -> Part {
    within(value - by, value, value + by)
}

/// A resistor of so many percent.
pub const fn resistor(ohms: f64, percent: f64) -> Part {
    around(ohms, ohms * percent / 100.0)
}

/// A part that is exactly this: a wrong one, as a rule.
pub const fn exactly(value: f64) -> Part {
    around(value, 0.0)
}

/// No resistor where one belongs.
pub const OPEN: Part = exactly(1e12);
/// A bridge of solder where a resistor belongs.
pub const SHORTED: Part = exactly(1e-3);

/// 2 % at 25 °C, 3 % over temperature: the board's regulator (LD39050 data sheet), as in `src/frontend.rs`.
pub const RAIL: Part = around(3.3, 0.03 * 3.3);

// Chip: STM32F429ZI, data sheet DS9405.
/// Total unadjusted error at 30 MHz (ADC accuracy), which holds offset, gain and linearity; of all codes of 16 bits.
pub const CONVERTER: Part = around(0.0, 5.0 * 16.0);
/// Input leakage of a pin (I/O static characteristics).
pub const LEAKAGE: Part = around(0.0, 1e-6);
/// The internal reference (embedded reference voltage).
pub const REFERENCE: Part = around(1.21, 0.03);
/// The rail at which the factory read it.
pub const FACTORY_RAIL: Part = around(3.3, 0.01);
/// Its spread over temperature.
pub const REFERENCE_DRIFT: Part = around(0.0, 5e-3);
/// SNR of the converter, 64 dB at least (ADC dynamic accuracy): of a full sine, 2048 steps of amplitude. Steps rms.
pub const CONVERTER_NOISE: Part = within(0.0, 0.8, 0.914);
/// Offset, gain and linearity of the DAC (DAC characteristics).
pub const DAC_OFFSET: Part = around(0.0, 10e-3);
pub const DAC_GAIN: Part = around(1.0, 0.005);
pub const DAC_STEPS: Part = around(0.0, 4.0);
/// What its buffer makes of code 0.
pub const DAC_LOW: Part = within(0.0, 0.07, 0.2);

// Gauge amplifier.
/// A foil gauge as delivered, against its nominal resistance: 0.3 % in the makers' data sheets; 1 kΩ.
pub const GAUGE: Part = resistor(1e3, 0.3);
/// The same data sheets.
pub const GAUGE_FACTOR: Part = around(1.0, 0.01);
/// In the other arm, where one gauge is active.
pub const BRIDGE: Part = resistor(1e3, 0.1);
/// Of the two halves of the reference, against each other (MPMT data sheet).
pub const HALVES: Part = around(1.0, 0.0005);
/// Of a follower (MCP6024 data sheet).
pub const FOLLOWER_OFFSET: Part = around(0.0, 0.5e-3);
pub const PULL_UP: Part = resistor(2.2e6, 1.0);
/// What makes the gain: 1 + 100 kΩ over it (INA333 data sheet).
pub const TWO_GAUGES_GAIN: Part = resistor(5.76e3, 0.1);
pub const ONE_GAUGE_GAIN: Part = resistor(2.8e3, 0.1);
/// 0.25 % at gains of 10 to 100 (INA333 data sheet).
pub const AMPLIFIER_GAIN: Part = around(1.0, 0.0025);
/// At the input: 25 µV and 75 µV over the gain (INA333 data sheet).
pub const AMPLIFIER_OFFSET: Part = around(0.0, 30e-6);
/// How near to ground and rail it comes: 50 mV are promised, 5 mV typical without a load (INA333 data sheet).
pub const AMPLIFIER_SWING: Part = within(0.005, 0.01, 0.05);
/// 50 nV/√Hz (INA333 data sheet) in the 740 Hz of the bridge's filter (`hardware/README.md`), V rms at the input.
pub const AMPLIFIER_NOISE: Part = within(1.7e-6, 1.7e-6, 1.7e-6);
pub const FILTER: Part = resistor(1e3, 1.0);

// Monitor and supply.
pub const MONITOR_UPPER: Part = resistor(69.8e3, 0.1);
pub const MONITOR_LOWER: Part = resistor(30e3, 0.1);
pub const SUPPLY_UPPER: Part = resistor(100e3, 1.0);
pub const SUPPLY_LOWER: Part = resistor(10e3, 1.0);
/// Two BAS70, of which one leaks up to 100 nA either way (BAS70 data sheet).
pub const CLAMP: Part = around(0.0, 100e-9);

// Command.
pub const PULL_DOWN: Part = resistor(10e3, 1.0);
pub const FEEDBACK: Part = resistor(20e3, 0.1);
pub const TO_GROUND: Part = resistor(8.45e3, 0.1);
pub const TO_REFERENCE: Part = resistor(59e3, 0.1);
/// A CMOS amplifier for 12 V (TLV9301 data sheet): offset, and how near to ground it comes.
pub const COMMAND_OFFSET: Part = around(0.0, 2.5e-3);
pub const COMMAND_SWING: Part = within(0.0, 0.01, 0.03);

// The bench.
/// Two equal resistors in a plug instead of the gauges, and one across the upper.
pub const HALVING: Part = resistor(1e3, 0.1);
pub const SHUNT: Part = resistor(100e3, 0.1);
/// What a meter of the laboratory adds to a voltage, as a share.
pub const METER: Part = around(1.0, 0.001);
/// Spread of the estimate over its 250 ms: four standard deviations, of 500 differences that overlap.
pub const NOISE_ESTIMATE: Part = around(1.0, 0.15);

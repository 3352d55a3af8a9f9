//! The analogue front end: what a converter code means.
//!
//! Both directions stand here, so that the simulated gripper and the firmware cannot disagree.

use crate::math::{larger, smaller};
use crate::units::{AdcCode, DacCode, FINGERS, Kilopascals, Microstrain, Millivolts, Volts};

/// What the converters' volts mean: amplifiers, dividers and regulator. `hardware/` has the circuit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Output of a gauge's amplifier without strain.
    pub gauge_zero_v: f32,
    /// By so much it differs from that at full scale.
    pub gauge_full_scale_v: f32,
    /// Strain at full scale, up to which a gauge is measured, either way.
    pub gauge_full_scale_ue: f32,
    /// Below this a gauge is shorted.
    pub gauge_short_below_v: f32,
    /// Above this a gauge is open.
    pub gauge_open_above_v: f32,
    /// The regulator's monitor at its full scale, as it arrives at the converter.
    pub monitor_full_scale_v: f32,
    /// Above this the monitor's wire carries something else than its signal.
    pub monitor_high_above_v: f32,
    /// Supply voltage over that at the converter.
    pub supply_divider: f32,
    /// Full scale of the regulator, for command and monitor.
    pub regulator_full_scale_kpa: f32,
    /// The converter's output that commands full scale.
    pub command_full_scale_v: f32,
    /// Up to this it commands nothing.
    pub command_zero_v: f32,
}

impl Settings {
    /// The shield of `hardware/`, which every supported board carries; its constants are computed from the parts
    /// (`hardware/front_end.toml`).
    pub const REFERENCE: Self = Self {
        gauge_zero_v: 1.657,
        gauge_full_scale_v: 1.212,
        gauge_full_scale_ue: 20_000.0,
        // The amplifier ends within 50 mV of ground and rail (INA333 data sheet), where a wire that is shorted or broken
        // takes it; 25 000 µε are 0.14 and 3.17 V.
        gauge_short_below_v: 0.1,
        gauge_open_above_v: 3.2,
        // 10 V is 200 kPa.
        monitor_full_scale_v: 3.006,
        monitor_high_above_v: 3.2,
        // 100 kΩ : 10 kΩ.
        supply_divider: 11.0,
        regulator_full_scale_kpa: 200.0,
        // 3 V make 10 V, which is 200 kPa. The converter's buffer ends at 0.2 V, the command's amplifier subtracts 0.3 V.
        command_full_scale_v: 3.0,
        command_zero_v: 0.302,
    };
}

impl Default for Settings {
    fn default() -> Self {
        Self::REFERENCE
    }
}

/// Gain and zero of each gauge, beyond the front end's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeSettings {
    /// Strain of each gauge over what the front end's full scale makes of it.
    pub gain: [f32; FINGERS],
    /// Strain that each gauge shows at rest, as the last tare measured it.
    pub tare_ue: [f32; FINGERS],
}

impl Default for GaugeSettings {
    fn default() -> Self {
        Self {
            gain: [1.0; FINGERS],
            tare_ue: [0.0; FINGERS],
        }
    }
}

/// What every gauge's amplifier puts out, whatever the gain of its gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// Code without strain.
    pub zero: f32,
    /// By so many codes it differs from that at full scale.
    pub full_scale_codes: f32,
    /// Strain at full scale, at a gain of one.
    pub full_scale: Microstrain,
    /// The lowest and the highest code that are strain.
    pub linear: [AdcCode; 2],
    /// Below this the gauge is shorted.
    pub short_below: AdcCode,
    /// Above this the gauge is open.
    pub open_above: AdcCode,
}

impl Amplifier {
    /// Strain of a code, where one code is so many µε, before tare.
    pub(crate) fn strain(&self, code: AdcCode, ue_per_code: f32) -> Microstrain {
        Microstrain((f32::from(code.0) - self.zero) * ue_per_code)
    }

    const fn of(settings: &Settings) -> Self {
        let zero = settings.gauge_zero_v / V_PER_ADC_CODE;
        let codes = settings.gauge_full_scale_v / V_PER_ADC_CODE;
        Self {
            zero,
            full_scale_codes: codes,
            full_scale: Microstrain(settings.gauge_full_scale_ue),
            // The last whole codes inside.
            linear: [
                AdcCode(((zero - codes) as u16).saturating_add(1)),
                AdcCode((zero + codes) as u16),
            ],
            short_below: AdcCode((settings.gauge_short_below_v / V_PER_ADC_CODE) as u16),
            open_above: AdcCode((settings.gauge_open_above_v / V_PER_ADC_CODE) as u16),
        }
    }
}

/// Scale of every analogue channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontEnd {
    /// What the gauges' amplifiers put out.
    pub amplifier: Amplifier,
    /// Strain of one code of each gauge, µε.
    pub gauge_ue_per_code: [f32; FINGERS],
    /// Pressure of one code of the regulator's monitor, kPa.
    pub monitor_kpa_per_code: f32,
    /// Above this the monitor's wire carries something else than its signal.
    pub monitor_high_above: AdcCode,
    /// Supply voltage of one code, V.
    pub supply_v_per_code: f32,
    /// Up to this converter code nothing is commanded.
    pub command_zero: f32,
    /// Converter codes per kilopascal of command beyond that.
    pub command_codes_per_kpa: f32,
    /// Command at the regulator's 10 V.
    pub regulator_full_scale: Kilopascals,
}

/// Reference voltage of both converters, V (NUCLEO boards tie VREF+ to the 3.3 V rail).
const VREF: f32 = 3.3;
/// Volts of one left-aligned ADC code: 4096 steps of 12 bits, times 16.
const V_PER_ADC_CODE: f32 = VREF / 65_536.0;
/// Codes of the DAC per volt: 12 bits.
const DAC_CODES_PER_V: f32 = 4096.0 / VREF;
/// How near to ground and rail the gauges' amplifier comes (INA333 data sheet, output swing).
const AMPLIFIER_ENDS_V: f32 = 0.05;

/// The 3.3 V rail, which is the reference of all converters, where it is exactly right.
pub const RAIL: Millivolts = Millivolts(3_300);
/// Farther off than this share, 5 %, the board's regulator is faulty or overloaded: it is good for 2 % at
/// 25 °C and 3 % over temperature. What the chip says of it is good for 1.1 %: 0.3 % of factory calibration,
/// which is done at 3.3 V ± 10 mV, 0.4 % of temperature (DS9405, embedded reference voltage), and 0.3 % of the
/// converter's 5 steps.
const RAIL_TOLERANCE: u16 = RAIL.0 / 20;

/// Codes of the chip's internal reference, 12 bits at 3.3 V: 1.18 to 1.24 V, and 1.21 V typically.
const REFERENCE_CODES: core::ops::RangeInclusive<u16> = 1_464..=1_539;
const TYPICAL_REFERENCE_CODE: u16 = 1_502;

/// The factory's code of the internal reference, or the typical one where the factory has left none.
pub fn reference_code(factory: u16) -> u16 {
    match REFERENCE_CODES.contains(&factory) {
        true => factory,
        false => TYPICAL_REFERENCE_CODE,
    }
}

/// The rail at which the internal reference reads `code`, where it reads `calibrated`, 12 bits, at 3.3 V.
pub fn rail(code: AdcCode, calibrated: u16) -> Millivolts {
    let code = u32::from(code.0);
    // Left-aligned, as the code is.
    let calibrated = 16 * u32::from(calibrated);
    let millivolts = u32::from(RAIL.0)
        .saturating_mul(calibrated)
        .saturating_add(code / 2)
        .checked_div(code)
        .unwrap_or(u32::MAX);
    Millivolts(u16::try_from(millivolts).unwrap_or(u16::MAX))
}

/// Whether the rail is good enough to measure by.
pub fn rail_is_good(rail: Millivolts) -> bool {
    (RAIL.0 - RAIL_TOLERANCE..=RAIL.0 + RAIL_TOLERANCE).contains(&rail.0)
}

/// What a voltage is multiplied by that was computed from its code as if the rail were 3.3 V. Gauges need none
/// of it: their bridges hang on the same rail.
pub fn rail_factor(rail: Millivolts) -> f32 {
    f32::from(rail.0) / f32::from(RAIL.0)
}

impl FrontEnd {
    /// The front end of [`Settings::REFERENCE`] with gauges as it makes them.
    pub const REFERENCE: Self = Self::of(&Settings::REFERENCE, [1.0; FINGERS]);

    /// The front end of these settings, with gauges of this gain.
    pub const fn of(settings: &Settings, gain: [f32; FINGERS]) -> Self {
        let full_scale_ue = settings.gauge_full_scale_ue;
        let ue_per_code = V_PER_ADC_CODE * full_scale_ue / settings.gauge_full_scale_v;
        let mut gauge_ue_per_code = gain;
        let mut gauge = 0;
        while gauge < FINGERS {
            gauge_ue_per_code[gauge] *= ue_per_code;
            gauge += 1;
        }
        let full_scale_kpa = settings.regulator_full_scale_kpa;
        Self {
            amplifier: Amplifier::of(settings),
            gauge_ue_per_code,
            monitor_kpa_per_code: V_PER_ADC_CODE * full_scale_kpa / settings.monitor_full_scale_v,
            monitor_high_above: AdcCode((settings.monitor_high_above_v / V_PER_ADC_CODE) as u16),
            supply_v_per_code: V_PER_ADC_CODE * settings.supply_divider,
            command_zero: DAC_CODES_PER_V * settings.command_zero_v,
            command_codes_per_kpa: DAC_CODES_PER_V
                * (settings.command_full_scale_v - settings.command_zero_v)
                / full_scale_kpa,
            regulator_full_scale: Kilopascals(full_scale_kpa),
        }
    }

    /// Strain of each gauge's code, before tare.
    pub fn strains(&self, codes: &[AdcCode; FINGERS]) -> [Microstrain; FINGERS] {
        let gauges = self.gauge_ue_per_code.iter().zip(codes);
        let mut strains = [Microstrain(0.0); FINGERS];
        for (strain, (ue_per_code, code)) in strains.iter_mut().zip(gauges) {
            *strain = self.amplifier.strain(*code, *ue_per_code);
        }
        strains
    }

    /// The code of a gauge's strain, not yet quantised: what its amplifier puts out. It clips near ground and rail.
    pub fn gauge_code(&self, gauge: usize, strain: Microstrain) -> f32 {
        const ENDS: f32 = AMPLIFIER_ENDS_V / V_PER_ADC_CODE;
        let ue_per_code = self.gauge_ue_per_code.get(gauge).unwrap_or(&f32::INFINITY);
        (strain.0 / ue_per_code + self.amplifier.zero).clamp(ENDS, 65_536.0 - ENDS)
    }

    /// Pressure of a monitor code.
    pub fn pressure(&self, code: AdcCode) -> Kilopascals {
        Kilopascals(f32::from(code.0) * self.monitor_kpa_per_code)
    }

    /// Voltage of a supply code.
    pub fn supply(&self, code: AdcCode) -> Volts {
        Volts(f32::from(code.0) * self.supply_v_per_code)
    }

    /// The DAC code nearest to a commanded pressure. Nothing, negative and NaN give the safe code, zero.
    pub fn command(&self, pressure: Kilopascals) -> DacCode {
        // `larger` returns the number where the other is a NaN; the cast saturates.
        let pressure = smaller(larger(pressure.0, 0.0), self.regulator_full_scale.0);
        if pressure > 0.0 {
            let code = self.command_zero + pressure * self.command_codes_per_kpa;
            DacCode((code + 0.5) as u16)
        } else {
            DacCode(0)
        }
    }

    /// The monitor code of a pressure, not yet quantised.
    pub fn monitor_code(&self, pressure: Kilopascals) -> f32 {
        pressure.0 / self.monitor_kpa_per_code
    }

    /// The supply code of a voltage, not yet quantised.
    pub fn supply_code(&self, supply: Volts) -> f32 {
        supply.0 / self.supply_v_per_code
    }

    /// The pressure that a DAC code asks for.
    pub fn commanded(&self, code: DacCode) -> Kilopascals {
        let codes = f32::from(code.0) - self.command_zero;
        Kilopascals(larger(codes, 0.0) / self.command_codes_per_kpa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FE: FrontEnd = FrontEnd::REFERENCE;

    #[test]
    fn codes_and_quantities_are_inverse() {
        for ue in [-20_000.0, -1.0, 0.0, 4_000.0, 20_000.0] {
            let code = AdcCode(FE.gauge_code(0, Microstrain(ue)) as u16);
            // One count of truncation.
            let [strain, ..] = FE.strains(&[code; FINGERS]);
            assert!((strain.0 - ue).abs() <= FE.gauge_ue_per_code[0]);
        }
        for kpa in [0.0, 0.1, 60.0, 140.0, 160.0, 200.0] {
            let command = FE.commanded(FE.command(Kilopascals(kpa)));
            assert!((command.0 - kpa).abs() <= 0.5 / FE.command_codes_per_kpa);
            let code = AdcCode(FE.monitor_code(Kilopascals(kpa)) as u16);
            assert!((FE.pressure(code).0 - kpa).abs() <= FE.monitor_kpa_per_code);
        }
    }

    #[test]
    fn no_command_leaves_the_regulators_range() {
        assert_eq!(FE.command(Kilopascals(f32::NAN)), DacCode(0));
        assert_eq!(FE.command(Kilopascals(f32::NEG_INFINITY)), DacCode(0));
        assert_eq!(FE.command(Kilopascals(0.0)), DacCode(0));
        // 3.0 V of 3.3 V.
        assert_eq!(FE.command(Kilopascals(f32::INFINITY)), DacCode(3724));
    }

    #[test]
    fn the_internal_reference_tells_the_rail() {
        // 1.21 V as each rail sees it.
        for rail_mv in [2_700, 3_135, 3_234, 3_300, 3_366, 3_465, 3_600] {
            let code = AdcCode((1.21 / (1e-3 * f32::from(rail_mv)) * 65_536.0) as u16);
            let told = rail(code, 1_502);
            assert!(told.0.abs_diff(rail_mv) <= 2, "{told:?}, not {rail_mv} mV");
        }
        assert_eq!(rail(AdcCode(16 * 1_520), 1_520), RAIL);
        assert_eq!(rail(AdcCode(0), 1_502), Millivolts(u16::MAX));
        assert!(!rail_is_good(rail(AdcCode(u16::MAX), 1_502)));
    }

    #[test]
    fn a_chip_without_calibration_has_the_typical_one() {
        assert_eq!(reference_code(1_489), 1_489);
        for none in [0, 1_463, 1_540, u16::MAX] {
            assert_eq!(reference_code(none), 1_502);
        }
    }

    #[test]
    fn a_rail_is_good_within_5_percent() {
        for (rail, good) in [
            (3_134, false),
            (3_135, true),
            (3_300, true),
            (3_465, true),
            (3_466, false),
        ] {
            assert_eq!(rail_is_good(Millivolts(rail)), good, "{rail} mV");
        }
    }

    #[test]
    fn a_rail_that_is_off_by_2_percent_shows_the_true_pressure() {
        for off in [-0.02, 0.02] {
            let seen = FE.monitor_code(Kilopascals(150.0)) / (1.0 + off);
            let rail = Millivolts((3_300.0 * (1.0 + off)) as u16);
            let told = FE.pressure(AdcCode(seen as u16)).0 * rail_factor(rail);
            assert!((told - 150.0).abs() < 0.05, "{told}");
        }
    }

    #[test]
    fn a_rail_that_is_right_changes_nothing() {
        assert_eq!(rail_factor(RAIL), 1.0);
    }
}

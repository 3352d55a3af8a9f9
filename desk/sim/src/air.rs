//! The pressure regulator, and the lags of the air and of the fingers behind it.

use softgrip::frontend::FrontEnd;
use softgrip::units::DacCode;

use crate::gripper::RegulatorParameters;

/// Control tick, s; [`softgrip::TICK_US`] in seconds.
pub const TICK_S: f64 = 0.001;

/// Output pressure of the proportional regulator, limited in slew rate.
#[derive(Debug, Clone, Copy, Default)]
pub struct Valve {
    /// Current output pressure, kPa.
    pub kpa: f64,
}

impl Valve {
    /// Steady output pressure for a command, kPa, with the regulator's gain and offset errors.
    pub fn wanted_kpa(front_end: &FrontEnd, regulator: &RegulatorParameters, dac: DacCode) -> f64 {
        let commanded = f64::from(front_end.commanded(dac).0);
        if commanded > 1.0 {
            (regulator.gain * commanded + regulator.offset_kpa).max(0.0)
        } else {
            // Below its dead band a regulator shuts: zero is zero.
            0.0
        }
    }

    /// Advances by one control tick towards a pressure, limited in slew rate; gives the output pressure, kPa.
    pub fn step(&mut self, regulator: &RegulatorParameters, wanted_kpa: f64) -> f64 {
        let slew = regulator.slew_kpa_per_s * TICK_S;
        self.kpa += (wanted_kpa - self.kpa).clamp(-slew, slew);
        self.kpa
    }
}

/// A first-order lag, discretised at the control tick.
#[derive(Debug, Clone, Copy)]
pub struct Lag {
    gain: f64,
    pub(crate) value: f64,
}

impl Lag {
    /// A lag with output zero. `time_constant_s` in s.
    pub fn new(time_constant_s: f64) -> Self {
        Self {
            gain: 1.0 - (-TICK_S / time_constant_s).exp(),
            value: 0.0,
        }
    }

    /// Advances by one control tick and gives the output.
    pub fn step(&mut self, input: f64) -> f64 {
        self.value += self.gain * (input - self.value);
        self.value
    }
}

/// A free finger's swing behind its pressure, fitted to free closes and openings of the simulated
/// finger (0.003 rad at worst).
#[derive(Debug, Clone, Copy, Default)]
pub struct Swing {
    pub(crate) value: f64,
    rate: f64,
}

impl Swing {
    /// Natural frequency, rad/s. The controller's settings have it as `bending_hz`, 5.9 Hz.
    pub const OMEGA_RAD_PER_S: f64 = 37.0;
    /// Damping ratio; dimensionless.
    const DAMPING: f64 = 0.45;

    /// Advances by one control tick and gives the output.
    pub fn step(&mut self, input: f64) -> f64 {
        let acceleration = Self::OMEGA_RAD_PER_S * Self::OMEGA_RAD_PER_S * (input - self.value)
            - 2.0 * Self::DAMPING * Self::OMEGA_RAD_PER_S * self.rate;
        self.rate += TICK_S * acceleration;
        self.value += TICK_S * self.rate;
        self.value
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use softgrip::settings::Settings;

    use super::*;

    #[test]
    fn the_controller_expects_the_swing_of_the_simulated_finger() {
        let expected_hz = f64::from(Settings::default().finger.silicone.bending_hz);
        assert!((Swing::OMEGA_RAD_PER_S / TAU - expected_hz).abs() < 0.05);
    }
}

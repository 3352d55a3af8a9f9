//! The regulator's pressure monitor: pressure, or what is wrong with its wire.

use crate::frontend::FrontEnd;
use crate::units::{AdcCode, Kilopascals};

/// The regulator's monitor in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Monitor {
    /// The measured gauge pressure, kPa.
    Valid(Kilopascals),
    /// No new measurement in this tick, or a spike.
    Missing,
    /// Above anything that the monitor can put out: its wire is at the supply.
    TooHigh,
    /// It fell faster than air can leave, so its wire is off; until it is back where it was, or shows what
    /// the commands should have given.
    Lost,
}

impl Monitor {
    /// The measured pressure, where there is one.
    pub fn pressure(self) -> Option<Kilopascals> {
        match self {
            Self::Valid(pressure) => Some(pressure),
            Self::Missing | Self::TooHigh | Self::Lost => None,
        }
    }
}

/// Fastest believable fall of the pressure in one tick, as a share: a hose that bursts at the gripper empties
/// it with a time constant of some 10 ms, and a wire that comes off lets the input's 3 ms filter empty.
const FALL: f32 = 0.2;
/// What noise may add to that, kPa.
const NOISE_KPA: f32 = 5.0;
/// A fall must persist this long to be a wire that is off: shorter is a spike.
const PERSIST_TICKS: u16 = 3;

/// The pressure monitor's memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct MonitorWire {
    last_kpa: Option<f32>,
    fallen_ticks: u16,
}

impl MonitorWire {
    /// Nothing measured yet.
    pub const NEW: Self = Self {
        last_kpa: None,
        fallen_ticks: 0,
    };

    /// Judges one code. `rail`: see [`rail_factor`](crate::frontend::rail_factor). `expected`: what the commands so far should have given.
    pub fn step(
        &mut self,
        code: AdcCode,
        rail: f32,
        front_end: &FrontEnd,
        expected: Option<Kilopascals>,
    ) -> Monitor {
        // Of the code itself: the converter ends at the rail, and a low one hides what is above it.
        if code > front_end.monitor_high_above {
            return Monitor::TooHigh;
        }
        let pressure = Kilopascals(rail * front_end.pressure(code).0);
        let fell = |last| pressure.0 < (1.0 - FALL) * last - NOISE_KPA;
        if self.last_kpa.is_some_and(fell) {
            self.fallen_ticks = self.fallen_ticks.saturating_add(1);
            if self.fallen_ticks < PERSIST_TICKS {
                return Monitor::Missing;
            }
            // A wire that is off reads zero, which is right once the air has been let out.
            let right = |expected: Kilopascals| (pressure.0 - expected.0).abs() < NOISE_KPA;
            if !expected.is_some_and(right) {
                return Monitor::Lost;
            }
        }
        self.fallen_ticks = 0;
        self.last_kpa = Some(pressure.0);
        Monitor::Valid(pressure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FE: FrontEnd = FrontEnd::REFERENCE;

    fn code(kpa: f32) -> AdcCode {
        AdcCode(FE.monitor_code(Kilopascals(kpa)) as u16)
    }

    #[test]
    fn a_monitor_that_drops_faster_than_air_is_lost_until_it_is_back_or_shows_what_it_should() {
        let mut wire = MonitorWire::NEW;
        let mut monitor =
            |kpa: f32, expected: f32| wire.step(code(kpa), 1.0, &FE, Some(Kilopascals(expected)));
        assert!(matches!(monitor(140.0, 140.0), Monitor::Valid(_)));
        // A spike of two ticks.
        assert_eq!(monitor(0.0, 140.0), Monitor::Missing);
        assert_eq!(monitor(0.0, 140.0), Monitor::Missing);
        // A hose that bursts at the gripper.
        let mut kpa = 140.0;
        while kpa > 1.0 {
            assert!(matches!(monitor(kpa, 140.0), Monitor::Valid(_)), "{kpa}");
            kpa *= 0.9;
        }
        assert!(matches!(monitor(140.0, 140.0), Monitor::Valid(_)));
        // A wire that comes off, through the filter of the input.
        for (kpa, expected) in [
            (100.0, Monitor::Missing),
            (72.0, Monitor::Missing),
            (51.0, Monitor::Lost),
        ] {
            assert_eq!(monitor(kpa, 140.0), expected);
        }
        assert_eq!(monitor(0.0, 140.0), Monitor::Lost);
        // Once the air has been let out, zero is what it should show.
        assert_eq!(monitor(0.0, 20.0), Monitor::Lost);
        assert_eq!(monitor(0.0, 5.0), Monitor::Lost);
        assert!(matches!(monitor(0.0, 4.5), Monitor::Valid(_)));
    }

    #[test]
    fn a_monitor_that_is_back_at_what_the_commands_gave_meanwhile_is_believed() {
        let mut wire = MonitorWire::NEW;
        wire.step(code(140.0), 1.0, &FE, None);
        // Its wire was loose while the pressure went to 50 kPa.
        let falls = [(52.0, false), (52.0, false), (57.0, false), (52.0, true)];
        for (kpa, believed) in falls {
            let monitor = wire.step(code(kpa), 1.0, &FE, Some(Kilopascals(50.0)));
            assert_eq!(monitor.pressure().is_some(), believed, "{monitor:?}");
        }
        // From then on a fall counts from there: 52 → 36.6 kPa is the most.
        let monitor = wire.step(code(37.0), 1.0, &FE, Some(Kilopascals(50.0)));
        assert!(
            monitor
                .pressure()
                .is_some_and(|kpa| (kpa.0 - 37.0).abs() < 0.1)
        );
    }

    #[test]
    fn a_monitor_at_its_upper_end_is_too_high_and_what_is_just_below_is_a_pressure() {
        let mut wire = MonitorWire::NEW;
        let AdcCode(above) = FE.monitor_high_above;
        let highest = wire.step(AdcCode(above), 1.0, &FE, None);
        assert!(matches!(highest, Monitor::Valid(_)), "{highest:?}");
        assert_eq!(
            wire.step(AdcCode(above + 1), 1.0, &FE, None),
            Monitor::TooHigh
        );
    }

    #[test]
    fn the_fall_that_is_believed_is_a_fifth_and_5_kpa() {
        // 140 → 107 kPa is the most.
        for (kpa, expected) in [(107.5, true), (106.5, false)] {
            let mut wire = MonitorWire::NEW;
            wire.step(code(140.0), 1.0, &FE, None);
            let believed = wire.step(code(kpa), 1.0, &FE, None).pressure().is_some();
            assert_eq!(believed, expected, "{kpa}");
        }
    }

    #[test]
    fn a_wire_at_the_rail_is_too_high_whatever_the_rail() {
        for rail in [0.95, 1.0, 1.05] {
            let mut wire = MonitorWire::NEW;
            let end = wire.step(AdcCode(65_520), rail, &FE, None);
            assert_eq!(end, Monitor::TooHigh, "{rail}");
        }
    }
}

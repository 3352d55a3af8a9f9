//! Faults by their numbers, with their page of the manual and what to look at first.

use softgrip::fault::{Fault, RULES};

/// The fault of a number; none where there is no such.
pub fn of(number: u16) -> Option<Fault> {
    let mut faults = RULES.iter().map(|rule| rule.fault);
    faults.find(|fault| u16::from(fault.code()) == number)
}

/// Its page of the manual.
pub fn page(fault: Fault) -> String {
    let mut name = String::new();
    for letter in format!("{fault:?}").chars() {
        if letter.is_uppercase() {
            name.push('-');
        }
        name.extend(letter.to_lowercase());
    }
    format!("docs/faults/{:02}{name}.md", fault.code())
}

/// What to look at first.
pub fn look_at(fault: Fault) -> &'static str {
    match fault {
        Fault::OverPressure => "the regulator's scale, 0–10 V for 0–200 kPa, and the monitor's",
        Fault::NotFollowing => "the air supply, hoses, the regulator's 24 V and the monitor's wire",
        Fault::AirLoss => "hoses and their fittings",
        Fault::MonitorHigh => "the monitor's wire: a short to 24 V, or another scale than 0–10 V",
        Fault::SupplyLow => "the 24 V at J1 and its fuse",
        Fault::MonitorLost => "the monitor's wire and its plug",
        Fault::GaugeOpen => "this finger's plug, and each of its wires",
        Fault::GaugeShort => "this finger's plug and cable: SIG touches GND, or a wire is broken",
        Fault::GaugeStuck => "this finger's plug, and the solder joints of its amplifier",
        Fault::GaugeSaturated => {
            "this finger's bridge: a wrong resistor, or a gauge that was stretched"
        }
        Fault::GaugeJump => "this finger's plug: a loose contact",
        Fault::GaugeNoisy => "this finger's cable: its shield, and what it runs beside",
        Fault::AdcStale | Fault::AdcOverrun => "the program's version: the converter is not read",
        Fault::RailOff => "the 3.3 V rail, by meter at the header",
        Fault::Stopped => "the stop circuit: it must be closed, with 24 V at STOP",
        Fault::HostSilent => "the line to the gripper, and the setting grip.host_timeout_ms",
        Fault::SettingsInvalid => {
            "the stored settings: compare them with `softgrip settings print`"
        }
        Fault::Internal => "the debugger's log (`cargo fw`), which says what has failed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_the_page_that_it_is_said_to_have() {
        for rule in &RULES {
            let path = page(rule.fault);
            let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
            assert!(root.join(&path).exists(), "{path}");
            assert_eq!(of(rule.fault.code().into()), Some(rule.fault));
        }
        assert_eq!(of(0), None);
    }
}

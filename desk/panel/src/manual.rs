//! What the manual says about what can go wrong: its own text, so that page and manual cannot disagree.

use serde::Serialize;

const FAULTS: &str = include_str!("../../../docs/faults.md");
const CALIBRATION: &str = include_str!("../../../docs/calibration.md");

/// A row of the table in `docs/faults.md`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FaultEntry {
    /// The stable number.
    pub code: u8,
    /// Name.
    pub name: &'static str,
    /// What brings it about.
    pub cause: &'static str,
    /// What the output does.
    pub output: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// A row of the table in `docs/calibration.md`: why a sweep has learned nothing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RejectionEntry {
    /// Name.
    pub name: &'static str,
    /// What brings it about.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// All faults by rising number.
pub fn faults() -> Vec<FaultEntry> {
    FAULTS.lines().filter_map(fault).collect()
}

/// All reasons for which a sweep learns nothing.
pub fn sweep_rejections() -> Vec<RejectionEntry> {
    let table = CALIBRATION
        .lines()
        .skip_while(|line| !line.starts_with("| `SweepRejected` |"));
    let rows = table.skip(2).take_while(|line| line.starts_with('|'));
    rows.filter_map(rejection).collect()
}

fn cells(line: &'static str) -> Option<Vec<&'static str>> {
    let row = line.strip_prefix("| ")?.strip_suffix(" |")?;
    Some(row.split(" | ").collect())
}

fn rejection(line: &'static str) -> Option<RejectionEntry> {
    let [name, cause, remedy] = cells(line)?[..] else {
        return None;
    };
    Some(RejectionEntry {
        name: name.trim_matches('`'),
        cause,
        remedy,
    })
}

/// The row that a line is; none if it is no row of a fault.
fn fault(line: &'static str) -> Option<FaultEntry> {
    let [code, name, cause, _seen_within, output, remedy] = cells(line)?[..] else {
        return None;
    };
    // It leads to the fault's own page.
    let name = name.strip_prefix('[')?.split(']').next()?;
    Some(FaultEntry {
        code: code.parse().ok()?,
        name,
        cause,
        output,
        remedy,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrip::command::SweepFault;
    use softgrip::fault::RULES;

    #[test]
    fn the_manual_has_cause_and_remedy_of_every_fault_by_its_name() {
        let expected: Vec<(u8, String)> = RULES
            .iter()
            .map(|rule| (rule.fault.code(), format!("{:?}", rule.fault)))
            .collect();
        let entries = faults();
        let found: Vec<(u8, String)> = entries
            .iter()
            .map(|entry| (entry.code, entry.name.to_string()))
            .collect();
        assert_eq!(found, expected);
        for entry in entries {
            for text in [entry.cause, entry.output, entry.remedy] {
                assert!(text.len() > 3, "{entry:?}");
            }
        }
    }

    #[test]
    fn the_manual_has_cause_and_remedy_of_every_sweep_that_learns_nothing() {
        use SweepFault::{Contact, Gauge, Interrupted, Noise, OutOfRange, Pressure, Shape};
        // One that is new does not compile here, and belongs into the list.
        let known = |fault| match fault {
            Contact | Gauge | Interrupted | Noise | OutOfRange | Pressure | Shape => fault,
        };
        let all = [
            Contact,
            Shape,
            OutOfRange,
            Pressure,
            Noise,
            Gauge,
            Interrupted,
        ];
        let expected = all.map(|fault| format!("{:?}", known(fault)));
        let entries = sweep_rejections();
        let found: Vec<&str> = entries.iter().map(|entry| entry.name).collect();
        assert_eq!(found, expected);
        for entry in entries {
            assert!(entry.cause.len() > 3 && entry.remedy.len() > 3, "{entry:?}");
        }
    }
}

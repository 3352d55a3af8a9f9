//! Faults that can be injected into the simulated gripper.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, ensure};
use softgrip::FINGERS;

/// Kind of fault that can be injected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// The valve keeps its last opening.
    RegulatorStuck,
    /// No air comes in; it still goes out.
    SupplyClosed,
    /// The tube comes off: the pressure falls to nothing with a time constant of 30 ms.
    TubeBurst,
    /// More air goes out than comes in: as a burst, but with 1 s.
    Leak,
    /// The valve runs open to the regulator's full scale, whatever the command.
    OverPressure,
    /// The monitor's wire is off.
    MonitorOff,
    /// A gauge's wire is off.
    GaugeOpen,
    /// A gauge's wire touches ground.
    GaugeShort,
    /// A gauge's channel shows its last code.
    GaugeStuck,
    /// A gauge's amplifier is driven beyond its range.
    GaugeSaturated,
    /// A gauge has twenty times the noise.
    GaugeNoisy,
    /// A gauge comes off: its gain fades with a time constant of 3 s.
    GaugeDrift,
    /// The supply falls to 15 V.
    SupplySag,
    /// The converter loses data, says so, and its channels are one place off.
    AdcOverrun,
    /// The converter delivers nothing.
    StaleFrame,
    /// The robot says nothing any more.
    HostSilent,
    /// The robot opens the stop circuit.
    Stop,
}

impl FaultKind {
    /// Every kind, in the order of the help text.
    pub const ALL: [Self; 17] = [
        Self::RegulatorStuck,
        Self::SupplyClosed,
        Self::TubeBurst,
        Self::Leak,
        Self::OverPressure,
        Self::MonitorOff,
        Self::GaugeOpen,
        Self::GaugeShort,
        Self::GaugeStuck,
        Self::GaugeSaturated,
        Self::GaugeNoisy,
        Self::GaugeDrift,
        Self::SupplySag,
        Self::AdcOverrun,
        Self::StaleFrame,
        Self::HostSilent,
        Self::Stop,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::RegulatorStuck => "regulator-stuck",
            Self::SupplyClosed => "supply-closed",
            Self::TubeBurst => "tube-burst",
            Self::Leak => "leak",
            Self::OverPressure => "over-pressure",
            Self::MonitorOff => "monitor-off",
            Self::GaugeOpen => "gauge-open",
            Self::GaugeShort => "gauge-short",
            Self::GaugeStuck => "gauge-stuck",
            Self::GaugeSaturated => "gauge-saturated",
            Self::GaugeNoisy => "gauge-noisy",
            Self::GaugeDrift => "gauge-drift",
            Self::SupplySag => "supply-sag",
            Self::AdcOverrun => "adc-overrun",
            Self::StaleFrame => "stale-frame",
            Self::HostSilent => "host-silent",
            Self::Stop => "stop",
        }
    }

    /// Names of all kinds, separated by commas, for messages.
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }

    /// Whether it affects one finger's gauge.
    fn has_finger(self) -> bool {
        match self {
            Self::GaugeOpen
            | Self::GaugeShort
            | Self::GaugeStuck
            | Self::GaugeSaturated
            | Self::GaugeNoisy
            | Self::GaugeDrift => true,
            Self::RegulatorStuck
            | Self::SupplyClosed
            | Self::TubeBurst
            | Self::Leak
            | Self::OverPressure
            | Self::MonitorOff
            | Self::SupplySag
            | Self::AdcOverrun
            | Self::StaleFrame
            | Self::HostSilent
            | Self::Stop => false,
        }
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A fault during an interval, written `gauge-open:2@1.5s..2s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Injected {
    /// Kind of fault.
    pub kind: FaultKind,
    /// Affected finger, from 0; only for faults of a gauge.
    pub finger: Option<usize>,
    /// Start of the fault, s since the start of the run.
    pub from_s: f64,
    /// End of the fault, s since the start of the run; infinite if it stays.
    pub until_s: f64,
}

impl Injected {
    /// Whether the fault is active at `t_s`, s.
    pub fn is_on(&self, t_s: f64) -> bool {
        (self.from_s..self.until_s).contains(&t_s)
    }

    /// Kind and finger as on the command line, without the times.
    pub fn name(&self) -> String {
        match self.finger {
            Some(finger) => format!("{}:{}", self.kind, finger + 1),
            None => self.kind.to_string(),
        }
    }
}

/// Whether a fault of this kind is active at `t_s`, s.
pub fn any(faults: &[Injected], kind: FaultKind, t_s: f64) -> bool {
    faults.iter().any(|f| f.kind == kind && f.is_on(t_s))
}

impl fmt::Display for Injected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}s", self.name(), self.from_s)?;
        if self.until_s.is_finite() {
            write!(f, "..{}s", self.until_s)?;
        }
        Ok(())
    }
}

impl FromStr for Injected {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (what, when) = text
            .split_once('@')
            .context("must say when, as in tube-burst@1.5s or tube-burst@1.5s..2s")?;
        let (kind, finger) = named(what)?;
        let (from_s, until_s) = match when.split_once("..") {
            Some((from, until)) => (seconds(from)?, seconds(until)?),
            None => (seconds(when)?, f64::INFINITY),
        };
        ensure!(
            from_s < until_s,
            "must end after it begins, at {from_s} s, and not at {until_s} s"
        );
        Ok(Self {
            kind,
            finger,
            from_s,
            until_s,
        })
    }
}

/// Kind and finger of a fault that is written without its times, as `gauge-open:2`.
///
/// # Errors
/// If there is no such kind, or it is about one finger and names none, or the other way round.
pub fn named(text: &str) -> anyhow::Result<(FaultKind, Option<usize>)> {
    let (name, finger) = match text.split_once(':') {
        Some((name, finger)) => (name, Some(finger)),
        None => (text, None),
    };
    let kind = FaultKind::ALL
        .into_iter()
        .find(|kind| kind.name() == name)
        .with_context(|| format!("{name:?}: must be one of {}", FaultKind::names()))?;
    match (kind.has_finger(), finger) {
        (false, None) => Ok((kind, None)),
        (false, Some(_)) => anyhow::bail!("{text:?}: is about no finger: must be {kind}"),
        (true, finger) => {
            let number = finger.and_then(|finger| finger.parse().ok());
            let number = number.filter(|number| (1..=FINGERS).contains(number));
            let number = number.with_context(|| {
                format!("{text:?}: must name a finger from 1 to {FINGERS}, as in {kind}:2")
            })?;
            Ok((kind, Some(number - 1)))
        }
    }
}

fn seconds(text: &str) -> anyhow::Result<f64> {
    text.strip_suffix('s')
        .and_then(|number| number.parse().ok())
        .filter(|number: &f64| number.is_finite() && *number >= 0.0)
        .with_context(|| format!("{text:?}: must be a time from the start, as in 1.5s"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_read_as_it_is_written() {
        for kind in FaultKind::ALL {
            for until_s in [f64::INFINITY, 2.25] {
                let fault = Injected {
                    kind,
                    finger: kind.has_finger().then_some(1),
                    from_s: 1.5,
                    until_s,
                };
                let text = fault.to_string();
                assert_eq!(text.parse::<Injected>().ok(), Some(fault), "{text}");
            }
        }
    }

    #[test]
    fn it_begins_with_its_first_tick_and_is_over_at_its_last() {
        let fault: Injected = "gauge-open:3@1.5s..2s".parse().expect("a fault");
        assert_eq!(fault.finger, Some(2));
        let on = [1.499, 1.5, 1.999, 2.0].map(|t_s| fault.is_on(t_s));
        assert_eq!(on, [false, true, true, false]);
        assert!(!any(&[fault], FaultKind::GaugeShort, 1.6));
    }

    #[test]
    fn what_cannot_be_read_is_told_what_would_be_right() {
        for (text, expected) in [
            ("tube-burst", "as in tube-burst@1.5s"),
            (
                "burst@1s",
                "\"burst\": must be one of regulator-stuck, supply-closed, tube-burst",
            ),
            (
                "gauge-open@1s",
                "\"gauge-open\": must name a finger from 1 to 3, as in gauge-open:2",
            ),
            ("gauge-open:0@1s", "a finger from 1 to 3"),
            ("gauge-open:4@1s", "a finger from 1 to 3"),
            ("leak:1@1s", "\"leak:1\": is about no finger: must be leak"),
            (
                "leak@1.5",
                "\"1.5\": must be a time from the start, as in 1.5s",
            ),
            ("leak@-1s", "\"-1s\": must be a time"),
            ("leak@NaNs", "\"NaNs\": must be a time"),
            ("leak@1s..", "\"\": must be a time"),
            (
                "leak@2s..1s",
                "must end after it begins, at 2 s, and not at 1 s",
            ),
        ] {
            let error = text.parse::<Injected>().expect_err(text).to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}

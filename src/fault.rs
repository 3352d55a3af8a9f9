//! Everything that can be wrong, with stable numbers for logs, wires and the manual, and what each
//! does.

/// What is wrong with one gauge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GaugeFault {
    /// A broken wire: the pull-up takes the amplifier to the rail.
    Open,
    /// A shorted input.
    Short,
    /// The code no longer moves.
    Stuck,
    /// Beyond the amplifier's range.
    Saturated,
    /// A step that no finger can make.
    Jump,
    /// More noise than a loss could be told from.
    Noisy,
}

/// A latched fault. The numbers never change their meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Fault {
    /// The measured pressure exceeds the limit.
    OverPressure = 1,
    /// The pressure does not do what the regulator is told.
    NotFollowing = 2,
    /// The pressure fell away while something was held.
    AirLoss = 3,
    /// The monitor's signal is above its range.
    MonitorHigh = 4,
    /// The supply is too low for the regulator.
    SupplyLow = 5,
    /// The monitor's signal fell faster than air can leave: its wire is off.
    MonitorLost = 6,
    /// A gauge's wire is broken.
    GaugeOpen = 16,
    /// A gauge is shorted.
    GaugeShort = 17,
    /// A gauge no longer moves.
    GaugeStuck = 18,
    /// A gauge left its range.
    GaugeSaturated = 19,
    /// A gauge made an impossible step.
    GaugeJump = 20,
    /// A gauge is too noisy to tell a loss.
    GaugeNoisy = 21,
    /// No usable converter data for some ticks.
    AdcStale = 32,
    /// The converter lost data for some ticks in a row.
    AdcOverrun = 33,
    /// The 3.3 V rail, which is the converters' reference, is off by more than 5 %.
    RailOff = 34,
    /// The stop input opened, or a stop was commanded.
    Stopped = 48,
    /// The robot has said nothing for longer than the settings allow.
    HostSilent = 49,
    /// The stored settings are not valid; the default ones are in use.
    SettingsInvalid = 64,
    /// The program had to be restarted by its watchdog or after a panic.
    Internal = 65,
}

/// What the output may do in a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SafeOutput {
    /// What the settings say: vent, or hold.
    AsSet,
    /// Vent, whatever the settings say.
    Vent,
}

/// What a fault does, and what ends it. One row per fault; `tests/host/faults.rs` walks every row in
/// every state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// The fault.
    pub fault: Fault,
    /// Longest time from the cause to the safe output, ms, beyond what the settings add (see
    /// [`Settings`](crate::settings::Settings): `not_following_ms`, `host_timeout_ms`).
    pub within_ms: u16,
    /// The output.
    pub output: SafeOutput,
    /// The gauges can still tell a loss, so what is held is watched on.
    pub watches: bool,
    /// An acknowledgement clears it once its cause is gone; if not, only a restart does.
    pub acknowledges: bool,
    /// Whether it shows in each state: idle, closing, holding, empty, sweeping, releasing, and in a fault that
    /// holds on.
    pub shows: [bool; 7],
}

const fn row(
    fault: Fault,
    within_ms: u16,
    output: SafeOutput,
    watches: bool,
    acknowledges: bool,
    shows: [bool; 7],
) -> Rule {
    Rule {
        fault,
        within_ms,
        output,
        watches,
        acknowledges,
        shows,
    }
}

const ALWAYS: [bool; 7] = [true; 7];
/// Without pressure there is nothing to fall.
const INFLATED: [bool; 7] = [false, true, true, true, true, true, true];
/// Elsewhere the same leak is a regulator that does not follow.
const HELD: [bool; 7] = [false, false, true, false, false, false, true];
/// Fingers that are open or opening wait for nobody.
const CLOSED: [bool; 7] = [false, true, true, true, true, false, true];
const AT_START: [bool; 7] = [false; 7];

/// What every fault does, in the order of their numbers.
#[rustfmt::skip]
pub const RULES: [Rule; 19] = [
    // Above the limit, or with a monitor that cannot say so, there is nothing safe to hold.
    row(Fault::OverPressure,      1, SafeOutput::Vent, false, true, ALWAYS),
    // The air is in doubt: a grip that weakens is no loss to be told from it.
    row(Fault::NotFollowing,      5, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::AirLoss,          50, SafeOutput::AsSet, false, true, HELD),
    row(Fault::MonitorHigh,       1, SafeOutput::Vent, false, true, ALWAYS),
    row(Fault::SupplyLow,        20, SafeOutput::AsSet, false, true, ALWAYS),
    // The command still stands, and cannot exceed the limit by itself.
    row(Fault::MonitorLost,       5, SafeOutput::AsSet, false, true, INFLATED),
    // One gauge out of three is reported and done without; these are for the second.
    row(Fault::GaugeOpen,        20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::GaugeShort,       20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::GaugeStuck,       20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::GaugeSaturated,   20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::GaugeJump,        20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::GaugeNoisy,       20, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::AdcStale,          5, SafeOutput::AsSet, false, true, ALWAYS),
    row(Fault::AdcOverrun,        5, SafeOutput::AsSet, false, true, ALWAYS),
    // What is measured and what is commanded are in doubt.
    row(Fault::RailOff,          20, SafeOutput::Vent, false, true, ALWAYS),
    row(Fault::Stopped,           1, SafeOutput::AsSet, true, true, ALWAYS),
    row(Fault::HostSilent,        1, SafeOutput::AsSet, true, true, CLOSED),
    row(Fault::SettingsInvalid,   1, SafeOutput::Vent, false, false, AT_START),
    row(Fault::Internal,          1, SafeOutput::Vent, false, true, AT_START),
];

impl Fault {
    /// The stable number.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// What it does.
    pub fn rule(self) -> &'static Rule {
        // Every fault has its row, as a test shows; the first would be the safest for one that had none.
        let [first, ..] = &RULES;
        RULES
            .iter()
            .find(|rule| rule.fault == self)
            .unwrap_or(first)
    }
}

impl From<GaugeFault> for Fault {
    fn from(fault: GaugeFault) -> Self {
        match fault {
            GaugeFault::Open => Self::GaugeOpen,
            GaugeFault::Short => Self::GaugeShort,
            GaugeFault::Stuck => Self::GaugeStuck,
            GaugeFault::Saturated => Self::GaugeSaturated,
            GaugeFault::Jump => Self::GaugeJump,
            GaugeFault::Noisy => Self::GaugeNoisy,
        }
    }
}

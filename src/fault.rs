//! Everything that can be wrong, with stable numbers for logs, wires and the manual.

/// What is wrong with one gauge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GaugeFault {
    /// A broken wire: the pull-up takes the input to the rail.
    Open,
    /// A shorted input.
    Short,
    /// The code no longer moves.
    Stuck,
    /// Beyond the amplifier's range.
    Saturated,
    /// A step that no finger can make.
    Jump,
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
    /// The pressure fell away while it should have been held.
    AirLoss = 3,
    /// The monitor's signal is above its range.
    MonitorHigh = 4,
    /// The supply is too low for the regulator.
    SupplyLow = 5,
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
    /// No usable converter data for some ticks.
    AdcStale = 32,
    /// The stop input opened, or a stop was commanded.
    Stopped = 48,
}

impl Fault {
    /// The stable number.
    pub const fn code(self) -> u8 {
        self as u8
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
        }
    }
}

//! What times are measured by.

/// What the chip runs on.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Clock {
    /// A crystal of the board, within 50 ppm.
    External,
    /// The chip's own oscillator: some percent, as the chip's file says. Every time of the controller is off by that.
    Internal,
}

//! Colours of every picture.

use plotters::style::RGBColor;

/// Text and axes.
pub const INK: RGBColor = RGBColor(40, 44, 52);
/// Secondary text and lines.
pub const QUIET: RGBColor = RGBColor(110, 118, 130);
/// Grids.
pub const FAINT: RGBColor = RGBColor(225, 228, 233);
/// What must not be missed.
pub const ALARM: RGBColor = RGBColor(213, 60, 0);
/// Colours that people with any colour vision tell apart (Okabe and Ito, 2008).
pub const PALETTE: [RGBColor; 4] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
];

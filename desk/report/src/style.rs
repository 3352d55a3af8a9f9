//! Colours of all figures.

use plotters::style::RGBColor;

/// Colour of text and axes.
pub const INK: RGBColor = RGBColor(40, 44, 52);
/// Colour of secondary text and lines.
pub const QUIET: RGBColor = RGBColor(110, 118, 130);
/// Colour of grids.
pub const FAINT: RGBColor = RGBColor(225, 228, 233);
/// Colour of losses and alarms.
pub const ALARM: RGBColor = RGBColor(213, 60, 0);
/// Colours that people with any colour vision tell apart (Okabe and Ito, 2008).
pub const PALETTE: [RGBColor; 4] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
];

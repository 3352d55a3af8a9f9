//! Picture of what a black box has kept: strains and pressure of the last seconds.

use plotters::chart::SeriesLabelPosition;
use softgrip::FINGERS;

use crate::charts::{Look, Panel, Series, color, draw, standalone};
use crate::style::QUIET;

/// One tick of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Time from the first tick that is kept, s.
    pub t_s: f64,
    /// Strain of each gauge, µε.
    pub strain_ue: [f64; FINGERS],
    /// Measured pressure, kPa.
    pub pressure_kpa: f64,
    /// What the regulator was told, kPa.
    pub commanded_kpa: f64,
}

/// Of a panel, pixels.
const SIZE: (u32, u32) = (900, 330);

/// Draws the ticks as SVG. `came_s`: when what is told in `title` came, if it is among them.
///
/// # Errors
/// If there is no tick, or the drawing library fails.
pub fn svg(title: &str, ticks: &[Tick], came_s: Option<f64>) -> anyhow::Result<String> {
    let end_s = ticks.last().map_or(0.0, |tick| tick.t_s);
    let came_s = came_s.unwrap_or(end_s);
    let stages = vec![("before", 0.0, came_s), ("after", came_s, end_s)];
    let line = |name: String, color, value: &dyn Fn(&Tick) -> f64| Series {
        name,
        look: Look::Line,
        color,
        points: ticks.iter().map(|tick| (tick.t_s, value(tick))).collect(),
    };
    let panel = |title: &str, y_label, series: Vec<Series>| {
        let values = series.iter().flat_map(|series| &series.points);
        let values = values.map(|(_, y)| *y);
        let (low, high) = values.fold((0.0, 0.0), |(low, high): (f64, f64), y| {
            (low.min(y), high.max(y))
        });
        let room = 0.05 * (high - low).max(1.0);
        Panel {
            title: title.into(),
            x_label: "s",
            y_label,
            x: 0.0..end_s,
            y: low - room..high + room,
            stages: stages.clone(),
            series,
            legend: Some(SeriesLabelPosition::MiddleLeft),
        }
    };
    let strains = (0..FINGERS).map(|finger| {
        let strain = move |tick: &Tick| 1e-3 * tick.strain_ue[finger];
        line(format!("finger {}", finger + 1), color(finger), &strain)
    });
    let strains = panel(title, "strain, 10³ µε", strains.collect());
    let pressures = vec![
        line("commanded".into(), QUIET, &|tick| tick.commanded_kpa),
        line("measured".into(), color(0), &|tick| tick.pressure_kpa),
    ];
    let pressures = panel("", "pressure, kPa", pressures);
    Ok(standalone(&draw(&[strains, pressures], 1, SIZE)?))
}

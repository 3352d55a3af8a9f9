//! Line charts as SVG, for light and dark backgrounds.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::style::{ALARM, FAINT, INK, PALETTE, QUIET};

type Error = Box<dyn std::error::Error + Send + Sync>;

/// Colours of [`crate::style`] as they are drawn, and their replacements on a dark screen.
const DARK: [(&str, &str); 6] = [
    ("#282C34", "#E6E8EC"),
    ("#E1E4E9", "#33383F"),
    ("#6E7682", "#9AA3AF"),
    ("#0072B2", "#56B4E9"),
    ("#D53C00", "#FF7A45"),
    ("#FFFFFF", "#16181D"),
];

/// CSS rules that replace the colours on a dark screen; print stays white.
pub fn dark_rules() -> String {
    let rules: String = DARK
        .iter()
        .map(|(light, dark)| {
            format!(
                "svg [fill=\"{light}\"]{{fill:{dark}}}svg [stroke=\"{light}\"]{{stroke:{dark}}}"
            )
        })
        .collect();
    format!("@media screen and (prefers-color-scheme:dark){{{rules}}}")
}

/// An SVG as a file of its own, with a background: white, or black where the viewer prefers dark.
pub fn standalone(svg: &str) -> String {
    let ground = "svg{background:#fff}@media screen and (prefers-color-scheme:dark){svg{background:#16181d}}";
    let style = format!("<style>{ground}{}</style>", dark_rules());
    match svg.split_once('>') {
        Some((head, rest)) => format!("{head}>{style}{rest}"),
        None => svg.to_string(),
    }
}

/// A line, or points, of a chart.
pub struct Series {
    /// Name in the legend; empty for no legend entry.
    pub name: String,
    /// Line or marker style.
    pub look: Look,
    /// Colour, one of [`crate::style`].
    pub color: RGBColor,
    /// Coordinates (x, y) in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

/// Line or marker style.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// A line through the points.
    Line,
    /// A broken line through the points.
    Dashed,
    /// Filled circles.
    Dots,
    /// Open circles.
    Rings,
}

/// One pair of axes with its series.
pub struct Panel {
    /// Title above the panel.
    pub title: String,
    /// Label of the x axis, with its unit.
    pub x_label: &'static str,
    /// Label of the y axis, with its unit.
    pub y_label: &'static str,
    /// Range of the x axis.
    pub x: Range<f64>,
    /// Range of the y axis.
    pub y: Range<f64>,
    /// Named stretches of x, every other one shaded.
    pub stages: Vec<(&'static str, f64, f64)>,
    /// The series, from back to front.
    pub series: Vec<Series>,
    /// Position of the legend; none for no legend.
    pub legend: Option<SeriesLabelPosition>,
}

/// Colour of the n-th series.
pub fn color(n: usize) -> RGBColor {
    [PALETTE[0], PALETTE[1], PALETTE[2], ALARM][n % 4]
}

/// Draws panels in rows of `columns`, each `size` (width, height) in pixels, as SVG.
///
/// # Errors
/// If the drawing library refuses a panel, for example an empty range.
pub fn draw(panels: &[Panel], columns: usize, size: (u32, u32)) -> anyhow::Result<String> {
    let rows = panels.len().div_ceil(columns);
    let whole = (size.0 * columns as u32, size.1 * rows as u32);
    let mut svg = String::new();
    draw_on(&mut svg, panels, (rows, columns), whole)
        .map_err(|error| anyhow::anyhow!("cannot draw: {error}"))?;
    Ok(svg)
}

fn draw_on(
    svg: &mut String,
    panels: &[Panel],
    grid: (usize, usize),
    size: (u32, u32),
) -> Result<(), Error> {
    let root = SVGBackend::with_string(svg, size).into_drawing_area();
    for (area, panel) in root.split_evenly(grid).iter().zip(panels) {
        draw_panel(area, panel)?;
    }
    root.present()?;
    Ok(())
}

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw_panel(area: &DrawingArea<SVGBackend, Shift>, panel: &Panel) -> Result<(), Error> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15).into_font().color(&INK))
        .margin_right(14)
        .margin_top(4)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(panel.x.clone(), panel.y.clone())?;
    draw_stages(&mut chart, panel)?;
    chart
        .configure_mesh()
        .x_desc(panel.x_label)
        .y_desc(panel.y_label)
        .x_labels(6)
        .y_labels(6)
        .label_style(("sans-serif", 12).into_font().color(&INK))
        .axis_desc_style(("sans-serif", 13).into_font().color(&INK))
        .axis_style(QUIET)
        .bold_line_style(FAINT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for series in &panel.series {
        draw_line(&mut chart, series)?;
    }
    if let Some(position) = panel.legend.clone() {
        chart
            .configure_series_labels()
            .position(position)
            .label_font(("sans-serif", 12).into_font().color(&INK))
            .draw()?;
    }
    Ok(())
}

/// Shades every other stage, and names all of them.
fn draw_stages(chart: &mut Chart<'_>, panel: &Panel) -> Result<(), Error> {
    let (left, right) = (panel.x.start, panel.x.end);
    let (low, high) = (panel.y.start, panel.y.end);
    for (n, (name, from, to)) in panel.stages.iter().enumerate() {
        if n % 2 == 1 {
            let corners = [(*from, low), (to.min(right), high)];
            // Of the house's colours, so that it turns dark with the rest.
            chart.draw_series([Rectangle::new(corners, FAINT.mix(0.45).filled())])?;
        }
        let style = ("sans-serif", 12).into_font().color(&QUIET);
        let place = (from + 0.01 * (right - left), low + 0.98 * (high - low));
        chart.draw_series([Text::new(*name, place, style)])?;
    }
    Ok(())
}

/// Draws one series and tells the legend about it.
fn draw_line(chart: &mut Chart<'_>, series: &Series) -> Result<(), Error> {
    let color = series.color;
    let points = series.points.iter().copied();
    let drawn = match series.look {
        Look::Line => chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?,
        Look::Dashed => {
            let dashes = DashedLineSeries::new(points, 6, 4, color.stroke_width(2));
            chart.draw_series(dashes)?
        }
        Look::Dots => chart.draw_series(points.map(|at| Circle::new(at, 4, color.filled())))?,
        Look::Rings => {
            let ring = color.stroke_width(2);
            chart.draw_series(points.map(|at| Circle::new(at, 5, ring)))?
        }
    };
    if !series.name.is_empty() {
        let look = series.look;
        drawn.label(&series.name).legend(move |(x, y)| {
            let line = |from, to| {
                PathElement::new([(x + from, y), (x + to, y)], color.stroke_width(2)).into_dyn()
            };
            match look {
                Look::Line => line(0, 16),
                Look::Dashed => line(2, 8),
                Look::Dots => Circle::new((x + 8, y), 4, color.filled()).into_dyn(),
                Look::Rings => Circle::new((x + 8, y), 4, color.stroke_width(2)).into_dyn(),
            }
        });
    }
    Ok(())
}

//! Figure of a grasp: residuals, pressure and position of the object over time, with phases and events.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use sim::arm::Phase;
use sim::run::{Run, Sample};
use softgrip::FINGERS;
use softgrip::telemetry::Event;

use crate::style::{ALARM, FAINT, INK, PALETTE, QUIET};

const PANEL_WIDTH: u32 = 620;
const HEIGHT: u32 = 760;
/// Every n-th sample is drawn: 250 Hz is finer than the resolution of the figure.
const EVERY: usize = 4;

type Error = Box<dyn std::error::Error + Send + Sync>;

/// Figure of one or more runs as SVG, one column per run.
///
/// # Errors
/// If the drawing library fails.
pub fn grasp(runs: &[Run]) -> anyhow::Result<String> {
    let mut svg = String::new();
    draw(runs, &mut svg).map_err(|error| anyhow::anyhow!("cannot draw: {error}"))?;
    Ok(svg)
}

fn draw(runs: &[Run], svg: &mut String) -> Result<(), Error> {
    let size = (PANEL_WIDTH * runs.len() as u32, HEIGHT);
    let root = SVGBackend::with_string(svg, size).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, run) in root.split_evenly((1, runs.len())).iter().zip(runs) {
        column(area, run)?;
    }
    root.present()?;
    Ok(())
}

fn column(area: &DrawingArea<SVGBackend, Shift>, run: &Run) -> Result<(), Error> {
    let scenario = &run.scenario;
    let title = format!(
        "{} {:.0} g at {} m/s²: {}",
        scenario.object,
        1e3 * scenario.mass_kg,
        scenario.accel_m_s2,
        match (run.slid_at_s, run.flagged_at_s, run.latency_ms()) {
            (None, ..) => "held".to_string(),
            (Some(_), Some(_), Some(ms)) => format!("lost, reported {}", crate::words::latency(ms)),
            (Some(_), Some(s), None) => format!("lost, reported at {s:.3} s"),
            (Some(_), None, _) => "lost, and not reported".to_string(),
        }
    );
    let area = area.titled(&title, ("sans-serif", 18).into_font().color(&INK))?;
    let (top, rest) = area.split_vertically(360);
    let (middle, bottom) = rest.split_vertically(170);

    let fingers = (0..FINGERS).map(|i| Line {
        name: format!("finger {}", i + 1),
        color: PALETTE[i],
        value: Box::new(move |s: &Sample| {
            s.seen.residual[i].map(|residual| 1e-3 * f64::from(residual.0))
        }),
    });
    panel(
        &top,
        run,
        "contact residual, 10³ µε",
        -4.0..21.0,
        fingers.collect(),
        true,
    )?;
    let pressure = vec![
        Line {
            name: "asked".into(),
            color: QUIET,
            value: Box::new(|s: &Sample| Some(s.asked_kpa)),
        },
        Line {
            name: "measured".into(),
            color: PALETTE[0],
            value: Box::new(|s: &Sample| s.seen.pressure.map(|p| f64::from(p.0))),
        },
    ];
    panel(&middle, run, "pressure, kPa", -5.0..170.0, pressure, false)?;
    let object = vec![Line {
        name: "object below palm".into(),
        color: INK,
        value: Box::new(|s: &Sample| Some((-1e3 * s.truth.object_m[2]).min(200.0))),
    }];
    panel(&bottom, run, "depth, mm (true)", 200.0..0.0, object, false)
}

struct Line {
    name: String,
    color: RGBColor,
    value: Box<Value>,
}

/// Value of a line; none leaves a gap.
type Value = dyn Fn(&Sample) -> Option<f64>;

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn panel<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    run: &Run,
    label: &str,
    range: Range<f64>,
    lines: Vec<Line>,
    words: bool,
) -> Result<(), Error> {
    let end_s = run.samples.last().map_or(1.0, |sample| sample.truth.t_s);
    let mut chart = ChartBuilder::on(area)
        .margin_right(14)
        .margin_top(4)
        .x_label_area_size(30)
        .y_label_area_size(52)
        .build_cartesian_2d(0.0..end_s, range.clone())?;
    draw_phases(&mut chart, run, &range, end_s, words)?;
    chart
        .configure_mesh()
        .x_desc("s")
        .y_desc(label)
        .x_labels(7)
        .y_labels(6)
        .label_style(("sans-serif", 12).into_font().color(&INK))
        .axis_desc_style(("sans-serif", 13).into_font().color(&INK))
        .axis_style(QUIET)
        .bold_line_style(FAINT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for line in &lines {
        let points = run.samples.iter().step_by(EVERY);
        let points = points.filter_map(|sample| Some((sample.truth.t_s, (line.value)(sample)?)));
        let color = line.color;
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    draw_marks(&mut chart, run, &range, end_s, words)?;
    if lines.len() > 1 {
        let legend_y = if words { 190 } else { 45 };
        chart
            .configure_series_labels()
            // Below the plateau, where no line ever is.
            .position(SeriesLabelPosition::Coordinate(160, legend_y))
            .background_style(WHITE.mix(0.85))
            .label_font(("sans-serif", 12).into_font().color(&INK))
            .draw()?;
    }
    Ok(())
}

/// Shades the phases in which the arm lifts or sets down; with `words`, names all of them.
fn draw_phases(
    chart: &mut Chart<'_>,
    run: &Run,
    range: &Range<f64>,
    end_s: f64,
    words: bool,
) -> Result<(), Error> {
    let (low, high) = (range.start, range.end);
    for (phase, from, to) in phases(run) {
        if matches!(phase, Phase::Lift | Phase::Place) {
            let shade = Rectangle::new([(from, low), (to, high)], RGBColor(244, 246, 249).filled());
            chart.draw_series([shade])?;
        }
        if words {
            let style = ("sans-serif", 12).into_font().color(&QUIET);
            let y = low + 0.015 * (high - low);
            let y = y + 0.035 * (high - low);
            chart.draw_series([Text::new(
                format!("{phase:?}").to_lowercase(),
                (from + 0.01 * end_s, y),
                style,
            )])?;
        }
    }
    Ok(())
}

/// Draws a line across for everything worth one; with `words`, says what it was.
fn draw_marks(
    chart: &mut Chart<'_>,
    run: &Run,
    range: &Range<f64>,
    end_s: f64,
    words: bool,
) -> Result<(), Error> {
    let (low, high) = (range.start, range.end);
    for (row, (t_s, color, text)) in marks(run).into_iter().enumerate() {
        chart.draw_series([PathElement::new(
            [(t_s, low), (t_s, high)],
            color.stroke_width(1),
        )])?;
        if words {
            // Each word one line lower than the one before, so that close events stay readable.
            let y = high - (0.05 + 0.05 * row as f64) * (high - low);
            let style = ("sans-serif", 13).into_font().color(&color);
            chart.draw_series([Text::new(text, (t_s + 0.008 * end_s, y), style)])?;
        }
    }
    Ok(())
}

/// Every phase with its start and end, s.
fn phases(run: &Run) -> Vec<(Phase, f64, f64)> {
    let mut phases: Vec<(Phase, f64, f64)> = Vec::new();
    for sample in &run.samples {
        let (phase, t_s) = (sample.truth.arm.phase, sample.truth.t_s);
        match phases.last_mut() {
            Some((last, _, to)) if *last == phase => *to = t_s,
            _ => phases.push((phase, t_s, t_s)),
        }
    }
    phases
}

/// Instants that are marked in the figure: time s, colour, label.
fn marks(run: &Run) -> Vec<(f64, RGBColor, &'static str)> {
    let mut first_contact = true;
    run.events
        .iter()
        .filter_map(|timed| {
            let (color, text) = match timed.event {
                Event::Contact { .. } if first_contact => {
                    first_contact = false;
                    (QUIET, "contact")
                }
                Event::Holding { .. } => (QUIET, "holding"),
                Event::Empty => (QUIET, "closed on nothing"),
                Event::Slip { .. } => (PALETTE[1], "slip"),
                Event::Lost(_) => (ALARM, "LOST"),
                Event::Regripping => (QUIET, "closing harder"),
                Event::Released => (QUIET, "released"),
                Event::AirLoss => (ALARM, "AIR LOSS"),
                Event::Fault { .. } => (ALARM, "FAULT"),
                Event::Contact { .. }
                | Event::Refused(_)
                | Event::Tared
                | Event::Swept { .. }
                | Event::TareDue
                | Event::Regulator { .. }
                | Event::ClockInternal
                | Event::Acknowledged => {
                    return None;
                }
            };
            Some((timed.t_s, color, text))
        })
        .collect()
}

//! Chart of the spans, one column per object.

use plotters::prelude::SeriesLabelPosition;
use report::charts::{self, Look, Panel, Series};

use super::judge::{ObjectResult, quantile};
use super::{GaugeStudy, OBJECTS, SpanResult};

/// Lengths that are drawn, mm.
const LENGTHS_MM: [f64; 4] = [15.0, 30.0, 45.0, 60.0];

/// One quantity of a span, and the range in which it is drawn for each object.
struct Quantity {
    name: &'static str,
    label: &'static str,
    ranges: [(f64, f64); 2],
    value: fn(&ObjectResult) -> f64,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        name: "slid at the slip warning, nine of ten",
        label: "mm",
        ranges: [(0.0, 30.0), (0.0, 150.0)],
        value: |seen| 1e3 * quantile(&seen.slip_m, 0.9),
    },
    Quantity {
        name: "first sliding to collapse, median",
        label: "ms",
        ranges: [(100.0, 250.0), (100.0, 250.0)],
        value: |seen| quantile(&seen.loss_ms, 0.5),
    },
    Quantity {
        name: "shaking of held ones at 10 m/s², greatest",
        label: "% of the plateau",
        ranges: [(0.0, 40.0), (0.0, 40.0)],
        value: |seen| 1e2 * seen.held[1],
    },
];

/// Slip, loss and shaking against the middle of the span, a line for each length; a ring is the recipe's place.
///
/// # Errors
/// If the drawing library fails.
pub fn chart(study: &GaugeStudy) -> anyhow::Result<String> {
    let end_mm = study.spans.iter().map(|result| 1e3 * result.span.to_m);
    let end_mm = end_mm.fold(0.0, f64::max);
    let panels = QUANTITIES.iter().flat_map(|quantity| {
        (0..OBJECTS.len()).map(move |object| panel(study, quantity, object, end_mm))
    });
    let mut panels: Vec<_> = panels.collect();
    panels[0].legend = Some(SeriesLabelPosition::UpperMiddle);
    Ok(charts::standalone(&charts::draw(&panels, 2, (440, 260))?))
}

fn panel(study: &GaugeStudy, quantity: &Quantity, object: usize, end_mm: f64) -> Panel {
    let (low, high) = quantity.ranges[object];
    let at = |result: &SpanResult| {
        let middle_mm = 5e2 * (result.span.from_m + result.span.to_m);
        (middle_mm, (quantity.value)(&result.seen[object]))
    };
    let mut series: Vec<_> = LENGTHS_MM
        .iter()
        .enumerate()
        .map(|(n, &length_mm)| {
            let long = |result: &&SpanResult| {
                let length = 1e3 * (result.span.to_m - result.span.from_m);
                (length - length_mm).abs() < 0.1
            };
            let points = study.spans.iter().filter(long).map(at);
            Series {
                name: format!("{length_mm:.0} mm long"),
                look: Look::Line,
                color: charts::color(n),
                // Where it leaves the picture the span warns never, or too late to be of use.
                points: points
                    .skip_while(|point| point.1 > high)
                    .take_while(|point| point.1 <= high)
                    .collect(),
            }
        })
        .collect();
    series.push(Series {
        name: "recipe's place".into(),
        look: Look::Rings,
        color: report::style::INK,
        points: vec![at(&study.recipe)],
    });
    Panel {
        title: format!("{}: {}", OBJECTS[object], quantity.name),
        x_label: "middle of the span, mm from the clamp",
        y_label: quantity.label,
        x: 0.0..end_mm,
        y: low..high,
        stages: Vec::new(),
        series,
        legend: None,
    }
}

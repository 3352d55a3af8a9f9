//! Charts of the evaluation.

use plotters::prelude::SeriesLabelPosition;
use report::charts::{self, Look, Panel, Series, color};
use report::style::{PALETTE, QUIET};

use crate::options::NOISE_UE;
use crate::roc;
use crate::sample::Sample;
use crate::summary::{OperatingPoint, Summary};

/// Latencies up to here are drawn, ms.
const DRAWN_MS: f64 = 200.0;

/// Operating curves, latency over false-alarm rate, as SVG.
///
/// # Errors
/// If the drawing library fails.
pub fn roc(summary: &Summary) -> anyhow::Result<String> {
    let colors = [color(0), color(1), color(2), color(3), PALETTE[3], QUIET];
    let panel = |title: &str, y_label, value: fn(&OperatingPoint) -> Option<f64>| Panel {
        title: title.into(),
        x_label: "false alarms per hour, power of ten (none at all: half of one)",
        y_label,
        x: -2.5..3.0,
        y: -20.0..DRAWN_MS,
        stages: Vec::new(),
        series: summary
            .detectors
            .iter()
            .zip(colors)
            .flat_map(|(detector, color)| {
                let place = |setting: &OperatingPoint| {
                    let rate = (setting.alarms as f64).max(0.5) / setting.hours;
                    let ms = value(setting)?;
                    ((-20.0..=DRAWN_MS).contains(&ms)).then_some((rate.log10(), ms))
                };
                let series = |name: &str, look, points: Vec<(f64, f64)>| Series {
                    name: name.into(),
                    look,
                    color,
                    points,
                };
                let line = detector.curve.iter().filter_map(place).collect();
                let published = detector.published.iter().filter_map(place).collect();
                [
                    series(detector.name, Look::Line, line),
                    series("", Look::Rings, published),
                ]
            })
            .collect(),
        legend: Some(SeriesLabelPosition::UpperRight),
    };
    let panels = [
        panel("median", "latency, ms", |setting| setting.p50_ms),
        panel("99 %", "latency, ms", |setting| setting.p99_ms),
    ];
    charts::draw(&panels, 1, (960, 420))
}

/// Cumulative distribution of the latency, one line per level of noise.
///
/// # Errors
/// If the drawing library fails.
pub fn latencies(sample: &Sample) -> anyhow::Result<String> {
    let series = NOISE_UE.into_iter().enumerate().map(|(n, noise)| {
        let (losses, ms) = sample.reported_ms(n);
        let share = |n: usize| 100.0 * n as f64 / losses as f64;
        let steps = ms.cumulative().scan(0, |below, (ms, upto)| {
            let step = [(ms, share(*below)), (ms, share(upto))];
            *below = upto;
            Some(step)
        });
        Series {
            name: format!("{noise} µε"),
            look: Look::Line,
            color: color(n),
            points: steps
                .flatten()
                .filter(|(ms, _)| (-100.0..=60.0).contains(ms))
                .collect(),
        }
    });
    let panel = Panel {
        title: String::new(),
        x_label: "time after the collapse of the grip, ms",
        y_label: "losses reported, %",
        x: -100.0..60.0,
        y: 0.0..100.0,
        stages: Vec::new(),
        series: series.collect(),
        legend: Some(SeriesLabelPosition::UpperLeft),
    };
    charts::draw(&[panel], 1, (960, 420))
}

/// Caption of the figure of [`roc`].
pub fn roc_caption() -> String {
    format!(
        "Latency against false alarms at {} µε, each rule at many thresholds, on the same losses and the same hours. Rings: as published, and the controller as it is set. Lines end where a rule misses half (above) or a hundredth (below) of the losses, or is slower than {DRAWN_MS} ms.",
        roc::NOISE_UE
    )
}

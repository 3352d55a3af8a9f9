//! The report's pictures.

use finger::capability::GRAVITY_M_S2;
use finger::chain::Chain;
use finger::links;
use plotters::prelude::*;

use super::{PUBLISHED_KPA, Report};
use crate::scenario::ObjectKind;
use crate::study::{ACCELERATIONS, EXPERIMENTS, Stated};
use crate::style::{FAINT, INK, PALETTE, QUIET};

type Error = Box<dyn std::error::Error + Send + Sync>;

/// Pressure of the paper's experiments (section 4.2), kPa.
const EXPERIMENTS_KPA: f64 = 140.0;

/// What stands around a chart.
struct Frame<'a> {
    title: &'a str,
    labels: [&'a str; 2],
    legend: SeriesLabelPosition,
}

struct Line {
    name: String,
    color: RGBColor,
    points: Vec<(f64, f64)>,
}

impl Report {
    /// Every picture with its file's name.
    pub fn pictures(&self) -> anyhow::Result<Vec<(&'static str, String)>> {
        let mut pictures = vec![
            ("deflection.svg", self.deflection()),
            ("capability.svg", self.capability()),
            ("interpolation.svg", self.interpolation()),
        ];
        if !self.sensitivity.is_empty() {
            pictures.push(("sensitivity.svg", self.sensitivity_curves()));
        }
        pictures
            .into_iter()
            .map(|(name, picture)| match picture {
                Ok(svg) => Ok((name, svg)),
                Err(error) => anyhow::bail!("{name}: cannot draw: {error}"),
            })
            .collect()
    }

    /// Shapes at the published pressures: continuum, our chain, the published chain (figs. 19 and 20).
    fn deflection(&self) -> Result<String, Error> {
        let max = self.recipe.chain.max_pressure_kpa();
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, (1080, 760)).into_drawing_area();
            root.fill(&WHITE)?;
            let titled = root.titled(
                "the free finger: towards the inside of the bend over along the finger, mm",
                ("sans-serif", 18).into_font().color(&INK),
            )?;
            let cells = titled.split_evenly((2, 3));
            let pressures = PUBLISHED_KPA.into_iter().filter(|&p| p <= max);
            for (cell, pressure) in cells.iter().zip(pressures) {
                let mut lines = vec![
                    chain_line("published chain", PALETTE[1], &self.published, pressure),
                    chain_line("our chain", PALETTE[0], &self.recipe.chain, pressure),
                ];
                if let Some(geometry) = &self.recipe.geometry
                    && let [bend] = &geometry.solve(&[pressure])?.bends[..]
                {
                    let points = bend.curve.position_m.iter();
                    lines.push(Line {
                        name: "continuum".into(),
                        color: INK,
                        points: points.map(|[x, y]| (1e3 * x, 1e3 * y)).collect(),
                    });
                }
                let title = format!("{pressure} kPa");
                let frame = Frame {
                    title: &title,
                    labels: ["", ""],
                    legend: SeriesLabelPosition::UpperLeft,
                };
                chart(cell, frame, 0.0..105.0, 0.0..78.0, &lines, &[])?;
            }
            root.present()?;
        }
        Ok(svg)
    }

    /// Mass that can be lifted over acceleration (fig. 29), and what the paper's experiments held.
    fn capability(&self) -> Result<String, Error> {
        let max = self.recipe.chain.max_pressure_kpa();
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, (1080, 460)).into_drawing_area();
            root.fill(&WHITE)?;
            for (kind, cell) in root.split_evenly((1, 2)).iter().enumerate() {
                let lines: Vec<Line> = [100.0, 120.0, EXPERIMENTS_KPA, 160.0]
                    .into_iter()
                    .filter(|&p| p <= max)
                    .zip(PALETTE)
                    .map(|(pressure, color)| {
                        let lift = self.lift_n(pressure)[kind];
                        let mass = |a: f64| (a, 1e3 * lift / (GRAVITY_M_S2 + a));
                        Line {
                            name: format!("{pressure} kPa"),
                            color,
                            points: (0..=48).map(|i| mass(0.25 * f64::from(i))).collect(),
                        }
                    })
                    .collect();
                let of_kind = [ObjectKind::Sphere, ObjectKind::Cylinder][kind];
                let marks: Vec<(f64, f64, bool)> = EXPERIMENTS
                    .iter()
                    .filter(|experiment| experiment.object == of_kind)
                    .flat_map(|experiment| {
                        let at = ACCELERATIONS.into_iter().zip(experiment.stated);
                        at.filter(|(_, stated)| *stated != Stated::Unstated)
                            .map(|(a, stated)| {
                                (a, 1e3 * experiment.mass_kg, stated == Stated::Hold)
                            })
                    })
                    .collect();
                let title = format!(
                    "{}: greatest mass, statics; dots: the paper at 140 kPa, held (full) and lost (open)",
                    ["sphere", "cylinder"][kind]
                );
                let frame = Frame {
                    title: &title,
                    labels: ["acceleration, m/s²", "g"],
                    legend: SeriesLabelPosition::UpperRight,
                };
                chart(cell, frame, 0.0..12.0, 0.0..400.0, &lines, &marks)?;
            }
            root.present()?;
        }
        Ok(svg)
    }

    /// Interpolation error over pressure.
    fn interpolation(&self) -> Result<String, Error> {
        let line = Line {
            name: "largest of all columns".into(),
            color: PALETTE[0],
            points: self.table.interpolation_error_percent(&self.recipe.chain),
        };
        let max = self.recipe.chain.max_pressure_kpa();
        let labels = ["pressure, kPa", "% of full scale"];
        let title = "interpolation error of the table; the budget is 0.1 %";
        single(title, labels, 0.0..max, 0.0..0.12, &[line])
    }

    /// What 0.1 mm and 10 % do to the tip angle.
    fn sensitivity_curves(&self) -> Result<String, Error> {
        let lines: Vec<Line> = self
            .sensitivity
            .iter()
            .enumerate()
            .filter_map(|(i, row)| {
                let list = row.tip_angle_percent.as_ref()?;
                Some(Line {
                    name: row.change.into(),
                    // A plus and its minus share a colour.
                    color: PALETTE[i / 2],
                    points: self
                        .pressures_kpa
                        .iter()
                        .copied()
                        .zip(list.iter().copied())
                        .collect(),
                })
            })
            .collect();
        let ends = lines
            .iter()
            .flat_map(|line| &line.points)
            .map(|(_, y)| y.abs());
        let reach = ends.fold(1.0, f64::max) * 1.1;
        let max = self.recipe.chain.max_pressure_kpa();
        let labels = ["pressure, kPa", "%"];
        let title = "change of the tip angle";
        single(title, labels, 0.0..1.45 * max, -reach..reach, &lines)
    }
}

fn chain_line(name: &str, color: RGBColor, chain: &Chain, pressure_kpa: f64) -> Line {
    let joints = links::joints_m(&chain.link_length_m, &chain.link_angles_rad(pressure_kpa));
    Line {
        name: name.into(),
        color,
        points: joints.iter().map(|[x, y]| (1e3 * x, 1e3 * y)).collect(),
    }
}

fn single(
    title: &str,
    labels: [&str; 2],
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    lines: &[Line],
) -> Result<String, Error> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (860, 460)).into_drawing_area();
        root.fill(&WHITE)?;
        let frame = Frame {
            title,
            labels,
            legend: SeriesLabelPosition::UpperRight,
        };
        chart(&root, frame, x, y, lines, &[])?;
        root.present()?;
    }
    Ok(svg)
}

fn chart(
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    frame: Frame,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    lines: &[Line],
    marks: &[(f64, f64, bool)],
) -> Result<(), Error> {
    let label = ("sans-serif", 12).into_font().color(&INK);
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(frame.title, ("sans-serif", 14).into_font().color(&INK))
        .x_label_area_size(34)
        .y_label_area_size(48)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(frame.labels[0])
        .y_desc(frame.labels[1])
        .x_labels(7)
        .y_labels(6)
        .label_style(label.clone())
        .axis_style(QUIET)
        .bold_line_style(FAINT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for line in lines {
        let color = line.color;
        chart
            .draw_series(LineSeries::new(
                line.points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    for &(x, y, held) in marks {
        let style = if held {
            INK.filled()
        } else {
            INK.stroke_width(2)
        };
        chart.draw_series([Circle::new((x, y), 5, style)])?;
    }
    chart
        .configure_series_labels()
        .position(frame.legend)
        .background_style(WHITE.mix(0.85))
        .label_font(label)
        .draw()?;
    Ok(())
}

//! Figures of the table report.

use finger::capability::GRAVITY_M_S2;
use finger::chain::Chain;
use finger::links;
use finger::table::interpolation_error_percent;
use plotters::chart::SeriesLabelPosition;
use plotters::style::RGBColor;

use super::{TableReport, published_up_to};
use crate::paper::{ACCELERATIONS, EXPERIMENTS, Stated};
use report::charts::{self, Look, Panel, Series};
use report::style::{INK, PALETTE};
use sim::scenario::ObjectKind;

/// Pressure of the paper's experiments (section 4.2), kPa.
const EXPERIMENTS_KPA: f64 = 140.0;

impl TableReport {
    /// Every picture with its file's name.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub fn pictures(&self) -> anyhow::Result<Vec<(&'static str, String)>> {
        let mut pictures = vec![
            (
                "deflection.svg",
                charts::draw(&self.deflection()?, 3, (360, 340))?,
            ),
            (
                "capability.svg",
                charts::draw(&self.capability(), 2, (540, 460))?,
            ),
            (
                "interpolation.svg",
                charts::draw(&[self.interpolation()], 1, (860, 460))?,
            ),
        ];
        if !self.sensitivity.is_empty() {
            let panel = self.sensitivity_curves();
            pictures.push(("sensitivity.svg", charts::draw(&[panel], 1, (860, 460))?));
        }
        for (_, svg) in &mut pictures {
            *svg = charts::standalone(svg);
        }
        Ok(pictures)
    }

    /// Shapes at the published pressures: continuum, our chain, the published chain (figs. 19 and 20).
    fn deflection(&self) -> anyhow::Result<Vec<Panel>> {
        let max = self.recipe.chain.max_pressure_kpa();
        published_up_to(max)
            .into_iter()
            .map(|pressure| {
                let mut series = vec![
                    chain_line("published chain", PALETTE[1], &self.published, pressure),
                    chain_line("our chain", PALETTE[0], &self.recipe.chain, pressure),
                ];
                if let Some(geometry) = &self.recipe.geometry {
                    for bend in geometry.solve(&[pressure])?.bends {
                        let points = bend.curve.position_m.iter();
                        let points = points.map(|[x, y]| (1e3 * x, 1e3 * y)).collect();
                        series.push(line("continuum", INK, points));
                    }
                }
                Ok(Panel {
                    title: format!("the free finger at {pressure} kPa"),
                    x_label: "along the unbent finger, mm",
                    y_label: "inwards, mm",
                    x: 0.0..105.0,
                    y: 0.0..78.0,
                    stages: Vec::new(),
                    series,
                    legend: Some(SeriesLabelPosition::UpperLeft),
                })
            })
            .collect()
    }

    /// Mass that can be lifted over acceleration (fig. 29), and what the paper's experiments held.
    fn capability(&self) -> Vec<Panel> {
        let max = self.recipe.chain.max_pressure_kpa();
        let panel = |(kind, name, object)| {
            let mut series: Vec<Series> = [100.0, 120.0, EXPERIMENTS_KPA, 160.0]
                .into_iter()
                .filter(|&p| p <= max)
                .zip(PALETTE)
                .filter_map(|(pressure, color)| {
                    let lift_n: f64 = self.lift_n(pressure)[kind]?;
                    let mass = |a: f64| (a, 1e3 * lift_n / (GRAVITY_M_S2 + a));
                    let points = (0..=48).map(|i| mass(0.25 * f64::from(i))).collect();
                    Some(line(&format!("{pressure} kPa"), color, points))
                })
                .collect();
            series.push(experiments(object, Look::Dots, "paper: held", |s| {
                s == Stated::Hold
            }));
            series.push(experiments(object, Look::Rings, "paper: lost", |s| {
                !matches!(s, Stated::Hold | Stated::Unstated)
            }));
            Panel {
                title: format!("{name}: greatest mass by statics; paper at {EXPERIMENTS_KPA} kPa"),
                x_label: "acceleration, m/s²",
                y_label: "g",
                x: 0.0..12.0,
                y: 0.0..400.0,
                stages: Vec::new(),
                series,
                legend: Some(SeriesLabelPosition::UpperRight),
            }
        };
        [
            (0, "sphere", ObjectKind::Sphere),
            (1, "cylinder", ObjectKind::Cylinder),
        ]
        .map(panel)
        .into()
    }

    /// Interpolation error over pressure.
    fn interpolation(&self) -> Panel {
        let points = interpolation_error_percent(
            &self.table,
            &finger::table::links(&self.recipe.chain),
            &self.recipe.chain,
        );
        Panel {
            title: "interpolation error of the table; the budget is 0.1 %".into(),
            x_label: "pressure, kPa",
            y_label: "% of full scale",
            x: 0.0..self.recipe.chain.max_pressure_kpa(),
            y: 0.0..0.12,
            stages: Vec::new(),
            series: vec![line("largest of all columns", PALETTE[0], points)],
            legend: Some(SeriesLabelPosition::UpperRight),
        }
    }

    /// Sensitivity of the tip angle to 0.1 mm and 10 %.
    fn sensitivity_curves(&self) -> Panel {
        let series: Vec<Series> = self
            .sensitivity
            .iter()
            .enumerate()
            .filter_map(|(i, row)| {
                let list = row.tip_angle_percent.as_ref()?;
                let points = self.pressures_kpa.iter().copied().zip(list.iter().copied());
                // A plus and its minus share a colour.
                Some(line(row.change, PALETTE[i / 2], points.collect()))
            })
            .collect();
        let ends = series.iter().flat_map(|series| &series.points);
        let reach = ends.map(|(_, y)| y.abs()).fold(1.0, f64::max) * 1.1;
        Panel {
            title: "change of the tip angle".into(),
            x_label: "pressure, kPa",
            y_label: "%",
            // Room for the names.
            x: 0.0..1.45 * self.recipe.chain.max_pressure_kpa(),
            y: -reach..reach,
            stages: Vec::new(),
            series,
            legend: Some(SeriesLabelPosition::UpperRight),
        }
    }
}

fn line(name: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.into(),
        look: Look::Line,
        color,
        points,
    }
}

fn chain_line(name: &str, color: RGBColor, chain: &Chain, pressure_kpa: f64) -> Series {
    let joints = links::joints_m(&chain.link_length_m, &chain.link_angles_rad(pressure_kpa));
    let points = joints.iter().map(|[x, y]| (1e3 * x, 1e3 * y)).collect();
    line(name, color, points)
}

/// Accelerations and masses, g, of the paper's experiments with an object whose stated outcome `is` so.
fn experiments(object: ObjectKind, look: Look, name: &str, is: impl Fn(Stated) -> bool) -> Series {
    let points = EXPERIMENTS
        .iter()
        .filter(|experiment| experiment.object == object)
        .flat_map(|experiment| {
            let at = ACCELERATIONS.into_iter().zip(experiment.stated);
            at.filter(|&(_, stated)| is(stated))
                .map(|(a, _)| (a, 1e3 * experiment.mass_kg))
        })
        .collect();
    Series {
        name: name.into(),
        look,
        color: INK,
        points,
    }
}

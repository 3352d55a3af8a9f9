//! Figure of a fit: measurements, curves before and after, and residuals.

use finger::recipe::Recipe;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::Fit;
use super::data::{Point, Quantity};
use report::style::{FAINT, INK, PALETTE, QUIET};

const PANEL_WIDTH: u32 = 620;
const HEIGHT: u32 = 620;
/// Steps of the drawn curves.
const CURVE: u32 = 160;

type Error = Box<dyn std::error::Error + Send + Sync>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Fit {
    /// Draws one column per measured quantity as SVG.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub fn picture(&self) -> anyhow::Result<String> {
        let mut svg = String::new();
        self.draw(&mut svg)
            .map_err(|error| anyhow::anyhow!("cannot draw: {error}"))?;
        Ok(svg)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Error> {
        let mut quantities = Quantity::ALL.to_vec();
        quantities.retain(|quantity| self.of(*quantity).next().is_some());
        let size = (PANEL_WIDTH * quantities.len() as u32, HEIGHT);
        let root = SVGBackend::with_string(svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let columns = root.split_evenly((1, quantities.len()));
        for (area, quantity) in columns.iter().zip(quantities) {
            let title = format!("{} fitted to {}", self.start.name, self.measured);
            let area = area.titled(&title, ("sans-serif", 18).into_font().color(&INK))?;
            let (top, bottom) = area.split_vertically(390);
            self.curves(&top, quantity)?;
            self.residuals(&bottom, quantity)?;
        }
        root.present()?;
        Ok(())
    }

    /// Before and after, each with its name and colour.
    fn models(&self) -> [(&'static str, RGBColor, &Recipe); 2] {
        [
            ("before", PALETTE[1], &self.start),
            ("after", PALETTE[0], &self.fitted),
        ]
    }

    fn curves(&self, area: &Area, quantity: Quantity) -> Result<(), Error> {
        let max = self.start.chain.max_pressure_kpa();
        let highest = self
            .models()
            .map(|(_, _, recipe)| quantity.of(&recipe.chain, max));
        let highest = self.of(quantity).map(|p| p.value).chain(highest);
        let highest = 1.08 * highest.fold(0.0, f64::max);
        let mut chart = ChartBuilder::on(area)
            .margin_right(14)
            .margin_top(4)
            .x_label_area_size(30)
            .y_label_area_size(68)
            .build_cartesian_2d(0.0..max, 0.0..highest)?;
        chart
            .configure_mesh()
            .x_desc("pressure, kPa")
            .x_label_formatter(&|kpa| format!("{kpa:.0}"))
            .y_label_formatter(&|value| format!("{value:.0}"))
            .y_desc(quantity.name())
            .label_style(("sans-serif", 12).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 13).into_font().color(&INK))
            .axis_style(QUIET)
            .bold_line_style(FAINT)
            .light_line_style(TRANSPARENT)
            .draw()?;
        for (name, color, recipe) in self.models() {
            let at = |k: u32| max * f64::from(k) / f64::from(CURVE);
            let points = (0..=CURVE).map(|k| (at(k), quantity.of(&recipe.chain, at(k))));
            chart
                .draw_series(LineSeries::new(points, color.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2))
                });
        }
        let dot = |at: (f64, f64)| Circle::new(at, 4, INK.stroke_width(2));
        chart
            .draw_series(self.of(quantity).map(|p| dot((p.pressure_kpa, p.value))))?
            .label("measured")
            .legend(|(x, y)| Circle::new((x + 8, y), 4, INK.stroke_width(2)));
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .label_font(("sans-serif", 12).into_font().color(&INK))
            .draw()?;
        Ok(())
    }

    fn residuals(&self, area: &Area, quantity: Quantity) -> Result<(), Error> {
        let max = self.start.chain.max_pressure_kpa();
        let noise = self.noise.of(quantity);
        let decimals = quantity.decimals() / 2;
        let off = |recipe: &Recipe, point: &Point| {
            quantity.of(&recipe.chain, point.pressure_kpa) - point.value
        };
        let reach = self.models().into_iter().flat_map(|(_, _, recipe)| {
            self.of(quantity).map(move |point| off(recipe, point).abs())
        });
        let reach = 1.15 * reach.fold(2.0 * noise, f64::max);
        let mut chart = ChartBuilder::on(area)
            .margin_right(14)
            .margin_top(4)
            .x_label_area_size(30)
            .y_label_area_size(68)
            .build_cartesian_2d(0.0..max, -reach..reach)?;
        let band = Rectangle::new(
            [(0.0, -noise), (max, noise)],
            RGBColor(236, 239, 244).filled(),
        );
        chart.draw_series([band])?;
        chart
            .configure_mesh()
            .x_desc("pressure, kPa; grey: the stated noise")
            .y_desc("model less measured")
            .y_labels(6)
            .x_label_formatter(&|kpa| format!("{kpa:.0}"))
            .y_label_formatter(&|off| format!("{off:.decimals$}"))
            .label_style(("sans-serif", 12).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 13).into_font().color(&INK))
            .axis_style(QUIET)
            .bold_line_style(FAINT)
            .light_line_style(TRANSPARENT)
            .draw()?;
        for (_, color, recipe) in self.models() {
            let points: Vec<(f64, f64)> = self
                .of(quantity)
                .map(|point| (point.pressure_kpa, off(recipe, point)))
                .collect();
            chart.draw_series(LineSeries::new(points.clone(), color.stroke_width(1)))?;
            let dots = points.into_iter();
            chart.draw_series(dots.map(|at| Circle::new(at, 4, color.filled())))?;
        }
        Ok(())
    }
}

//! The result of a fit as text and as JSON.

use std::fmt::Write;

use finger::recipe::Recipe;
use serde_json::{Value, json};

use super::Fit;
use super::data::{Point, Quantity};
use super::identify::{Candidate, DISTINCT, Selection};
use super::parameter::Parameter;
use report::json::round;

impl Fit {
    /// The result as plain text.
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{}: {} values; noise {} deg, {} µε\n",
            self.measured,
            self.points.len(),
            self.noise.tip_angle_deg,
            self.noise.strain_ue
        );
        self.write_candidates(&mut out);
        let _ = writeln!(out);
        for change in &self.changes {
            let _ = writeln!(out, "{}", change.sentence());
        }
        for quantity in Quantity::ALL {
            self.write_residuals(&mut out, quantity);
        }
        let [before, after] = [&self.start, &self.fitted].map(|recipe| self.misfit(recipe));
        let _ = writeln!(
            out,
            "\nrms residual over noise: {before:.2} before, {after:.2} after"
        );
        if after > 2.0 {
            let _ = writeln!(
                out,
                "The residuals are larger than the noise: the model does not follow this finger, or its \
                 measurements are worse than stated."
            );
        }
        for hysteresis in &self.hysteresis {
            let quantity = hysteresis.quantity;
            let _ = writeln!(
                out,
                "hysteresis of the {}: unloading is {:+.*} above loading at {:.1} kPa, {:+.1} % of the largest; the \
                 fit goes between them",
                quantity.name(),
                quantity.decimals(),
                hysteresis.most,
                hysteresis.pressure_kpa,
                hysteresis.percent
            );
        }
        for note in self.warnings() {
            let _ = writeln!(out, "{note}");
        }
        out
    }

    fn write_candidates(&self, out: &mut String) {
        let identified = &self.identified;
        let fitted = |c: &Candidate| c.selection == Selection::Fitted;
        let _ = writeln!(
            out,
            "parameter           step  change, %  effect  distinct  correlation             verdict"
        );
        for (i, candidate) in identified.candidates.iter().enumerate() {
            let (step, unit) = candidate.parameter.step();
            let likeness = (0..identified.candidates.len())
                .filter(|&j| j != i && fitted(&identified.candidates[j]))
                .map(|j| (j, identified.correlation[(i, j)]))
                .filter(|(_, cosine)| *cosine != 0.0)
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
                .map_or(String::new(), |(j, cosine)| {
                    let name = identified.candidates[j].parameter.name();
                    format!("{cosine:+.3} {name}")
                });
            let _ = writeln!(
                out,
                "{:<15} {:>8}  {:>+9.1}  {:>6.1}  {:>8.1}  {likeness:<22}  {}",
                candidate.parameter.name(),
                format!("{step} {unit}"),
                candidate.change_percent,
                candidate.effect,
                candidate.distinct,
                words(candidate.selection),
            );
        }
        let values: Vec<String> = identified
            .singular_values
            .iter()
            .map(|value| format!("{value:.1}"))
            .collect();
        let _ = writeln!(
            out,
            "step: how well it is known beforehand; effect: what a step does to all values together, in noise; \
             distinct: what of it the fitted ones cannot imitate\nfitted: distinct of {DISTINCT} or more, the largest \
             first; singular values of all effects: {}",
            values.join(" ")
        );
    }

    fn write_residuals(&self, out: &mut String, quantity: Quantity) {
        let mut points = self.of(quantity).peekable();
        if points.peek().is_none() {
            return;
        }
        let _ = writeln!(
            out,
            "\n    kPa  measured    before           off by     after           off by   {}",
            quantity.name()
        );
        let decimals = quantity.decimals();
        for point in points {
            let row = |recipe: &Recipe| {
                let model = quantity.of(&recipe.chain, point.pressure_kpa);
                let off = model - point.value;
                let percent = match point.value > 0.0 {
                    true => format!("{:+.1} %", 100.0 * off / point.value),
                    false => String::new(),
                };
                format!("{model:>8.decimals$}  {off:>+7.decimals$} {percent:>8}")
            };
            let _ = writeln!(
                out,
                "{:>7.1}  {:>8.decimals$}  {}  {}",
                point.pressure_kpa,
                point.value,
                row(&self.start),
                row(&self.fitted)
            );
        }
    }

    /// Warnings about the interpretation of the fit.
    fn warnings(&self) -> Vec<&'static str> {
        let fits = |parameter| self.changes.iter().any(|c| c.parameter == parameter);
        let alone = self.of(Quantity::TipAngle).next().is_none();
        let mut notes = vec![
            "The fitted numbers stand for the held ones too: the curve is good, the dimensions need not be.",
        ];
        if alone && fits(Parameter::GaugeDistance) {
            notes.push(
                "From strain alone the gauge's distance and the bend cannot be told apart, so the tip angle is not \
                 better known than before: measure tip angles too, or the distance, and say --known gauge-distance.",
            );
        }
        if self.points.len() <= self.changes.len() {
            notes.push("As many parameters as values: nothing checks the fit.");
        }
        notes
    }

    pub(super) fn of(&self, quantity: Quantity) -> impl Iterator<Item = &Point> {
        let points = self.points.iter();
        points.filter(move |point| point.quantity == quantity)
    }

    /// The result as JSON.
    pub fn json(&self) -> Value {
        let identified = &self.identified;
        let number = |x: f64| round(x, 4);
        let candidates = identified.candidates.iter().map(|c| {
            let (step, unit) = c.parameter.step();
            json!({
                "name": c.parameter.name(),
                "step": step,
                "unit": unit,
                "change_percent": number(c.change_percent),
                "effect": number(c.effect),
                "distinct": number(c.distinct),
                "verdict": words(c.selection),
            })
        });
        let changes = self.changes.iter().map(|c| {
            json!({
                "name": c.parameter.name(),
                "steps": c.steps,
                "deviation_steps": number(c.deviation),
            })
        });
        let points = self.points.iter().map(|point| {
            let model =
                |recipe: &Recipe| number(point.quantity.of(&recipe.chain, point.pressure_kpa));
            json!({
                "pressure_kpa": point.pressure_kpa,
                "quantity": point.quantity.column(),
                "measured": point.value,
                "before": model(&self.start),
                "after": model(&self.fitted),
            })
        });
        let hysteresis = self.hysteresis.iter().map(|hysteresis| {
            json!({
                "quantity": hysteresis.quantity.column(),
                "most": number(hysteresis.most),
                "pressure_kpa": hysteresis.pressure_kpa,
                "percent": number(hysteresis.percent),
            })
        });
        let correlation = identified.correlation.row_iter();
        let singular = identified.singular_values.iter();
        json!({
            "measured": self.measured,
            "recipe": self.start.name,
            "noise": { "tip_angle_deg": self.noise.tip_angle_deg, "strain_ue": self.noise.strain_ue },
            "parameters": candidates.collect::<Vec<_>>(),
            "correlation": correlation
                .map(|row| row.iter().map(|x| number(*x)).collect())
                .collect::<Vec<Vec<_>>>(),
            "singular_values": singular.map(|x| number(*x)).collect::<Vec<_>>(),
            "changes": changes.collect::<Vec<_>>(),
            "points": points.collect::<Vec<_>>(),
            "hysteresis": hysteresis.collect::<Vec<_>>(),
            "misfit_before": number(self.misfit(&self.start)),
            "misfit_after": number(self.misfit(&self.fitted)),
        })
    }
}

fn words(selection: Selection) -> &'static str {
    match selection {
        Selection::Fitted => "fitted",
        Selection::Known => "held: known",
        Selection::Weak => "held: moves the values too little",
        Selection::Alike => "held: looks like the fitted",
        Selection::Spare => "held: one too many for these values",
    }
}

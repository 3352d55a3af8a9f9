//! `softgrip fit`: a recipe that bends as a finger did on the bench.
//!
//! A free finger's tip angle over pressure is a smooth curve with a height and a slope: it cannot tell
//! seven dimensions and constants. So the few that it can tell are chosen by a rule ([`identify`]) and
//! fitted, and the rest stay as the recipe has them.

pub mod change;
pub mod data;
pub mod identify;
pub mod parameter;
mod plot;
mod problem;
mod text;

use std::path::Path;

use anyhow::{Context, bail};
use finger::recipe::{self, Recipe};
use nalgebra::DMatrix;
use toml_edit::DocumentMut;

use change::Change;
use data::{Hysteresis, Measurements, Noise, Point, Quantity};
use identify::Identified;
use parameter::Parameter;
use problem::Problem;

/// What to fit to, and what is known.
pub struct Request<'a> {
    /// The measurements' file.
    pub measured: &'a Path,
    /// The recipe to start from, for messages.
    pub recipe: &'a Path,
    /// Its text.
    pub text: &'a str,
    /// How good the measurements are.
    pub noise: Noise,
    /// What is not to be changed.
    pub known: &'a [Parameter],
}

/// A fit and what it is worth.
pub struct Fit {
    measured: String,
    points: Vec<Point>,
    hysteresis: Vec<Hysteresis>,
    notes: Vec<String>,
    noise: Noise,
    identified: Identified,
    changes: Vec<Change>,
    start: Recipe,
    fitted: Recipe,
    toml: String,
}

impl Fit {
    /// Fits a geometry recipe to measurements.
    pub fn new(request: &Request) -> anyhow::Result<Self> {
        let Request {
            noise, known, text, ..
        } = *request;
        let start = recipe::parse(request.recipe, text)?;
        if start.geometry.is_none() {
            bail!(
                "{}: kind = \"measured\": a fit changes dimensions and rubber, so the recipe must be of kind \
                 \"geometry\"",
                request.recipe.display()
            );
        }
        let Measurements {
            points,
            hysteresis,
            notes,
        } = data::read(request.measured, start.chain.max_pressure_kpa(), noise)?;
        let document: DocumentMut = text.parse()?;
        let problem = Problem {
            points: &points,
            noise,
            recipe: &document,
        };
        let mut parameters = Parameter::ALL.to_vec();
        parameters.retain(|parameter| parameter.is_in(&document));
        let unchanged = vec![0.0; parameters.len()];
        let jacobian = problem
            .residuals(&parameters, &unchanged)
            .and_then(|here| problem.jacobian(&parameters, &unchanged, &here))
            .with_context(|| format!("{}", request.recipe.display()))?;
        let percent = change_percent(&jacobian, &points, noise, &start);
        let identified = identify::identify(&parameters, known, &jacobian, &percent);
        let chosen = identified.fitted();
        if chosen.is_empty() {
            bail!(
                "{}: nothing can be fitted: no parameter that is not known moves these values by {} times their \
                 noise; measure at higher pressures or with less noise",
                request.measured.display(),
                identify::DISTINCT
            );
        }
        let changes = changes(&problem, &chosen)
            .with_context(|| format!("{}", request.measured.display()))?;
        let measured = match request.measured.file_name() {
            Some(name) => name.to_string_lossy().into_owned(),
            None => request.measured.display().to_string(),
        };
        let steps: Vec<f64> = changes.iter().map(|change| change.steps).collect();
        let toml = change::recipe(
            problem.changed(&chosen, &steps),
            &measured,
            &start.name,
            &changes,
        );
        Ok(Self {
            // As it will be read: what is reported is what the file says.
            fitted: recipe::parse(Path::new("fitted.toml"), &toml)?,
            measured,
            points,
            hysteresis,
            notes,
            noise,
            identified,
            changes,
            start,
            toml,
        })
    }

    /// The fitted recipe, as a file holds it.
    pub fn toml(&self) -> &str {
        &self.toml
    }

    /// The fitted recipe.
    pub fn fitted(&self) -> &Recipe {
        &self.fitted
    }

    /// What was understood of the measurements that is not plain.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What was changed.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// What the measurements can tell.
    pub fn identified(&self) -> &Identified {
        &self.identified
    }

    /// The measured points of one quantity, in rising pressure.
    fn of(&self, quantity: Quantity) -> impl Iterator<Item = &Point> {
        let points = self.points.iter();
        points.filter(move |point| point.quantity == quantity)
    }

    /// Root mean square of measured less modelled values, in standard deviations of the noise.
    fn misfit(&self, recipe: &Recipe) -> f64 {
        let squares = self.points.iter().map(|point| {
            let model = point.quantity.of(&recipe.chain, point.pressure_kpa);
            ((point.value - model) / self.noise.of(point.quantity)).powi(2)
        });
        (squares.sum::<f64>() / self.points.len() as f64).sqrt()
    }
}

/// Fits the chosen parameters, with the standard deviation of each.
fn changes(problem: &Problem, chosen: &[Parameter]) -> anyhow::Result<Vec<Change>> {
    // To the thousandth of a step, so that the recipe does not pretend to more.
    let steps: Vec<f64> = problem
        .solve(chosen)?
        .iter()
        .map(|steps| report::json::round(*steps, 3))
        .collect();
    let here = problem.residuals(chosen, &steps)?;
    let jacobian = problem.jacobian(chosen, &steps, &here)?;
    let covariance = (jacobian.transpose() * &jacobian).try_inverse();
    let deviation = |i: usize| {
        covariance
            .as_ref()
            .map_or(f64::INFINITY, |c| c[(i, i)].sqrt())
    };
    Ok((0..chosen.len())
        .map(|i| Change {
            parameter: chosen[i],
            steps: steps[i],
            deviation: deviation(i),
        })
        .collect())
}

/// Mean change of the modelled values per step of each parameter, %.
fn change_percent(
    jacobian: &DMatrix<f64>,
    points: &[Point],
    noise: Noise,
    start: &Recipe,
) -> Vec<f64> {
    let mean = |column: &[f64]| {
        let ratios: Vec<f64> = points
            .iter()
            .zip(column)
            .filter(|(point, _)| point.pressure_kpa > 0.0)
            .map(|(point, change)| {
                let model = point.quantity.of(&start.chain, point.pressure_kpa);
                100.0 * change * noise.of(point.quantity) / model
            })
            .collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    };
    jacobian
        .column_iter()
        .map(|column| mean(column.clone_owned().as_slice()))
        .collect()
}

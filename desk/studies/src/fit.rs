//! Fit of a recipe to measurements of a free finger.
//!
//! The tip angle of a free finger over pressure is a smooth curve with a height and a slope: it cannot
//! identify seven dimensions and constants. A rule ([`identify`]) chooses the few parameters that the data
//! can identify; these are fitted, and the others stay as in the recipe.

mod change;
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

pub use change::Change;
use data::{Hysteresis, Measurements, Noise, Point};
use identify::Identified;
use parameter::Parameter;
use problem::Problem;

/// Input of a fit.
pub struct Request<'a> {
    /// CSV file with the measurements.
    pub measured: &'a Path,
    /// The recipe to start from, for messages.
    pub recipe: &'a Path,
    /// Text of the recipe, TOML.
    pub text: &'a str,
    /// Standard deviations of the measurements.
    pub noise: Noise,
    /// Parameters that must not change, because they were measured.
    pub known: &'a [Parameter],
}

/// A fitted recipe with its uncertainties.
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
    ///
    /// # Errors
    /// If the recipe is not of kind "geometry", a measurement is refused (by its line), no parameter can be
    /// identified, or the model has no solution for a changed recipe.
    pub fn new(request: &Request) -> anyhow::Result<Self> {
        let Request { noise, text, .. } = *request;
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
        let identified = identify_parameters(request, &problem, &start)?;
        let (chosen, steps, changes) = fit_parameters(&problem, &identified)
            .with_context(|| format!("{}", request.measured.display()))?;
        let measured = match request.measured.file_name() {
            Some(name) => name.to_string_lossy().into_owned(),
            None => request.measured.display().to_string(),
        };
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

    /// The fitted recipe, parsed.
    pub fn fitted(&self) -> &Recipe {
        &self.fitted
    }

    /// Assumptions made while reading the measurements, for the user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The fitted parameters with their changes.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// Identifiability of all parameters.
    pub fn identified(&self) -> &Identified {
        &self.identified
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

/// Chooses the parameters that the measurements can identify, by the sensitivity of the unchanged recipe.
fn identify_parameters(
    request: &Request,
    problem: &Problem,
    start: &Recipe,
) -> anyhow::Result<Identified> {
    let mut parameters = Parameter::ALL.to_vec();
    parameters.retain(|parameter| parameter.is_in(problem.recipe));
    let unchanged = vec![0.0; parameters.len()];
    let jacobian = problem
        .residuals(&parameters, &unchanged)
        .and_then(|here| problem.jacobian(&parameters, &unchanged, &here))
        .with_context(|| format!("{}", request.recipe.display()))?;
    let percent = change_percent(&jacobian, problem.points, problem.noise, start);
    let identified = identify::identify(&parameters, request.known, &jacobian, &percent);
    if identified.fitted().is_empty() {
        bail!(
            "{}: nothing can be fitted: no parameter that is not known moves these values by {} times their \
             noise; measure at higher pressures or with less noise",
            request.measured.display(),
            identify::DISTINCT
        );
    }
    Ok(identified)
}

/// The chosen parameters, their steps, and their changes with standard deviations.
fn fit_parameters(
    problem: &Problem,
    identified: &Identified,
) -> anyhow::Result<(Vec<Parameter>, Vec<f64>, Vec<Change>)> {
    let chosen = identified.fitted();
    // To the thousandth of a step, so that the recipe does not pretend to more.
    let steps: Vec<f64> = problem
        .solve(&chosen)?
        .iter()
        .map(|steps| report::json::round(*steps, 3))
        .collect();
    let jacobian = problem
        .residuals(&chosen, &steps)
        .and_then(|here| problem.jacobian(&chosen, &steps, &here))?;
    let covariance = (jacobian.transpose() * &jacobian).try_inverse();
    let changes = (0..chosen.len())
        .map(|i| Change {
            parameter: chosen[i],
            steps: steps[i],
            deviation: covariance
                .as_ref()
                .map_or(f64::INFINITY, |c| c[(i, i)].sqrt()),
        })
        .collect();
    Ok((chosen, steps, changes))
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

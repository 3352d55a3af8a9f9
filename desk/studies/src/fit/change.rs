//! A fitted change of a parameter, and the fitted recipe with all of them.

use std::fmt::Write;

use toml_edit::DocumentMut;

use super::parameter::Parameter;

/// A parameter that has been fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The fitted parameter.
    pub parameter: Parameter,
    /// Change in steps of the parameter ([`Parameter::step`]).
    pub steps: f64,
    /// Standard deviation if the other parameters are as the recipe has them, in steps.
    pub deviation: f64,
}

impl Change {
    /// A fitted change with its standard deviation.
    pub(super) fn sentence(self) -> String {
        let (step, unit) = self.parameter.step();
        let decimals = if unit == "%" { 1 } else { 4 };
        format!(
            "{} {:+.decimals$} ± {:.decimals$} {unit}",
            self.parameter.name(),
            self.parameter.shift(self.steps),
            step * self.deviation,
        )
    }
}

/// The fitted recipe: the old one with a name and a comment of its own.
pub(super) fn recipe(
    mut recipe: DocumentMut,
    measured: &str,
    from: &str,
    changes: &[Change],
) -> String {
    let mut header = format!("# The recipe {from}, fitted to {measured}:\n");
    for change in changes {
        let _ = writeln!(header, "#   {}", change.sentence());
    }
    if let Some(name) = recipe["name"].as_value_mut() {
        let decor = name.decor().clone();
        let fitted = format!("{}-fitted", from.trim_end_matches("-fitted"));
        *name = fitted.into();
        *name.decor_mut() = decor;
    }
    format!("{header}# What follows was said of the recipe before.\n#\n{recipe}")
}

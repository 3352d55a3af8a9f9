//! The parameters that a fit may change. They are changed in the text of the recipe, so that layout and
//! comments stay.

use toml_edit::{DocumentMut, Item, TableLike, Value};

use report::json::round;

/// A parameter of the recipe. A fit counts its change in steps, the uncertainty without a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The outer radius of every station, together.
    OuterRadius,
    /// The bore's radius at every station, together.
    BoreRadius,
    /// The bore's offset at every station, together.
    BoreOffset,
    /// Young's modulus, and with it what tells it of the strain energy: Yeoh's C1, for `E = 6 C1`, both of
    /// Mooney's and Rivlin's constants, all of Ogden's μ.
    Stiffness,
    /// Yeoh's C2, if the recipe has it.
    Hardening,
    /// Length inside the clamp that bends like the root.
    RootLength,
    /// Distance of the gauge's grid from the neutral axis.
    GaugeDistance,
}

impl Parameter {
    /// Every parameter, in the order of the output.
    pub const ALL: [Self; 7] = [
        Self::OuterRadius,
        Self::BoreRadius,
        Self::BoreOffset,
        Self::Stiffness,
        Self::Hardening,
        Self::RootLength,
        Self::GaugeDistance,
    ];

    /// Name in the output and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::OuterRadius => "outer-radius",
            Self::BoreRadius => "bore-radius",
            Self::BoreOffset => "bore-offset",
            Self::Stiffness => "stiffness",
            Self::Hardening => "hardening",
            Self::RootLength => "root-length",
            Self::GaugeDistance => "gauge-distance",
        }
    }

    /// One step, and its unit: how well the number is known beforehand (standard deviation). Radii and
    /// offset: a printed mould and its core. Rubber: from batch to batch. Root and gauge: by eye.
    pub fn step(self) -> (f64, &'static str) {
        match self {
            Self::OuterRadius | Self::BoreRadius | Self::BoreOffset => (0.1, "mm"),
            Self::Stiffness | Self::Hardening => (10.0, "%"),
            Self::RootLength => (2.0, "mm"),
            Self::GaugeDistance => (0.2, "mm"),
        }
    }

    /// The change of `steps` steps, in the unit of [`Self::step`].
    pub fn shift(self, steps: f64) -> f64 {
        match self.step() {
            // A power, so that what is scaled stays positive whatever the fit tries.
            (percent, "%") => 100.0 * ((1.0 + 0.01 * percent).powf(steps) - 1.0),
            (step, _) => step * steps,
        }
    }

    /// Whether the recipe contains it.
    pub fn is_in(self, recipe: &DocumentMut) -> bool {
        let constants = recipe["rubber"].get("yeoh_mpa").and_then(Item::as_array);
        self != Self::Hardening || constants.is_some_and(|array| array.len() > 1)
    }

    /// Changes a recipe that has been checked by so many steps.
    pub fn apply(self, recipe: &mut DocumentMut, steps: f64) {
        let shift = self.shift(steps);
        let add = |value: f64| value + shift;
        let scale = |value: f64| value * (1.0 + 0.01 * shift);
        match self {
            Self::OuterRadius => each_station(recipe, "outer_radius_mm", add),
            Self::BoreRadius => each_station(recipe, "bore_radius_mm", add),
            Self::BoreOffset => each_station(recipe, "bore_offset_mm", add),
            Self::Stiffness => {
                if let Some(modulus) = recipe["rubber"].get_mut("youngs_modulus_kpa") {
                    change(modulus, scale);
                }
                constant(recipe, "yeoh_mpa", 0, scale);
                for index in 0..2 {
                    constant(recipe, "mooney_rivlin_mpa", index, scale);
                }
                for key in ["ogden", "ogden_abaqus"] {
                    each_mu(recipe, key, scale);
                }
            }
            Self::Hardening => constant(recipe, "yeoh_mpa", 1, scale),
            Self::RootLength => change(&mut recipe["root"]["free_length_mm"], add),
            Self::GaugeDistance => change(&mut recipe["gauge"]["distance_mm"], add),
        }
    }
}

fn each_station(recipe: &mut DocumentMut, key: &str, to: impl Fn(f64) -> f64) {
    let one = |station: &mut dyn TableLike| {
        if let Some(item) = station.get_mut(key) {
            change(item, &to);
        }
    };
    match &mut recipe["station"] {
        Item::ArrayOfTables(stations) => stations.iter_mut().for_each(|table| one(table)),
        Item::Value(Value::Array(stations)) => stations
            .iter_mut()
            .filter_map(Value::as_inline_table_mut)
            .for_each(|table| one(table)),
        Item::None | Item::Value(_) | Item::Table(_) => {}
    }
}

/// One constant of the rubber, if the recipe has it.
fn constant(recipe: &mut DocumentMut, key: &str, index: usize, to: impl Fn(f64) -> f64) {
    let constants = recipe["rubber"].get_mut(key);
    if let Some(value) = constants
        .and_then(Item::as_array_mut)
        .and_then(|array| array.get_mut(index))
    {
        change_value(value, to);
    }
}

/// The first of every pair of the rubber's constants, if the recipe has them.
fn each_mu(recipe: &mut DocumentMut, key: &str, to: impl Fn(f64) -> f64) {
    let pairs = recipe["rubber"].get_mut(key).and_then(Item::as_array_mut);
    for pair in pairs.into_iter().flat_map(|array| array.iter_mut()) {
        if let Some(mu) = pair.as_array_mut().and_then(|pair| pair.get_mut(0)) {
            change_value(mu, &to);
        }
    }
}

fn change(item: &mut Item, to: impl Fn(f64) -> f64) {
    if let Some(value) = item.as_value_mut() {
        change_value(value, to);
    }
}

/// A number's comment and white space stay.
fn change_value(value: &mut Value, to: impl Fn(f64) -> f64) {
    let number = value
        .as_float()
        .or(value.as_integer().map(|whole| whole as f64));
    if let Some(number) = number {
        let decor = value.decor().clone();
        // Six decimals: nanometres, pascals.
        *value = Value::from(round(to(number), 6));
        *value.decor_mut() = decor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECIPE: &str = include_str!("../../../../recipes/rtv225.toml");

    #[test]
    fn a_change_keeps_everything_else() {
        let mut recipe: DocumentMut = RECIPE.parse().expect("a good recipe");
        let modulus = recipe["rubber"]["youngs_modulus_kpa"].as_float();
        Parameter::Stiffness.apply(&mut recipe, 1.0);
        let stiffer = recipe["rubber"]["youngs_modulus_kpa"].as_float();
        assert_eq!(stiffer, modulus.map(|kpa| round(1.1 * kpa, 6)));
        let text = recipe.to_string();
        let lines = RECIPE.lines().zip(text.lines());
        let changed: Vec<_> = lines.filter(|(before, after)| before != after).collect();
        let keys = changed.iter().map(|(_, after)| after.split(' ').next());
        assert!(keys.eq([Some("youngs_modulus_kpa"), Some("yeoh_mpa")]));
        let comment = |line: &str| line.split_once('#').map(|(_, comment)| comment.to_string());
        for (before, after) in changed {
            assert_eq!(comment(before), comment(after));
        }
        assert_eq!(text.lines().count(), RECIPE.lines().count());
    }

    #[test]
    fn every_parameter_changes_a_recipe_in_either_spelling() {
        let inline = RECIPE.replace("[[station]]\n", "");
        let (before, after) = inline
            .split_once("at_mm")
            .and_then(|(before, rest)| Some((before, rest.split_once("[bore]")?.1)))
            .expect("stations, then the bore");
        let inline = format!(
            "station = [{{ at_mm = 0, outer_radius_mm = 10, bore_radius_mm = 5, bore_offset_mm = 2 }}]\n{before}[bore]{after}"
        );
        for text in [RECIPE, &inline] {
            for parameter in Parameter::ALL {
                let mut recipe: DocumentMut = text.parse().expect("a good recipe");
                assert!(parameter.is_in(&recipe));
                parameter.apply(&mut recipe, 1.0);
                assert_ne!(recipe.to_string(), text, "{}", parameter.name());
            }
        }
    }
}

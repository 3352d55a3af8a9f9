//! Rubber as people publish it: constants of one strain energy or another, converted exactly.

use serde::Deserialize;

use crate::check::{FieldError, within, wrong};
use crate::hyperelastic::Rubber;
use crate::ogden::TERMS;

/// Constants of a strain energy `W` of the stretches `λ̄` at constant volume, as published, in MPa.
#[derive(Debug, Clone, PartialEq)]
pub enum Constants {
    /// Yeoh's `C₁`, `C₂`, `C₃` of `Σ Cᵢ (Ī₁ − 3)ⁱ`; one or two mean that the others are zero.
    Yeoh(Vec<f64>),
    /// Mooney's and Rivlin's `C₁₀`, `C₀₁` of `C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3)`.
    MooneyRivlin([f64; 2]),
    /// Ogden's pairs of `μ` and `α` of `Σ μ/α (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)` (Ogden 1972, Holzapfel).
    Ogden(Vec<[f64; 2]>),
    /// Ogden's pairs of `μ` and `α` of `Σ 2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3)`, as in Abaqus.
    OgdenAbaqus(Vec<[f64; 2]>),
}

impl Constants {
    /// Checks the constants and makes the rubber; `field` is what the user calls them.
    ///
    /// # Errors
    /// [`FieldError`], which names the first wrong constant and what would be right.
    pub fn rubber(&self, field: &str) -> Result<Rubber, FieldError> {
        match self {
            Self::Yeoh(constants) => yeoh(field, constants),
            Self::MooneyRivlin([c10, c01]) => {
                within(&format!("{field}[0]"), *c10, -1.0, 1.0)?;
                within(&format!("{field}[1]"), *c01, -1.0, 1.0)?;
                within(&format!("{field}[0] + {field}[1]"), c10 + c01, 0.001, 1.0)?;
                Ok(Rubber::mooney_rivlin([1e6 * c10, 1e6 * c01]))
            }
            Self::Ogden(pairs) => ogden(field, pairs, "½ Σ μ α", Rubber::ogden),
            Self::OgdenAbaqus(pairs) => ogden(field, pairs, "Σ μ", Rubber::ogden_abaqus),
        }
    }
}

fn yeoh(field: &str, constants: &[f64]) -> Result<Rubber, FieldError> {
    if !(1..=3).contains(&constants.len()) {
        let expected = "numbers given: must be one to three, C1, C2 and C3".to_string();
        return Err(wrong(field, constants.len() as f64, expected));
    }
    let mut yeoh_pa = [0.0; 3];
    for (i, &mpa) in constants.iter().enumerate() {
        // Later ones may be negative: where that makes the energy unstable is for the model to find.
        let low = if i == 0 { 0.001 } else { -1.0 };
        within(&format!("{field}[{i}]"), mpa, low, 1.0)?;
        yeoh_pa[i] = 1e6 * mpa;
    }
    Ok(Rubber::incompressible(yeoh_pa))
}

fn ogden(
    field: &str,
    pairs: &[[f64; 2]],
    shear: &str,
    rubber: fn(&[[f64; 2]]) -> Rubber,
) -> Result<Rubber, FieldError> {
    if !(1..=TERMS).contains(&pairs.len()) {
        let expected = format!("pairs given: must be one to {TERMS} of μ and α");
        return Err(wrong(field, pairs.len() as f64, expected));
    }
    for (i, &[mu, alpha]) in pairs.iter().enumerate() {
        within(&format!("{field}[{i}][0]"), mu, -100.0, 100.0)?;
        let exponent = format!("{field}[{i}][1]");
        within(&exponent, alpha, -30.0, 30.0)?;
        if alpha.abs() < 0.01 {
            let expected = "must be at least 0.01 away from zero".to_string();
            return Err(wrong(&exponent, alpha, expected));
        }
    }
    let rubber = rubber(
        &pairs
            .iter()
            .map(|[mu, a]| [1e6 * mu, *a])
            .collect::<Vec<_>>(),
    );
    // As for the other energies, in MPa; to the thousandth of a pascal, as it will be read.
    let modulus = (1e3 * rubber.youngs_modulus_pa() / 3.0).round() / 1e9;
    within(
        &format!("{field}: the shear modulus {shear}"),
        modulus,
        0.002,
        2.0,
    )?;
    Ok(rubber)
}

/// The rubber of a recipe.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RubberPart {
    youngs_modulus_kpa: Option<f64>,
    yeoh_mpa: Option<Vec<f64>>,
    mooney_rivlin_mpa: Option<[f64; 2]>,
    ogden: Option<Vec<[f64; 2]>>,
    ogden_abaqus: Option<Vec<[f64; 2]>>,
    pub density_g_per_cm3: f64,
}

/// What a recipe says of its rubber, checked.
pub(crate) struct Checked {
    /// Young's modulus at small strain, Pa.
    pub youngs_modulus_pa: f64,
    /// The rubber at large strain.
    pub rubber: Rubber,
    /// The field that tells the rubber.
    pub field: &'static str,
}

impl RubberPart {
    /// Young's modulus, unless it is given, is that of the strain energy; the strain energy, unless it is
    /// given, is neo-Hookean.
    pub fn check(&self) -> Result<Checked, FieldError> {
        const MODULUS: &str = "rubber.youngs_modulus_kpa";
        let modulus_kpa = self.youngs_modulus_kpa;
        if let Some(kpa) = modulus_kpa {
            within(MODULUS, kpa, 10.0, 100_000.0)?;
        }
        let density = self.density_g_per_cm3;
        within("rubber.density_g_per_cm3", density, 0.1, 10.0)?;
        let (rubber, field) = match (self.constants()?, modulus_kpa) {
            (Some((field, constants)), _) => (constants.rubber(field)?, field),
            (None, Some(kpa)) => (Rubber::from_youngs_modulus(1e3 * kpa), MODULUS),
            (None, None) => {
                let expected = "is needed where there is no yeoh_mpa, mooney_rivlin_mpa, ogden or ogden_abaqus";
                return Err(wrong(MODULUS, 0.0, expected.into()));
            }
        };
        Ok(Checked {
            youngs_modulus_pa: modulus_kpa.map_or(rubber.youngs_modulus_pa(), |kpa| 1e3 * kpa),
            rubber,
            field,
        })
    }

    /// The constants, with their field: of one strain energy at most.
    fn constants(&self) -> Result<Option<(&'static str, Constants)>, FieldError> {
        let mut given = [
            (
                "rubber.yeoh_mpa",
                self.yeoh_mpa.clone().map(Constants::Yeoh),
            ),
            (
                "rubber.mooney_rivlin_mpa",
                self.mooney_rivlin_mpa.map(Constants::MooneyRivlin),
            ),
            ("rubber.ogden", self.ogden.clone().map(Constants::Ogden)),
            (
                "rubber.ogden_abaqus",
                self.ogden_abaqus.clone().map(Constants::OgdenAbaqus),
            ),
        ]
        .into_iter()
        .filter_map(|(field, constants)| Some((field, constants?)));
        let first = given.next();
        let count = 1 + given.clone().count();
        match (&first, given.next()) {
            (Some((one, _)), Some((other, _))) => {
                let expected = format!("strain energies given: {one} or {other}, not both");
                Err(wrong("rubber", count as f64, expected))
            }
            _ => Ok(first),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<Checked, String> {
        let part: RubberPart = toml::from_str(&format!("density_g_per_cm3 = 1.1\n{text}"))
            .map_err(|error| error.message().to_string())?;
        part.check().map_err(|error| error.to_string())
    }

    #[test]
    fn constants_that_are_not_given_are_zero() {
        for (text, yeoh_pa) in [
            ("yeoh_mpa = [0.11]", [0.11e6, 0.0, 0.0]),
            ("yeoh_mpa = [0.11, 0.02]", [0.11e6, 0.02e6, 0.0]),
            (
                "yeoh_mpa = [0.11, 0.02, -0.001]",
                [0.11e6, 0.02e6, -0.001e6],
            ),
        ] {
            let rubber = check(text).expect("a rubber");
            assert_eq!(rubber.rubber, Rubber::incompressible(yeoh_pa));
            assert_eq!(rubber.youngs_modulus_pa, 6.0 * 0.11e6);
            assert_eq!(rubber.field, "rubber.yeoh_mpa");
        }
    }

    #[test]
    fn every_energy_has_its_key_and_its_modulus() {
        for (text, modulus_pa) in [
            ("youngs_modulus_kpa = 600", 0.6e6),
            ("yeoh_mpa = [0.1, 0.02]\nyoungs_modulus_kpa = 550", 0.55e6),
            ("mooney_rivlin_mpa = [0.08, 0.02]", 0.6e6),
            ("ogden_abaqus = [[0.15, 1.3], [0.05, -2]]", 0.6e6),
            ("ogden = [[0.2, 1.5], [-0.05, -2]]", 0.6e6),
        ] {
            let rubber = check(text).expect("a rubber");
            let off = rubber.youngs_modulus_pa / modulus_pa - 1.0;
            assert!(off.abs() < 1e-12, "{text}: {off}");
        }
    }

    #[test]
    fn what_is_no_rubber_is_named() {
        for (text, expected) in [
            ("", "rubber.youngs_modulus_kpa = 0: is needed where"),
            (
                "yeoh_mpa = [0.1]\nogden = [[0.2, 1.5]]",
                "rubber = 2: strain energies given: rubber.yeoh_mpa or rubber.ogden, not both",
            ),
            ("yeoh_mpa = []", "rubber.yeoh_mpa = 0: numbers given"),
            ("yeoh_mpa = [1, 1, 1, 1]", "rubber.yeoh_mpa = 4: numbers"),
            (
                "yeoh_mpa = [-0.1, 0.02]",
                "rubber.yeoh_mpa[0] = -0.1: must lie within 0.001 and 1",
            ),
            (
                "mooney_rivlin_mpa = [0.1, -0.2]",
                "rubber.mooney_rivlin_mpa[0] + rubber.mooney_rivlin_mpa[1] = -0.1: must lie within",
            ),
            (
                "ogden_abaqus = [[0.1, 0.0]]",
                "rubber.ogden_abaqus[0][1] = 0: must be at least 0.01 away from zero",
            ),
            (
                "ogden = [[0.1, -2.0]]",
                "rubber.ogden: the shear modulus ½ Σ μ α = -0.1: must lie within 0.002 and 2",
            ),
            ("ogden = [[0.1]]", "invalid length 1"),
            ("neo_hooke = 0.1", "unknown field `neo_hooke`"),
        ] {
            let message = check(text).err().expect("no rubber");
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}

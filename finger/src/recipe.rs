//! Finger recipes: TOML files that describe one finger.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use sha2::{Digest, Sha256};
use softgrip_table::LINKS;

use crate::chain::Chain;
use crate::check::{FieldError, each_within, within, wrong};
use crate::cubic::MonotoneCubic;
use crate::geometry::{Description, Geometry};
use crate::grasp::Grasp;
use crate::model::ModelError;
use crate::mounting::{GaugePart, GraspPart};

/// Why a recipe cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// The file cannot be read.
    #[error("{}: {error}", path.display())]
    Read {
        /// The recipe's file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The file is not TOML, or a field is missing, unknown or of the wrong type.
    #[error("{}: {message}", path.display())]
    Parse {
        /// The recipe's file.
        path: PathBuf,
        /// The parser's message, with line and column.
        message: String,
    },
    /// A value that no finger can have.
    #[error("{}: {error}", path.display())]
    Value {
        /// The recipe's file.
        path: PathBuf,
        /// The field, and what would be right.
        error: FieldError,
    },
    /// The model of a geometry recipe has no answer.
    #[error("{}: {error}", path.display())]
    Model {
        /// The recipe's file.
        path: PathBuf,
        /// Which part of the model, where along the finger, and at which pressure.
        error: ModelError,
    },
}

/// A recipe that has been read and checked.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// The name that the recipe gives itself.
    pub name: String,
    /// First eight bytes of the SHA-256 of the file.
    pub inputs_hash: u64,
    /// The finger as links and springs.
    pub chain: Chain,
    /// The gripper that three such fingers make, if the recipe says.
    pub grasp: Option<Grasp>,
    /// What the chain was computed from, unless it was measured.
    pub geometry: Option<Geometry>,
}

/// Read first, so that the rest is parsed as its own type and errors keep their line.
#[derive(Deserialize)]
struct Head {
    kind: Kind,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Measured,
    Geometry,
}

/// A finger given by its measured (or published) link chain.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Measured {
    #[serde(rename = "kind")]
    _kind: Kind,
    name: String,
    links: Links,
    joints: Joints,
    torque: Vec<Torque>,
    gauge: GaugePart,
    grasp: Option<GraspPart>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Links {
    length_mm: [f64; LINKS],
    mass_g: [f64; LINKS],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Joints {
    stiffness_nmm_per_deg: [f64; LINKS],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Torque {
    pressure_kpa: f64,
    torque_nmm: [f64; LINKS],
}

/// Reads and checks the recipe at `path`, and computes the chain of one that is given by its geometry.
///
/// # Errors
/// [`RecipeError`], which names the file and, as far as there is one, the field and what would be right.
pub fn load(path: &Path) -> Result<Recipe, RecipeError> {
    let text = std::fs::read_to_string(path).map_err(|error| RecipeError::Read {
        path: path.to_path_buf(),
        error,
    })?;
    parse(path, &text)
}

/// The same for a recipe's `text`; `path` is for messages.
///
/// # Errors
/// As [`load`], except [`RecipeError::Read`].
pub fn parse(path: &Path, text: &str) -> Result<Recipe, RecipeError> {
    let value = |error| RecipeError::Value {
        path: path.to_path_buf(),
        error,
    };
    let (name, chain, grasp, geometry) = match from_toml::<Head>(path, text)?.kind {
        Kind::Measured => {
            let measured: Measured = from_toml(path, text)?;
            let chain = measured.chain().map_err(value)?;
            let grasp = measured.grasp().map_err(value)?;
            (measured.name, chain, grasp, None)
        }
        Kind::Geometry => {
            let description: Description = from_toml(path, text)?;
            let geometry = description.check().map_err(value)?;
            let grasp = description.grasp().map_err(value)?;
            let chain = geometry
                .chain(description.max_pressure_kpa)
                .map_err(|error| RecipeError::Model {
                    path: path.to_path_buf(),
                    error,
                })?;
            (description.name, chain, grasp, Some(geometry))
        }
    };
    let digest = Sha256::digest(text.as_bytes());
    let mut first = [0; 8];
    first.copy_from_slice(&digest[..8]);
    Ok(Recipe {
        name,
        inputs_hash: u64::from_be_bytes(first),
        chain,
        grasp,
        geometry,
    })
}

fn from_toml<T: serde::de::DeserializeOwned>(path: &Path, text: &str) -> Result<T, RecipeError> {
    toml::from_str(text).map_err(|error| RecipeError::Parse {
        path: path.to_path_buf(),
        message: error.to_string().trim_end().to_string(),
    })
}

impl Measured {
    fn chain(&self) -> Result<Chain, FieldError> {
        let length_mm = &self.links.length_mm;
        each_within("links.length_mm", length_mm, 0.1, 500.0)?;
        each_within("links.mass_g", &self.links.mass_g, 0.001, 1000.0)?;
        let stiffness = &self.joints.stiffness_nmm_per_deg;
        each_within("joints.stiffness_nmm_per_deg", stiffness, 0.001, 10_000.0)?;
        self.check_torques()?;
        let torque = |i: usize| {
            let mut points = vec![(0.0, 0.0)];
            points.extend(
                self.torque
                    .iter()
                    .map(|t| (t.pressure_kpa, 1e-3 * t.torque_nmm[i])),
            );
            MonotoneCubic::starting_flat(&points)
        };
        Ok(Chain {
            link_length_m: length_mm.map(|mm| 1e-3 * mm),
            link_mass_kg: self.links.mass_g.map(|g| 1e-3 * g),
            root_free_length_m: 0.0,
            joint_stiffness_nm_per_rad: stiffness.map(|k| 1e-3 * k / 1f64.to_radians()),
            joint_torque_nm: std::array::from_fn(torque),
            gauge: self.gauge.check(self.length_mm())?,
        })
    }

    fn grasp(&self) -> Result<Option<Grasp>, FieldError> {
        let grasp = self.grasp.as_ref();
        grasp.map(|part| part.check(self.length_mm())).transpose()
    }

    fn length_mm(&self) -> f64 {
        self.links.length_mm.iter().sum()
    }

    /// Pressures must rise, and no torque may fall with them.
    fn check_torques(&self) -> Result<(), FieldError> {
        if self.torque.is_empty() {
            let expected = "needs at least one [[torque]] with a pressure and its torques";
            return Err(wrong("torque", 0.0, expected.into()));
        }
        for (k, torque) in self.torque.iter().enumerate() {
            let pressure = format!("torque[{k}].pressure_kpa");
            within(&pressure, torque.pressure_kpa, 1.0, 1000.0)?;
            let field = format!("torque[{k}].torque_nmm");
            each_within(&field, &torque.torque_nmm, 0.0, 100_000.0)?;
        }
        for (k, pair) in self.torque.windows(2).enumerate() {
            let (below, above) = (&pair[0], &pair[1]);
            if above.pressure_kpa <= below.pressure_kpa {
                return Err(wrong(
                    &format!("torque[{}].pressure_kpa", k + 1),
                    above.pressure_kpa,
                    format!(
                        "must be above the pressure before it, {} kPa",
                        below.pressure_kpa
                    ),
                ));
            }
            for i in 0..LINKS {
                if above.torque_nmm[i] < below.torque_nmm[i] {
                    return Err(wrong(
                        &format!("torque[{}].torque_nmm[{i}]", k + 1),
                        above.torque_nmm[i],
                        format!(
                            "must not fall with pressure: it is {} at {} kPa",
                            below.torque_nmm[i], below.pressure_kpa
                        ),
                    ));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../recipes/paper.toml");

    fn error(from: &str, to: &str) -> String {
        assert!(PAPER.contains(from), "{from} is not in the recipe");
        parse(Path::new("x.toml"), &PAPER.replacen(from, to, 1))
            .expect_err("the recipe is wrong")
            .to_string()
    }

    #[test]
    fn the_paper_is_read_as_printed() {
        let recipe = parse(Path::new("paper.toml"), PAPER).expect("a good recipe");
        let chain = recipe.chain;
        // Table 3 over table 2, summed: 91.2 degrees at 160 kPa.
        assert!((chain.tip_angle_rad(160.0).to_degrees() - 91.2).abs() < 0.05);
        assert!((chain.joint_torques_nm(120.0)[2] - 24.49e-3).abs() < 1e-12);
        assert!((chain.joint_stiffness_nm_per_rad[0] - 4.12e-3 * 57.295_78).abs() < 1e-6);
        for (share, expected) in chain
            .gauge_share()
            .iter()
            .zip([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        {
            assert!((share - expected).abs() < 1e-12);
        }
        assert_eq!(chain.tip_angle_rad(0.0), 0.0);
    }

    #[test]
    fn a_recipe_need_not_say_how_it_grips() {
        let geometry = include_str!("../../recipes/rtv225.toml").replacen(
            "max_pressure_kpa = 160.0",
            "max_pressure_kpa = 20.0",
            1,
        );
        for text in [PAPER, &geometry] {
            let (finger, _) = text.split_once("[grasp]").expect("a grasp at the end");
            let path = Path::new("x.toml");
            let with = parse(path, text).expect("a good recipe");
            let without = parse(path, finger).expect("a good recipe");
            assert!(with.grasp.is_some() && without.grasp.is_none());
            assert_eq!(with.chain, without.chain);
            let part = parse(path, &format!("{finger}[grasp]\nfriction = 0.8\n"));
            let message = part.expect_err("not all of a grasp").to_string();
            assert!(message.contains("palm_radius_mm"), "{message}");
        }
    }

    #[test]
    fn every_wrong_value_is_named_with_what_would_be_right() {
        for (from, to, expected) in [
            (
                "mass_g = [3.94, 3.94",
                "mass_g = [3.94, -3.94",
                "x.toml: links.mass_g[1] = -3.94: must lie within 0.001 and 1000",
            ),
            (
                "[4.12, 1.95,",
                "[4.12, nan,",
                "x.toml: joints.stiffness_nmm_per_deg[1] = NaN: must lie within 0.001 and 10000",
            ),
            (
                "pressure_kpa = 80.0",
                "pressure_kpa = 60.0",
                "x.toml: torque[1].pressure_kpa = 60: must be above the pressure before it, 60 kPa",
            ),
            (
                "[28.71, 13.62",
                "[28.71, 3.62",
                "x.toml: torque[2].torque_nmm[1] = 3.62: must not fall with pressure: it is 7.37 at 80 kPa",
            ),
            (
                "to_mm = 45.0",
                "to_mm = 0.0",
                "x.toml: gauge.to_mm = 0: must lie beyond gauge.from_mm, 0 mm",
            ),
            (
                "pressure_kpa = 160.0",
                "pressure_kpa = inf",
                "x.toml: torque[5].pressure_kpa = inf: must lie within 1 and 1000",
            ),
        ] {
            assert_eq!(error(from, to), expected);
        }
        for (from, to, expected) in [
            ("distance_mm = 1.0", "", "missing field `distance_mm`"),
            ("[links]", "[linkz]", "linkz"),
            ("kind = \"measured\"", "kind = \"guessed\"", "guessed"),
            ("4.05, 1.36]", "4.05]", "length"),
        ] {
            let message = error(from, to);
            assert!(message.contains(expected), "{message}");
        }
    }
}

//! Bending of a section under inner pressure: the finite-element solution that replaces eqs. 1–4.
//!
//! The paper puts `M = e F*`, proportional to pressure. That cannot be: to first order a closed tube of
//! constant volume does not bend under inner pressure at all, and Table 3 is nearly flat below 50 kPa.
//! Curvature comes from the bore's growth. So the section is solved as it is, in plane finite elements
//! with the stretch along the finger linear over the *deformed* section: the stationary point of
//!
//! ```text
//! Π(x, λ, κ) = ∫ W(F) dA − p ∫ (λ + κ y) da,    F₃₃ = λ + κ y
//!               wall           deformed bore
//! ```
//!
//! in the positions `x` of the nodes, the stretch `λ` at `y = 0` and the curvature `κ`. The second
//! integral is the bore's volume per undeformed length, so it holds the thrust on the closed end too.

use nalgebra::Matrix2;

use crate::bordered::Step;
use crate::hyperelastic::{Energy, Rubber};
use crate::mesh::{Mesh, MeshSize};
use crate::potential::{Potential, Unknowns};
use crate::section::{Section, SectionError};

/// Shortest pressure step before a section counts as ballooning, or its rubber as unstable, Pa.
const SHORTEST_STEP_PA: f64 = 100.0;
/// A section that balloons at this share of the logarithmic strain at which its rubber becomes unstable does
/// so by its rubber, which softens towards its end. Fitted silicones do so at 0.9 and more of it; rubbers
/// whose end is far balloon at less than 0.7, as they would without an end.
const ALMOST_UNSTABLE: f64 = 0.75;
/// Newton's method has converged when no node moves more than this share of the outer radius.
const CONVERGED: f64 = 1e-6;
/// A node that moves this share of the outer radius in one iteration is on its way to another branch.
const TOO_FAR: f64 = 0.3;
/// Newton's method converges in two to four iterations or not at all.
const ITERATIONS: usize = 10;

/// A section in equilibrium under pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inflated {
    /// Inner pressure, Pa.
    pub pressure_pa: f64,
    /// Rotation per undeformed length `κ`, rad/m, positive towards the flat.
    pub curvature_per_m: f64,
    /// Mean stretch of the wall along the finger.
    pub stretch: f64,
    /// Slope of bending moment against curvature at constant pressure, with no axial force, N·m².
    pub bending_stiffness_nm2: f64,
}

/// Why a section has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InflationError {
    /// The section is not closed.
    #[error(transparent)]
    Section(#[from] SectionError),
    /// There is nothing to inflate.
    #[error("the section has no bore")]
    Solid,
    /// A material constant that no rubber has.
    #[error("{name} = {value} Pa: must be finite and {expected}")]
    Material {
        /// Which one, as messages call it.
        name: &'static str,
        /// Its value, Pa.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// An exponent of Ogden's energy that is no exponent.
    #[error("Ogden's exponent is {value}: must be finite and not zero")]
    Exponent {
        /// The exponent `α`.
        value: f64,
    },
    /// The strain energy describes no material at the stretches that the wall reaches: stress would fall
    /// with further stretch.
    #[error(
        "the strain energy is unstable beyond a stretch of {:.2} (with {:.2} and {:.2} across), reached \
         at {:.1} kPa", stretches[0], stretches[1], stretches[2], 1e-3 * pressure_pa
    )]
    Unstable {
        /// The first unstable principal stretches, the greatest first.
        stretches: [f64; 3],
        /// Where they are reached, Pa.
        pressure_pa: f64,
    },
    /// Pressures must be given in rising order from zero.
    #[error(
        "pressure {pressure_pa} Pa: must be finite, not negative and not below the one before it"
    )]
    Pressure {
        /// The offending pressure, Pa.
        pressure_pa: f64,
    },
    /// No stable equilibrium continues the solution: the limit point of a rubber tube.
    #[error(
        "the section balloons at about {:.1} kPa; ask for lower pressures, or for a thicker wall or a \
         stiffer rubber", 1e-3 * last_pa
    )]
    Balloons {
        /// The highest pressure at which equilibrium was found, Pa.
        last_pa: f64,
    },
}

/// A section of rubber, meshed and at rest.
pub struct SectionModel {
    potential: Potential,
    /// Scale of length, m.
    radius: f64,
}

impl SectionModel {
    /// Meshes half of a section, which symmetry makes the whole.
    ///
    /// # Errors
    /// [`InflationError::Section`] or [`InflationError::Solid`] if it is open or has no bore;
    /// [`InflationError::Material`] or [`InflationError::Exponent`] if the rubber's constants are out of range.
    pub fn new(section: &Section, rubber: Rubber, size: MeshSize) -> Result<Self, InflationError> {
        section.check()?;
        if section.bore_radius_m == 0.0 {
            return Err(InflationError::Solid);
        }
        check(&rubber)?;
        Ok(Self {
            potential: Potential::new(Mesh::of(section, size), rubber),
            radius: section.outer_radius_m,
        })
    }

    /// Inflates the section from rest through `pressures_pa`, Pa, in rising order: its equilibrium at each.
    ///
    /// # Errors
    /// [`InflationError::Balloons`] if a pressure lies beyond the limit point, with the highest
    /// pressure that was reached; [`InflationError::Unstable`] if the rubber's strain energy ends before;
    /// [`InflationError::Pressure`] if they do not rise.
    pub fn inflate(&self, pressures_pa: &[f64]) -> Result<Vec<Inflated>, InflationError> {
        let mut path = Path::from_rest(self.potential.rest());
        let mut inflated = Vec::with_capacity(pressures_pa.len());
        for &target in pressures_pa {
            let pressure_pa = target;
            if !(target.is_finite() && target >= path.pressure()) {
                return Err(InflationError::Pressure { pressure_pa });
            }
            let mut step = target - path.pressure();
            let condensed = loop {
                let next = path.pressure() + step;
                match self.equilibrium(path.predict(next), next, path.pressure()) {
                    Ok((unknowns, condensed)) => {
                        path.push(next, unknowns);
                        if next >= target {
                            break condensed;
                        }
                        step = (2.0 * step).min(target - next);
                    }
                    Err(_) if step > SHORTEST_STEP_PA => step /= 2.0,
                    Err(error) => return Err(self.cause(error, path.last())),
                }
            };
            let unknowns = path.last();
            let [_, curvature_per_m] = self.potential.axial(unknowns);
            inflated.push(Inflated {
                pressure_pa,
                curvature_per_m,
                stretch: self.potential.mean_stretch(unknowns),
                // Twice, for the other half; the stretch follows without axial force.
                bending_stiffness_nm2: 2.0 * condensed.determinant() / condensed[(0, 0)],
            });
        }
        Ok(inflated)
    }

    /// The equilibrium at `pressure` near `unknowns`, if it is stable; `last_pa` is the one before.
    fn equilibrium(
        &self,
        unknowns: Unknowns,
        pressure: f64,
        last_pa: f64,
    ) -> Result<(Unknowns, Matrix2<f64>), InflationError> {
        let found = self.newton(unknowns, pressure);
        let (unknowns, condensed) = found.ok_or(InflationError::Balloons { last_pa })?;
        match self.potential.unstable_beyond(&unknowns, 1.0) {
            None => Ok((unknowns, condensed)),
            Some(stretches) => Err(InflationError::Unstable {
                stretches,
                pressure_pa: pressure,
            }),
        }
    }

    /// Why there is nothing beyond the equilibrium `last`. Shortly before its end a strain energy has gone so
    /// soft that the section balloons by it: then the energy is to blame and not the section.
    fn cause(&self, error: InflationError, last: &Unknowns) -> InflationError {
        let InflationError::Balloons { last_pa } = error else {
            return error;
        };
        match self.potential.unstable_beyond(last, 1.0 / ALMOST_UNSTABLE) {
            None => error,
            Some(stretches) => InflationError::Unstable {
                stretches,
                pressure_pa: last_pa,
            },
        }
    }

    /// The equilibrium at `pressure` near `unknowns`, with the stiffness of `λ` and `κ` there.
    fn newton(&self, mut unknowns: Unknowns, pressure: f64) -> Option<(Unknowns, Matrix2<f64>)> {
        for _ in 0..ITERATIONS {
            let Step {
                inner,
                border,
                condensed,
            } = self.potential.equations(&unknowns, pressure)?.solve()?;
            let n = inner.len();
            let mut positions = unknowns.rows_mut(0, n);
            positions += &inner;
            let mut axial = unknowns.fixed_rows_mut::<2>(n);
            axial += border;
            let change = (inner.amax() / self.radius)
                .max(border[0].abs())
                .max(border[1].abs() * self.radius);
            if change < CONVERGED {
                return Some((unknowns, condensed));
            }
            if change > TOO_FAR {
                return None;
            }
        }
        None
    }
}

/// Refuses what is no rubber at small strain.
fn check(rubber: &Rubber) -> Result<(), InflationError> {
    let shear = rubber.youngs_modulus_pa() / 3.0;
    let bulk = rubber.bulk_modulus_pa;
    let material = |name, value: f64, ok: bool, expected| match value.is_finite() && ok {
        true => Ok(()),
        false => Err(InflationError::Material {
            name,
            value,
            expected,
        }),
    };
    match &rubber.energy {
        Energy::Yeoh([c1, c2, c3]) => {
            material("C1", *c1, *c1 > 0.0, "positive")?;
            material("C2", *c2, true, "in pascals")?;
            material("C3", *c3, true, "in pascals")?;
        }
        Energy::Ogden(terms) => {
            for term in terms.as_slice() {
                let value = term.alpha;
                if !(value.is_finite() && value != 0.0) {
                    return Err(InflationError::Exponent { value });
                }
            }
            material("shear modulus", shear, shear > 0.0, "positive")?;
        }
    }
    material(
        "bulk modulus",
        bulk,
        bulk > 5.0 * shear,
        "above five times the shear modulus",
    )
}

/// Inflates a section to one pressure, Pa, on several meshes: how far the result depends on them.
///
/// # Errors
/// As [`SectionModel::new`] and [`SectionModel::inflate`].
pub fn mesh_study(
    section: &Section,
    rubber: Rubber,
    pressure_pa: f64,
    sizes: &[MeshSize],
) -> Result<Vec<(MeshSize, Inflated)>, InflationError> {
    let mut study = Vec::with_capacity(sizes.len());
    for &size in sizes {
        let states = SectionModel::new(section, rubber, size)?.inflate(&[pressure_pa])?;
        study.extend(states.into_iter().map(|state| (size, state)));
    }
    Ok(study)
}

/// The last equilibria on the way up, at most three, to start the next from.
struct Path(Vec<(f64, Unknowns)>);

impl Path {
    fn from_rest(rest: Unknowns) -> Self {
        Self(vec![(0.0, rest)])
    }

    fn pressure(&self) -> f64 {
        self.0[self.0.len() - 1].0
    }

    fn last(&self) -> &Unknowns {
        &self.0[self.0.len() - 1].1
    }

    fn push(&mut self, pressure: f64, unknowns: Unknowns) {
        self.0.retain(|(known, _)| *known != pressure);
        if self.0.len() == 3 {
            self.0.remove(0);
        }
        self.0.push((pressure, unknowns));
    }

    /// Lagrange's polynomial through the known equilibria.
    fn predict(&self, pressure: f64) -> Unknowns {
        let mut sum = self.last() * 0.0;
        for (i, (here, unknowns)) in self.0.iter().enumerate() {
            let others = self.0.iter().enumerate().filter(|(j, _)| *j != i);
            let weight: f64 = others
                .map(|(_, (there, _))| (pressure - there) / (here - there))
                .product();
            sum.axpy(weight, unknowns, 1.0);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECTION: Section = Section {
        outer_radius_m: 9.6e-3,
        bore_radius_m: 4.6e-3,
        bore_offset_m: 2.7e-3,
        flat_half_angle_rad: 0.98,
    };
    const YEOH_PA: [f64; 3] = [0.1e6, 0.02e6, 200.0];

    fn inflate(rubber: Rubber, pressures_pa: &[f64]) -> Result<Vec<Inflated>, InflationError> {
        SectionModel::new(&SECTION, rubber, MeshSize::STANDARD)?.inflate(pressures_pa)
    }

    #[test]
    fn without_pressure_bends_as_a_beam() {
        for modulus in [0.3e6, 0.6e6] {
            let rubber = Rubber::from_youngs_modulus(modulus);
            let rest = inflate(rubber, &[0.0]).expect("rest")[0];
            let beam = modulus * SECTION.second_moment_m4();
            assert!((rest.bending_stiffness_nm2 / beam - 1.0).abs() < 0.01);
            assert!(rest.curvature_per_m.abs() < 1e-9 && (rest.stretch - 1.0).abs() < 1e-9);
        }
        let yeoh = Rubber::incompressible(YEOH_PA);
        let rest = inflate(yeoh, &[0.0]).expect("rest")[0];
        let beam = yeoh.youngs_modulus_pa() * SECTION.second_moment_m4();
        assert!((rest.bending_stiffness_nm2 / beam - 1.0).abs() < 0.01);
    }

    #[test]
    fn curvature_starts_with_the_square_of_pressure() {
        // A stiff penalty: what little volume change the standard one allows bends to first order.
        let rubber = Rubber {
            bulk_modulus_pa: 1e9,
            ..Rubber::incompressible(YEOH_PA)
        };
        let states = inflate(rubber, &[1e3, 2e3]).expect("small pressures");
        let ratio = states[1].curvature_per_m / states[0].curvature_per_m;
        assert!(ratio > 3.5, "{ratio}");
    }

    #[test]
    fn the_standard_mesh_is_fine_enough() {
        let fine = MeshSize {
            around: 28,
            through: 6,
        };
        let rubber = Rubber::incompressible(YEOH_PA);
        for pressure in [60e3, 160e3] {
            let study = mesh_study(&SECTION, rubber, pressure, &[MeshSize::STANDARD, fine]);
            let study = study.expect("below the limit");
            let [standard, fine] = [study[0].1, study[1].1];
            for (standard, fine) in [
                (standard.curvature_per_m, fine.curvature_per_m),
                (standard.stretch, fine.stretch),
                (standard.bending_stiffness_nm2, fine.bending_stiffness_nm2),
            ] {
                assert!((standard / fine - 1.0).abs() < 0.005, "{standard} {fine}");
            }
        }
    }

    #[test]
    fn the_path_does_not_depend_on_the_steps() {
        let rubber = Rubber::incompressible(YEOH_PA);
        let at_once = inflate(rubber, &[160e3]).expect("below the limit")[0];
        let pressures: Vec<f64> = (0..=40).map(|k| 4e3 * f64::from(k)).collect();
        let stepped = inflate(rubber, &pressures).expect("below the limit");
        assert!((stepped[40].curvature_per_m / at_once.curvature_per_m - 1.0).abs() < 1e-9);
        for pair in stepped.windows(2) {
            assert!(pair[1].curvature_per_m > pair[0].curvature_per_m);
        }
    }

    #[test]
    fn a_limit_point_is_an_error_that_names_the_pressure() {
        let rubber = Rubber::from_youngs_modulus(0.55e6);
        let error = inflate(rubber, &[40e3, 160e3]).expect_err("balloons");
        let InflationError::Balloons { last_pa } = error else {
            panic!("{error}");
        };
        assert!((60e3..90e3).contains(&last_pa), "{error}");
        let message = format!("the section balloons at about {:.1} kPa", 1e-3 * last_pa);
        assert!(error.to_string().starts_with(&message), "{error}");
        // It is the limit point and not the solver: bending goes soft, and a softer rubber scales.
        let near = inflate(rubber, &[last_pa]).expect("reached")[0];
        let rest = inflate(rubber, &[0.0]).expect("rest")[0];
        assert!(near.bending_stiffness_nm2 < 0.4 * rest.bending_stiffness_nm2);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let yeoh = Rubber::incompressible(YEOH_PA);
        for pressures in [
            vec![-1.0],
            vec![2e3, 1e3],
            vec![f64::NAN],
            vec![f64::INFINITY],
        ] {
            let error = inflate(yeoh, &pressures).expect_err("nonsense");
            assert!(matches!(error, InflationError::Pressure { .. }), "{error}");
        }
        let error = inflate(Rubber::incompressible([-0.1e6, 0.0, 0.0]), &[1e3]);
        let error = error.expect_err("no rubber").to_string();
        assert_eq!(error, "C1 = -100000 Pa: must be finite and positive");
        let solid = SectionModel::new(&SECTION.solid(), yeoh, MeshSize::STANDARD);
        assert_eq!(solid.err(), Some(InflationError::Solid));
    }
}

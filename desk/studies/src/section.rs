//! One cross-section: its dimensions, and how it bends and stretches under pressure.

use std::fmt::Write;

use anyhow::Context;
use finger::hyperelastic::{Energy, Rubber};
use finger::mesh::MeshSize;
use finger::ogden::Term;
use finger::section::Section;
use finger::yeoh::{Inflated, InflationError, SectionModel, mesh_study};
use serde_json::{Value, json};

use report::json::round;

/// Meshes of the study, coarse to fine.
const MESHES: [MeshSize; 4] = [
    MeshSize {
        around: 7,
        through: 2,
    },
    MeshSize::STANDARD,
    MeshSize {
        around: 21,
        through: 5,
    },
    MeshSize {
        around: 28,
        through: 6,
    },
];

/// A section inflated to one or more pressures.
pub struct SectionReport {
    section: Section,
    rubber: Rubber,
    states: Vec<Inflated>,
    /// The highest pressure on several meshes.
    study: Vec<(MeshSize, Inflated)>,
}

impl SectionReport {
    /// Inflates a section to pressures in any order, kPa, at least one. `constants` is what the user calls
    /// those of the rubber.
    ///
    /// # Errors
    /// If there is no pressure, the section is impossible, or it has no stable state at a pressure.
    pub fn new(
        section: Section,
        rubber: Rubber,
        constants: &str,
        pressures_kpa: &[f64],
        study_meshes: bool,
    ) -> anyhow::Result<Self> {
        let mut pressures_pa: Vec<f64> = pressures_kpa.iter().map(|kpa| 1e3 * kpa).collect();
        pressures_pa.sort_by(f64::total_cmp);
        pressures_pa.dedup();
        let highest = *pressures_pa.last().context("no pressure")?;
        let states = SectionModel::new(&section, rubber, MeshSize::STANDARD)?
            .inflate(&pressures_pa)
            .map_err(|error| match error {
                InflationError::Unstable { .. } => anyhow::anyhow!(
                    "{constants}: {error}: ask for lower pressures, or take constants that were fitted up to larger stretches"
                ),
                error => {
                    anyhow::Error::new(error).context(format!("--pressure {}", 1e-3 * highest))
                }
            })?;
        let study = match study_meshes {
            true => mesh_study(&section, rubber, highest, &MESHES)?,
            false => Vec::new(),
        };
        Ok(Self {
            section,
            rubber,
            states,
            study,
        })
    }

    /// The results as plain text.
    pub fn text(&self) -> String {
        let mut out = String::new();
        let [area, centroid, moment] = self.properties();
        let rubber = match &self.rubber.energy {
            Energy::Yeoh(constants) => {
                let [c1, c2, c3] = constants.map(|pa| 1e-6 * pa);
                format!("C1 {c1:.4}, C2 {c2:.4}, C3 {c3:.4} MPa")
            }
            Energy::Ogden(terms) => {
                let term = |term: &Term| format!("μ {:.4} α {}", 1e-6 * term.mu_pa, term.alpha);
                let terms: Vec<String> = terms.as_slice().iter().map(term).collect();
                format!("{} MPa in Σ 2μ/α² (Σ λ^α - 3)", terms.join(", "))
            }
        };
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "area {area:.2} mm², centroid {centroid:+.3} mm towards the thin side, second moment {moment:.0} mm⁴\n\
             rubber: {rubber}; E {:.0} kPa at small strain\n\n\
             \x20   kPa  curvature, 1/m   stretch   EI, N·m²",
            1e-3 * self.rubber.youngs_modulus_pa()
        );
        for state in &self.states {
            let _ = writeln!(out, "{:>7.1}  {}", 1e-3 * state.pressure_pa, row(state));
        }
        if let Some((finest, rest)) = self.study.split_last() {
            let kpa = 1e-3 * finest.1.pressure_pa;
            let _ = writeln!(
                out,
                "\nat {kpa} kPa\n   mesh  curvature, 1/m   stretch   EI, N·m²   off the finest, %"
            );
            for (size, state) in rest {
                let off = percents(state, &finest.1).map(|percent| format!("{percent:+8.3}"));
                let _ = writeln!(out, "{:>7}  {}  {}", mesh(*size), row(state), off.join(""));
            }
            let _ = writeln!(out, "{:>7}  {}", mesh(finest.0), row(&finest.1));
        }
        out
    }

    /// The results as JSON.
    pub fn json(&self) -> Value {
        let [area, centroid, moment] = self.properties();
        let state = |state: &Inflated| {
            json!({
                "pressure_kpa": round(1e-3 * state.pressure_pa, 6),
                "curvature_per_m": round(state.curvature_per_m, 6),
                "stretch": round(state.stretch, 6),
                "bending_stiffness_nm2": round(state.bending_stiffness_nm2, 9),
            })
        };
        let mut value = json!({
            "area_mm2": round(area, 4),
            "centroid_mm": round(centroid, 4),
            "second_moment_mm4": round(moment, 3),
        });
        match &self.rubber.energy {
            Energy::Yeoh(constants) => {
                value["yeoh_mpa"] = json!(constants.map(|pa| round(1e-6 * pa, 9)));
            }
            Energy::Ogden(terms) => {
                let pair = |term: &Term| json!([round(1e-6 * term.mu_pa, 9), term.alpha]);
                value["ogden_abaqus"] = terms.as_slice().iter().map(pair).collect();
            }
        }
        value["states"] = self.states.iter().map(state).collect();
        if !self.study.is_empty() {
            let meshes = self.study.iter().map(|(size, on_it)| {
                let mut row = state(on_it);
                row["around"] = size.around.into();
                row["through"] = size.through.into();
                row
            });
            value["mesh_study"] = meshes.collect();
        }
        value
    }

    /// Area, mm², centroid, mm, and second moment, mm⁴.
    fn properties(&self) -> [f64; 3] {
        [
            1e6 * self.section.area_m2(),
            1e3 * self.section.centroid_m(),
            1e12 * self.section.second_moment_m4(),
        ]
    }
}

fn row(state: &Inflated) -> String {
    // A tube that does not bend does so by nought, not by minus nought.
    let curvature = round(state.curvature_per_m, 4);
    format!(
        "{curvature:>14.4}  {:>8.4}  {:>9.6}",
        state.stretch, state.bending_stiffness_nm2
    )
}

fn mesh(size: MeshSize) -> String {
    format!("{}×{}", size.around, size.through)
}

fn percents(state: &Inflated, finest: &Inflated) -> [f64; 3] {
    [
        (state.curvature_per_m, finest.curvature_per_m),
        (state.stretch, finest.stretch),
        (state.bending_stiffness_nm2, finest.bending_stiffness_nm2),
    ]
    .map(|(value, finest)| 100.0 * (value / finest - 1.0))
}

//! The finger along its length: sections, rubber, tip and root, and what follows without solving anything.

use serde::Deserialize;
use softgrip_table::LINKS;

use crate::chain::Gauge;
use crate::check::{FieldError, within, wrong};
use crate::grasp::Grasp;
use crate::hyperelastic::Rubber;
use crate::links;
use crate::material::RubberPart;
use crate::mounting::{GaugePart, GraspPart};
use crate::section::Section;

/// A finger given by its dimensions and its rubber, as a recipe holds it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    #[serde(rename = "kind")]
    _kind: Kind,
    /// The name that the recipe gives itself.
    pub name: String,
    /// The highest pressure that the model is asked for, kPa.
    pub max_pressure_kpa: f64,
    links: LinkPart,
    section: SectionPart,
    station: Vec<StationPart>,
    bore: BorePart,
    tip: TipPart,
    root: RootPart,
    rubber: RubberPart,
    gauge: GaugePart,
    grasp: Option<GraspPart>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Geometry,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkPart {
    length_mm: [f64; LINKS],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct SectionPart {
    flat_half_angle_deg: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct StationPart {
    at_mm: f64,
    outer_radius_mm: f64,
    bore_radius_mm: f64,
    bore_offset_mm: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct BorePart {
    end_mm: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct TipPart {
    from_mm: f64,
    area_factor: f64,
    inertia_factor: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RootPart {
    free_length_mm: f64,
}

/// A finger that has been checked, in SI units. Arc length `s` runs from the clamp to the tip.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// Lengths of the equivalent links, m.
    pub link_length_m: [f64; LINKS],
    /// Sections with their arc lengths, m, rising; linear between, constant beyond.
    pub stations: Vec<(f64, Section)>,
    /// Arc length where the bore ends, m; beyond it is solid.
    pub bore_end_m: f64,
    /// Arc length from which the tip is chamfered, m.
    pub tip_from_m: f64,
    /// Area of the tip over that of the full outline: what chamfer and nail leave of the mass.
    pub tip_area_factor: f64,
    /// Second moment of the tip over that of the full outline: what the chamfer leaves of the stiffness.
    pub tip_inertia_factor: f64,
    /// Length inside the clamp that bends like the finger's root, m.
    pub root_free_length_m: f64,
    /// Young's modulus at small strain, Pa, for the joints' stiffness.
    pub youngs_modulus_pa: f64,
    /// The rubber at large strain, for the inflation.
    pub rubber: Rubber,
    /// The recipe's field that gives the rubber, for messages.
    pub rubber_field: &'static str,
    /// Density, kg/m³.
    pub density_kg_per_m3: f64,
    /// Where the strain gauge is bonded.
    pub gauge: Gauge,
}

impl Description {
    /// Checks every value but those of the grasp, and brings them to SI units.
    ///
    /// # Errors
    /// [`FieldError`], which names the first wrong field and what would be right.
    pub fn check(&self) -> Result<Geometry, FieldError> {
        within("max_pressure_kpa", self.max_pressure_kpa, 1.0, 1000.0)?;
        for (i, &length) in self.links.length_mm.iter().enumerate() {
            within(&format!("links.length_mm[{i}]"), length, 0.1, 500.0)?;
        }
        let length: f64 = self.links.length_mm.iter().sum();
        within("bore.end_mm", self.bore.end_mm, 0.1, length)?;
        within("tip.from_mm", self.tip.from_mm, self.bore.end_mm, length)?;
        within("tip.area_factor", self.tip.area_factor, 0.01, 10.0)?;
        within("tip.inertia_factor", self.tip.inertia_factor, 0.01, 10.0)?;
        let free = self.root.free_length_mm;
        within("root.free_length_mm", free, 0.0, length)?;
        let rubber = self.rubber.check()?;
        Ok(Geometry {
            link_length_m: self.links.length_mm.map(|mm| 1e-3 * mm),
            stations: self.stations(length)?,
            bore_end_m: 1e-3 * self.bore.end_mm,
            tip_from_m: 1e-3 * self.tip.from_mm,
            tip_area_factor: self.tip.area_factor,
            tip_inertia_factor: self.tip.inertia_factor,
            root_free_length_m: 1e-3 * free,
            youngs_modulus_pa: rubber.youngs_modulus_pa,
            rubber: rubber.rubber,
            rubber_field: rubber.field,
            density_kg_per_m3: 1e3 * self.rubber.density_g_per_cm3,
            gauge: self.gauge.check(length)?,
        })
    }

    /// Checks the gripper that three such fingers make, if there is one.
    ///
    /// # Errors
    /// As [`Description::check`].
    pub fn grasp(&self) -> Result<Option<Grasp>, FieldError> {
        let length = self.links.length_mm.iter().sum();
        let grasp = self.grasp.as_ref();
        grasp.map(|part| part.check(length)).transpose()
    }

    fn stations(&self, length_mm: f64) -> Result<Vec<(f64, Section)>, FieldError> {
        let angle = self.section.flat_half_angle_deg;
        within("section.flat_half_angle_deg", angle, 0.0, 89.0)?;
        if self.station.is_empty() {
            let expected = "needs at least one [[station]] with its radii and offset";
            return Err(wrong("station", 0.0, expected.into()));
        }
        let mut stations: Vec<(f64, Section)> = Vec::with_capacity(self.station.len());
        for (k, part) in self.station.iter().enumerate() {
            let field = |name: &str| format!("station[{k}].{name}");
            within(&field("at_mm"), part.at_mm, 0.0, length_mm)?;
            let at_m = 1e-3 * part.at_mm;
            if let Some(&(before, _)) = stations.last().filter(|(before, _)| at_m <= *before) {
                let expected =
                    format!("must lie beyond the station before it, {} mm", 1e3 * before);
                return Err(wrong(&field("at_mm"), part.at_mm, expected));
            }
            let outer = part.outer_radius_mm;
            within(&field("outer_radius_mm"), outer, 0.5, 100.0)?;
            within(&field("bore_radius_mm"), part.bore_radius_mm, 0.1, outer)?;
            within(&field("bore_offset_mm"), part.bore_offset_mm, 0.0, outer)?;
            let section = Section {
                outer_radius_m: 1e-3 * outer,
                bore_radius_m: 1e-3 * part.bore_radius_mm,
                bore_offset_m: 1e-3 * part.bore_offset_mm,
                flat_half_angle_rad: angle.to_radians(),
            };
            section.check().map_err(|error| {
                wrong(
                    &field("bore_radius_mm"),
                    part.bore_radius_mm,
                    error.to_string(),
                )
            })?;
            stations.push((at_m, section));
        }
        Ok(stations)
    }
}

impl Geometry {
    /// Length of the finger from the clamp to the tip, m: that of its links.
    pub fn length_m(&self) -> f64 {
        self.link_length_m.iter().sum()
    }

    /// The section at `s`, m, as if the bore went on to the tip.
    pub fn section(&self, s: f64) -> Section {
        let after = self.stations.partition_point(|(at, _)| *at <= s);
        if after == 0 || after == self.stations.len() {
            return self.stations[after.saturating_sub(1)].1;
        }
        let ((from, a), (to, b)) = (self.stations[after - 1], self.stations[after]);
        let t = (s - from) / (to - from);
        let mix = |a: f64, b: f64| a + t * (b - a);
        Section {
            outer_radius_m: mix(a.outer_radius_m, b.outer_radius_m),
            bore_radius_m: mix(a.bore_radius_m, b.bore_radius_m),
            bore_offset_m: mix(a.bore_offset_m, b.bore_offset_m),
            flat_half_angle_rad: a.flat_half_angle_rad,
        }
    }

    /// Area of rubber at `s`, m, in m²: solid beyond the bore, less the chamfer at the tip.
    pub fn area_m2(&self, s: f64) -> f64 {
        if s < self.bore_end_m {
            self.section(s).area_m2()
        } else if s < self.tip_from_m {
            self.section(s).solid().area_m2()
        } else {
            self.tip_area_factor * self.section(s).solid().area_m2()
        }
    }

    /// Bending stiffness `E I(s)` at small strain at `s`, m, in N·m² (eqs. 38–45).
    pub fn bending_stiffness_nm2(&self, s: f64) -> f64 {
        let moment = if s < self.bore_end_m {
            self.section(s).second_moment_m4()
        } else if s < self.tip_from_m {
            self.section(s).solid().second_moment_m4()
        } else {
            self.tip_inertia_factor * self.section(s).solid().second_moment_m4()
        };
        self.youngs_modulus_pa * moment
    }

    /// Arc lengths where the sections are not smooth, and the tip, rising, m.
    pub fn breaks_m(&self) -> Vec<f64> {
        let mut breaks: Vec<f64> = self.stations.iter().map(|(at, _)| *at).collect();
        breaks.extend([self.bore_end_m, self.tip_from_m, self.length_m()]);
        breaks.retain(|s| *s > 0.0);
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }

    /// Mass of each link, kg (table 1): the rubber between its joints.
    pub fn link_masses_kg(&self) -> [f64; LINKS] {
        let middles = links::midpoints_m(&self.link_length_m);
        std::array::from_fn(|i| {
            let half = self.link_length_m[i] / 2.0;
            let mut joint = middles[i] - half;
            let end = middles[i] + half;
            let mut volume = 0.0;
            for to in self.breaks_m().into_iter().chain([end]) {
                let to = to.clamp(joint, end);
                // Simpson's rule: areas are quadratic between breaks.
                let inner = |share: f64| self.area_m2(joint + share * (to - joint));
                // The ends are asked for just inside, because the bore stops at one of them.
                let inside = 1e-9;
                let sum = inner(inside) + 4.0 * inner(0.5) + inner(1.0 - inside);
                volume += sum * (to - joint) / 6.0;
                joint = to;
            }
            self.density_kg_per_m3 * volume
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECIPE: &str = include_str!("../../recipes/rtv225.toml");

    fn check(text: &str) -> Result<Geometry, String> {
        let description: Description =
            toml::from_str(text).map_err(|error| error.message().to_string())?;
        description.check().map_err(|error| error.to_string())
    }

    #[test]
    fn sections_are_linear_between_stations_and_constant_beyond() {
        let finger = check(RECIPE).expect("a good finger");
        let [root, tip] = [0.0, 0.09].map(|s| finger.section(s));
        assert_eq!((root, tip), (finger.stations[0].1, finger.stations[1].1));
        let middle = finger.section(0.045);
        let mean = (root.outer_radius_m + tip.outer_radius_m) / 2.0;
        assert!((middle.outer_radius_m - mean).abs() < 1e-15);
        assert_eq!(finger.section(0.1), tip);
        assert_eq!(finger.section(-1.0), root);
    }

    #[test]
    fn masses_are_the_integral_of_the_area() {
        let finger = check(RECIPE).expect("a good finger");
        let n = 100_000;
        let step = finger.length_m() / f64::from(n);
        let total: f64 = (0..n)
            .map(|i| finger.area_m2((f64::from(i) + 0.5) * step) * step)
            .sum();
        let links: f64 = finger.link_masses_kg().iter().sum();
        assert!((links / (finger.density_kg_per_m3 * total) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn every_wrong_value_is_named_with_what_would_be_right() {
        for (from, to, expected) in [
            (
                "at_mm = 90.0",
                "at_mm = 0.0",
                "station[1].at_mm = 0: must lie beyond the station before it, 0 mm",
            ),
            (
                "bore_offset_mm = 2.4288",
                "bore_offset_mm = 4.9",
                "station[0].bore_radius_mm = 5.2086: the wall opposite the flat is -0.139 mm thick: bore offset plus bore radius must stay below the outer radius",
            ),
            (
                "end_mm = 88.574",
                "end_mm = 190.1",
                "bore.end_mm = 190.1: must lie within 0.1 and 100",
            ),
            (
                "youngs_modulus_kpa = 550.0",
                "youngs_modulus_kpa = 0.55",
                "rubber.youngs_modulus_kpa = 0.55: must lie within 10 and 100000",
            ),
            (
                "[0.1, 0.02,",
                "[nan, 0.02,",
                "rubber.yeoh_mpa[0] = NaN: must lie within 0.001 and 1",
            ),
            (
                "to_mm = 45.0",
                "to_mm = 0.0",
                "gauge.to_mm = 0: must lie beyond gauge.from_mm, 0 mm",
            ),
            (
                "flat_half_angle_deg = 56.106",
                "flat_half_angle_deg = 95.0",
                "section.flat_half_angle_deg = 95: must lie within 0 and 89",
            ),
            (
                "max_pressure_kpa = 160.0",
                "max_pressure_kpa = 160.0\ncolour = 1",
                "unknown field `colour`",
            ),
            (
                "inertia_factor = 0.2605",
                "",
                "missing field `inertia_factor`",
            ),
            (
                "kind = \"geometry\"",
                "kind = \"measured\"",
                "unknown variant `measured`",
            ),
        ] {
            assert!(RECIPE.contains(from), "{from} is not in the recipe");
            let message = check(&RECIPE.replacen(from, to, 1)).expect_err("the recipe is wrong");
            assert!(message.contains(expected), "{message}");
        }
    }
}
